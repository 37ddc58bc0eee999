"""Speaker adaptation of the phone nets: output layers of a person's own, from sentences whose words are known.

The hidden layers stay as they are. The layer after them moves so that the phones of the known words become likelier
where a Viterbi alignment puts them (a linear output network: B. Li & K. C. Sim, "Comparison of discriminative input and
output transformations for speaker adaptation in the hybrid NN/HMM systems", Interspeech 2010). A Gaussian prior around
the layer as it was trained keeps phones that were not said where they are. So a few sentences help with all words.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from hvcpd.language.graph import graph_of
from hvcpd.people.bands import LogBands
from hvcpd.people.enrolled import SpokenSentence
from hvcpd.people.phones import PHONES, CtcSearch, LogPosteriors, OutputLayer, PhoneNet, Pronounce, nets

Phones = NDArray[np.int64]
"""The phone in each frame, by its index in PHONES, or BLANK; shape (frames,)."""
BLANK = len(PHONES)
"""The index of the blank."""
PRIOR = 0.03
"""Weight of the prior against the mean loss of a frame. Two of Kokoro's voices that calibrate, five sentences each,
right and sure of 40 others, with .1, .03 and .01: 22, 26 and 25 (17 without); 4 wrong each time (3 without)."""
N_STEPS, RATE, MOMENTUM = 200, 0.5, 0.9
"""Number of steps, rate and momentum of gradient descent on a convex loss; 100 steps more change no sentence."""


def adapted_layers(sentences: Sequence[SpokenSentence], pronounce: Pronounce) -> tuple[OutputLayer, ...]:
    """A person's output layer of each net; none if the phones of none of the sentences can be aligned."""
    layers = (_adapted(net, sentences, pronounce) for net in nets())
    return tuple(layer for layer in layers if layer is not None)


def _adapted(net: PhoneNet, sentences: Iterable[SpokenSentence], pronounce: Pronounce) -> OutputLayer | None:
    inputs, wanted = list[LogBands](), list[Phones]()
    for sentence in sentences:
        activations = net.activations(sentence.logs)
        phones = alignment(net.layer.log_posteriors(activations), sentence.words, pronounce)
        if phones is not None:
            inputs.append(activations)
            wanted.append(phones)
    return _fitted(net.layer, np.concatenate(inputs), np.concatenate(wanted)) if wanted else None


def alignment(log_posteriors: LogPosteriors, words: Sequence[str], pronounce: Pronounce) -> Phones | None:
    """The phones of known words; None if there are too few frames."""
    found = CtcSearch(graph_of(words), pronounce).best(log_posteriors)
    if found is None:
        return None
    phones = np.full(len(log_posteriors), BLANK)
    for word, (begin, end) in zip(found.words, found.spans, strict=True):
        searches = (CtcSearch(graph_of(said), lambda phone: [(phone,)]) for said in pronounce(word) if said)
        ways = [way for search in searches if (way := search.best(log_posteriors[begin:end])) is not None]
        best = min(ways, key=lambda way: way.loss)
        for phone, (first, last) in zip(best.words, best.spans, strict=True):
            phones[begin + first : begin + last] = PHONES.index(phone)
    return phones


def _fitted(start: OutputLayer, activations: LogBands, phones: Phones) -> OutputLayer:
    """The layer near `start` with the least cross-entropy of the phones and the prior's loss."""
    scale = np.sqrt((activations**2).mean(axis=0) + 1e-6)
    inputs = np.pad(activations / scale, ((0, 0), (0, 1)), constant_values=1.0)  # the last weights are the bias
    base, wanted = start.logits(activations), np.eye(BLANK + 1, dtype=np.float32)[phones]
    rates = np.full((inputs.shape[1], 1), RATE / np.sqrt(len(scale)), np.float32)  # gradients grow with the inputs
    rates[-1] = RATE
    moved = step = np.zeros((inputs.shape[1], BLANK + 1), np.float32)
    for _ in range(N_STEPS):
        logits = base + inputs @ moved
        likely = np.exp(logits - logits.max(axis=1, keepdims=True))
        error = (likely / likely.sum(axis=1, keepdims=True) - wanted) / len(inputs)
        step = MOMENTUM * step - rates * (inputs.T @ error + PRIOR * moved)
        moved = moved + step
    weights = start.weights + moved[:-1] / scale[:, None]
    return OutputLayer(np.asarray(weights, np.float32), np.asarray(start.bias + moved[-1], np.float32))
