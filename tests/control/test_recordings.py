"""Which recordings of a word can be used."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from hvcpd.control.enrol.recordings import check_take, confusable, distance, features, odd_takes, speech_in
from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from tests.recognition.signals import word

QUIET = np.zeros(SAMPLE_RATE_HZ // 3, np.float32)


def recording(*words: str, gain: float = 1.0, noise_rms: float = 1e-4, pause_s: float = 0.4, seed: int = 1) -> Samples:
    pause = np.zeros(round(pause_s * SAMPLE_RATE_HZ), np.float32)
    parts = [QUIET, *[part for w in words for part in (gain * word(w), pause)][:-1], QUIET]
    sound = np.concatenate(parts)
    sound = sound + noise_rms * np.random.default_rng(seed).standard_normal(len(sound))
    return np.asarray(np.clip(sound, -1.0, 1.0), np.float32)


def test_a_good_take_holds_the_word_and_nothing_around_it() -> None:
    take, fault = check_take(recording("water"))
    assert fault == ""
    assert take is not None
    assert abs(len(take) * 0.01 - len(word("water")) / SAMPLE_RATE_HZ) < 0.08
    speech = speech_in(recording("water"))
    assert speech is not None
    assert speech.snr_db > 30.0


def test_a_recording_that_was_cut_at_the_word_is_good_too() -> None:
    take, fault = check_take(word("water"))
    assert fault == ""
    assert take is not None


@pytest.mark.parametrize(
    ("sound", "why"),
    [
        (np.zeros(8000, np.float32), "nothing"),
        (np.zeros(0, np.float32), "nothing"),
        (recording("water", gain=40.0), "too loud for the microphone"),
        (recording("water", noise_rms=0.03), "above the noise"),
        (recording("water", "stop"), "pause"),
        (recording("water", "stop", "green", "rose", "water", pause_s=0.05), "takes"),
    ],
)
def test_a_take_that_cannot_be_used_is_refused_with_its_reason(sound: Samples, why: str) -> None:
    take, fault = check_take(sound)
    assert take is None
    assert why in fault


def test_what_is_just_too_loud_a_room_is_not_told_with_the_limit_itself() -> None:
    """It said "speech is 15 dB above the noise, not 15"."""
    speech = speech_in(recording("water"))
    assert speech is not None
    assert "speech is 14 dB above the noise, not 15" in replace(speech, snr_db=14.96).fault


def energies(name: str, pitch_hz: float = 120.0, noise_rms: float = 1e-4) -> np.ndarray:
    sound = np.concatenate([QUIET, word(name, pitch_hz), QUIET])
    noise = noise_rms * np.random.default_rng(2).standard_normal(len(sound))
    take, fault = check_take(np.asarray(sound + noise, np.float32))
    assert take is not None, fault
    return take


def test_the_noise_of_the_room_is_taken_out() -> None:
    clean, noisy = energies("water"), energies("water", noise_rms=0.004)
    assert distance(features(clean), features(noisy)) < 0.6 * distance(features(clean), features(energies("green")))


def test_takes_of_one_word_are_near_and_of_others_far() -> None:
    same = distance(features(energies("water")), features(energies("water", 135.0)))
    other = distance(features(energies("water")), features(energies("rose")))
    assert same < other / 1.5
    assert distance(features(energies("water")), features(energies("water"))) < 0.1


def test_a_take_unlike_the_others_is_found() -> None:
    assert odd_takes([energies("water"), energies("water", 135.0), energies("stop")]) == [2]
    assert odd_takes([energies("water")]) == []


def test_words_that_sound_alike_are_found_where_they_compete() -> None:
    takes = {
        "water": [energies("water"), energies("water", 140.0)],
        "later": [energies("water", 121.0), energies("water", 139.0)],
        "stop": [energies("stop"), energies("stop", 140.0)],
    }
    assert confusable(takes, [("later", "water"), ("stop", "water")]) == [("later", "water")]
    assert confusable(takes, [("stop", "water")]) == []
