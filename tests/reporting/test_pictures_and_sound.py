"""PNG, spectrum, trails and clips against what they must hold."""

from __future__ import annotations

import io
import struct
import zlib

import numpy as np
import pytest
import soundfile
from hypothesis import given, settings
from hypothesis import strategies as st

from hvcpd.ports import SAMPLE_RATE_HZ
from hvcpd.reporting.audio_clip import limited, make_clip
from hvcpd.reporting.events import Trail
from hvcpd.reporting.simplify import length_m, simplified
from hvcpd.reporting.spectrogram import HOP, encode_png, magma, picture, spectrogram


def decode_png(png: bytes) -> tuple[np.ndarray, np.ndarray]:
    """Pixels and palette of an 8-bit indexed PNG without filters; checks every chunk's sum."""
    assert png[:8] == b"\x89PNG\r\n\x1a\n"
    chunks, at = {}, 8
    while at < len(png):
        (length,) = struct.unpack(">I", png[at : at + 4])
        body = png[at + 4 : at + 8 + length]
        assert struct.unpack(">I", png[at + 8 + length : at + 12 + length])[0] == zlib.crc32(body)
        chunks[body[:4]] = body[4:]
        at += 12 + length
    width, height, depth, kind = struct.unpack(">IIBB", chunks[b"IHDR"][:10])
    assert (depth, kind) == (8, 3)
    rows = np.frombuffer(zlib.decompress(chunks[b"IDAT"]), np.uint8).reshape(height, width + 1)
    assert not rows[:, 0].any()
    assert list(chunks) == [b"IHDR", b"PLTE", b"IDAT", b"IEND"]
    return rows[:, 1:], np.frombuffer(chunks[b"PLTE"], np.uint8).reshape(-1, 3)


def test_png_round_trip() -> None:
    pixels = np.random.default_rng(1).integers(0, 48, (7, 13)).astype(np.uint8)
    decoded, palette = decode_png(encode_png(pixels, magma(48)))
    assert np.array_equal(decoded, pixels)
    assert np.array_equal(palette, magma(48))


def test_png_refuses_what_is_no_picture() -> None:
    with pytest.raises(ValueError, match="0 × 3"):
        encode_png(np.zeros((3, 0), np.uint8), magma(4))
    with pytest.raises(ValueError, match="4 colours"):
        encode_png(np.full((3, 3), 4, np.uint8), magma(4))


def test_colours_rise_in_lightness() -> None:
    lightness = magma(48) @ np.array([0.2126, 0.7152, 0.0722])
    assert np.all(np.diff(lightness) > 0)


@pytest.mark.parametrize("frequency_hz", [500.0, 2000.0, 6000.0])
def test_a_tone_is_bright_at_its_frequency(frequency_hz: float) -> None:
    t = np.arange(SAMPLE_RATE_HZ) / SAMPLE_RATE_HZ
    spectrum = spectrogram(np.sin(2 * np.pi * frequency_hz * t).astype(np.float32))
    pixels, _ = decode_png(picture(spectrum)[0])
    brightest = pixels.shape[0] - 1 - int(np.argmax(pixels[:, pixels.shape[1] // 2]))
    assert abs(brightest / (pixels.shape[0] - 1) * 8000.0 - frequency_hz) < 40.0
    assert pixels.shape[1] * HOP / SAMPLE_RATE_HZ == pytest.approx(1.0, abs=0.03)


def test_silence_has_a_picture_and_a_blink_has_none() -> None:
    decode_png(picture(spectrogram(np.zeros(4000, np.float32)))[0])
    with pytest.raises(ValueError, match="10 samples"):
        spectrogram(np.zeros(10, np.float32))


@given(st.integers(0, 2**32 - 1), st.integers(1, 300), st.floats(0.01, 0.5))
@settings(max_examples=60, deadline=None)
def test_a_simplified_trail_is_near_the_true_place_at_every_time(seed: int, n: int, tolerance_m: float) -> None:
    rng = np.random.default_rng(seed)
    t = np.cumsum(rng.uniform(0.01, 1.0, n))
    x, y = np.cumsum(rng.normal(0, 0.05, (2, n)), axis=1)
    short = simplified(Trail("Rob", t, x, y), tolerance_m)
    off = np.hypot(np.interp(t, short.t_s, short.x_m) - x, np.interp(t, short.t_s, short.y_m) - y)
    assert off.max() <= tolerance_m + 1e-9
    assert (short.t_s[0], short.t_s[-1]) == (t[0], t[-1])


def test_a_straight_way_keeps_two_points_and_a_stop_four() -> None:
    t = np.arange(0.0, 30.0, 0.025)
    straight = simplified(Trail("Rob", t, t * 0.2, t * 0.1))
    assert len(straight.t_s) == 2
    assert length_m(straight) == pytest.approx(np.hypot(0.2, 0.1) * t[-1])
    x = np.interp(t, [0, 10, 20, 30], [0, 2, 2, 4])
    assert len(simplified(Trail("Rob", t, x, 0 * t)).t_s) == 4


def test_a_trail_without_points_or_with_holes() -> None:
    none = np.zeros(0)
    assert len(simplified(Trail("Rob", none, none, none)).t_s) == 0
    x = np.array([0.0, np.nan, 1.0])
    assert np.isfinite(simplified(Trail("Rob", np.arange(3.0), x, x)).x_m).all()


def read(flac: bytes) -> np.ndarray:
    samples, rate_hz = soundfile.read(io.BytesIO(flac))
    assert rate_hz == SAMPLE_RATE_HZ
    return samples


def test_a_clip_keeps_the_sound_at_the_level_of_speech() -> None:
    t = np.arange(2 * SAMPLE_RATE_HZ) / SAMPLE_RATE_HZ
    tone = (0.001 * np.sin(2 * np.pi * 440 * t)).astype(np.float32)
    samples = read(make_clip(tone, [(0.5, 1.5)]).flac)
    level_dbfs = 20 * np.log10(np.sqrt(np.mean(samples[SAMPLE_RATE_HZ // 2 : -SAMPLE_RATE_HZ // 2] ** 2)))
    assert level_dbfs == pytest.approx(-20.0, abs=0.3)
    spectrum = np.abs(np.fft.rfft(samples))
    assert np.argmax(spectrum) / 2.0 == pytest.approx(440.0, abs=1.0)
    spectrum[870:890] = 0.0
    assert spectrum.max() < 0.01 * np.abs(np.fft.rfft(samples)).max(), "of ten bits nothing is heard"


def test_the_limiter_never_passes_full_scale_and_leaves_the_quiet_alone() -> None:
    sound = np.linspace(-20, 20, 2001).astype(np.float32)
    out = limited(sound)
    assert np.abs(out).max() <= 1.0
    assert np.all(np.diff(out) >= 0)
    quiet = np.abs(sound) < 0.6
    assert np.array_equal(out[quiet], sound[quiet])


@given(
    st.lists(st.floats(width=32), min_size=1, max_size=50), st.lists(st.tuples(st.floats(), st.floats()), max_size=3)
)
def test_any_sound_makes_a_clip(values: list[float], spoken: list[tuple[float, float]]) -> None:
    samples = read(make_clip(np.array(values, np.float32), spoken).flac)
    assert len(samples) == len(values)
    assert np.all(np.isfinite(samples))
