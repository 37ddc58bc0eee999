"""Finds where a sentence may begin: the sounds that sentences begin with, by matched filters, all the time."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from hvcpd.recognition.matched import PART, Spectrum, Weighing, power_of, scrutinized
from hvcpd.recognition.rounded import Rounded, restored, rounded

SIZE = 8192
"""Samples of a transform: half a second, most of which are new ones each time."""
SOUND_SAMPLES = 3 * PART
"""Of a first word the loudest 0.19 s are sought, in whole parts: "hi" has little more."""
STEP = SIZE - SOUND_SAMPLES
"""Lags that one transform tells of: 0.32 s."""
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
MOST_OF_SOUND = 8
"""Onsets of one sound in one step, the strongest ones."""
MOST_SCRUTINIZED = 48
"""Of all onsets in one step, the strongest ones: amid babble, hisses of other voices come before a word's beginning."""
LEAST_THERE = 4.5
"""Strength of an onset for what is left over where it is found..."""
LEAST_OF_BEST = 0.25
"""...of the strongest one's such strength, what others have at least: what is said resembles other beginnings too..."""
MOST = 12
"""...and how many are found in one step."""

Spectra = NDArray[np.complex64]


@dataclass(frozen=True)
class Onset:
    """Sound number `sound` seems to begin at sample `at`, with a strength for what is usually heard, and `there` for
    what is left over where it is found; 0 if a part of it is not there."""

    sound: int
    at: int
    strength: float
    there: float = 0.0


class Onsets:
    """Known beginnings, to be found in what is heard."""

    def __init__(self, sounds: Iterable[Samples], quick: bool = False) -> None:
        """`sounds`, float32 at 16 kHz, of any length but 0; each is only looked at once. `quick`: to be found in half
        the time with five times the memory."""
        self._leads: list[int] = []
        cut: list[Rounded] = []
        powers: list[Spectrum] = []
        for sound in sounds:
            lead = _loudest(sound)
            part = sound[lead : lead + SOUND_SAMPLES]
            self._leads.append(lead)
            cut.append(np.zeros(SOUND_SAMPLES, np.int16))
            cut[-1][: len(part)] = rounded(part)
            powers.append(power_of(part))
        self._sounds = np.array(cut, np.int16).reshape(-1, SOUND_SAMPLES)
        self._powers = np.array(powers, np.float32)
        self._spectra = _conjugates(self._sounds) if quick else None

    def find(self, places: Sequence[tuple[int, Samples]], weighing: Weighing) -> list[list[Onset]]:
        """For each place those among the first STEP samples of what was heard there.

        `places`: a sample's number, and what is weighed from it on, shape (SIZE,). Several at once cost less: each
        sound is transformed once.
        """
        standing_out: list[list[Onset]] = [[] for _ in places]
        for place, onset in self._standing_out(places, weighing):
            standing_out[place].append(onset)
        return [
            self._best(found, weighed, first, weighing)
            for found, (first, weighed) in zip(standing_out, places, strict=True)
        ]

    def _best(self, found: list[Onset], weighed: Samples, first: int, weighing: Weighing) -> list[Onset]:
        """Of what stands out, the strongest for what is left over."""
        found.sort(key=lambda onset: -onset.strength)
        found = [self._scrutinized(onset, weighed, first, weighing) for onset in found[:MOST_SCRUTINIZED]]
        found.sort(key=lambda onset: -onset.there)
        return [onset for onset in found[:MOST] if onset.there >= max(LEAST_THERE, LEAST_OF_BEST * found[0].there)]

    def _standing_out(self, places: Sequence[tuple[int, Samples]], weighing: Weighing) -> Iterator[tuple[int, Onset]]:
        """All that stand out from what is usually heard, each with the number of its place."""
        spectra = [np.fft.rfft(weighed, SIZE) for _, weighed in places]
        for start in range(0, len(self._sounds), BATCH):
            batch = slice(start, start + BATCH)
            known, usual = self._known(batch), self._expected(batch, weighing)
            for place, (first, _) in enumerate(places):
                values = np.fft.irfft(spectra[place] * known, SIZE)[:, :STEP]
                for row in np.flatnonzero(values.max(axis=1) >= LEAST * usual):
                    number = start + int(row)
                    begins = first - self._leads[number]
                    for at, height in _peaks(values[row] / usual[row]):
                        yield place, Onset(number, begins + at, height)

    def _expected(self, batch: slice, weighing: Weighing) -> NDArray[np.float32]:
        return np.asarray(np.sqrt(np.maximum(self._powers[batch] @ weighing.weights, 1e-20)), np.float32)

    def _scrutinized(self, onset: Onset, weighed: Samples, first: int, weighing: Weighing) -> Onset:
        """The same, once it is known how strong it is there."""
        number = onset.sound
        at = onset.at + self._leads[number] - first
        there = weighed[at : at + SOUND_SAMPLES]
        expected = float(self._expected(slice(number, number + 1), weighing)[0])
        sound = restored(self._sounds[number])
        match = scrutinized(there, sound, self._powers[number], weighing, onset.strength, expected)
        return replace(onset, there=match.strength if match.whole else 0.0)

    def _known(self, batch: slice) -> Spectra:
        # Transformed each time: the spectra would take five times the memory of the sounds.
        return self._spectra[batch] if self._spectra is not None else _conjugates(self._sounds[batch])


def _conjugates(sounds: Rounded) -> Spectra:
    return np.asarray(np.fft.rfft(restored(sounds), SIZE).conj(), np.complex64)


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
    for _ in range(MOST_OF_SOUND):
        peak = int(row.argmax())
        if row[peak] < LEAST:
            return
        yield peak, float(row[peak])
        row[max(peak - APART, 0) : peak + APART] = 0.0
