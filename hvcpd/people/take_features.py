"""Features of takes of words: cepstra in the current noise, and tandem features, computed by the phone net.

A net that was trained to tell the sounds of a language apart gives better features for matching words with examples
than cepstra do, even where it names the sounds wrongly (H. Hermansky, D. Ellis & S. Sharma, "Tandem connectionist
feature extraction for conventional HMM systems", ICASSP 2000; T. Hazen, W. Shen & C. White, "Query-by-example spoken
term detection using phonetic posteriorgram templates", ASRU 2009). The noise of the moment is not in tandem features:
they count beside the cepstra.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping, Sequence
from functools import cache

import numpy as np
from numpy.typing import NDArray

from hvcpd.people.bands import Bands, heard_alone, stored
from hvcpd.people.phones import NetOutput, centred, phones_of
from hvcpd.people.template_decoder import Heard, distances
from hvcpd.recognition.frontend import CONTEXT_FRAMES, Energies, Features
from hvcpd.recognition.frontend import features_of as cepstral_features_of
from hvcpd.recognition.scorer import Scorer, norms_of
from hvcpd.recognition.templates import Noise, Template, TemplateBank, noise_features

SILENCE_FRAMES = 30
"""Before and after a take: as far as the net sees."""
ACTIVATIONS, POSTERIORS = 8.9, 10.0
"""Weights of the directions of the net's activations and of the roots of its posteriors, whose distances are
Hellinger's: about as much counts the one as the other, and what is unlike is as far apart as with cepstra in the same
time."""
QUIET_SHARE = 8
"""One frame in so many, the quietest, tells what the room's noise is for the net."""
LEAST_QUIET = 5
MOST_OTHERS = 500
"""Most takes that are remembered though the newest listener does not need them, 5 kB each: those of two people."""


@cache
def _axes() -> Features:
    """The principal axes of the directions, shape (width of the activations, 64), by `benchmarks/take_bands.py`: as
    many digits are right with them as with all 192 dimensions, in half the memory."""
    return np.asarray(stored("tandem.npz")["axes"], np.float32)


def directions_of(activations: Features) -> Features:
    """Rows scaled to length 1, shape (frames, width)."""
    return np.asarray(activations / np.maximum(np.linalg.norm(activations, axis=1, keepdims=True), 1e-6), np.float32)


def features_of(output: NetOutput) -> Features:
    """Of what the net makes of a piece, shape (frames, width)."""
    directions = directions_of(output.activations) @ _axes()
    return np.concatenate([ACTIVATIONS * directions, POSTERIORS * np.exp(output.log_posteriors / 2.0)], axis=1)


def features_of_take(take: Energies) -> Features:
    """Of a take, shape (half its frames, rounded up; width)."""
    found = features_of(phones_of(centred(heard_alone(take, SILENCE_FRAMES))))
    begin = SILENCE_FRAMES // 2
    return found[begin : begin + (len(take) + 1) // 2].copy()


class FeatureCache:
    """Features of takes. A PC needs 2 ms for each, a Raspberry Pi several times that: those of a team's people are not
    made again when another word or name is learned."""

    def __init__(self, make: Callable[[Energies], Features] = features_of_take) -> None:
        self._make = make
        self._known: dict[bytes, NDArray[np.float16]] = {}

    def of(self, take: Energies) -> Features:
        """As `features_of_take`."""
        return self._of(_key(take), take).astype(np.float32)

    def all_of(self, takes: Sequence[Energies]) -> list[Features]:
        """The features of all takes that a listener needs, however many; at most MOST_OTHERS others stay in memory."""
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


SHARED = FeatureCache()
"""All listeners' of this process: a robot that learns a name makes new ones."""


class TandemTakes:
    """Knows takes of words in one or more voices."""

    def __init__(self, takes: Mapping[str, Mapping[str, Sequence[Energies]]], known: FeatureCache = SHARED) -> None:
        """`takes[voice][word]`: without noise. Raises ValueError without takes."""
        said = [(v, w, take) for v, words in takes.items() for w, of_word in words.items() for take in of_word]
        if not said:
            raise ValueError("no templates")
        templates: list[Template] = []
        rows = known.all_of([take for _, _, take in said])
        first = 0
        for (voice, word, _), features in zip(said, rows, strict=True):
            templates.append(Template(voice, word, first, len(features)))
            first += len(features)
        self.templates = tuple(templates)
        self._rows: Features = np.concatenate(rows)

    def hear(self, logs: Bands, output: NetOutput) -> Heard:
        """A piece of sound beside the takes: its `logs`, shape (frames, N_BANDS), and what the net makes of them."""
        features = features_of(output)
        level = logs.mean(axis=1)[::2]
        quiet = np.argsort(level)[: max(len(level) // QUIET_SHARE, LEAST_QUIET)]
        noise = features[quiet].mean(axis=0, keepdims=True)
        return Heard(features, self._rows, distances(features, noise, norms_of(noise))[:, 0])


LEAST_GAIN = 1e-9


class ComposedTakes:
    """Knows takes of words in one or more voices."""

    def __init__(self, takes: Mapping[str, Mapping[str, Sequence[Energies]]]) -> None:
        """`takes[voice][word]`: without noise. Raises ValueError without takes."""
        self._bank = TemplateBank(takes)
        self._scorer = Scorer(self._bank, (0.0,))
        self.templates = self._bank.templates

    def hear(self, energies: Energies, noise: Noise) -> Heard:
        """A piece of sound, of whose noise the mean energies, shape (N_BANDS,), are known, beside the takes.

        `energies`, shape (n, N_BANDS), begin and end with a little noise.
        """
        gain = max(self._scorer.level_of(energies, noise), LEAST_GAIN)
        mask = self._scorer.mask(gain)
        rows = self._bank.compose(np.arange(self._bank.n_frames), noise + mask, gain)
        padded = np.pad(energies + mask, ((CONTEXT_FRAMES, CONTEXT_FRAMES), (0, 0)), mode="edge")
        heard = cepstral_features_of(padded)
        silence = noise_features(noise + mask)[None, :]
        to_noise = distances(heard, silence, norms_of(silence))[:, 0]
        return Heard(heard, rows, to_noise)
