"""Analysis of a microphone's samples: levels, clipping, and the robot's own sound found again. Pure numpy."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from hvcpd.ports import SAMPLE_RATE_HZ, Samples

SILENCE_DBFS = -120.0
"""Instead of minus infinity for digital silence; a 16-bit converter's smallest step is at -90 dBFS."""
CLIPPED_AT = 0.999
"""Amplitude from which a sample counts as clipped; converters differ in their last step."""
FOUND_SHARPNESS = 6.0
"""Least ratio of the correlation's peak to its RMS at which the own sound is in the recording; the largest of some
50,000 values of mere noise seldom passes 4.5 (normal distribution)."""
NEEDED_SNR_DB = 0.0
"""All sentences are understood in steady noise of this SNR (docs/hearing-figures.md: white, pink, fan at 0 dB)."""

RESPONSE_FRAME = 2048
"""Samples, 128 ms: bins of 8 Hz, so that a sixth of an octave at 100 Hz has one or two."""
BANDS_PER_OCTAVE = 6
SPEECH_HZ = (100.0, 6500.0)
"""Where the own voice has enough power to measure by."""
MIDDLE_HZ = (2000.0, 5000.0)
"""Above small drivers' resonances and below their upper end; its median is the response's 0 dB."""
HIGHEST_RESONANCE_HZ = 2000.0
"""Drivers of 2 to 3 cm, as on sound HATs, resonate below it."""
LEAST_RESONANCE_DB = 3.0
FADED_DB = 10.0
"""The usual measure of a loudspeaker's range (IEC 60268-5)."""
LEAST_COHERENCE = 0.5
"""Half of what was heard in a band comes of what was played."""
TINY_POWER = 1e-20
"""Least power that anything is divided by, full scale = 1: a silent band has none."""


def level_dbfs(sound: Samples) -> float:
    """RMS in dB re full scale (amplitude 1) of samples of shape (n,), without their mean."""
    if sound.size == 0:
        return SILENCE_DBFS
    return power_dbfs(float(np.var(sound.astype(np.float64))))


def power_dbfs(power: float) -> float:
    """A mean square in dB re full scale; SILENCE_DBFS at least."""
    return max(10.0 * math.log10(power), SILENCE_DBFS) if power > 0.0 else SILENCE_DBFS


def clipped_share(sound: Samples) -> float:
    """Return the share, 0 to 1, of samples at full scale in sound of shape (n,)."""
    return float(np.mean(np.abs(sound) >= CLIPPED_AT)) if sound.size else 0.0


@dataclass(frozen=True)
class Echo:
    """The robot's own sound, found in a recording."""

    delay_s: float
    """From the first sample played to the first heard."""
    level_dbfs: float
    """Of what was heard of it, without the noise."""
    peak: float
    """The largest amplitude while it was heard."""
    snr_db: float
    """Its level over the noise before it."""


def find_echo(played: Samples, heard: Samples, noise: Samples) -> Echo | None:
    """Find the sound `played`, shape (n,), in the recording `heard`, shape (m,) with m >= n; None if it is not there.

    `noise` is a recording of the same room in silence. The delay is the peak of the cross-correlation, both whitened
    by the played sound's spectrum (the phase transform; Knapp and Carter 1976), so that vowels do not blur it.
    """
    if played.size == 0 or heard.size < played.size or not np.any(heard):
        return None
    size = 1 << (heard.size + played.size - 1).bit_length()
    cross = np.fft.rfft(heard, size) * np.conj(np.fft.rfft(played, size))
    strength = np.abs(cross)
    cross /= strength + 1e-3 * strength.max()
    lags = np.fft.irfft(cross, size)[: heard.size - played.size + 1]
    at = int(np.argmax(lags))
    if lags[at] < FOUND_SHARPNESS * float(np.sqrt(np.mean(lags**2))):
        return None
    piece = heard[at : at + played.size]
    noise_power = float(np.var(noise.astype(np.float64))) if noise.size else 0.0
    level = power_dbfs(float(np.var(piece.astype(np.float64))) - noise_power)
    floor = level_dbfs(noise)
    return Echo(at / SAMPLE_RATE_HZ, level, float(np.max(np.abs(piece))), level - floor)


@dataclass(frozen=True)
class Response:
    """How a loudspeaker in its housing, heard by the robot's own microphone, colours sound."""

    lowest_hz: float
    """From here on it is at most `FADED_DB` below its middle."""
    resonance_hz: float | None
    """Where it is loudest below `HIGHEST_RESONANCE_HZ`; None if that is less than `LEAST_RESONANCE_DB`."""
    resonance_db: float
    """How much louder than in its middle."""


def find_response(played: Samples, heard: Samples) -> Response | None:
    """The response between `played` and `heard`, both of shape (n,), in time with each other; None for noise alone.

    The transfer function by the cross-spectrum over the played sound's (Bendat and Piersol, *Random Data*, ch. 6: H1,
    which noise in the microphone does not bias), averaged over sixths of an octave whose coherence suffices.
    """
    window = np.hanning(RESPONSE_FRAME)
    starts = range(0, min(played.size, heard.size) - RESPONSE_FRAME + 1, RESPONSE_FRAME // 4)
    if not starts:
        return None
    x, y = (np.fft.rfft([window * sound[at : at + RESPONSE_FRAME] for at in starts]) for sound in (played, heard))
    s_xx, s_yy = (np.sum(np.abs(spectra) ** 2, axis=0) for spectra in (x, y))
    explained = np.abs(np.sum(np.conj(x) * y, axis=0)) ** 2 / np.maximum(s_xx, TINY_POWER)
    band = np.rint(BANDS_PER_OCTAVE * np.log2(np.maximum(np.fft.rfftfreq(RESPONSE_FRAME, 1 / SAMPLE_RATE_HZ), 1.0)))
    found: dict[float, float] = {}
    for number in np.unique(band):
        hz, at = float(2.0 ** (number / BANDS_PER_OCTAVE)), band == number
        share = np.sum(explained[at]) / max(np.sum(s_yy[at]), TINY_POWER)
        if SPEECH_HZ[0] <= hz <= SPEECH_HZ[1] and share >= LEAST_COHERENCE:
            found[hz] = power_dbfs(float(np.sum(explained[at]) / np.sum(s_xx[at])))
    middle = [gain_db for hz, gain_db in found.items() if MIDDLE_HZ[0] <= hz <= MIDDLE_HZ[1]]
    if not middle:
        return None
    middle_db = float(np.median(middle))
    lowest_hz = min(hz for hz, gain_db in found.items() if gain_db >= middle_db - FADED_DB)
    low = [(gain_db - middle_db, hz) for hz, gain_db in found.items() if hz <= HIGHEST_RESONANCE_HZ]
    peak_db, peak_hz = max(low, default=(0.0, 0.0))  # a buzzer, or a fan's noise, leaves none
    return Response(lowest_hz, peak_hz if peak_db >= LEAST_RESONANCE_DB else None, peak_db)


def predicted_range_m(own_level_dbfs: float, own_distance_m: float, floor_dbfs: float) -> float:
    """How far away a peer of the same loudspeaker is still understood, in metres.

    The inverse-distance law of a free field, L(r) = L0 - 20 log10(r / r0) (Kinsler et al., "Fundamentals of Acoustics",
    ch. 5), until the level is NEEDED_SNR_DB over the floor. Walls may carry sound further, and blur it.
    """
    return float(own_distance_m * 10.0 ** ((own_level_dbfs - floor_dbfs - NEEDED_SNR_DB) / 20.0))
