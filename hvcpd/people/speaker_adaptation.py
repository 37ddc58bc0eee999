"""Speaker adaptation of the phone net: an output layer of a person's own, from sentences whose words are known.

The hidden layers stay as they are. The layer after them moves so that the phones of the known words become likelier
where a Viterbi alignment puts them (a linear output network: B. Li & K. C. Sim, "Comparison of discriminative input and
output transformations for speaker adaptation in the hybrid NN/HMM systems", Interspeech 2010). A Gaussian prior around
the layer as it was trained keeps phones that were not said where they are. So a few sentences help with all words.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from hvcpd.language.graph import graph_of
from hvcpd.people.enrolled import SpokenSentence
from hvcpd.people.phones import (
    PHONES,
    CtcSearch,
    Index,
    LogPosteriors,
    Logs,
    OutputLayer,
    Pronounce,
    anybodys_layer,
    phones_of,
)

GAP = len(PHONES)
"""The output for a frame of no phone."""
PRIOR = 0.03
"""Weight of the prior against the mean loss of a frame. Two of Kokoro's voices that calibrate, five sentences each,
right and sure of 40 others, with .1, .03 and .01: 22, 26 and 25 (17 without); 4 wrong each time (3 without)."""
STEPS, RATE, MOMENTUM = 200, 0.5, 0.9
"""Of gradient descent on a convex loss; 100 steps more change no sentence."""
_NEVER = -1e9


def adapted(sentences: Iterable[SpokenSentence], pronounce: Pronounce) -> OutputLayer | None:
    """A person's output layer; None if the phones of none of the sentences can be aligned."""
    pairs = [pair for sentence in sentences if (pair := _aligned(sentence, pronounce)) is not None]
    if not pairs:
        return None
    activations = np.concatenate([of_sentence for of_sentence, _ in pairs])
    return _fitted(activations, np.concatenate([phones for _, phones in pairs]))


def _aligned(sentence: SpokenSentence, pronounce: Pronounce) -> tuple[Logs, Index] | None:
    """Each frame's activations and phone."""
    output = phones_of(sentence.logs)
    phones = alignment(output.log_posteriors, sentence.words, pronounce)
    return (output.activations, phones) if phones is not None else None


def alignment(log_posteriors: LogPosteriors, words: Sequence[str], pronounce: Pronounce) -> Index | None:
    """The phone in each frame, or GAP, for known words; shape (frames,). None if there are too few frames."""
    found = CtcSearch(graph_of(words), pronounce).best(log_posteriors)
    if found is None:
        return None
    phones = np.full(len(log_posteriors), GAP)
    for word, (begin, end) in zip(found.words, found.spans, strict=True):
        ways = [[PHONES.index(phone) for phone in said] for said in pronounce(word) if 0 < len(said) <= end - begin]
        fits = [_viterbi(log_posteriors[begin:end], way) for way in ways]
        if fits:
            phones[begin:end] = max(fits, key=lambda fit: fit[0])[1]
    return phones


def _viterbi(log_posteriors: LogPosteriors, phones: Sequence[int]) -> tuple[float, Index]:
    """The best path through the phones in order, with GAP before, between and after them; its score, and each frame's
    output."""
    states = np.array([GAP, *(output for phone in phones for output in (phone, GAP))])
    may_skip = np.zeros(len(states), bool)
    may_skip[3::2] = states[3::2] != states[1:-2:2]  # a phone said twice has a gap within
    emitted = log_posteriors[:, states].astype(np.float64)
    score = np.full(len(states), _NEVER)
    score[:2] = emitted[0, :2]
    steps = np.zeros(emitted.shape, np.int64)
    for frame in range(1, len(emitted)):
        one, two = np.roll(score, 1), np.where(may_skip, np.roll(score, 2), _NEVER)
        one[0] = _NEVER
        ways = np.stack([score, one, two])
        steps[frame] = ways.argmax(axis=0)
        score = ways.max(axis=0) + emitted[frame]
    state = len(states) - 1 if score[-1] > score[-2] else len(states) - 2
    best = float(score[state])
    path = np.empty(len(emitted), np.int64)
    for frame in reversed(range(len(emitted))):
        path[frame] = state
        state -= int(steps[frame, state])
    return best, states[path]


def _fitted(activations: Logs, phones: Index) -> OutputLayer:
    """The layer with the least cross-entropy of the phones and the prior's loss."""
    start = anybodys_layer()
    scale = np.sqrt((activations**2).mean(axis=0) + 1e-6)
    inputs = activations / scale
    base, wanted = start.logits(activations), np.eye(GAP + 1, dtype=np.float32)[phones]
    weights, bias = np.zeros_like(start.weights), np.zeros_like(start.bias)
    weights_step, bias_step = np.zeros_like(weights), np.zeros_like(bias)
    rate = RATE / np.sqrt(len(weights))  # a weight's gradient grows with the number of inputs
    for _ in range(STEPS):
        logits = base + inputs @ weights + bias
        likely = np.exp(logits - logits.max(axis=1, keepdims=True))
        error = (likely / likely.sum(axis=1, keepdims=True) - wanted) / len(inputs)
        weights_step = MOMENTUM * weights_step - rate * (inputs.T @ error + PRIOR * weights)
        bias_step = MOMENTUM * bias_step - RATE * (error.sum(axis=0) + PRIOR * bias)
        weights, bias = weights + weights_step, bias + bias_step
    moved = start.weights + weights / scale[:, None]
    return OutputLayer(np.asarray(moved, np.float32), np.asarray(start.bias + bias, np.float32))
