"""Whether our voices sound like eight speakers, to a network that was trained to know people by their voices.

The network (GE2E: Wan and others, "Generalized end-to-end loss for speaker verification", ICASSP 2018; its weights are
in `pip install resemblyzer`, which also needs librosa, torch and webrtcvad) gives each sentence a vector of 256
numbers; two sentences by one person have similar ones. Each voice says the same random sentences of the phrasebook. For
each group of voices, and other programs beside them: the similarity (cosine) of two different sentences by one voice,
that of two voices, the two voices most alike, and the share of pairs of sentences that is judged wrongly, same voice or
not, at the threshold where both errors are equal.

    python -m benchmarks.speakers [--sentences 8] [--seed 1]
"""

from __future__ import annotations

import argparse
import itertools
import random
from collections.abc import Callable, Mapping, Sequence
from importlib.util import find_spec

import numpy as np
from numpy.typing import NDArray

from benchmarks.judging import talkers
from benchmarks.transcripts import on_air
from benchmarks.voice import VOCABULARY
from hvcpd.language.phrasebook import Phrasebook
from hvcpd.ports import Samples
from hvcpd.synthesis.lexicon import Lexicon

Vectors = NDArray[np.float64]


def encoder() -> Callable[[Samples], Vectors]:
    """The network: from a sentence to its vector of unit length, shape (256,). ImportError without it."""
    import torch
    from resemblyzer import VoiceEncoder

    torch.set_num_threads(1)
    network = VoiceEncoder("cpu", verbose=False)
    return lambda sound: np.asarray(network.embed_utterance(sound), np.float64)


def equal_error_rate(same: Sequence[float], other: Sequence[float]) -> float:
    """The share of errors where as large a share of `same` lies below the threshold as of `other` above it."""
    thresholds = np.unique(np.concatenate([same, other]))
    missed = np.searchsorted(np.sort(same), thresholds, "left") / len(same)
    taken = 1.0 - np.searchsorted(np.sort(other), thresholds, "left") / len(other)
    at = int(np.argmin(np.abs(missed - taken)))
    return float(missed[at] + taken[at]) / 2.0


def row(group: str, vectors: Mapping[str, Vectors]) -> str:
    """A line of the table; `vectors`: of each voice's sentences, shape (n, 256), the same sentences in all voices."""
    differing = ~np.eye(len(next(iter(vectors.values()))), dtype=bool)  # two voices in one sentence have its words
    same = [float(s) for v in vectors.values() for s in (v @ v.T)[np.triu(differing)]]
    pairs = {(a, b): (vectors[a] @ vectors[b].T)[differing] for a, b in itertools.combinations(vectors, 2)}
    other = [float(s) for found in pairs.values() for s in found]
    (a, b), alike = max(((pair, float(np.mean(found))) for pair, found in pairs.items()), key=lambda each: each[1])
    error = equal_error_rate(same, other)
    nearest = f"{a}, {b}: {alike:.2f}"
    return f"{group:16}{np.mean(same):12.2f}{np.mean(other):12.2f}  {nearest:28}{100.0 * error:8.1f} %"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sentences", type=int, default=8)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    if find_spec("resemblyzer") is None:
        parser.error("needs resemblyzer (pip install resemblyzer)")
    vector_of = encoder()
    book, rng = Phrasebook(VOCABULARY), random.Random(options.seed)
    sentences = [book.phrases(book.sample(rng)) for _ in range(options.sentences)]
    groups: dict[str, dict[str, Vectors]] = {}
    for name, talker in talkers(Lexicon.load()).items():
        if name.endswith("-gb"):
            continue  # the same voices in another accent
        group = "other programs" if not talker.own else "natural" if name.endswith("-n") else "formant"
        sounds = [on_air(talker.speak(phrases), seed) for seed, phrases in enumerate(sentences)]
        groups.setdefault(group, {})[name] = np.stack([vector_of(sound) for sound in sounds])
    print(f"{'':16}{'one voice':>12}{'two voices':>12}  {'most alike':28}{'equal error rate':>8}")
    for group, vectors in groups.items():
        print(row(group, vectors))


if __name__ == "__main__":
    main()
