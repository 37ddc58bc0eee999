"""From pitch and spectra to sound at 16 kHz: a pulse train through a filter that moves, noise, and a free part.

The method is hibari-tts 0.2's (`hibari/dsp.py`), with 800 samples to a window in place of 1200, so that the bins stay
20 Hz apart. As the source and the filter are apart, one talker becomes many: pitch is scaled, and the spectrum is
stretched along the frequency axis, as vocal tracts of other lengths do (vocal tract length perturbation: Jaitly and
Hinton 2013).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from hvcpd.synthesis.acoustic_net import BINS, AcousticNet, Array

WINDOW = 800
HOP = WINDOW // 4
"""Samples to a frame: 12.5 ms."""
BIN_HZ = SAMPLE_RATE_HZ / WINDOW
LAST_BIN = WINDOW // 2

_HANN: Array = (0.5 - 0.5 * np.cos(2.0 * np.pi * np.arange(WINDOW) / WINDOW)).astype(np.float32)
_OVERLAPPED = 1.5
"""Sum of the squares of windows that overlap by three quarters."""

LOWEST_BIN = 11
"""The recorded talker has hardly any harmonic below this bin, 220 Hz, and her filter falls there by 20 dB. A lower
voice's first harmonics get the filter's level at this bin."""

VOICED_HZ = 40.0
"""Lowest pitch: below, a frame has no voice."""

HIGHEST_HZ = 7_900.0
"""Highest harmonic of the pulses."""

LOUDEST = 7.0
"""Highest log magnitude."""


@dataclass(frozen=True)
class Colour:
    """What makes another talker of the recorded one: `stretch` multiplies all frequencies of the spectrum, `breath_db`
    is the gain of its noise in voiced frames, `tilt_db` a gain per octave above `TILT_FROM_HZ`."""

    stretch: float = 1.0
    breath_db: float = 0.0
    tilt_db: float = 0.0


TILT_FROM_HZ = 800.0

FREE_HZ = (3_000.0, 5_000.0)
"""In vowels the free part rises from nothing to all between these: natural voices are periodic up to about there."""

VOWEL = 4.0
"""Least power of the voice's part below `FREE_HZ`, relative to the free part's, in a vowel."""


def sound_of(net: AcousticNet, hidden: Array, f0_hz: Array, colour: Colour, seed: int) -> Samples:
    """Return the sound, shape (frames · `HOP`,), of the network's activations, shape (frames, 256), at that pitch,
    shape (frames,); the noise follows from `seed`."""
    bins = np.arange(LAST_BIN + 1)
    sources = np.clip(np.rint(bins / colour.stretch), LOWEST_BIN, BINS - 1).astype(np.int64)
    voice_log, voice_turn, noise_log, rest_log, rest_phase = net.spectra(hidden, sources)
    octaves = np.log2(np.maximum(bins * BIN_HZ, TILT_FROM_HZ) / TILT_FROM_HZ)
    gain = 10.0 ** (colour.tilt_db * octaves / 20.0)
    rng = np.random.default_rng(seed)
    white = rng.standard_normal((2, *voice_log.shape), dtype=np.float32)
    spectrum = _frames(pulses(f0_hz)) * _polar(voice_log, np.pi * np.tanh(voice_turn))
    # A component that is moved by a bin advances by a quarter of a turn more in each frame. In a vowel the free part
    # has what is left of the talker's own harmonics: at another pitch it is kept as noise only, and only where natural
    # voices have noise.
    moved = 0.5 * np.pi * ((np.arange(len(hidden))[:, None] * (bins - sources)) % 4)
    low = bins * BIN_HZ < FREE_HZ[0]
    free = np.square(_limited(rest_log[:, low])).sum(axis=1, keepdims=True)
    voiced = np.square(np.abs(spectrum[:, low])).sum(axis=1, keepdims=True) > VOWEL * free
    phase = np.where(voiced, rng.uniform(-np.pi, np.pi, rest_phase.shape), rest_phase + moved)
    kept = np.where(voiced, np.interp(bins * BIN_HZ, FREE_HZ, (0.0, 1.0)), 1.0)
    breath = np.where(voiced, 10.0 ** (colour.breath_db / 20.0), 1.0)
    spectrum += _limited(noise_log) * breath * (white[0] + 1j * white[1])
    spectrum += _polar(rest_log, phase) * kept
    return _overlapped(spectrum * gain)


def _limited(log: Array) -> Array:
    return np.asarray(np.exp(np.minimum(log, np.float32(LOUDEST))))


def _polar(log: Array, phase: NDArray[np.floating]) -> NDArray[np.complexfloating]:
    return np.asarray(_limited(log) * (np.cos(phase) + 1j * np.sin(phase)))


def pulses(f0_hz: Array) -> NDArray[np.float64]:
    """A band-limited pulse train, shape (frames · `HOP`,): each harmonic below `HIGHEST_HZ` with amplitude 1, 0
    without voice.

    Σ cos(h·t), h = 1 … H, is sin((H + ½)t) / (2·sin(t/2)) - ½.
    """
    centres = (np.arange(len(f0_hz)) + 0.5) * HOP
    pitch = np.interp(np.arange(len(f0_hz) * HOP) + 0.5, centres, f0_hz)
    voiced = pitch > VOICED_HZ
    pitch = np.maximum(pitch, VOICED_HZ)
    phase = 2.0 * np.pi * (np.cumsum(pitch / SAMPLE_RATE_HZ) % 1.0)
    harmonics = np.floor(HIGHEST_HZ / pitch) + 0.5
    half = 2.0 * np.sin(0.5 * phase)
    near = np.abs(half) <= 2e-3
    train = np.where(near, harmonics, np.sin(harmonics * phase) / np.where(near, 1.0, half)) - 0.5
    return np.asarray(np.where(voiced, train, 0.0))


def _frames(sound: NDArray[np.float64]) -> NDArray[np.complexfloating]:
    """Spectra of windows centred on each frame's beginning; a cosine of amplitude 1 has magnitude 1."""
    padded = np.pad(sound, WINDOW // 2)
    views = np.lib.stride_tricks.sliding_window_view(padded, WINDOW)[::HOP][: len(sound) // HOP]
    return np.asarray(np.fft.rfft(views * (_HANN / np.float32(WINDOW / 4)), axis=1))


def _overlapped(spectra: NDArray[np.complexfloating]) -> Samples:
    """The inverse of `_frames`, shape (frames · `HOP`,)."""
    count = len(spectra)
    blocks = (np.fft.irfft(spectra, WINDOW, axis=1) * _HANN).reshape(count, 4, HOP)
    out = np.zeros((count + 3, HOP))
    for number in range(4):
        out[number : number + count] += blocks[:, number]
    return (out.ravel()[WINDOW // 2 : WINDOW // 2 + count * HOP] / _OVERLAPPED).astype(np.float32)
