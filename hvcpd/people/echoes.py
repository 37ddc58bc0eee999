"""Takes of words by what the net of phones makes of them, which is alike whenever a person says the same.

A net that was trained to tell the sounds of a language apart gives better features for matching words with examples
than cepstra do, even where it names the sounds wrongly (H. Hermansky, D. Ellis & S. Sharma, "Tandem connectionist
feature extraction for conventional HMM systems", ICASSP 2000; T. Hazen, W. Shen & C. White, "Query-by-example spoken
term detection using phonetic posteriorgram templates", ASRU 2009). The noise of the moment is not in these takes: they
count beside those that it is composed with (`composed`).
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping, Sequence
from functools import cache

import numpy as np
from numpy.typing import NDArray

from hvcpd.people.cepstra import Bands
from hvcpd.people.matching import Heard, distances
from hvcpd.people.phones import Sounds, centred, sounds_of
from hvcpd.people.stored import stored
from hvcpd.people.take_bands import heard_alone
from hvcpd.recognition.frontend import Energies, Features
from hvcpd.recognition.scorer import norms_of
from hvcpd.recognition.templates import Template

SILENCE_FRAMES = 30
"""Before and after a take: as far as the net sees."""
INSIDE, CHANCES = 8.9, 10.0
"""Weights of the directions of what is inside the net and of the roots of its chances, whose distances are Hellinger's:
about as much counts the one as the other, and what is unlike is as far apart as with cepstra in the same time."""
QUIET_SHARE = 8
"""One frame in so many, the quietest, tells what the room's noise is for the net."""
LEAST_QUIET = 5
MOST_OTHERS = 500
"""So many takes are remembered at most that the newest listener does not need, 5 kB each: of two people."""


@cache
def _axes() -> Features:
    """The principal axes of the directions, shape (width of what is inside, 64), by `benchmarks/take_bands.py`: as many
    digits are right with them as with all 192 dimensions, in half the memory."""
    return np.asarray(stored("echoes.npz")["axes"], np.float32)


def directions_of(inside: Features) -> Features:
    """Of length 1, likewise shape (frames, width)."""
    return np.asarray(inside / np.maximum(np.linalg.norm(inside, axis=1, keepdims=True), 1e-6), np.float32)


def features_of(sounds: Sounds) -> Features:
    """Of what the net makes of a piece, shape (frames, width)."""
    directions = directions_of(sounds.inside) @ _axes()
    return np.concatenate([INSIDE * directions, CHANCES * np.exp(sounds.chances / 2.0)], axis=1)


def features_of_take(take: Energies) -> Features:
    """Of a take, shape (half its frames, rounded up; width)."""
    found = features_of(sounds_of(centred(heard_alone(take, SILENCE_FRAMES))))
    begin = SILENCE_FRAMES // 2
    return found[begin : begin + (len(take) + 1) // 2].copy()


class Remembered:
    """Features of takes. A PC needs 2 ms for each, a Raspberry Pi several times that: those of a team's people are not
    made again when another word or name is learned."""

    def __init__(self, make: Callable[[Energies], Features] = features_of_take) -> None:
        self._make = make
        self._known: dict[bytes, NDArray[np.float16]] = {}

    def of(self, take: Energies) -> Features:
        """As `features_of_take`."""
        return self._of(_key(take), take).astype(np.float32)

    def all_of(self, takes: Sequence[Energies]) -> list[Features]:
        """The same of all takes that a listener needs, however many; of others MOST_OTHERS stay at most."""
        keys = [_key(take) for take in takes]
        found = {key: self._of(key, take) for key, take in zip(keys, takes, strict=True)}
        if len(self._known) > len(found) + MOST_OTHERS:
            self._known = found
        return [found[key].astype(np.float32) for key in keys]

    def _of(self, key: bytes, take: Energies) -> NDArray[np.float16]:
        found = self._known.get(key)
        if found is None:
            found = self._known[key] = self._make(take).astype(np.float16)
        return found


def _key(take: Energies) -> bytes:
    return hashlib.blake2b(np.ascontiguousarray(take).tobytes(), digest_size=16).digest()


SHARED = Remembered()
"""All listeners' of this process: a robot that learns a name makes new ones."""


class EchoedTakes:
    """Knows takes of words in one or more voices."""

    def __init__(self, takes: Mapping[str, Mapping[str, Sequence[Energies]]], remembered: Remembered = SHARED) -> None:
        """`takes[voice][word]`: without noise. Raises ValueError without takes."""
        said = [(v, w, take) for v, words in takes.items() for w, of_word in words.items() for take in of_word]
        if not said:
            raise ValueError("no templates")
        templates: list[Template] = []
        rows = remembered.all_of([take for _, _, take in said])
        first = 0
        for (voice, word, _), features in zip(said, rows, strict=True):
            templates.append(Template(voice, word, first, len(features)))
            first += len(features)
        self.templates = tuple(templates)
        self._rows: Features = np.concatenate(rows)

    def hear(self, logs: Bands, sounds: Sounds) -> Heard:
        """A piece of sound beside the takes: its `logs`, shape (frames, N_BANDS), and what the net makes of them."""
        features = features_of(sounds)
        level = logs.mean(axis=1)[::2]
        quiet = np.argsort(level)[: max(len(level) // QUIET_SHARE, LEAST_QUIET)]
        noise = features[quiet].mean(axis=0, keepdims=True)
        return Heard(features, self._rows, distances(features, noise, norms_of(noise))[:, 0])
