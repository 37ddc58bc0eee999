"""How late the own sentence comes back is measured to within some milliseconds, or not at all."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from hvcpd.assembly.sound import Sound, make_sound, user_cache_folder
from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from hvcpd.ranging.own_delay import MOST_DELAY_S, OwnDelay

BLOCK = 400
RT60_S = 0.45
SENTENCES = (
    (("hi", "all"), ("i", "am", "rob")),
    (("task", "three", "complete"),),
    (("hi", "all"), ("i", "am", "rob"), ("task", "three", "complete"), ("i", "will", "complete", "task", "one")),
)
"""Of 1.7, 1.5 and 5.3 s."""


@cache
def sound() -> Sound:
    return make_sound(None, user_cache_folder())


@cache
def sentence(which: int, name: str = "Rob") -> Samples:
    return np.asarray(0.3 * sound().speaker_of(name).render(SENTENCES[which]), np.float32)


def through_room(said: Samples, late_s: float, snr_db: float, seed: int = 1) -> Samples:
    """As the own microphone hears it, for two seconds beyond its end."""
    rng = np.random.default_rng(seed)
    n = round(RT60_S * SAMPLE_RATE_HZ)
    ringing = 0.02 * rng.standard_normal(n) * 10.0 ** (-3.0 * np.arange(n) / n)
    ringing[0] = 1.0
    way = np.concatenate([np.zeros(round(late_s * SAMPLE_RATE_HZ)), ringing])
    padded = np.pad(said, (0, 2 * SAMPLE_RATE_HZ))
    size = len(padded) + len(way)
    heard = np.fft.irfft(np.fft.rfft(padded, size) * np.fft.rfft(way, size), size)[: len(padded)]
    level = np.sqrt(np.mean(np.square(heard[: len(said)])))
    return np.asarray(0.5 * (heard + level * 10.0 ** (-snr_db / 20.0) * rng.standard_normal(len(heard))), np.float32)


def measured(said: Samples, heard: Samples, told_s: float) -> float | None:
    """At the moment when, by the latency told, the sentence's end has been heard."""
    delay = OwnDelay()
    for begin in range(0, len(said) + round(told_s * SAMPLE_RATE_HZ), BLOCK):
        piece = said[begin : begin + BLOCK]
        delay.play(np.pad(piece, (0, BLOCK - len(piece))))
        delay.hear(heard[begin : begin + BLOCK])
    return delay.measure()


@pytest.mark.parametrize("snr_db", [30.0, 0.0])
@pytest.mark.parametrize("late_s", [0.0, 0.075, 0.225, 0.6])
@pytest.mark.parametrize("which", range(len(SENTENCES)))
def test_it_is_found_whatever_was_told(which: int, late_s: float, snr_db: float) -> None:
    said = sentence(which)
    heard = through_room(said, late_s, snr_db)
    for told_s in (0.0, 0.15, 0.6):
        assert measured(said, heard, told_s) == pytest.approx(late_s, abs=0.008)


@pytest.mark.parametrize("which", range(len(SENTENCES)))
def test_with_headphones_on_nothing_is_found(which: int) -> None:
    rng = np.random.default_rng(2)
    said = sentence(which)
    noise = 0.01 * rng.standard_normal(len(said) + SAMPLE_RATE_HZ)
    assert measured(said, noise.astype(np.float32), 0.15) is None
    assert measured(said, np.zeros(len(said) + SAMPLE_RATE_HZ, np.float32), 0.15) is None


@pytest.mark.parametrize(("which", "other"), [(0, 1), (1, 0)])
def test_another_sentence_of_somebody_else_is_not_taken_for_it(which: int, other: int) -> None:
    said = sentence(which)
    for begin in range(0, 8000, 1000):
        heard = np.pad(sentence(other, "Bot"), (begin, 2 * SAMPLE_RATE_HZ))
        assert measured(said, heard, 0.15) is None


def test_somebody_who_talks_as_loud_meanwhile_does_not_hide_it() -> None:
    said = sentence(2)
    heard = through_room(said, 0.225, 30.0)
    talk = 0.5 * sentence(0, "Bot")
    heard[20_000 : 20_000 + len(talk)] += talk
    assert measured(said, heard, 0.15) == pytest.approx(0.225, abs=0.01)


def test_a_delay_that_changes_in_the_sentence_is_measured_at_its_end() -> None:
    said = sentence(2)
    sooner, later = through_room(said, 0.075, 30.0), through_room(said, 0.4, 30.0)
    heard = np.concatenate([sooner[:SAMPLE_RATE_HZ], later[SAMPLE_RATE_HZ:]])
    assert measured(said, heard, 0.15) == pytest.approx(0.4, abs=0.008)


def test_one_short_word_is_not_enough() -> None:
    """ "Stop" sounds like the beginning of much else."""
    said = np.asarray(0.3 * sound().speaker_of("Rob").render([["stop"]]), np.float32)
    assert measured(said, through_room(said, 0.075, 30.0), 0.3) is None


def test_longer_than_may_be_is_not_looked_for() -> None:
    said = sentence(2)
    assert measured(said, through_room(said, MOST_DELAY_S + 0.1, 30.0), 0.15) is None


def test_nothing_said_is_not_found() -> None:
    assert OwnDelay().measure() is None
    silence = np.zeros(SAMPLE_RATE_HZ, np.float32)
    assert measured(silence, silence, 0.15) is None
