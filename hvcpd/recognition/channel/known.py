"""Known responses: what earlier sentences showed of the channel from each voice, and paths through them.

While robots stand still, the channel between them stays as it is. Through a known response a path has one free
parameter, its gain, instead of up to TAPS, so that chance explains nothing, and a voice is heard in more noise. The
response is the least-squares one over all sentences that came through it. Where a sentence has another one, the
channel has changed, and is learned anew.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from hvcpd.recognition.channel.estimation import TAPS, Taps, channel_responses
from hvcpd.recognition.frontend import TINY


@dataclass(frozen=True, eq=False)
class KnownResponse:
    """The response from one voice, by its normal equations: sums over one or more sentences, shape (TAPS,)."""

    autocorrelation: Taps
    correlation: Taps

    @cached_property
    def response(self) -> Taps:
        """The response, at lags from -PRE_TAPS on, shape (TAPS,)."""
        return np.asarray(channel_responses(self.autocorrelation[None], self.correlation[None], TAPS)[0], np.float32)

    @cached_property
    def explained(self) -> float:
        """The energy of the sentences that it explains beyond what chance does."""
        return float(self.response @ self.correlation) - TAPS

    @cached_property
    def taps(self) -> Taps:
        """The same, of energy 1."""
        return np.asarray(self.response / np.sqrt(max(float(self.response @ self.response), TINY)), np.float32)

    @cached_property
    def _own(self) -> Taps:
        """Autocorrelation of the response; at lags other than 0 twice, for both directions."""
        spectrum = np.fft.rfft(self.taps, 2 * TAPS)
        own = np.asarray(np.fft.irfft(spectrum.real**2 + spectrum.imag**2)[:TAPS], np.float32)
        own[1:] *= 2.0
        return own

    def gains(self, autocorrelations: Taps, correlations: Taps) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """For each of several signals, given as to `channel_responses`, the gain, at least 0, at which the response
        explains most; and the energy that it explains there beyond what chance does."""
        energies = np.maximum((autocorrelations @ self._own).astype(np.float64), TINY)
        heard = np.maximum((correlations @ self.taps).astype(np.float64), 0.0)
        return heard / energies, heard**2 / energies - 1.0

    def updated(self, shown: KnownResponse) -> KnownResponse:
        """With what another sentence showed, if one response explains all as well as two do; otherwise that alone, as
        the channel has changed. What was said in less noise counts for more."""
        both = KnownResponse(self.autocorrelation + shown.autocorrelation, self.correlation + shown.correlation)
        return both if both.explained >= self.explained + shown.explained else shown
