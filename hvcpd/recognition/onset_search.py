"""Onset search: finds possible beginnings of sentences, by matched filters for their first sounds.

The search for greetings runs all the time, the search for all other words only where there are signs of speech. A
search costs more than anything else in quiet, and its cost grows with the number of known voices. So rare beginnings
are searched for only after signs of speech: first right there, later also in the sound before. While a sentence that
began with a greeting is followed, they are not searched for at all.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import chain

import numpy as np
from numpy.typing import NDArray

from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from hvcpd.recognition.frontend import TINY, rfft
from hvcpd.recognition.matched_filter import (
    BINS,
    PART,
    Quantised,
    Spectrum,
    WhitenedSound,
    WhiteningFilter,
    power_of,
    quantised,
    restored,
    scrutinized,
)
from hvcpd.recognition.paths import Said, Voicebook

SIZE = 8192
"""Samples of a transform: half a second, most of which are new ones each time."""
SOUND_SAMPLES = 3 * PART
"""The search uses the loudest 0.19 s of a first word, in whole parts: "hi" has little more."""
STEP = SIZE - SOUND_SAMPLES
"""Number of lags that one transform covers: 0.32 s."""
LEAST = 6.0
"""Strength of an onset; noise alone passes it once in 10^9 samples."""
MEDIAN_OF_NORMAL = 0.6745
"""Median of |x| of a normal distribution with deviation 1."""
SPARSE = 8
"""Every eighth value is enough to estimate that median: about 620 values, a twentieth of a syllable apart."""
APART = SAMPLE_RATE_HZ // 50
"""20 ms: nearer ones, of the same sound, are one."""
BATCH = 4
"""Sounds that are correlated at once."""
MOST_OF_SOUND = 8
"""Maximum number of onsets of one sound in one step."""
MOST_SCRUTINIZED = 48
"""Maximum number of onsets of all sounds in one step that are compared with the residual: in babble, hisses of other
voices come before a word's beginning."""
LEAST_THERE = 4.5
"""Least strength of an onset relative to the residual at its place."""
LEAST_OF_BEST = 0.25
"""Least share of the strongest onset's strength, also relative to the residual: speech resembles other beginnings
too."""
MOST = 12
"""Maximum number of onsets of one step."""

Spectra = NDArray[np.complex64]


@dataclass(frozen=True)
class Onset:
    """Sound number `sound` seems to begin at sample `at`. The strength is relative to the usual noise; `there` is
    relative to the residual at that place, and 0 if a part of the sound is missing."""

    sound: int
    at: int
    strength: float
    there: float = 0.0


class OnsetSearch:
    """Searches the microphone signal for known beginnings."""

    def __init__(self, sounds: Iterable[Samples], quick: bool = False) -> None:
        """`sounds`, float32 at 16 kHz, of any length but 0; each is read only once. `quick`: search in half the
        time with five times the memory."""
        self._leads: list[int] = []
        cut: list[Quantised] = []
        powers: list[Spectrum] = []
        for sound in sounds:
            lead = _loudest(sound)
            part = sound[lead : lead + SOUND_SAMPLES]
            self._leads.append(lead)
            cut.append(np.zeros(SOUND_SAMPLES, np.int16))
            cut[-1][: len(part)] = quantised(part)
            powers.append(power_of(part))
        self._sounds = np.array(cut, np.int16).reshape(-1, SOUND_SAMPLES)
        self._powers = np.array(powers, np.float32)
        self._spectra = _conjugates(self._sounds) if quick else None

    def find(self, places: Sequence[tuple[int, Samples]], whitening: WhiteningFilter) -> list[list[Onset]]:
        """Return for each place the onsets among its first STEP samples.

        `places`: a sample number, and the whitened sound from it on, shape (SIZE,). Several at once cost less: each
        sound is transformed once.
        """
        standing_out: list[list[Onset]] = [[] for _ in places]
        for place, onset in self._standing_out(places, whitening):
            standing_out[place].append(onset)
        return [
            self._best(found, whitened, first, whitening)
            for found, (first, whitened) in zip(standing_out, places, strict=True)
        ]

    def _best(self, found: list[Onset], whitened: Samples, first: int, whitening: WhiteningFilter) -> list[Onset]:
        """Return the strongest candidates, relative to the residual."""
        found.sort(key=lambda onset: -onset.strength)
        found = [self._scrutinized(onset, whitened, first, whitening) for onset in found[:MOST_SCRUTINIZED]]
        found.sort(key=lambda onset: -onset.there)
        return [onset for onset in found[:MOST] if onset.there >= max(LEAST_THERE, LEAST_OF_BEST * found[0].there)]

    def _standing_out(
        self, places: Sequence[tuple[int, Samples]], whitening: WhiteningFilter
    ) -> Iterator[tuple[int, Onset]]:
        """Return all candidates that stand out from the usual noise, each with the number of its place."""
        spectra = [rfft(whitened, SIZE) for _, whitened in places]
        for start in range(0, len(self._sounds), BATCH):
            batch = slice(start, start + BATCH)
            known, usual = self._known(batch), self._expected(batch, whitening)
            for place, (first, _) in enumerate(places):
                values = np.fft.irfft(spectra[place] * known, SIZE)[:, :STEP]
                for row in np.flatnonzero(values.max(axis=1) >= LEAST * usual):
                    number = start + int(row)
                    begins = first - self._leads[number]
                    for at, height in _peaks(values[row] / usual[row]):
                        yield place, Onset(number, begins + at, height)

    def _expected(self, batch: slice, whitening: WhiteningFilter) -> NDArray[np.float32]:
        return np.asarray(np.sqrt(np.maximum(self._powers[batch] @ whitening.weights, TINY)), np.float32)

    def _scrutinized(self, onset: Onset, whitened: Samples, first: int, whitening: WhiteningFilter) -> Onset:
        """Return the onset with its strength at this place."""
        number = onset.sound
        at = onset.at + self._leads[number] - first
        there = whitened[at : at + SOUND_SAMPLES]
        expected = float(self._expected(slice(number, number + 1), whitening)[0])
        sound = restored(self._sounds[number])
        match = scrutinized(there, sound, self._powers[number], whitening, onset.strength, expected)
        return replace(onset, there=match.strength if match.whole else 0.0)

    def _known(self, batch: slice) -> Spectra:
        # Transformed each time: the spectra would take five times the memory of the sounds.
        return self._spectra[batch] if self._spectra is not None else _conjugates(self._sounds[batch])


def _conjugates(sounds: Quantised) -> Spectra:
    return np.asarray(rfft(restored(sounds), SIZE).conj(), np.complex64)


def _loudest(sound: Samples) -> int:
    """The sample from which SOUND_SAMPLES of it have most energy, with high frequencies raised as in speech in
    noise."""
    energy = np.concatenate([[0.0], np.cumsum(np.square(np.diff(sound, prepend=sound[:1])), dtype=np.float64)])
    last = max(len(sound) - SOUND_SAMPLES, 0)
    ends = np.minimum(np.arange(last + 1) + SOUND_SAMPLES, len(sound))
    return int((energy[ends] - energy[: last + 1]).argmax())


def _peaks(row: NDArray[np.float32]) -> Iterator[tuple[int, float]]:
    """The strongest places, and their strengths relative to the usual surroundings of the sound."""
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


LOOK_BACK = 4
"""Steps (1.25 s) before signs of speech in which a sentence may have begun: signs are never seen later than that."""
LONGEST_WAIT = 6
"""Steps (1.9 s) that may wait while a greeting is followed: what is heard is kept for 3 s."""


@dataclass(frozen=True)
class First:
    """A possible beginning of a sentence."""

    book: Voicebook
    word: str
    node: int
    said: Said


_Beginnings = tuple[Sequence[First], OnsetSearch]


def _beginnings(firsts: Sequence[First], quick: bool) -> _Beginnings:
    return firsts, OnsetSearch((first.said.samples for first in firsts), quick)


def _found(known: _Beginnings, sound: WhitenedSound, places: Sequence[int], more: bool) -> list[tuple[First, int]]:
    """The beginnings within STEP samples of each place, in their order, with their samples; `more`: the sound will be
    requested again."""
    firsts, search = known
    heard = [(at, sound.between(at, at + SIZE, more)) for at in places] if firsts else []
    return [(firsts[onset.sound], onset.at) for onset in chain(*search.find(heard, sound.whitening))]


class OnsetSchedule:
    """Searches a growing sound for beginnings."""

    def __init__(self, make: Callable[[bool], Sequence[First]]) -> None:
        """`make`: all greetings, or all other beginnings."""
        self._make = make
        self._greetings: _Beginnings | None = None
        self._others: _Beginnings | None = None
        self._next = 0
        self._waiting: list[int] = []
        """First samples of the steps that were searched only for greetings."""
        self._sign: int | None = None
        """Sample at which signs of speech were noticed first."""

    @property
    def due(self) -> int:
        """The search continues when samples up to this one are available."""
        return self._next + SIZE

    def restart(self, at: int) -> None:
        """Note a gap: the next sample has number `at` and does not follow on the last one."""
        self._next, self._waiting, self._sign = at, [], None

    def renew(self) -> None:
        """Replace the known beginnings."""
        self._greetings = self._others = None

    def seek(self, sound: WhitenedSound, signs: bool, greeted: bool, settled: bool) -> Iterator[tuple[First, int]]:
        """Search the new part of the sound; return the beginnings and their samples.

        `signs`: there are signs of speech; `greeted`: a sentence that began with a greeting may be in progress;
        `settled`: some sentence surely is.
        """
        greetings = self._greetings  # another thread may replace them meanwhile
        if greetings is None:
            greetings = self._greetings = _beginnings(self._make(True), quick=True)
            sound.whitening.expect(_spectra_of(self._make(False)))
        while sound.end >= self.due:
            found = _found(greetings, sound, [self._next], signs or greeted) if not settled else []
            greeted = greeted or bool(found)
            self._waiting.append(self._next)
            self._next += STEP
            yield from found
        if settled:
            self._waiting, self._sign = [], None
            return
        if self._sign is None:
            self._sign = sound.end if signs else None
        elif not signs and self._next >= self._sign + STEP:
            self._sign = None  # the sound before it has been searched
        longest = LONGEST_WAIT if self._sign is not None else LOOK_BACK
        self._waiting = self._waiting[-longest:]
        if self._sign is not None and not greeted:
            yield from self._seek_others(sound, self._sign)

    def _seek_others(self, sound: WhitenedSound, sign: int) -> Iterator[tuple[First, int]]:
        """Search for all beginnings but greetings: at the `sign`, and before it once no greeting can have been
        there."""
        due = self._waiting if self._next >= sign else [at for at in self._waiting if at + SIZE > sign]
        self._waiting = [at for at in self._waiting if at not in due]
        if not due:
            return
        others = self._others = self._others or _beginnings(self._make(False), quick=False)
        yield from _found(others, sound, due, True)


def _spectra_of(firsts: Sequence[First]) -> Spectrum:
    """The mean power spectrum of the beginnings in each voice, shape (n_voices, BINS); the first rate is
    representative."""
    books = {first.book.voice: first.book for first in reversed(firsts)}.values()
    mean = [
        np.mean([_shape_of(first.said.samples) for first in firsts if first.book is book], axis=0) for book in books
    ]
    return np.asarray(mean, np.float32).reshape(-1, BINS)


def _shape_of(sound: Samples) -> Spectrum:
    """The sound's power spectrum, with sum 1."""
    power = power_of(sound)
    return power / max(float(power.sum()), TINY)
