"""Front end of the phone nets: log energies in mel bands, after spectral subtraction of the noise.

The noise is estimated from the sound before the speech.
"""

from __future__ import annotations

from functools import cache
from itertools import accumulate

import numpy as np
from numpy.typing import NDArray

from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from hvcpd.recognition.arrays import quantile
from hvcpd.recognition.frontend import FFT_SIZE, HOP_SAMPLES, frames_of, mel_edges_hz, power_ratio
from hvcpd.recognition.stream import INT16_SCALE

Bands = NDArray[np.float64]
"""Mel filterbank energies, shape (frames, N_BANDS), of sound in 16-bit integers' scale."""
LogBands = NDArray[np.float32]
"""Their logarithms, shape (frames, N_BANDS), or what a layer of a net makes of them, shape (frames, its width)."""

N_BANDS, LOW_HZ, HIGH_HZ = 25, 130.0, 6800.0
WINDOW_SAMPLES, PRE_EMPHASIS = 410, 0.97
"""Parameters of the front end with which the nets were trained: those of PocketSphinx's model `en-us`."""
LEVEL_RMS = 0.1
"""RMS of the louder quarter of the speech's samples, full scale 1, in the nets' training."""
LEAST_RMS = 1e-4
"""Speech fainter than this (-80 dBFS) is as good as none."""
LEAST = 1e-4
"""Added to energies before the logarithm, which bounds it."""

ONSET_LAG_FRAMES = 20
"""Longest time (0.2 s) from the beginning of speech until it is noticed."""
QUIET_SHARE = 0.5
"""Share of the frames before the speech, the quieter ones, that gives the noise: somebody may have spoken before. Of
171 sentences 0.7 s after another one 147 are understood, with a share of 0.7 140; alone 143 and 142."""
LEAST_FRAMES, QUIETEST_SHARE = 10, 0.1
"""With fewer frames than this before the speech, the noise is that of the quietest share of all frames."""
SMOOTH = 0.5
"""Weight of the preceding frame in the smoothed energy from which the noise is subtracted."""
SPECTRAL_FLOOR = 0.05
"""Least gain of a band. The nets were trained on speech with spectral subtraction like this, and with
gains averaged over neighbouring bands (C. Kim & R. Stern, "Power-normalized cepstral coefficients (PNCC) for robust
speech recognition", ICASSP 2012). Temporal masking cost 11 of 198 sentences."""
GAIN_BANDS = 2
"""Bands to either side over which gains are averaged."""
FAINT_DB = 37.0
"""Level below the loudest eighth of the frames that is masked, by as much energy in each band: of 200 digits in quiet
181 were right, 165 without."""
LOUD_PARTS = 8


@cache
def _filters() -> NDArray[np.float64]:
    """Triangles of unit area whose corners are whole lines of the spectrum, shape (FFT_SIZE // 2 + 1, N_BANDS)."""
    line_hz = SAMPLE_RATE_HZ / FFT_SIZE
    corners = np.floor(mel_edges_hz(LOW_HZ, HIGH_HZ, N_BANDS) / line_hz + 0.5) * line_hz
    left, centre, right = corners[:-2], corners[1:-1], corners[2:]
    hz = np.arange(FFT_SIZE // 2 + 1)[:, None] * line_hz
    rising, falling = (hz - left) / (centre - left), (right - hz) / (right - centre)
    return np.asarray(np.maximum(np.minimum(rising, falling), 0.0) * 2.0 / (right - left))


def mel_bands(sound: Samples) -> Bands:
    """Energies of every whole frame of a sound, shape (n,), full scale 1; no row if it is too short."""
    if len(sound) < WINDOW_SAMPLES:
        return np.zeros((0, N_BANDS))
    scaled = np.asarray(sound, np.float64) * float(INT16_SCALE)
    scaled[1:] -= PRE_EMPHASIS * scaled[:-1]
    frames = frames_of(scaled, WINDOW_SAMPLES, HOP_SAMPLES)
    spectra = np.fft.rfft(frames * np.hamming(WINDOW_SAMPLES), FFT_SIZE)
    return np.asarray((spectra.real**2 + spectra.imag**2) @ _filters())


def level_gain(speech: Samples) -> np.float32:
    """The gain that brings speech to the level of the nets' training."""
    if not len(speech):
        return np.float32(1.0)
    loud = np.sort(np.abs(speech))[-max(len(speech) // 4, 1) :]
    return np.float32(LEVEL_RMS / max(float(np.sqrt(np.mean(loud.astype(np.float64) ** 2))), LEAST_RMS))


def estimated_noise(sound: Samples, lead: int) -> NDArray[np.float64]:
    """Noise estimate, shape (N_BANDS,), from a sound in which speech was noticed after `lead` samples."""
    bands = mel_bands(sound)
    return mean_of_quiet_frames(bands, (lead - WINDOW_SAMPLES) // HOP_SAMPLES + 1) if len(bands) else np.zeros(N_BANDS)


def mean_of_quiet_frames(energies: NDArray[np.floating], lead: int) -> NDArray[np.float64]:
    """Noise estimate, shape (bands,), from the energies of frames, shape (n, bands), in which speech was noticed after
    `lead` frames: the mean of the quieter ones before it, or of the quietest of all where those are too few."""
    before = energies[: max(lead - ONSET_LAG_FRAMES, 0)]
    frames, share = (before, QUIET_SHARE) if len(before) >= LEAST_FRAMES else (energies, QUIETEST_SHARE)
    power = frames.sum(axis=1)
    return np.asarray(frames[power <= quantile(power, share)].mean(axis=0))


def noise_subtracted(bands: Bands, noise: NDArray[np.float64]) -> Bands:
    """Band energies after spectral subtraction of the `noise`, shape (N_BANDS,)."""
    smooth = np.array(list(accumulate(bands, lambda level, energy: SMOOTH * level + (1.0 - SMOOTH) * energy)))
    gain = np.clip(1.0 - noise / np.maximum(smooth, LEAST), SPECTRAL_FLOOR, 1.0)
    sums = np.cumsum(np.pad(gain, ((0, 0), (1, 0))), axis=1)
    begin = np.maximum(np.arange(N_BANDS) - GAIN_BANDS, 0)
    end = np.minimum(np.arange(N_BANDS) + GAIN_BANDS + 1, N_BANDS)
    return np.asarray(bands * (sums[:, end] - sums[:, begin]) / (end - begin))


def log_bands(sound: Samples, noise: NDArray[np.float64]) -> Bands:
    """Log band energies, shape (frames, N_BANDS), of one utterance with a short margin around it, shape (n,), after
    subtraction of the `noise`, shape (N_BANDS,)."""
    bands = mel_bands(sound)
    if not len(bands):
        return bands
    power = np.sort(bands.sum(axis=1))
    loud = float(power[-max(len(power) // LOUD_PARTS, 1) :].mean())
    mask = loud / N_BANDS * power_ratio(-FAINT_DB)
    return np.asarray(np.log(noise_subtracted(bands, noise) + mask + LEAST))
