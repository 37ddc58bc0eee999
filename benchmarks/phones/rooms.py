"""Rooms that speech is heard in, and other paces."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from benchmarks.hearing.worlds.rooms import Box, Place, response
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


BOXES = 150
"""Number of simulated rooms."""
LEAST_M, MOST_M = (3.0, 2.5, 2.3), (10.0, 8.0, 3.5)
"""Range of their sizes."""
BOX_RT60_S, DISTANCE_M = (0.25, 1.1), (0.7, 4.0)


def simulated(rng: np.random.Generator) -> list[Samples]:
    """Responses of BOXES boxes, each with a speaker and a robot somewhere in it. Raises ImportError without
    pyroomacoustics."""
    found = []
    for _ in range(BOXES):
        length, width, height = np.sort(rng.uniform(LEAST_M, MOST_M))[::-1].round(1).tolist()
        box = Box((length, width, height), round(float(np.exp(rng.uniform(*np.log(BOX_RT60_S)))), 2))
        distance_m = round(float(rng.uniform(DISTANCE_M[0], min(DISTANCE_M[1], 0.5 * length))), 1)
        found.append(response(Place(box, distance_m, int(rng.integers(1 << 30)), float(rng.uniform(-2.0, 5.0)))))
    return found


class Rooms:
    """Impulse responses: some measured, and many made of decaying noise; or boxes alone."""

    def __init__(self, folder: Path | None, rng: np.random.Generator, boxes: bool = False) -> None:
        self._rng = rng
        self._boxes = simulated(rng) if boxes else []
        paths = sorted(folder.glob("unis_a_*.wav")) if folder is not None else []
        self._measured = [np.asarray(read_wav(path), np.float32) for path in paths]

    def draw(self) -> Samples | None:
        """A response with its direct sound first, of RMS 1; None: close to the microphone."""
        rng = self._rng
        if self._boxes:
            return self._boxes[rng.integers(len(self._boxes))]
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
