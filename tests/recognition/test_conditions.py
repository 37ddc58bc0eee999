"""Sentences in the robots' own voices, in rooms, in noise, said slowly and cut off."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from hil_fakes.room import PinkNoise
from hil_fakes.transducers import tilt
from hvcpd.assembly.make import make_speech_recogniser
from hvcpd.assembly.plan import HearingPlan
from hvcpd.assembly.sound import Sound, make_phrasebook, make_sound
from hvcpd.config.settings import DEFAULT_TEAMS
from hvcpd.config.task_file import load_tasks
from hvcpd.config.tasks import default_tasks_path
from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from hvcpd.recognition.events import Recognised
from hvcpd.recognition.stages import SynchronousWorker
from hvcpd.synthesis.voices import voice_for

pytestmark = pytest.mark.slow

NAMES = ("Rex", "Gus")
BOOK = make_phrasebook(NAMES, DEFAULT_TEAMS, load_tasks(default_tasks_path()))
SPEECH_RMS = 0.03


@pytest.fixture(scope="module")
def sound(units: Path) -> Sound:
    return make_sound(None, units)


def said(text: str, sound: Sound, rate: float = 1.0) -> Samples:
    utterance = BOOK.parse_text(text)
    voice = voice_for(utterance.speaker or NAMES[0])
    speech = sound.speaker_in(replace(voice, rate=rate * voice.rate)).render(BOOK.phrases(utterance))
    loud = speech[np.abs(speech) > 1e-4]
    return np.asarray(speech * (SPEECH_RMS / np.sqrt(np.mean(loud**2))), np.float32)


def heard(speech: Samples, sound: Sound, snr_db: float, seed: int) -> list[str]:
    """All that is understood of this, in pink noise, after two seconds of the noise alone."""
    stream = np.concatenate(
        [np.zeros(2 * SAMPLE_RATE_HZ, np.float32), speech, np.zeros(2 * SAMPLE_RATE_HZ, np.float32)]
    )
    noise = PinkNoise(SPEECH_RMS * 10.0 ** (-snr_db / 20.0), seed).take(len(stream))
    stream = np.asarray(stream + noise, np.float32)
    recogniser = make_speech_recogniser(BOOK, NAMES, sound, strangers=False)
    events = [e for at in range(0, len(stream), 400) for e in recogniser.push(stream[at : at + 400])]
    return [" ".join(e.words) for e in events if isinstance(e, Recognised)]


def words(text: str) -> str:
    return " ".join(BOOK.render(BOOK.parse_text(text)))


SENTENCES = (
    "Hi Gus, I am Rex, water the yellow rose",
    "Hi Rex, I am Gus, I will water the yellow rose",
    "Hi all, I am Rex, member of team plant, confirmed task ten",
    "Hi team B, I am Gus, task three complete, I will complete task four",
    "Hi, I am Rex, what is left",
)


def reverberation(rt60_s: float, seed: int) -> Samples:
    """Nothing but reverberation, as from far across a room: noise that decays."""
    n = round(rt60_s * SAMPLE_RATE_HZ)
    decay = 10.0 ** (-3.0 * np.arange(n) / n)
    response = np.random.default_rng(seed).standard_normal(n) * decay
    return np.asarray(response / np.sqrt(np.sum(response**2)), np.float32)


@pytest.mark.slow
@pytest.mark.parametrize(("rt60_s", "sentences"), [(0.3, SENTENCES[:3]), (0.5, SENTENCES[2:])])
def test_words_are_heard_across_a_room(rt60_s: float, sentences: tuple[str, ...], sound: Sound) -> None:
    for seed, text in enumerate(sentences):
        response = reverberation(rt60_s, seed)
        speech = np.convolve(said(text, sound), response).astype(np.float32)
        assert heard(speech, sound, 20.0, seed) == [words(text)], text


@pytest.mark.slow
def test_slow_speech_is_heard_to_its_faint_end_in_loud_noise(sound: Sound) -> None:
    for seed, text in enumerate(SENTENCES):
        assert heard(said(text, sound, 0.8), sound, 0.0, seed) == [words(text)], text


@pytest.mark.slow
def test_a_last_word_after_a_comma_is_heard_through_a_dull_channel(sound: Sound) -> None:
    for seed in range(3):
        dull = tilt(said("Hi team plant, I am Rex, member of team A, stop", sound), -3.0)
        assert heard(dull, sound, 20.0, seed) == ["hi team plant i am rex member of team a stop"]


@pytest.mark.slow
@pytest.mark.parametrize("rate", [0.9, 1.1])
def test_other_speaking_rates_are_heard_in_quiet(rate: float, sound: Sound) -> None:
    for seed, text in enumerate(SENTENCES[:3]):
        assert heard(said(text, sound, rate), sound, 45.0, seed) == [words(text)], text


@pytest.mark.slow
@pytest.mark.parametrize("rate", [0.8, 1.0])
@pytest.mark.parametrize(
    "text", ["Hi team B, I am Gus, member of team B, stop", "Hi all, I am Rex, move back five metres"]
)
def test_the_end_of_a_longer_sentence_is_no_sentence(text: str, rate: float, sound: Sound) -> None:
    speech = said(text, sound, rate)
    for part in (0.1, 0.2, 0.3):
        cut = speech[round(part * len(speech)) :]
        assert heard(cut, sound, 20.0, 1) == [], f"{part} cut off"


@pytest.mark.parametrize("foreign", ["basket", "strawberry", "banana"])
def test_a_word_that_nobody_knows_is_not_taken_for_another(foreign: str, sound: Sound) -> None:
    speaker = sound.speaker_in(voice_for("Rex"))
    speech = speaker.render([("hi", "gus"), ("i", "am", "rex"), ("water", "the", foreign, "rose")])
    assert heard(speech * np.float32(0.3), sound, 30.0, 1) == []


def test_a_name_is_not_left_out(sound: Sound) -> None:
    speaker = sound.speaker_in(voice_for("Rex"))
    speech = speaker.render([("hi", "basket"), ("i", "am", "rex"), ("what", "is", "left")])
    assert heard(speech * np.float32(0.3), sound, 30.0, 1) == []


@pytest.mark.parametrize("seed", range(4))
def test_the_floor_is_not_free_between_a_faint_voice_and_its_sentence(seed: int, sound: Sound) -> None:
    """In noise a voice seems to end before the sentence is understood; who waits for it must know that it comes."""
    speech = np.concatenate([np.zeros(32000, np.float32), said(SENTENCES[1], sound), np.zeros(32000, np.float32)])
    noise = PinkNoise(SPEECH_RMS * 10.0 ** (5.0 / 20.0), seed).take(len(speech))
    recogniser = make_speech_recogniser(BOOK, NAMES, sound, strangers=False)
    free_blocks = 0
    for at in range(0, len(speech), 400):
        if any(
            isinstance(event, Recognised) for event in recogniser.push(speech[at : at + 400] + noise[at : at + 400])
        ):
            break
        free_blocks = 0 if recogniser.busy else free_blocks + 1
    assert at < len(speech) - 400, "it was understood"
    assert free_blocks <= 4, "0.1 s"


def test_after_a_hundred_years_all_is_heard_as_on_the_first_day(sound: Sound) -> None:
    """Counters that overflow, and what takes longer with the time, end a robot that is never switched off."""
    hearing = HearingPlan(channel=SynchronousWorker(), second=SynchronousWorker())
    quiet = np.zeros(SAMPLE_RATE_HZ, np.float32)
    stream = np.concatenate(
        [quiet, said("Hi Gus, I am Rex, what is left", sound), quiet, said("Gus, stop", sound), quiet]
    )
    stream += PinkNoise(0.1 * SPEECH_RMS, 1).take(len(stream))
    told = []
    for before in (0, 100 * 365 * 86_400 * SAMPLE_RATE_HZ):
        recogniser = make_speech_recogniser(BOOK, NAMES, sound, hearing)
        events = recogniser.lost(before) if before else []
        events += [e for at in range(0, len(stream), 400) for e in recogniser.push(stream[at : at + 400])]
        told.append([(type(e), e.start_sample - before, e.end_sample - before) for e in events])
    assert told[0] == told[1]
    assert sum(kind is Recognised for kind, _, _ in told[0]) == 2
