"""When a sentence whose samples are known arrived at a microphone by the shortest way.

The response of the way from loudspeaker to microphone is estimated by least squares from the whole sentence, which is
taken piece by piece: the stretch between the two clocks is the one for which the pieces' responses agree best. The
arrival is the first peak of the response's envelope that is not fainter than later ones by much, because later ones are
echoes, and may be louder (C. Peng et al., "BeepBeep: a high accuracy acoustic ranging system using COTS mobile
devices", SenSys 2007).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from hvcpd.ports import Samples

REACH = 1024
"""Samples either side of the expected arrival, 64 ms: a recogniser knows a sentence's beginning to 20 ms."""
PIECE = 4096
"""Samples of a sentence that are compared at once: 250 ppm shift its ends by one sample."""
STRETCHES = np.arange(-800, 801, 20) * 1e-6
"""Crystals differ by 100 ppm at most; a robot that drives at 0.2 m/s changes the stretch by 580 ppm."""
FINER = 8
"""Steps to a sample in which the envelope's peak is sought before it is interpolated."""
EARLY = 800
"""Samples before the loudest arrival in which the first one is sought: 50 ms. In a room with RT60 0.45 s, at six times
the critical distance, the loudest is anywhere in the first 40 ms."""
QUIET = (64, 192)
"""Lags of which the noise is taken: from the first on, up to EARLY before the loudest arrival, or to the second."""
AROUND, LATE, FADE = 160, 64, 32
"""Samples before and after the first arrival that are compared once it is known roughly, and over which both ends
fade: the fewer they are, the more of a faint voice's spectrum stands out of the noise."""
FAINTEST, ABOVE_SIDE = 0.4, 1.3
"""Least amplitude of the first arrival relative to the loudest, and to the highest side lobe of a single arrival with
the same spectrum. Echoes of floor, walls and ceiling that come together may be louder than direct sound."""
ABOVE_NOISE = 5.0
"""Least amplitude of the first arrival over the response's noise: chance exceeds it at one lag in 10^10."""
APART = 10
"""Samples, 20 cm of detour: what comes sooner is one arrival with the first."""
EDGE = 0.5
"""Share of the first peak at which its edge is measured: echoes that come within the peak move the peak itself."""
SMOOTH = 33
"""Bins of 8 Hz over which powers are averaged."""

Spectrum = NDArray[np.complex128]

_ENDS = np.clip((REACH - np.abs(np.arange(2 * REACH) - REACH + 0.5)) / (2 * FADE), 0.0, 1.0)
"""A window of all lags that fades only at their ends."""


@dataclass(frozen=True)
class Arrival:
    """The sample of the microphone, with a fraction, at which the first sample of a sentence arrived.

    `stretch`: samples of the microphone's clock for each of the speaker's, minus 1. `clear`: amplitude of the first
    arrival over the response's noise; `first`: over the loudest echo that comes APART later or more; `forerun`: of the
    loudest that comes as much sooner, over the first arrival's.
    """

    at: float
    stretch: float
    clear: float
    first: float
    forerun: float = 0.0

    def later(self, samples: int) -> Arrival:
        """The same, by a clock that began this number of samples earlier."""
        return replace(self, at=self.at + samples)


def arrival(heard: Samples, sound: Samples, before: int) -> Arrival | None:
    """Return when `sound`, shape (n,), begins in `heard`, shape (m,), as a sample of `heard`; None if it is not found.

    It is sought within REACH around sample `before`.
    """
    if len(sound) < PIECE or before < REACH:
        return None
    starts = range(0, len(sound), PIECE)
    pieces = [_correlated(heard, sound[s : s + PIECE], before + s) for s in starts]
    correlations: Spectrum = np.array([correlation for correlation, _, _ in pieces])
    power = _smoothed(np.sum([heard_power for _, heard_power, _ in pieces], axis=0))
    own = _smoothed(np.sum([own_power for _, _, own_power in pieces], axis=0))
    if not power.any() or not own.any():
        return None
    centres = np.array([s + min(PIECE, len(sound) - s) / 2 for s in starts])
    stretch = _best_stretch(np.asarray(correlations / np.sqrt(own * power)), centres)
    response = _aligned(correlations, centres, stretch) / own
    noise = np.maximum(power - _smoothed(np.abs(response) ** 2) * own, 1e-3 * power) / own / len(sound)
    rough = _Peaks(response, _weights(response, noise * (2 * REACH)))
    if rough.first is None:
        return None
    near, n_near = _near(rough.first // FINER)
    response = np.asarray(np.fft.rfft(np.fft.irfft(response) * near))
    fine = _Peaks(response, _weights(response, noise * n_near))
    if fine.first is None:
        return None
    return Arrival(float(fine.edge) / FINER - REACH + before, stretch, rough.clear, rough.share, rough.forerun)


def _correlated(heard: Samples, piece: Samples, at: int) -> tuple[Spectrum, NDArray[np.float64], NDArray[np.float64]]:
    """Correlate a piece with what was heard up to REACH around `at`: its spectrum, those of both powers, of 2 REACH
    lags."""
    part = heard[at - REACH : at + REACH + len(piece)].astype(np.float64)
    part = np.pad(part, (0, 2 * REACH + len(piece) - len(part)))
    size = 8 * REACH
    y, x = np.fft.rfft(part, size), np.fft.rfft(piece.astype(np.float64), size)
    lags = np.fft.irfft(y * x.conj())[: 2 * REACH] * _ENDS
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
    return float(STRETCHES[best]) + step * peak_offset(np.asarray(energies), best)


def _near(first: int) -> tuple[NDArray[np.float64], float]:
    """A window of the lags around the first arrival, and the number of them."""
    lags = np.arange(2 * REACH) - first
    near = np.clip(np.minimum((lags + AROUND + FADE) / FADE, (LATE + FADE - lags) / FADE), 0.0, 1.0)
    return np.asarray(near), float(near.sum())


def _weights(response: Spectrum, noise: NDArray[np.float64]) -> NDArray[np.float64]:
    """Wiener's weight of each frequency, its power over itself with its noise's; all that are heard well are made
    equally strong, so that a loudspeaker's resonances do not lengthen the first arrival."""
    gains = _smoothed(np.abs(response) ** 2)
    return np.asarray(_smoothed(np.maximum(gains - noise, 0.0) / gains) / np.sqrt(gains))


class _Peaks:
    """The envelope of a response under weights, and its first peak: None if there is none."""

    def __init__(self, response: Spectrum, weights: NDArray[np.float64]) -> None:
        alone = _envelope(np.asarray(weights * np.abs(response), np.complex128))[: REACH * FINER]
        """A single arrival at 0 would look like this."""
        self._envelope = envelope = _envelope(np.asarray(response * weights))
        rising = np.flatnonzero(np.diff(alone) > 0.0)
        side = float(alone[rising[0] :].max() / alone[0]) if len(rising) else 0.0
        self._width = _crossing(alone, EDGE * alone[0])
        loudest = int(envelope[:-1].argmax())  # a peak has two neighbours
        begin = max(loudest - EARLY * FINER, 1)
        self._noise = float(np.sqrt(np.mean(envelope[QUIET[0] * FINER : max(begin, QUIET[1] * FINER)] ** 2)))
        least = max(max(FAINTEST, ABOVE_SIDE * side) * envelope[loudest], ABOVE_NOISE * self._noise)
        inner = envelope[begin : loudest + 1]
        peaks = (inner >= envelope[begin - 1 : loudest]) & (inner >= envelope[begin + 1 : loudest + 2])
        found = np.flatnonzero(peaks & (inner >= least))
        self.first = begin + int(found[0]) if len(found) else None
        later = envelope[(self.first or 0) + APART * FINER :].max(initial=1e-12)
        self.share = float(envelope[self.first] / later) if self.first is not None else 0.0
        earlier = envelope[QUIET[0] * FINER : max((self.first or 0) - APART * FINER, 0)].max(initial=0.0)
        self.forerun = float(earlier / envelope[self.first]) if self.first is not None else 0.0

    @property
    def clear(self) -> float:
        """The first peak's amplitude over the noise's."""
        return float(self._envelope[self.first] / max(self._noise, 1e-12)) if self.first is not None else 0.0

    @property
    def edge(self) -> float:
        """Where the arrival is by the first peak's edge."""
        before = self._envelope[self.first :: -1]
        return (self.first or 0) - _crossing(before, EDGE * float(before[0])) + self._width


def _envelope(spectrum: Spectrum) -> NDArray[np.float64]:
    analytic = np.zeros(2 * REACH * FINER, np.complex128)
    analytic[: len(spectrum)] = spectrum
    return np.asarray(np.abs(np.fft.ifft(analytic)))


def _crossing(values: NDArray[np.float64], level: float) -> float:
    """Where falling values first cross a level, interpolated."""
    below = int(np.argmax(values < level))
    return below - (level - values[below]) / (values[below - 1] - values[below]) if below else 0.0


def peak_offset(values: NDArray[np.float64], peak: int) -> float:
    """Offset of the vertex of the parabola through a peak and its neighbours; 0 at the ends."""
    if not 0 < peak < len(values) - 1:
        return 0.0
    before, at, after = values[peak - 1 : peak + 2]
    bend = before - 2.0 * at + after
    return float(0.5 * (before - after) / bend) if bend < 0.0 else 0.0
