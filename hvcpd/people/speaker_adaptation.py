"""Speaker adaptation of the phone net: sentences of a person whose words are certain, and an output layer from them.

The words are certain because the person was asked to say them, or because a robot read back what it had understood, and
the same person confirmed it.

The hidden layers stay as they are. The layer after them moves so that the phones of the known words become likelier
where a Viterbi alignment puts them (a linear output network: B. Li & K. C. Sim, "Comparison of discriminative input and
output transformations for speaker adaptation in the hybrid NN/HMM systems", Interspeech 2010). A Gaussian prior around
the layer as it was trained keeps phones that were not said where they are. So a few sentences help with all words.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from hvcpd.language.graph import graph_of
from hvcpd.language.messages import Confirmed, ToRobot, Utterance
from hvcpd.people.bands import logs_of_segment
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
    centred,
    phones_of,
)
from hvcpd.ports import SAMPLE_RATE_HZ
from hvcpd.recognition.events import Recognised
from hvcpd.recognition.second_pass import Segment

CONFIRMED_S = 20.0
"""Time after the sentence in which a confirmation refers to it: the robot has read it back by then."""


def spoken(segment: Segment, words: tuple[str, ...]) -> SpokenSentence:
    """A segment of sound in which these words were said, as the phone net hears it."""
    return SpokenSentence(words, centred(logs_of_segment(segment)))


@dataclass
class _Candidate:
    speaker: str
    at_s: float
    segment: Segment
    words: tuple[str, ...]
    read_back: bool = False


class ConfirmedSentences:
    """Takes what the robot says, second-pass results and recognised sentences, in order; returns what is confirmed."""

    def __init__(self, own_name: str) -> None:
        self._own_name = own_name.lower()
        self._found: tuple[Segment, Recognised] | None = None
        self._candidate: _Candidate | None = None

    def said(self, utterance: Utterance) -> None:
        """Take a sentence that the robot says: one to the speaker reads the speaker's sentence back."""
        to = utterance.addressee.name.lower() if isinstance(utterance.addressee, ToRobot) else ""
        if self._candidate is not None and to == self._candidate.speaker:
            self._candidate.read_back = True

    def found(self, segment: Segment, sentence: Recognised) -> None:
        """Take a second-pass result for a segment of sound."""
        self._found = (segment, sentence)

    def heard(self, utterance: Utterance, start_s: float, now: float) -> tuple[str, SpokenSentence] | None:
        """Take a recognised sentence that began at `start_s`; return the speaker's name and earlier sentence if it
        confirms one."""
        speaker = (utterance.speaker or "").lower()
        found, self._found = self._found, None
        candidate = self._candidate
        if not speaker or speaker == self._own_name:
            return None
        if candidate is not None and speaker == candidate.speaker:
            self._candidate = None
        if isinstance(utterance.statement, Confirmed):
            if candidate is None or candidate.speaker != speaker or not candidate.read_back:
                return None
            if now - candidate.at_s > CONFIRMED_S:
                return None
            return utterance.speaker or "", spoken(candidate.segment, candidate.words)
        if found is not None and not found[0].within_talk:
            segment, sentence = found
            if abs(sentence.start_sample / SAMPLE_RATE_HZ - start_s) < 0.001:
                self._candidate = _Candidate(speaker, now, segment, sentence.words)
        return None


GAP = len(PHONES)
"""The output for a frame of no phone."""
PRIOR = 0.03
"""Weight of the prior against the mean loss of a frame. Two of Kokoro's voices that calibrate, five sentences each,
right and sure of 40 others, with .1, .03 and .01: 22, 26 and 25 (17 without); 4 wrong each time (3 without)."""
STEPS, RATE, MOMENTUM = 200, 0.5, 0.9
"""Of gradient descent on a convex loss; 100 steps more change no sentence."""


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
        searches = (CtcSearch(graph_of(said), lambda phone: [(phone,)]) for said in pronounce(word) if said)
        ways = [way for search in searches if (way := search.best(log_posteriors[begin:end])) is not None]
        best = min(ways, key=lambda way: way.loss)
        for phone, (first, last) in zip(best.words, best.spans, strict=True):
            phones[begin + first : begin + last] = PHONES.index(phone)
    return phones


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
