"""What PocketSphinx is given to hear: its own cepstra, without the noise, and with what a narrow microphone lost."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from hvcpd.assembly.make import Sound, make_sound
from hvcpd.people.cepstra import (
    LEAST,
    LEAST_GAIN,
    N_BANDS,
    N_CEPSTRA,
    bands_of,
    cepstra_of,
    logs_of,
    noise_of,
    transform,
    upper_lost,
    without_noise,
)
from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from hvcpd.synthesis.speaker import Speaker
from hvcpd.synthesis.voices import VOICES

NOBODY = np.zeros(N_BANDS)


@pytest.fixture(scope="module")
def sound(units: Path) -> Sound:
    return make_sound(None, units)


@pytest.fixture(scope="module")
def sentence(sound: Sound) -> Samples:
    """With half a second of a quiet room around it."""
    speech = np.pad(Speaker(VOICES[0], sound.lexicon, sound.cache).render([["bot", "six", "is", "left"]]), 8000)
    return np.asarray(0.3 * speech + noise(len(speech), 1e-4), np.float32)


def noise(n: int, rms: float) -> NDArray[np.float64]:
    return rms * np.random.default_rng(7).standard_normal(n)


def narrow(sound: Samples) -> Samples:
    """As from a telephone: nothing above 3.8 kHz."""
    spectrum = np.fft.rfft(sound)
    spectrum[np.fft.rfftfreq(len(sound), 1.0 / SAMPLE_RATE_HZ) > 3800.0] = 0.0
    return np.asarray(np.fft.irfft(spectrum, len(sound)), np.float32)


def distance(one: NDArray[np.float32], other: NDArray[np.float32]) -> float:
    return float(np.sqrt(np.mean((one - other) ** 2)))


def cepstra(sound: Samples, noise: NDArray[np.float64]) -> NDArray[np.float32]:
    return cepstra_of(logs_of(sound, noise))


def test_shapes_and_mean(sentence: Samples) -> None:
    found = cepstra(sentence, NOBODY)
    assert found.shape == (1 + (len(sentence) - 410) // 160, N_CEPSTRA)
    assert found.dtype == np.float32
    assert np.abs(found.mean(axis=0)).max() < 1e-3
    assert cepstra(sentence[:300], NOBODY).shape == (0, N_CEPSTRA)


def test_the_level_does_not_count(sentence: Samples) -> None:
    assert distance(cepstra(sentence, NOBODY), cepstra(np.float32(0.1) * sentence, NOBODY)) < 0.05


def test_known_noise_is_taken_away(sentence: Samples) -> None:
    noisy = np.asarray(sentence + noise(len(sentence), 0.01), np.float32)
    known = bands_of(np.asarray(noise(3 * SAMPLE_RATE_HZ, 0.01), np.float32)).mean(axis=0)
    loudness, ours = (np.ptp(cepstra(noisy, each)[:, 0]) for each in (NOBODY, known))
    assert ours > 1.3 * loudness


def test_no_band_falls_further_than_it_may() -> None:
    bands = np.full((20, N_BANDS), 5.0)
    assert np.allclose(without_noise(bands, np.full(N_BANDS, 5.0)), 5.0 * LEAST_GAIN)
    assert np.allclose(without_noise(bands, NOBODY), 5.0)
    assert np.isfinite(np.log(without_noise(0.0 * bands, NOBODY) + LEAST)).all()


def test_the_noise_is_what_was_heard_before_without_who_spoke_before() -> None:
    before = noise(3 * SAMPLE_RATE_HZ, 0.01)
    wanted = bands_of(np.asarray(before, np.float32)).mean(axis=0)
    before[5000:12000] += 0.3 * np.sin(0.3 * np.arange(7000))
    both = np.concatenate([before, noise(8000, 0.3)]).astype(np.float32)
    found = noise_of(both, len(before))
    assert np.abs(np.log(found / wanted)).max() < 0.5
    assert np.isfinite(noise_of(both[:500], 0)).all()


def test_what_a_narrow_microphone_lost_is_made_up(sentence: Samples) -> None:
    telephone = np.asarray(narrow(sentence) + noise(len(sentence), 1e-5), np.float32)
    assert upper_lost(bands_of(telephone))
    assert not upper_lost(bands_of(sentence))
    wide = cepstra(sentence, NOBODY)
    floor = cepstra(np.asarray(telephone + noise(len(sentence), 0.003), np.float32), NOBODY)  # hides the loss
    assert distance(cepstra(telephone, NOBODY), wide) < 0.9 * distance(floor, wide)


@pytest.fixture(scope="module")
def decoder() -> Any:
    """PocketSphinx with a grammar of one word, and neither noise nor mean taken away."""
    pocketsphinx = pytest.importorskip("pocketsphinx")
    known = pocketsphinx.Decoder(
        hmm=pocketsphinx.get_model_path("en-us/en-us"),
        dict=pocketsphinx.get_model_path("en-us/cmudict-en-us.dict"),
        lm=None,
        loglevel="FATAL",
    )
    with tempfile.TemporaryDirectory() as folder:
        grammar = Path(folder) / "one.gram"
        grammar.write_text("#JSGF V1.0;\ngrammar one;\npublic <one> = bot six is left;\n")
        known.add_jsgf_file("one", str(grammar))
    known.activate_search("one")
    settings = known.config
    settings["cmn"], settings["remove_noise"] = "none", False
    known.reinit_feat(settings)
    return known


def test_plain_cepstra_are_those_of_pocketsphinx(decoder: Any, sentence: Samples) -> None:
    def segments() -> list[tuple[str, int, float]]:
        return [(each.word, each.end_frame, float(np.log(each.ascore))) for each in decoder.seg()]

    pcm = np.round(sentence * 32768.0).astype("<i2")
    decoder.start_utt()
    decoder.process_raw(pcm.tobytes(), full_utt=True)
    decoder.end_utt()
    theirs = segments()
    plain = np.log(bands_of(pcm.astype(np.float32) / np.float32(32768.0)) + LEAST) @ transform()
    decoder.start_utt()
    decoder.process_cep(plain.astype(np.float32).tobytes(), full_utt=True)
    decoder.end_utt()
    ours = segments()
    assert [each[0] for each in ours] == [each[0] for each in theirs]
    assert np.allclose([each[2] for each in ours], [each[2] for each in theirs], atol=0.01)
