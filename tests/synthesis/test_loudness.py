"""BS.1770 at 16 kHz against its definition, and what the voices owe to a loudspeaker: level, peak, no DC."""

from __future__ import annotations

import random
from pathlib import Path

import numpy as np
import pytest

from hvcpd.language.phrasebook import Phrasebook, Vocabulary
from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from hvcpd.synthesis.delivery import Delivery, for_noise
from hvcpd.synthesis.leveling import TARGET_LUFS
from hvcpd.synthesis.lexicon import Lexicon
from hvcpd.synthesis.loudness import SILENCE_LUFS, k_weighting, loudness_lufs
from hvcpd.synthesis.speaker import Speaker
from hvcpd.synthesis.unit_cache import UnitCache
from hvcpd.synthesis.voices import VOICES, voice_named

pytestmark = pytest.mark.slow

LEXICON = Lexicon.load()
BOOK = Phrasebook(Vocabulary(("Rob", "Bot"), ("plant",), ("water the yellow rose",), (1, 2)))
RNG = random.Random(4)
SENTENCES = [BOOK.phrases(BOOK.sample(RNG)) for _ in range(4)] + [(("stop",),)]

TABLE_1 = ([1.53512485958697, -2.69169618940638, 1.19839281085285], [1.0, -1.69065929318241, 0.73248077421585])
TABLE_2 = ([1.0, -2.0, 1.0], [1.0, -1.99004745483398, 0.99007225036621])
"""BS.1770-4, tables 1 and 2: the two filters at 48 kHz."""


def sine(hz: float, seconds: float = 2.0, level: float = 1.0) -> Samples:
    t = np.arange(round(seconds * SAMPLE_RATE_HZ)) / SAMPLE_RATE_HZ
    return (level * np.sin(2.0 * np.pi * hz * t)).astype(np.float32)


def test_a_long_sound_is_filtered_as_in_one_piece() -> None:
    sound = np.random.default_rng(1).normal(0.0, 0.1, 4 * SAMPLE_RATE_HZ).astype(np.float32)
    size = 2 * len(sound)
    weights = k_weighting(np.fft.rfftfreq(size, 1.0 / SAMPLE_RATE_HZ))
    whole = np.fft.irfft(np.fft.rfft(sound, size) * weights)[: len(sound)]
    power = float(np.mean(whole**2))  # noise is as loud in all blocks
    assert loudness_lufs(sound) == pytest.approx(-0.691 + 10.0 * np.log10(power), abs=0.01)


def test_the_standards_reference_tone() -> None:
    """A 997 Hz sine at full scale in one channel reads -3.01 LUFS."""
    assert loudness_lufs(sine(997.0)) == pytest.approx(-3.01, abs=0.1)
    assert loudness_lufs(sine(997.0, level=0.1)) == pytest.approx(-23.01, abs=0.1)


def test_the_weighting_is_the_standards_own_up_to_where_the_rate_ends() -> None:
    hz = np.array([40.0, 100.0, 500.0, 1000.0, 2000.0, 4000.0])
    z1 = np.exp(-2j * np.pi * hz / 48_000)
    wanted = np.ones(len(hz), dtype=complex)
    for b, a in (TABLE_1, TABLE_2):
        wanted *= np.polyval(b[::-1], z1) / np.polyval(a[::-1], z1)
    assert 20.0 * np.log10(np.abs(k_weighting(hz) / wanted)) == pytest.approx(0.0, abs=0.35)


def test_silence_between_words_does_not_count() -> None:
    tone, gap = sine(997.0, 3.0, 0.1), np.zeros(5 * SAMPLE_RATE_HZ, np.float32)
    assert loudness_lufs(np.concatenate([tone, gap, tone])) == pytest.approx(loudness_lufs(tone), abs=0.5)
    assert loudness_lufs(gap) == loudness_lufs(np.zeros(0, np.float32)) == SILENCE_LUFS


def test_a_sound_shorter_than_a_block_has_the_loudness_of_its_own_length() -> None:
    assert loudness_lufs(sine(997.0, 0.2)) == pytest.approx(loudness_lufs(sine(997.0)), abs=0.2)


@pytest.mark.parametrize("voice", VOICES, ids=lambda voice: voice.name)
@pytest.mark.parametrize("delivery", [Delivery(), Delivery(gain_db=20.0), Delivery(0.5, lombard=True), Delivery(2.0)])
def test_sentences_are_fit_to_play(voice: object, delivery: Delivery, units: Path) -> None:
    speaker = Speaker(delivery.voice(voice), LEXICON, UnitCache(units))  # type: ignore[arg-type]
    for phrases in SENTENCES[:3] if delivery.rate != 1.0 else SENTENCES:
        plain = speaker.render(phrases)
        assert loudness_lufs(plain) == pytest.approx(TARGET_LUFS, abs=1.0)
        sound, gain_db = delivery.level(plain)
        assert loudness_lufs(sound) == pytest.approx(TARGET_LUFS + gain_db, abs=1.0)
        assert np.isfinite(sound).all()
        assert float(np.max(np.abs(sound))) <= 10.0 ** (-1.0 / 20.0)
        assert abs(float(sound.mean())) < 0.001 * float(np.max(np.abs(sound)))
        assert abs(float(sound[0])) < 1e-3
        assert abs(float(sound[-1])) < 1e-3


def test_noise_and_haste_change_the_speech_as_they_should() -> None:
    oak, words = voice_named("oak"), (("water", "the", "yellow", "rose"),)
    plain = Speaker(oak, LEXICON).render(words)
    fast = Speaker(Delivery(1.5).voice(oak), LEXICON).render(words)
    lombard = for_noise(plain)
    assert len(fast) < 0.85 * len(plain) < len(plain) == len(lombard)

    def bright(sound: Samples) -> float:
        power = np.abs(np.fft.rfft(sound.astype(float))) ** 2
        hz = np.fft.rfftfreq(len(sound), 1.0 / SAMPLE_RATE_HZ)
        return float(10.0 * np.log10(power[(hz > 1500) & (hz < 4000)].sum() / power[hz < 1000].sum()))

    def unevenness_db(sound: Samples) -> float:
        power = np.square(sound[: len(sound) // 640 * 640].reshape(-1, 640)).mean(axis=1)
        return float(np.std(10.0 * np.log10(power[power > 1e-3 * power.max()])))

    assert bright(lombard) > bright(plain) + 6.0
    assert unevenness_db(lombard) < 0.5 * unevenness_db(plain)
    assert loudness_lufs(lombard) == pytest.approx(loudness_lufs(plain), abs=0.5)
    assert not for_noise(np.zeros(100, np.float32)).any()


def test_a_gain_is_given_as_far_as_the_peak_allows() -> None:
    tone = sine(997.0, 0.5, 0.25)
    louder, got_db = Delivery(gain_db=6.0).level(tone)
    assert got_db == 6.0
    assert float(np.max(np.abs(louder))) == pytest.approx(0.25 * 10.0**0.3, rel=1e-3)
    loudest, got_db = Delivery(gain_db=20.0).level(tone)
    assert 9.0 < got_db < 12.0
    assert float(np.max(np.abs(loudest))) <= 10.0 ** (-1.0 / 20.0)
    silence = np.zeros(10, np.float32)
    assert not Delivery(gain_db=20.0).level(silence)[0].any()


@pytest.mark.parametrize(("rate", "gain_db"), [(0.0, 0.0), (3.0, 0.0), (1.0, 30.0), (float("nan"), 0.0)])
def test_a_delivery_out_of_range_is_our_own_misuse(rate: float, gain_db: float) -> None:
    with pytest.raises(ValueError, match="is not from"):
        Delivery(rate, gain_db)
