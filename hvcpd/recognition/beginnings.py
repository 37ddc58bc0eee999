"""Where sentences may begin: greetings are sought all the time, all other words where there are signs of speech.

A search costs more than anything else in quiet, and grows with the voices that are known. So what a sentence seldom
begins with is sought only once something stirs, first right there, later also in what came before; and not at all
while a sentence that began with a greeting is followed."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import chain

import numpy as np

from hvcpd.ports import Samples
from hvcpd.recognition.matched import BINS, Spectrum, power_of
from hvcpd.recognition.onsets import SIZE, STEP, Onsets
from hvcpd.recognition.paths import Said, Voicebook
from hvcpd.recognition.weighed import WeighedSound

LOOK_BACK = 4
"""Steps (1.25 s) before signs of speech in which a sentence may have begun: so late, they are surely seen."""
LONGEST_WAIT = 6
"""Steps (1.9 s) that may wait while a greeting is followed: what is heard is kept for 3 s."""


@dataclass(frozen=True)
class First:
    """A way in which a sentence may begin."""

    book: Voicebook
    word: str
    node: int
    said: Said


class _Search:
    """Known beginnings, and the filters that find them."""

    def __init__(self, firsts: Sequence[First], quick: bool) -> None:
        self.firsts = firsts
        self._onsets = Onsets((first.said.samples for first in firsts), quick)

    def find(self, sound: WeighedSound, places: Sequence[int], more: bool) -> list[tuple[First, int]]:
        """What begins within STEP samples from each of these on, in their order, and where; `more`: the sound will be
        asked for again."""
        if not self.firsts:
            return []
        heard = [(at, sound.between(at, at + SIZE, more)) for at in places]
        found = chain(*self._onsets.find(heard, sound.weighing))
        return [(self.firsts[onset.sound], onset.at) for onset in found]


class Beginnings:
    """Seeks them in a sound as it grows."""

    def __init__(self, make: Callable[[bool], Sequence[First]]) -> None:
        """`make`: all greetings, or all other beginnings."""
        self._make = make
        self._greetings: _Search | None = None
        self._others: _Search | None = None
        self._next = 0
        self._waiting: list[int] = []
        """Where steps begin in which only greetings have been sought."""
        self._sign: int | None = None
        """Where the signs of speech were seen first."""

    @property
    def due(self) -> int:
        """The search goes on when samples up to this one are there."""
        return self._next + SIZE

    def restart(self, at: int) -> None:
        """What comes next is sample `at`, and follows on nothing."""
        self._next, self._waiting, self._sign = at, [], None

    def renew(self) -> None:
        """Other beginnings are known now."""
        self._greetings = self._others = None

    def seek(self, sound: WeighedSound, signs: bool, greeted: bool, settled: bool) -> Iterator[tuple[First, int]]:
        """What begins in the sound that was not looked into yet, and at which samples.

        `signs`: of speech; `greeted`: a sentence that began with a greeting may be under way; `settled`: some sentence
        surely is.
        """
        greetings = self._greetings  # another thread may renew meanwhile
        if greetings is None:
            greetings = self._greetings = _Search(self._make(True), quick=True)
            sound.weighing.expect(_spectra_of(self._make(False)))
        while sound.end >= self.due:
            found = greetings.find(sound, [self._next], signs or greeted) if not settled else []
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
            self._sign = None  # what came before it was looked into
        longest = LONGEST_WAIT if self._sign is not None else LOOK_BACK
        self._waiting = self._waiting[-longest:]
        if self._sign is not None and not greeted:
            yield from self._seek_others(sound, self._sign)

    def _seek_others(self, sound: WeighedSound, sign: int) -> Iterator[tuple[First, int]]:
        """The same of all but greetings: where the `sign` was, and before it when it is known that no greeting was."""
        due = self._waiting if self._next >= sign else [at for at in self._waiting if at + SIZE > sign]
        self._waiting = [at for at in self._waiting if at not in due]
        if not due:
            return
        others = self._others = self._others or _Search(self._make(False), quick=False)
        yield from others.find(sound, due, True)


def _spectra_of(firsts: Sequence[First]) -> Spectrum:
    """The mean power spectrum of the beginnings in each voice, shape (n_voices, BINS); the first rate tells enough."""
    books = {first.book.voice: first.book for first in reversed(firsts)}.values()
    mean = [
        np.mean([_shape_of(first.said.samples) for first in firsts if first.book is book], axis=0) for book in books
    ]
    return np.asarray(mean, np.float32).reshape(-1, BINS)


def _shape_of(sound: Samples) -> Spectrum:
    """Its power spectrum, 1 in all."""
    power = power_of(sound)
    return power / max(float(power.sum()), 1e-20)
