"""Enrolled people: their sentences and words as mel energies, which are all that the recogniser needs of recordings."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from hvcpd.recognition.arrays import quantile
from hvcpd.recognition.frontend import Energies

MAX_TAKES = 6
"""Maximum number of takes of one word, the newest: each is one more path wherever its word may come."""
MAX_FRAMES = 250
"""2.5 s: nobody takes as long for one word."""
MIN_FRAMES = 5
MAX_SENTENCES = 20
"""Kept, the newest: more than that improve the phone net no further, and each is to be aligned anew at a start."""
MAX_SENTENCE_FRAMES = 1600
"""16 s, longer than any sentence."""

STRANGER = "stranger"
"""Voice name of a speaker who is neither a robot nor known by takes."""

LogBands = NDArray[np.float32]
Takes = Mapping[str, Sequence[Energies]]
"""For each word, in lower case, its takes: shape (frames, N_BANDS), without the silence around them."""


@dataclass(frozen=True, eq=False)
class SpokenSentence:
    """A sentence whose words are certain: `logs`, shape (frames, bands of the phone net), centred logarithms."""

    words: tuple[str, ...]
    logs: LogBands


@dataclass(frozen=True)
class Person:
    """A person's name, as written, takes of words, and sentences."""

    name: str
    takes: Takes = field(default_factory=dict)
    sentences: tuple[SpokenSentence, ...] = ()

    @property
    def words(self) -> frozenset[str]:
        """The words with takes."""
        return frozenset(self.takes)

    @property
    def n_takes(self) -> int:
        """Number of takes of all words."""
        return sum(map(len, self.takes.values()))

    def same_as(self, other: Person) -> bool:
        """Whether both have the same takes of the same words, and the same sentences."""
        return self._content == other._content

    @property
    def _content(self) -> tuple[object, ...]:
        takes = {word: [take.tobytes() for take in of_word] for word, of_word in self.takes.items()}
        return takes, [(each.words, each.logs.tobytes()) for each in self.sentences]

    @property
    def voice(self) -> str:
        """The recogniser's name for this voice: only takes tell it from others."""
        return voice_of(self.name) if self.takes else STRANGER

    def with_takes(self, more: Takes) -> Person:
        """The same with more takes, the oldest beyond MAX_TAKES of a word left out."""
        known = {word: [*self.takes.get(word, ()), *new][-MAX_TAKES:] for word, new in more.items()}
        return replace(self, takes={**self.takes, **known})

    def with_sentences(self, more: Iterable[SpokenSentence]) -> Person:
        """The same with more sentences, the oldest beyond MAX_SENTENCES left out."""
        return replace(self, sentences=(*self.sentences, *more)[-MAX_SENTENCES:])


def voice_of(name: str) -> str:
    """The recogniser's name for an enrolled person's voice; no synthesizer's has a comma."""
    return f"{name.lower()}, enrolled"


def spoken_takes(person: Person, words: Iterable[str]) -> dict[str, list[Energies]]:
    """The person's takes of `words`, all of the same loudness, since people do not keep theirs from one word to the
    next."""
    return {word: [level_normalised(take) for take in person.takes[word]] for word in words if word in person.takes}


def level_normalised(energies: Energies) -> Energies:
    """The take with a mean power of 1 in the louder half of its frames."""
    power = energies.sum(axis=1)
    out: Energies = energies / power[power >= quantile(power, 0.5)].mean()
    return out
