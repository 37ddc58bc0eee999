"""Finds where a sentence may begin: the sounds that sentences begin with, by matched filters, all the time."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from hvcpd.recognition.matched import Spectrum, power_of

SIZE = 8192
"""Samples of a transform: half a second, most of which are new ones each time."""
SOUND_SAMPLES = 3200
"""Of a first word the loudest 0.2 s are sought: "hi" has little more."""
STEP = SIZE - SOUND_SAMPLES
"""Lags that one transform tells of: 0.31 s."""
LEAST = 6.0
"""Strength of an onset; noise alone passes it once in 10^9 samples."""
MEDIAN_OF_NORMAL = 0.6745
"""Median of |x| of a normal distribution with deviation 1..."""
SPARSE = 8
"""...of which every eighth value tells enough: some 620, a twentieth of a syllable apart."""
APART = SAMPLE_RATE_HZ // 50
"""20 ms: nearer ones, of the same sound, are one."""
BATCH = 4
"""Sounds that are correlated at once."""
MOST = 8
"""Onsets in one step, the strongest ones."""
LEAST_OF_BEST = 0.4
"""Of the strongest one's strength, what others have at least: what is said resembles other beginnings too."""

Spectra = NDArray[np.complex64]


@dataclass(frozen=True)
class Onset:
    """Sound number `sound` seems to begin at sample `at`."""

    sound: int
    at: int
    strength: float


class Onsets:
    """Known beginnings, to be found in what is heard."""

    def __init__(self, sounds: Sequence[Samples], quick: bool = False) -> None:
        """`sounds`, float32 at 16 kHz, of any length but 0. `quick`: to be found in half the time with three times the
        memory."""
        cut = np.zeros((len(sounds), SOUND_SAMPLES), np.float32)
        self._leads = [_loudest(sound) for sound in sounds]
        for row, sound, lead in zip(cut, sounds, self._leads, strict=True):
            part = sound[lead : lead + SOUND_SAMPLES]
            row[: len(part)] = part
        self._sounds = cut
        self._spectra = _conjugates(cut) if quick else None
        self._powers = np.array([power_of(row) for row in cut], np.float32)

    def find(self, weighed: Samples, first: int, weights: Spectrum) -> list[Onset]:
        """Those among the first STEP samples of `weighed`, shape (SIZE,), which begins at sample `first`."""
        if not len(self._sounds):
            return []
        spectrum = np.fft.rfft(weighed, SIZE)
        found: list[Onset] = []
        for start in range(0, len(self._sounds), BATCH):
            batch = slice(start, start + BATCH)
            values = np.fft.irfft(spectrum * self._known(batch), SIZE)[:, :STEP]
            usual = np.sqrt(np.maximum(self._powers[batch] @ weights, 1e-20))
            for row in np.flatnonzero(values.max(axis=1) >= LEAST * usual):
                number = start + int(row)
                begins = first - self._leads[number]
                found += [Onset(number, begins + at, strength) for at, strength in _peaks(values[row] / usual[row])]
        found.sort(key=lambda onset: -onset.strength)
        return [onset for onset in found[:MOST] if onset.strength >= LEAST_OF_BEST * found[0].strength]

    def _known(self, batch: slice) -> Spectra:
        # Transformed each time: the spectra would take three times the memory of the sounds.
        return self._spectra[batch] if self._spectra is not None else _conjugates(self._sounds[batch])


def _conjugates(sounds: Samples) -> Spectra:
    return np.asarray(np.fft.rfft(sounds, SIZE).conj(), np.complex64)


def _loudest(sound: Samples) -> int:
    """From which sample on SOUND_SAMPLES of it have most energy, its highs raised as those of speech in noise are."""
    energy = np.concatenate([[0.0], np.cumsum(np.square(np.diff(sound, prepend=sound[:1])), dtype=np.float64)])
    last = max(len(sound) - SOUND_SAMPLES, 0)
    ends = np.minimum(np.arange(last + 1) + SOUND_SAMPLES, len(sound))
    return int((energy[ends] - energy[: last + 1]).argmax())


def _peaks(row: NDArray[np.float32]) -> Iterator[tuple[int, float]]:
    """The strongest places, and how strong they are for what the sound usually has around them."""
    spread = np.abs(row[::SPARSE])
    middle = len(spread) // 2
    spread.partition(middle)
    row = row / max(float(spread[middle]) / MEDIAN_OF_NORMAL, 1.0)
    for _ in range(MOST):
        peak = int(row.argmax())
        if row[peak] < LEAST:
            return
        yield peak, float(row[peak])
        row[max(peak - APART, 0) : peak + APART] = 0.0
