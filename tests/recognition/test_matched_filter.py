"""The matched filter: strengths as theory has them, and what is left over."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from hvcpd.recognition.matched_filter import FRAME, REACH, WhiteningFilter, correlated, faded, power_of, scrutinized
from hvcpd.recognition.paths import passes


def _noise(n: int, seed: int, level: float = 0.01) -> Samples:
    return np.asarray(np.random.default_rng(seed).standard_normal(n) * level, np.float32)


def _taught(noise: Samples) -> WhiteningFilter:
    whitening = WhiteningFilter()
    whitening.push(noise)
    return whitening


def _word(n: int = 6000) -> Samples:
    """A hum of a few harmonics and a hiss, as a word has."""
    t = np.arange(n) / 16_000
    hum = sum(np.sin(2 * np.pi * 130 * k * t + k) / k for k in range(1, 12))
    return np.asarray(0.05 * (hum + _noise(n, 5, 0.3)) * np.hanning(n), np.float32)


def _strength(
    whitening: WhiteningFilter, heard: Samples, word: Samples, at: int, lags: int = 49
) -> tuple[float, int, float]:
    first = at - lags // 2
    whitened = whitening.whiten(heard[first - REACH : first + len(word) + lags - 1 + REACH])
    expected = float(np.dot(power_of(word), whitening.weights)) ** 0.5
    strength, offset = correlated(whitened, word, expected)
    return strength, offset - lags // 2, expected


@pytest.mark.parametrize("coloured", [False, True])
def test_noise_alone_has_strength_one(coloured: bool) -> None:
    noise = _noise(160_000, 1)
    if coloured:
        noise = np.asarray(np.convolve(noise, [0.5, 1.0, 0.7, 0.3], "same"), np.float32)
    whitening, word = _taught(noise[:64_000]), _word()
    whitened = whitening.whiten(noise[64_000:])
    values = np.correlate(whitened, word, "valid") / float(np.dot(power_of(word), whitening.weights)) ** 0.5
    assert np.std(values) == pytest.approx(1.0, abs=0.12)


@pytest.mark.parametrize("gain", [0.05, 0.2, 1.0])
def test_a_word_has_the_strength_of_its_energy_over_the_noise(gain: float) -> None:
    noise, word = _noise(96_000, 2), _word()
    heard = noise.copy()
    heard[70_000 : 70_000 + len(word)] += np.float32(gain) * word
    strength, offset, expected = _strength(_taught(noise[:64_000]), heard, word, 70_000)
    assert strength == pytest.approx(gain * expected, abs=3.0 + 0.05 * gain * expected)
    if gain * expected > 6.0:
        assert offset == 0


def test_expectation_is_that_of_white_noise() -> None:
    noise, word = _noise(64_000, 3, 0.02), _word()
    expected = float(np.dot(power_of(word), _taught(noise).weights)) ** 0.5
    assert expected == pytest.approx(float(np.sqrt(np.square(word, dtype=np.float64).sum())) / 0.02, rel=0.06)


def test_what_is_left_over_lowers_the_strength_of_a_chance_likeness() -> None:
    noise, word = _noise(96_000, 4), _word()
    other = np.roll(word[::-1], 300) * np.float32(8.0)
    heard = noise.copy()
    heard[70_000 : 70_000 + len(word)] += other
    whitening = _taught(noise[:64_000])
    strength, offset, expected = _strength(whitening, heard, word, 70_000)
    whitened = whitening.whiten(heard[70_000 + offset - REACH : 70_000 + offset + len(word) + REACH])
    fit = scrutinized(whitened, word, power_of(word), whitening, strength, expected)
    assert fit.strength < 0.5 * strength


def test_somebody_loud_for_a_moment_hides_that_part_only() -> None:
    noise, word = _noise(96_000, 6), _word(8000)
    heard = noise.copy()
    heard[70_000:78_000] += np.float32(0.3) * word
    loud = heard.copy()
    loud[76_500:78_000] += _noise(1500, 9, 0.3)
    whitening, power = _taught(noise[:64_000]), power_of(word)
    fits = []
    for sound in (heard, loud):
        whitened = whitening.whiten(sound[70_000 - REACH : 78_000 + REACH])
        expected = float(np.dot(power, whitening.weights)) ** 0.5
        strength = float(np.dot(whitened, word)) / expected
        fits.append(scrutinized(whitened, word, power, whitening, strength, expected))
    assert fits[1].strength > 0.8 * fits[0].strength
    assert fits[1].strength / fits[1].expected == pytest.approx(0.3, rel=0.1)


def test_half_a_word_is_not_the_whole() -> None:
    noise, word = _noise(96_000, 6), _word(8000)
    for whole in (True, False):
        heard = noise.copy()
        half = np.concatenate([word[:4000], np.zeros(4000, np.float32)])
        heard[70_000:78_000] += np.float32(0.2) * (word if whole else half)
        whitening = _taught(noise[:64_000])
        strength, offset, expected = _strength(whitening, heard, word, 70_000)
        whitened = whitening.whiten(heard[70_000 + offset - REACH : 78_000 + offset + REACH])
        assert scrutinized(whitened, word, power_of(word), whitening, strength, expected).whole is whole


def test_silence_before_a_burst_is_missed_by_no_loud_word() -> None:
    """A closure holds nothing that could be found, however strong the word is."""
    noise, word = _noise(96_000, 6), np.concatenate([np.zeros(1200, np.float32), _word(6800)])
    word[1100:1200] += _noise(100, 5, 1e-3)
    heard = noise.copy()
    heard[70_000:78_000] += np.float32(3.0) * word
    whitening = _taught(noise[:64_000])
    strength, offset, expected = _strength(whitening, heard, word, 70_000)
    whitened = whitening.whiten(heard[70_000 + offset - REACH : 78_000 + offset + REACH])
    assert strength > 100.0
    assert scrutinized(whitened, word, power_of(word), whitening, strength, expected).whole


def test_digital_silence_teaches_nothing() -> None:
    assert not _taught(np.zeros(64_000, np.float32)).ready
    assert _taught(_noise(64_000, 7)).ready


@given(st.lists(st.integers(1, 3000), min_size=1, max_size=20))
@settings(max_examples=20, deadline=None)
def test_the_size_of_blocks_changes_nothing(sizes: list[int]) -> None:
    noise = _noise(40_000, 8)
    blocks = WhiteningFilter()
    at = 0
    while at < len(noise):
        for size in sizes:
            blocks.push(noise[at : at + size])
            at += size
    assert np.array_equal(blocks.weights, _taught(noise).weights)


def test_power_is_the_energy_of_the_sound() -> None:
    word = _word(5000)
    assert float(power_of(word).sum()) == pytest.approx(float(np.square(word, dtype=np.float64).sum()), rel=0.01)
    assert power_of(word[:10]).shape == (FRAME // 2 + 1,)


@pytest.mark.parametrize("colour", [[1.0], [1.0, 0.9, 0.6], [1.0, -0.7]])
def test_a_faint_voice_stirs_and_steady_noise_does_not(colour: list[float]) -> None:
    random = np.random.default_rng(9)
    noise = np.convolve(random.standard_normal(30 * SAMPLE_RATE_HZ), colour, "same").astype(np.float32)
    number = np.arange(2, 12)[:, None]
    vowel = (np.sin(2.0 * np.pi * number * 130.0 * np.arange(SAMPLE_RATE_HZ // 2) / SAMPLE_RATE_HZ) / number).sum(
        axis=0
    )
    vowel *= 0.25 * noise.std() / vowel.std()  # -12 dB
    said = noise.copy()
    said[20 * SAMPLE_RATE_HZ :][: len(vowel)] += vowel.astype(np.float32)

    def stirs(sound: Samples) -> list[bool]:
        whitening = WhiteningFilter()
        whitening.expect(power_of(vowel.astype(np.float32))[None])
        found = []
        for at in range(0, len(sound), 640):
            whitening.push(sound[at : at + 640])
            found.append(whitening.voiced)
        return found

    assert np.mean(stirs(noise)) < 0.03
    assert any(stirs(said)[500:530])


def _hum(n: int) -> Samples:
    """A voice without any hiss, which fades in slowly."""
    t = np.arange(n) / SAMPLE_RATE_HZ
    hum = sum(np.sin(2 * np.pi * 130 * k * t + k) / k**2 for k in range(1, 12))
    return np.asarray(0.05 * hum * np.linspace(0.0, 1.0, n) ** 2, np.float32)


@pytest.mark.parametrize("cut", [1000, 2080, 3500])
def test_the_beginning_of_a_word_is_as_strong_as_expected(cut: int) -> None:
    """Amid nothing but the voice itself all other frequencies count 10,000 times as much, and a cut has them all."""
    word = _hum(6000)
    whitening = _taught(np.tile(word, 4))
    part = faded(word[:cut])
    expected = float(np.dot(power_of(part), whitening.weights)) ** 0.5
    whitened = whitening.whiten(np.pad(word, REACH))[:cut]
    strength, _ = correlated(whitened, part, expected)
    assert strength > 0.6 * expected


def test_zeros_tell_nothing_of_the_noise() -> None:
    noise = _noise(8 * FRAME, 3)
    muted = np.concatenate([noise, np.zeros(40 * FRAME, np.float32)])
    whitening = WhiteningFilter()
    whitening.push(np.zeros(40 * FRAME, np.float32))
    assert not whitening.ready
    whitening.push(muted)
    assert np.allclose(np.median(whitening.weights), np.median(_taught(noise).weights), rtol=0.2)


@pytest.mark.parametrize(
    ("strength", "fits"), [(49.0, False), (51.0, True), (100.0, True), (199.0, True), (201.0, False)]
)
def test_a_word_is_about_as_loud_as_those_before_it(strength: float, fits: bool) -> None:
    """ "Left" was once found eight times as loud as the "turn" before it, which nobody had said."""
    assert passes(strength, 100.0) == fits


@pytest.mark.parametrize("strength", [0.6, 7.4])
def test_a_word_that_noise_hides_may_be_off_by_chance(strength: float) -> None:
    assert passes(strength, 4.0)
