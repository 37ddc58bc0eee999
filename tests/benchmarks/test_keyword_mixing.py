"""Takes mixed in the front end's energies are like those mixed in samples, and end where their labels say."""

from __future__ import annotations

import numpy as np

from benchmarks.keyword.clips import KINDS, Clip
from benchmarks.keyword.mixing import CROSS, N_FRAMES, EnergyMixer, mixed
from hvcpd.ports import SAMPLE_RATE_HZ
from hvcpd.recognition.frontend import N_BANDS, energies_of


def noise(seconds: float, seed: int) -> np.ndarray:
    return np.random.default_rng(seed).standard_normal(round(seconds * SAMPLE_RATE_HZ)).astype(np.float32)


def clips(number: int = 4) -> list[Clip]:
    """Bursts of noise of 0.4 s."""
    sounds = {kind: [0.2 * noise(0.4, 10 * k + n) for n in range(number)] for k, kind in enumerate(KINDS)}
    return [Clip(s, kind, len(s) - 1, "train", f"{kind} {n}") for kind in KINDS for n, s in enumerate(sounds[kind])]


def test_two_sounds_energies_add_as_their_samples_do() -> None:
    first, second = noise(20.0, 1), noise(20.0, 2)
    alone = energies_of(first), energies_of(second)
    true = energies_of(first + second)
    guessed = mixed(*alone, np.random.default_rng(3))
    assert abs(guessed.mean() / true.mean() - 1.0) < 0.03
    spread = [np.std((sums - alone[0] - alone[1]) / (2.0 * np.sqrt(alone[0] * alone[1]))) for sums in (true, guessed)]
    assert abs(spread[0] - CROSS) < 0.05
    assert abs(spread[1] - CROSS) < 0.05


def test_a_call_ends_where_its_label_says() -> None:
    takes = EnergyMixer(clips(), None, "train", 1).draw(300)
    assert takes.energies.shape == (300, N_FRAMES, N_BANDS)
    logs = np.log(takes.energies).mean(axis=2)
    called = [(k, end) for k, ends in enumerate(takes.ends) for end in ends[ends >= 0][-1:]]
    drops = [[logs[k, end + at - 8] - logs[k, end + at] for k, end in called] for at in range(-12, 24, 4)]
    assert len(called) > 80
    assert 0 <= range(-12, 24, 4)[int(np.argmax(np.mean(drops, axis=1)))] <= 8


def test_the_same_seed_draws_the_same_and_hard_clips_are_drawn_more_often() -> None:
    first, second = (EnergyMixer(clips(), None, "train", 7) for _ in range(2))
    takes = first.draw(40)
    np.testing.assert_array_equal(takes.energies, second.draw(40).energies)
    for _ in range(20):
        takes = first.draw(40)
        first.learned(takes, np.array([4.0 if number == 2 else 0.0 for _, number in takes.clips], np.float32))
    numbers = [number for _, number in first.draw(400).clips if number >= 0]
    assert numbers.count(2) > 0.6 * len(numbers)
