"""Phone nets, small and speaker-independent, for English, and the search for sentences in their posteriors.

The nets are convolutional, over mel bands, and were trained by connectionist temporal classification (CTC: A. Graves,
S. Fernandez, F. Gomez & J. Schmidhuber, ICML 2006) on synthetic speech and people's words (`benchmarks/phones`).

The best sentence of a word network is found by a Viterbi search over the CTC topology: each phone lasts for a frame or
more, and between two phones, and in pauses, there are blank frames. The forward algorithm over the same paths gives the
likelihood of all sentences together.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hvcpd.language.graph import Arc, WordGraph, one_of
from hvcpd.people.bands import Bands, LogBands, estimated_noise, level_gain, log_bands
from hvcpd.ports import Samples
from hvcpd.recognition.arrays import first_occurrences, mapped_arrays
from hvcpd.recognition.frontend import HOP_SAMPLES
from hvcpd.recognition.stages import Segment

LogPosteriors = NDArray[np.float32]
"""Log probabilities of each of PHONES and, last, of the blank, shape (frames, len(PHONES) + 1)."""

PHONES = tuple(
    "AA AE AH AO AW AY B CH D DH EH ER EY F G HH IH IY JH K L M N NG OW OY P R S SH T TH UH UW V W Y Z ZH".split()
)
"""ARPAbet without stress, in the order of the nets' outputs; the blank follows."""

LOUD_NATS = 5.8
"""Range (25 dB) below the loudest frames within which frames count for the mean."""


def mean_normalised(logs: Bands) -> LogBands:
    """Log band energies, shape (frames, N_BANDS), minus the mean of the loud frames (cepstral mean normalisation,
    before the cosine transform)."""
    if not len(logs):
        return np.zeros(logs.shape, np.float32)
    level = logs.max(axis=1)
    loud = np.sort(level)[-max(len(level) // 8, 1) :].mean()
    return np.asarray(logs - logs[level > loud - LOUD_NATS].mean(axis=0), np.float32)


def inputs_of(speech: Samples, around: Samples, lead: int) -> LogBands:
    """The nets' inputs, shape (frames, N_BANDS), for `speech`, shape (n,); the noise is estimated from the sound
    `around` it, shape (m,), in which speech was noticed after `lead` samples."""
    gain = level_gain(speech)
    return mean_normalised(log_bands(gain * speech, estimated_noise(gain * around, lead)))


def net_inputs(segment: Segment) -> LogBands:
    """`inputs_of` the speech in a segment."""
    return inputs_of(segment.speech, segment.sound, segment.lead)


ANY_PHONE = "*"
"""In a pronunciation: whichever phone is heard."""
LEAST_POSTERIOR = 1e-6
"""Of ANY_PHONE in a frame, so that its logarithm is finite."""
ANY_PHONE_COST = 1.8
"""Of each, nats (docs/decisions/phones.md)."""

FRAME_SAMPLES = 2 * HOP_SAMPLES
"""Samples (20 ms) of a frame of the nets' outputs: two of the front end's."""
KERNEL_SIZES = (5, 3)
"""Kernel sizes of the first two layers, in frames; the second halves the rate."""
BLANK_COST = 1.5
"""Cost of a blank, natural logarithm: nets trained by CTC are surer of blanks than of phones, so that short words would
be left out. Of 195 sentences of other synthetic voices than those trained on 191 are right, with 0.5 189."""


@dataclass(frozen=True, eq=False)
class OutputLayer:
    """The last layer: `weights`, shape (width, len(PHONES) + 1), and `bias`."""

    weights: LogBands
    bias: LogBands

    def logits(self, activations: LogBands) -> LogBands:
        """Before the softmax, shape (frames, len(PHONES) + 1)."""
        return np.asarray(activations @ self.weights + self.bias, np.float32)

    def log_posteriors(self, activations: LogBands) -> LogPosteriors:
        """Log posteriors by the activations of the last hidden layer, shape (frames, width), with BLANK_COST."""
        logits = self.logits(activations)
        logits[:, -1] -= BLANK_COST
        logits -= logits.max(axis=1, keepdims=True)
        return np.asarray(logits - np.log(np.exp(logits).sum(axis=1, keepdims=True)), np.float32)


@dataclass(frozen=True, eq=False)
class PhoneNet:
    """Two convolutions, then residual layers (K. He et al., CVPR 2016) of one matrix each: a third of the units are
    taken from earlier, a third from later frames, at the distances `shifts` (temporal shift: J. Lin, C. Gan & S. Han,
    ICCV 2019).

    `arrays`: as `benchmarks.phones.train` wrote them: of each layer bytes, "weights0", shape (inputs, outputs), and of
    each output "scale0" and "bias0", ... As numbers of four bytes the weights of a net would take 7 MB of memory.
    `layer`: the speaker-independent output layer.
    """

    arrays: Mapping[str, NDArray[Any]]
    shifts: tuple[int, ...]
    layer: OutputLayer

    @classmethod
    def of(cls, file: Mapping[str, NDArray[Any]]) -> PhoneNet:
        """The net of a file."""
        weights = file["weights_out"] * file["scale_out"]
        return cls(file, tuple(map(int, file["apart"])), OutputLayer(weights, file["bias_out"]))

    def log_posteriors(self, logs: LogBands) -> LogPosteriors:
        """Log posteriors for `mean_normalised` logarithms, shape (frames, N_BANDS): half as many frames, rounded up."""
        return self.layer.log_posteriors(self.activations(logs))

    def activations(self, logs: LogBands) -> LogBands:
        """Activations of the last hidden layer, likewise, shape (frames, its width)."""
        sound = logs
        for number, size in enumerate(KERNEL_SIZES):
            sound = np.maximum(self._sums(number, _with_context(sound, size)[:: number + 1]), 0.0)
        for number, shift in enumerate(self.shifts, len(KERNEL_SIZES)):
            sound = np.maximum(sound + self._sums(number, _shifted(sound, shift)), 0.0)
        return sound

    def _sums(self, number: int, seen: LogBands) -> LogBands:
        """A layer's weighted sums of what it sees, shape (frames, inputs)."""
        arrays = self.arrays
        sums = seen @ arrays[f"weights{number}"].astype(np.float32)
        return np.asarray(sums * arrays[f"scale{number}"] + arrays[f"bias{number}"], np.float32)


@cache
def near_net() -> PhoneNet:
    """The net with a context of 0.35 s to either side, which knows sounds alone: best at rejecting words."""
    return PhoneNet.of(mapped_arrays(Path(__file__).with_name("phones_near.npz")))


@cache
def far_net() -> PhoneNet:
    """The net with a context of 1.2 s to either side, which knows words, too: the better one by itself."""
    return PhoneNet.of(mapped_arrays(Path(__file__).with_name("phones_far.npz")))


def nets() -> tuple[PhoneNet, PhoneNet]:
    """Both nets, whose errors differ (docs/decisions/phones.md)."""
    return near_net(), far_net()


def _with_context(sound: LogBands, size: int) -> LogBands:
    """Each frame with its neighbours, `size` in all, zeros beyond the ends: shape (frames, size * units)."""
    padded = np.pad(sound, ((size // 2, size // 2), (0, 0)))
    return np.concatenate([padded[k : k + len(sound)] for k in range(size)], axis=1)


def _shifted(sound: LogBands, shift: int) -> LogBands:
    """The first third of the units as they were `shift` frames earlier, the last third as they will be."""
    n, third = len(sound), sound.shape[1] // 3
    padded = np.pad(sound, ((shift, shift), (0, 0)))
    return np.concatenate((padded[:n, :third], sound[:, third : 2 * third], padded[2 * shift :, 2 * third :]), axis=1)


def _before(values: NDArray[Any]) -> NDArray[Any]:
    """For each value the one before it; for the first, itself. `numpy.roll` takes three to five times as long."""
    return np.concatenate((values[:1], values[:-1]))


Scores = NDArray[np.float32]
Index = NDArray[np.int64]
Pronounce = Callable[[str], Sequence[Sequence[str]]]

_OUTPUTS = (*PHONES, ANY_PHONE)
"""The columns that a search reads; then that of ANY_PHONE in a frame after the same phone's, and the blank."""
_SAME = len(_OUTPUTS)


def _with_any_phone(log_posteriors: LogPosteriors) -> LogPosteriors:
    """With the columns of ANY_PHONE ahead of the blank's: shape (frames, len(PHONES) + 3). It is one phone, whichever;
    one that could change from frame to frame would be any speech, however long."""
    phones = np.exp(log_posteriors[:, :-1])
    any_phone = np.maximum(phones.sum(axis=1, keepdims=True), LEAST_POSTERIOR)
    same = np.maximum((phones * _before(phones)).sum(axis=1, keepdims=True) / _before(any_phone), LEAST_POSTERIOR)
    return np.concatenate((log_posteriors[:, :-1], np.log(any_phone), np.log(same), log_posteriors[:, -1:]), axis=1)


LOG_ZERO = np.float32(-1e9)


@dataclass(frozen=True)
class CtcSentence:
    """A sentence; of each word the first frame and the frame after its last; and the `loss`, 0 or more: the logarithm
    of the probability of the best phone sequence over that of the sentence."""

    words: tuple[str, ...]
    spans: tuple[tuple[int, int], ...]
    loss: float


class CtcSearch:
    """Viterbi search and forward algorithm over a word network, its words' phones side by side in one vector."""

    def __init__(self, graph: WordGraph, pronounce: Pronounce, costs: Mapping[str, float] | None = None) -> None:
        """`pronounce`: the pronunciations of a word, in PHONES and ANY_PHONE; `costs`: those of some words, nats."""
        known = {
            word: sorted({tuple(map(_OUTPUTS.index, said)) for said in pronounce(word) if said}) for word in graph.words
        }
        ways = sorted(((arc, said) for arc in graph.arcs for said in known[arc.word]), key=lambda way: way[0].target)
        self._graph = graph
        self._pronounce = pronounce
        self._words = [arc.word for arc, _ in ways]
        self._source: Index = np.array([arc.source for arc, _ in ways], np.int64)
        self._target: Index = np.array([arc.target for arc, _ in ways], np.int64)
        lengths = np.array([len(said) for _, said in ways], np.int64)
        self._last: Index = np.cumsum(lengths) - 1
        self._first: Index = self._last - lengths + 1
        self._phones: Index = np.array([phone for _, said in ways for phone in said], np.int64)
        any_phone = _OUTPUTS.index(ANY_PHONE)
        self._stays: Index = np.where(self._phones == any_phone, _SAME, self._phones)
        same = (self._phones[1:] == self._phones[:-1]) & (self._phones[1:] != any_phone)
        self._repeated: Index = 1 + np.flatnonzero(same)
        self._begins: Index = first_occurrences(self._target)
        self._nodes: Index = self._target[self._begins]
        self._word_costs = costs or {}
        total = [self._word_costs.get(arc.word, 0.0) + ANY_PHONE_COST * said.count(any_phone) for arc, said in ways]
        self._costs: Scores = np.array(total, np.float32)

    def best(self, log_posteriors: LogPosteriors) -> CtcSentence | None:
        """The likeliest sentence, by its best path over all frames; None if they are too few for any."""
        since, scores, began, rest = self._forward(log_posteriors)
        finals = sorted(self._graph.finals)
        node = finals[int(rest[finals].argmax())]
        if rest[node] <= LOG_ZERO / 2 or not len(log_posteriors):
            return None
        loss = float(log_posteriors.max(axis=1).sum()) - float(rest[node])
        words: list[str] = []
        spans: list[tuple[int, int]] = []
        frame = int(since[-1, node])
        while frame >= 0:
            first, after = np.searchsorted(self._target, (node, node + 1))
            way = int(first + scores[frame, first:after].argmax())
            begin, node = int(began[frame, way]), int(self._source[way])
            words.append(self._words[way])
            spans.append((begin, frame + 1))
            frame = int(since[begin - 1, node]) if begin > 0 else -1
        return CtcSentence(tuple(words[::-1]), tuple(spans[::-1]), loss)

    def fit(self, log_posteriors: LogPosteriors, words: Sequence[str]) -> CtcSentence | None:
        """The best path of one sentence; None if there are too few frames for it."""
        return self._of(words).best(log_posteriors)

    def log_likelihood(
        self, log_posteriors: LogPosteriors, without: str | None = None, beginnings: bool = False
    ) -> float:
        """Log likelihood of all sentences together, summed over all their paths; `without` those that have a word; with
        `beginnings`, also of their beginnings. Minus infinity if there are too few frames for any."""
        phone = gap = np.zeros(len(self._phones))
        rest = np.zeros(self._graph.n_nodes)
        rest[self._graph.start] = 1.0
        weight = np.exp(-self._costs) * [word != without for word in self._words]
        scale = 0.0
        for row in np.exp(_with_any_phone(log_posteriors).astype(np.float64)):
            entered = _before(phone)
            entered[self._repeated] = 0.0
            entered += _before(gap)
            entered[self._first] = weight * rest[self._source]
            gap = (gap + phone) * row[-1]
            phone = phone * row[self._stays] + entered * row[self._phones]
            rest = rest * row[-1]
            rest[self._nodes] += np.add.reduceat(phone[self._last], self._begins)
            most = max(float(phone.max()), float(gap.max()), float(rest.max()))
            phone, gap, rest = phone / most, gap / most, rest / most
            scale += math.log(most)
        whole = float((rest if beginnings else rest[sorted(self._graph.finals)]).sum())
        return scale + math.log(whole) if whole > 0.0 and len(log_posteriors) else -math.inf

    def log_likelihood_of(self, log_posteriors: LogPosteriors, *sentences: Sequence[str]) -> float:
        """`log_likelihood` of these sentences alone."""
        return self._of(*sentences).log_likelihood(log_posteriors)

    def _of(self, *sentences: Sequence[str]) -> CtcSearch:
        return CtcSearch(one_of(sentences), self._pronounce, self._word_costs)

    def instead_of(self, word: str) -> frozenset[str]:
        """The words that may be said wherever this one may, it among them."""
        places = {(a.source, a.target) for a in self._graph.arcs if a.word == word}
        return frozenset(a.word for a in self._graph.arcs if (a.source, a.target) in places)

    def n_phones(self, word: str) -> int:
        """Number of phones in the shortest pronunciation of a word."""
        return min(len(said) for said in self._pronounce(word) if said)

    def _forward(self, log_posteriors: LogPosteriors) -> tuple[Index, Scores, Index, Scores]:
        """The back pointers of the Viterbi search, and the score of the best path to each node after the last frame.

        `since[t, n]`: the frame at which the best path that is at node n after frame t came there, or -1; `scores[t,
        w]`: the score of the word w that ends in frame t, and `began[t, w]` the frame at which it began.
        """
        n, n_nodes = len(log_posteriors), self._graph.n_nodes
        since, scores = np.full((n, n_nodes), -1), np.empty((n, len(self._words)), np.float32)
        began = np.empty(scores.shape, np.int64)
        rest = np.full(n_nodes, LOG_ZERO, np.float32)
        rest[self._graph.start] = 0.0
        came = np.full(n_nodes, -1)
        phone = gap = np.full(len(self._phones), LOG_ZERO, np.float32)
        phone_began = gap_began = np.zeros(len(phone), np.int64)
        for frame, row in enumerate(_with_any_phone(log_posteriors)):
            entered, entered_began = self._entered(phone, gap, phone_began, gap_began)
            entered[self._first], entered_began[self._first] = rest[self._source] - self._costs, frame
            gap_began = np.where(phone > gap, phone_began, gap_began)
            gap = np.maximum(phone, gap) + row[-1]
            entered, phone = entered + row[self._phones], phone + row[self._stays]
            phone_began = np.where(entered > phone, entered_began, phone_began)
            phone = np.maximum(entered, phone)
            rest = rest + row[-1]
            scores[frame], began[frame] = phone[self._last], phone_began[self._last]
            best = np.maximum.reduceat(scores[frame], self._begins)
            arrived = best > rest[self._nodes]
            rest[self._nodes[arrived]], came[self._nodes[arrived]] = best[arrived], frame
            since[frame] = came
        return since, scores, began, rest

    def _entered(self, phone: Scores, gap: Scores, phone_began: Index, gap_began: Index) -> tuple[Scores, Index]:
        """Scores of entering each phone from the phone or from the blank before it."""
        straight = _before(phone)
        straight[self._repeated] = LOG_ZERO  # a phone said twice has a gap within
        around = _before(gap)
        began = np.where(around > straight, _before(gap_began), _before(phone_began))
        return np.maximum(straight, around), began


def word_loop(words: Iterable[str], pronounce: Pronounce, word_cost: float) -> CtcSearch:
    """A loop of these words, in any number and order; those that sound the same count once."""
    sounds = sorted({" ".join(said) for word in words for said in pronounce(word) if said})
    loop = WordGraph(1, tuple(Arc(0, 0, said) for said in sounds), 0, frozenset((0,)), frozenset())
    return CtcSearch(loop, lambda said: [said.split()], dict.fromkeys(sounds, word_cost))
