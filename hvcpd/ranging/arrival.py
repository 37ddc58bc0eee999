"""When a sentence whose samples are known arrived at a microphone by the shortest way.

The response of the way from loudspeaker to microphone is estimated by least squares from the whole sentence, which is
taken piece by piece: the stretch between the two clocks is the one for which the pieces' responses agree best. The
arrival is the first peak of the response's envelope that is not fainter than later ones by much, because later ones are
echoes, and may be louder (C. Peng et al., "BeepBeep: a high accuracy acoustic ranging system using COTS mobile
devices", SenSys 2007).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hvcpd.ports import SAMPLE_RATE_HZ, Samples

REACH = 1024
"""Samples either side of the expected arrival, 64 ms: a recogniser knows a sentence's beginning to 20 ms."""
PIECE = 4096
"""Samples of a sentence that are compared at once: 250 ppm shift its ends by one sample."""
STRETCHES = np.arange(-400, 401, 20) * 1e-6
"""Crystals differ by 100 ppm at most; a robot that drives at 0.2 m/s changes the stretch by 580 ppm."""
FINER = 8
"""Steps to a sample in which the envelope's peak is sought before it is interpolated."""
EARLY = 240
"""Samples before the loudest arrival in which the first one is sought: 30 ms, 10 m of detour."""
LATE, FADE = 64, 32
"""Samples after it that are compared, and over which both ends fade."""
FAINTEST = 0.4
"""Least amplitude of the first arrival relative to the loudest: side lobes stay below a quarter."""
ABOVE_NOISE = 5.0
"""Least amplitude of the first arrival over the response's mean noise: chance exceeds it once in 10^10."""
EDGE = 0.5
"""Share of the first peak at which its edge is measured: echoes that come within the peak move the peak itself."""
SMOOTH = 33
"""Bins of 8 Hz over which powers are averaged."""

Spectrum = NDArray[np.complex128]


@dataclass(frozen=True)
class Arrival:
    """The sample of the microphone, with a fraction, at which the first sample of a sentence arrived.

    `stretch`: samples of the microphone's clock for each of the speaker's, minus 1. `clear`: amplitude of the
    first arrival over the response's noise; `first`: over the loudest arrival.
    """

    at: float
    stretch: float
    clear: float
    first: float


def arrival(heard: Samples, sound: Samples, before: int) -> Arrival | None:
    """Return when `sound`, shape (n,), begins in `heard`, shape (m,), as a sample of `heard`; None if it is not found.

    It is sought within REACH around sample `before`.
    """
    if len(sound) < PIECE or before < REACH:
        return None
    starts = np.arange(0, len(sound), PIECE)
    pieces = [_correlated(heard, sound[s : s + PIECE], before + s) for s in starts]
    correlations = np.array([p[0] for p in pieces])
    power, own = (_smoothed(sum(p[i] for p in pieces)) for i in (1, 2))
    if not power.any() or not own.any():
        return None
    centres = starts + np.minimum(PIECE, len(sound) - starts) / 2
    stretch = _best_stretch(correlations / np.sqrt(own * power), centres)
    response = _aligned(correlations, centres, stretch) / own
    noise = np.maximum(power - _smoothed(np.abs(response) ** 2) * own, 1e-3 * power) / own / len(sound)
    weights = _weights(response, noise * (2 * REACH))
    near, n_near = _near(int(_envelope(response * weights).argmax()) // FINER)
    response = np.fft.rfft(np.fft.irfft(response) * near)
    weights = _weights(response, noise * n_near)
    alone = (weights * np.abs(response)).astype(np.complex128)
    return _first_peak(response * weights, alone, before, stretch)


def _correlated(heard: Samples, piece: Samples, at: int) -> tuple[Spectrum, NDArray[np.float64], NDArray[np.float64]]:
    """Correlate a piece with what was heard up to REACH around `at`: its spectrum, those of both powers, of 2 REACH
    lags."""
    part = heard[at - REACH : at + REACH + len(piece)].astype(np.float64)
    part = np.pad(part, (0, 2 * REACH + len(piece) - len(part)))
    size = 8 * REACH
    y, x = np.fft.rfft(part, size), np.fft.rfft(piece.astype(np.float64), size)
    lags = np.fft.irfft(y * x.conj())[: 2 * REACH] * np.hanning(2 * REACH)
    step = size // (2 * REACH)
    return np.fft.rfft(lags), _thinned(np.abs(y) ** 2, step) * len(piece) / len(part), _thinned(np.abs(x) ** 2, step)


def _thinned(power: NDArray[np.float64], step: int) -> NDArray[np.float64]:
    edge = step // 2
    padded = np.pad(power, (edge, step - 1 - edge), mode="reflect")
    return np.asarray(np.convolve(padded, np.ones(step) / step, "valid")[::step])


def _smoothed(power: NDArray[np.float64]) -> NDArray[np.float64]:
    padded = np.pad(power, SMOOTH // 2, mode="reflect")
    smooth = np.convolve(padded, np.hanning(SMOOTH + 2)[1:-1] * 2 / (SMOOTH + 1), "valid")
    return np.asarray(smooth + 1e-6 * smooth.max())


def _aligned(correlations: Spectrum, centres: NDArray[np.float64], stretch: float) -> Spectrum:
    """The sum of the pieces' correlations, each moved back by what the stretch has moved it."""
    turn = 2j * np.pi * np.arange(correlations.shape[1]) / (2 * REACH)
    return np.asarray((correlations * np.exp(np.outer(centres * stretch, turn))).sum(axis=0))


def _best_stretch(correlations: Spectrum, centres: NDArray[np.float64]) -> float:
    energies = [float(np.sum(np.abs(_aligned(correlations, centres, s)) ** 2)) for s in STRETCHES]
    best = int(np.argmax(energies))
    step = float(STRETCHES[1] - STRETCHES[0])
    return float(STRETCHES[best]) + step * _between(np.asarray(energies), best)


def _near(loudest: int) -> tuple[NDArray[np.float64], float]:
    """A window of the lags in which the first arrival may be, and the number of them."""
    lags = np.arange(2 * REACH) - loudest
    near = np.clip(np.minimum((lags + EARLY + FADE) / FADE, (LATE + FADE - lags) / FADE), 0.0, 1.0)
    return np.asarray(near), float(near.sum())


def _weights(response: Spectrum, noise: NDArray[np.float64]) -> NDArray[np.float64]:
    """Wiener's weight of each frequency, its power over itself with its noise's; all that are heard well are made
    equally strong, so that a loudspeaker's resonances do not lengthen the first arrival."""
    gains = _smoothed(np.abs(response) ** 2)
    return np.asarray(_smoothed(np.maximum(gains - noise, 0.0) / gains) / np.sqrt(gains))


def _first_peak(response: Spectrum, pulse: Spectrum, before: int, stretch: float) -> Arrival | None:
    """`pulse`: what a single arrival at 0 would look like."""
    envelope, alone = _envelope(response), _envelope(pulse)[: REACH * FINER]
    rising = np.flatnonzero(np.diff(alone) > 0.0)
    side = float(alone[rising[0] :].max() / alone[0]) if len(rising) else 0.0
    loudest = int(envelope.argmax())
    begin = max(loudest - EARLY * FINER, 1)
    noise = float(np.sqrt(np.mean(envelope[: max(begin, len(envelope) // 16)] ** 2)))
    least = max(max(FAINTEST, 1.3 * side) * envelope[loudest], ABOVE_NOISE * noise)
    inner = envelope[begin : loudest + 1]
    peaks = np.flatnonzero(
        (inner >= envelope[begin - 1 : loudest]) & (inner >= envelope[begin + 1 : loudest + 2]) & (inner >= least)
    )
    if not len(peaks):
        return None
    peak = begin + int(peaks[0])
    width = _crossing(alone, EDGE * alone[0])
    edge = _crossing(envelope[peak :: -1], EDGE * envelope[peak])
    at = (peak - edge + width) / FINER - REACH + before
    return Arrival(at, stretch, float(envelope[peak]) / max(noise, 1e-12), float(envelope[peak] / envelope[loudest]))


def _envelope(spectrum: Spectrum) -> NDArray[np.float64]:
    analytic = np.zeros(2 * REACH * FINER, np.complex128)
    analytic[: len(spectrum)] = spectrum
    return np.asarray(np.abs(np.fft.ifft(analytic)))


def _crossing(values: NDArray[np.float64], level: float) -> float:
    """Where falling values first cross a level, interpolated."""
    below = int(np.argmax(values < level))
    return below - (level - values[below]) / (values[below - 1] - values[below]) if below else 0.0


def _between(values: NDArray[np.float64], peak: int) -> float:
    """The offset of the vertex of the parabola through a peak and its neighbours."""
    if not 0 < peak < len(values) - 1:
        return 0.0
    left, top, right = values[peak - 1 : peak + 2]
    bend = left - 2.0 * top + right
    return float(0.5 * (left - right) / bend) if bend < 0.0 else 0.0
