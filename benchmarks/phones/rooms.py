"""Rooms that speech is heard in, and other paces."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from hvcpd.hardware.soundfile import read_wav
from hvcpd.ports import SAMPLE_RATE_HZ, Samples


def stretched(sound: Samples, factor: float) -> Samples:
    """As long as `factor` times the sound, as high: overlapping pieces, each where it fits best what went before
    (WSOLA: W. Verhelst & M. Roelands, ICASSP 1993)."""
    size, reach = 512, 128
    hop = size // 2
    window = np.hanning(size + 1)[:-1].astype(np.float32)
    padded = np.pad(sound, (size, 2 * size + reach))
    n = round(len(sound) * factor / hop) + 2
    out = np.zeros((n + 1) * hop + size, np.float32)
    at = size // 2
    for k in range(n):
        wanted = size // 2 + round(k * hop / factor)
        if wanted + size + reach >= len(padded):
            break
        if k:
            follows = padded[at + hop : at + hop + size]
            first = max(wanted - reach, 0)
            region = padded[first : wanted + reach + size]
            if len(follows) == size and np.any(follows):
                at = first + int(np.argmax(np.correlate(region[::1], follows, "valid")))
            else:
                at = wanted
        piece = padded[at : at + size]
        out[k * hop : k * hop + size] += window[: len(piece)] * piece
    return out[hop : hop + round(len(sound) * factor)]


class Rooms:
    """Impulse responses: some measured, and many made of decaying noise."""

    def __init__(self, folder: Path | None, rng: np.random.Generator) -> None:
        self._rng = rng
        paths = sorted(folder.glob("unis_a_*.wav")) if folder is not None else []
        self._measured = [np.asarray(read_wav(path), np.float32) for path in paths]

    def draw(self) -> Samples | None:
        """A response with its direct sound first, of RMS 1; None: close to the microphone."""
        rng = self._rng
        kind = rng.random()
        if kind < 0.3:
            return None
        if kind < 0.5 and self._measured:
            response = self._measured[rng.integers(len(self._measured))]
            response = response[max(int(np.argmax(np.abs(response))) - 16, 0) :][: SAMPLE_RATE_HZ // 2]
        else:
            rt60_s = 2.0 ** rng.uniform(-3.0, 0.6)
            n = round(min(rt60_s, 1.0) * SAMPLE_RATE_HZ)
            response = rng.standard_normal(n) * 10.0 ** (-3.0 * np.arange(n) / (rt60_s * SAMPLE_RATE_HZ))
            direct_db = rng.uniform(-8.0, 15.0)
            early = rng.integers(16, max(n // 4, 17), 8)
            response[early] *= 3.0
            response *= 1.0 / np.sqrt(np.sum(response**2))
            response[0] += 10.0 ** (direct_db / 20.0)
        return np.asarray(response / np.sqrt(np.sum(response**2)), np.float32)
