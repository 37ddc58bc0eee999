"""What is left of the keyword when the sentence around it is taken out."""

from __future__ import annotations

import numpy as np
import pytest

from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from hvcpd.recognition.events import Received, Recognised
from hvcpd.recognition.keyword.net import KeywordNet, Weights
from hvcpd.recognition.keyword.stage import KeywordRescorer
from hvcpd.recognition.keyword.verification import RESIDUAL_LOG_ODDS
from hvcpd.recognition.stream import HISTORY_SAMPLES, FrameStream, History
from hvcpd.synthesis.lexicon import Lexicon
from hvcpd.synthesis.speaker import Speaker
from hvcpd.synthesis.voices import voice_named
from tests.recognition.signals import in_noise

GAIN = 0.5
BEGIN = SAMPLE_RATE_HZ


def said(text: str, voice: str) -> Samples:
    sound = Speaker(voice_named(voice), Lexicon.load()).render([text.split()])
    return np.asarray(0.05 * sound / np.sqrt(np.mean(sound**2)), np.float32)


TALK = said("i am in the kitchen and i will water the green rose", "oak")
CALL = said("stop", "lark")


def mixed(talk: Samples, call: Samples, at: int) -> Samples:
    out = talk.copy()
    out[at : at + len(call)] += call
    return out


def heard_of(sound: Samples) -> KeywordRescorer:
    history = History()
    history.push(sound, masked=False)
    recent = KeywordRescorer(KeywordNet(Weights.load()), history)
    for chunk in FrameStream().push(sound, masked=False):
        recent.push(chunk)
    return recent


def left(heard: Samples, at: int, talk: Samples = TALK, late: int = 0, rest_s: float = 1.0) -> float | None:
    """The log odds left of the word that was heard `at` samples after the talk began; the talk is told `late` samples
    off its place, and `rest_s` after its end."""
    recent = heard_of(in_noise(np.pad(np.float32(GAIN) * heard, (0, round(rest_s * SAMPLE_RATE_HZ)))))
    begin, end = BEGIN + late, BEGIN + late + len(talk)
    received = Received(begin, np.float32(GAIN) * talk)
    told = Recognised(("green",), "oak", begin, end, 1.0, 20.0, (), received=received)
    residual = recent.residual(told, BEGIN + at, BEGIN + at + len(CALL))
    return residual.log_odds if residual is not None else None


@pytest.mark.parametrize("at", [6_000, 14_000, 30_000])
def test_a_call_over_a_sentence_is_still_there_without_it(at: int) -> None:
    over = left(mixed(TALK, CALL, at), at)
    assert over is not None
    assert over >= RESIDUAL_LOG_ODDS


def test_what_the_sentence_itself_made_up_is_gone_with_it() -> None:
    talk = mixed(TALK, CALL, 6_000)
    gone = left(talk, 6_000, talk)
    assert gone is not None
    assert gone < RESIDUAL_LOG_ODDS


@pytest.mark.parametrize("at", [6_000, 14_000, 30_000])
def test_a_sentence_that_is_known_poorly_leaves_itself_and_no_call(at: int) -> None:
    """Of "hi Siobhan" in a furnished room a third was left, in which the net heard the word as well as before."""
    talk = mixed(TALK, CALL, at)
    alone = left(talk, at, np.float32(0.4) * talk)
    over = left(mixed(TALK, CALL, at), at, np.float32(0.4) * TALK)
    assert alone is not None
    assert over is not None
    assert alone < RESIDUAL_LOG_ODDS < over


def test_a_sentence_that_explains_all_leaves_no_call() -> None:
    talk = mixed(TALK, CALL, 6_000)
    recent = heard_of(np.pad(talk, SAMPLE_RATE_HZ))
    heard = recent.sound_since(0)
    assert heard is not None
    told = Recognised(("green",), "oak", BEGIN, BEGIN + len(talk), 1.0, 20.0, (), received=Received(0, heard))
    residual = recent.residual(told, BEGIN + 6_000, BEGIN + 6_000 + len(CALL))
    assert residual is not None
    assert residual.log_odds == -np.inf


def test_from_a_sentence_of_which_nothing_is_known_nothing_follows() -> None:
    over = left(mixed(TALK, CALL, 6_000), 6_000, np.float32(0.01) * TALK)
    assert over is not None
    assert over >= RESIDUAL_LOG_ODDS


def test_a_sentence_that_nobody_knows_or_long_ago_tells_nothing() -> None:
    recent = heard_of(np.zeros(SAMPLE_RATE_HZ, np.float32))
    assert recent.residual(Recognised(("green",), "oak", 0, 9_000, 1.0, 20.0, ()), 100, 8_000) is None
    assert left(mixed(TALK, CALL, 6_000), 6_000, rest_s=HISTORY_SAMPLES / SAMPLE_RATE_HZ) is None
