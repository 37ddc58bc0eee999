"""The phone net objects to a word that is not "stop", alone, and to no call."""

from __future__ import annotations

import numpy as np
import pytest

from hvcpd.people.phone_checks import MOST_CALL_LOSS, loss_of_call
from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from hvcpd.recognition.keyword.stage import CHECKED_BEFORE
from hvcpd.synthesis.leveling import audible
from hvcpd.synthesis.lexicon import Lexicon
from hvcpd.synthesis.speaker import Speaker
from hvcpd.synthesis.voices import VOICES, voice_named

AFTER = 3 * SAMPLE_RATE_HZ // 10
NOISE_DBFS = -75.0


def said(text: str, voice: str) -> Samples:
    sound = Speaker(voice_named(voice), Lexicon.load()).render([text.split()])
    begin, end = audible(sound)
    return np.asarray(0.03 * sound[begin:end] / np.sqrt(np.mean(sound[begin:end] ** 2)), np.float32)


def heard(word: Samples, talk: Samples | None = None) -> Samples:
    """Up to 0.3 s after a word's end, in a quiet room, or while somebody else talks."""
    noise = np.random.default_rng(1).standard_normal(CHECKED_BEFORE + AFTER) * 10.0 ** (NOISE_DBFS / 20.0)
    sound = noise.astype(np.float32)
    sound[CHECKED_BEFORE - len(word) : CHECKED_BEFORE] += word
    return sound if talk is None else sound + talk[: len(sound)]


@pytest.mark.parametrize("voice", [voice.name for voice in VOICES])
@pytest.mark.parametrize("text", ["stop", "rob stop"])
def test_a_call_keeps_its_probability(voice: str, text: str) -> None:
    assert loss_of_call(heard(said(text, voice))) < 0.1


@pytest.mark.parametrize("voice", ["oak", "lark", "wren"])
@pytest.mark.parametrize("text", ["alexa", "house", "follow", "bird", "shop"])
def test_another_word_loses_all_that_this_net_may_take(voice: str, text: str) -> None:
    assert loss_of_call(heard(said(text, voice))) == MOST_CALL_LOSS


def test_over_talk_it_has_no_say() -> None:
    talk = said("i am in the kitchen and i will water the green rose", "oak")
    assert loss_of_call(heard(said("alexa", "lark"))) == MOST_CALL_LOSS
    assert loss_of_call(heard(said("alexa", "lark"), talk)) == 0.0


def followed(word: str, talk: str, voice: str, other: str) -> Samples:
    """A word, and talk from 0.05 s after it on."""
    sound, after = heard(said(word, voice)), AFTER - SAMPLE_RATE_HZ // 20
    sound[-after:] += said(talk, other)[:after]
    return sound


@pytest.mark.parametrize("voice", ["oak", "lark", "granite"])
def test_a_name_that_a_request_follows_at_once_is_no_call(voice: str) -> None:
    """ "Bot, come back" by strangers stopped robots for good."""
    assert loss_of_call(followed("bot", "move back half a metre", voice, voice)) == MOST_CALL_LOSS


@pytest.mark.parametrize("other", ["oak", "lark", "granite"])
def test_a_call_that_talk_follows_at_once_stays_one(other: str) -> None:
    assert loss_of_call(followed("stop", "move back half a metre", "wren", other)) < 0.1


def test_in_noise_as_loud_as_the_word_it_has_no_say() -> None:
    noise = (0.03 * np.random.default_rng(7).standard_normal(4 * SAMPLE_RATE_HZ)).astype(np.float32)
    assert loss_of_call(heard(said("alexa", "lark"), noise)) == 0.0
    assert loss_of_call(heard(said("alexa", "lark"), np.float32(0.05) * noise)) == MOST_CALL_LOSS


def test_of_hardly_any_sound_it_says_nothing() -> None:
    assert loss_of_call(np.zeros(10, np.float32)) == 0.0
