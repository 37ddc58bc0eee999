"""Ears that hear the keyword, too: they report when to stand still, to go on and to stay stopped."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence

import numpy as np

from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from hvcpd.recognition.events import Ears, EarsAround, Event, Garbled, Recognised
from hvcpd.recognition.fitted import logistic, logit
from hvcpd.recognition.frontend import HOP_SAMPLES, N_BANDS, energies_of
from hvcpd.recognition.keyword.belief import CERTAIN, FAIR, Belief, Residual, Verdict, may_open
from hvcpd.recognition.keyword.net import (
    LOOKS,
    POSSIBLE,
    KeywordNet,
    KeywordSpotter,
    Probabilities,
    Word,
    second_highest,
)
from hvcpd.recognition.stream import CHUNK_FRAMES, CHUNK_SAMPLES, Chunk, History

CALL = "stop"
LAST_WORD = 4 * SAMPLE_RATE_HZ // 5
"""Samples (0.8 s) before the end of a sentence from which on its last word is detected."""
LEAST_EXPLAINED = 0.1
"""Of a sentence's power. From one of which less is known nothing follows."""
AFTER = 3 * SAMPLE_RATE_HZ // 10
"""Samples (0.3 s) after the end of a word within which the net detects it."""
AFTER_CALL = 3 * SAMPLE_RATE_HZ // 4
"""Samples (0.75 s) after the end of a word within which the net knows whether it was a call."""
SPANS_KEPT = 32
"""Words of half a minute, if they came one after the other: a sentence is reported within 13 s of its beginning."""
BEFORE = 3 * SAMPLE_RATE_HZ // 2
"""The net starts this long (1.5 s) before the word: its receptive field."""
NOISE_POWER = 0.1
"""Of the noise with which an uncertain word is heard again, relative to the word's mean power (10 dB)."""
CHECKED_BEFORE_S = 1.6
"""Sound before a word's end by which a call is checked: the word, a name before it, and what is or is not said before
that."""
TWICE = 0.71
"""Least probability that is left of a certain call where the check objects: two of them are certain, so that nobody
calls in vain."""

USUAL_GAIN = 25.0
"""Gain of a robot's sentence (`Ears.gain`) up to which a call over it is likely; sentences alone have 25 to 45."""
NATS_A_GAIN = 0.04
"""What each unit beyond that takes from the log odds of the word, nats (docs/decisions/keyword.md)."""

Check = Callable[[Samples], float]
"""What another listener takes from the log odds of a call, nats, by the sound from CHECKED_BEFORE_S before the word's
end on."""


class RecentSound:
    """The last seconds of sound, in which the net can listen again: without a sentence, or with noise."""

    def __init__(self, net: KeywordNet, history: History) -> None:
        """`net`: its own instance, because it starts again each time. `history`: the sound of the chunks."""
        self._net = net
        self._history = history
        self._begin = self._end = 0
        """The sound of all chunks from one sample up to another one was heard, and not the robot's own voice."""

    def hear(self, chunk: Chunk) -> None:
        """Take the next frames."""
        first = chunk.first_frame * HOP_SAMPLES
        if first != self._end:
            self._begin = first
        self._end = first + len(chunk.energies) * HOP_SAMPLES

    def since(self, start: int) -> Samples | None:
        """The sound from sample `start` on; None if that is not kept."""
        return self._history.between(start, self._end) if start >= self._begin else None

    def without(self, sentence: Recognised, start: int, end: int) -> Residual | None:
        """What is left between samples `start` and `end` without that sentence; None if the sentence's samples are
        unknown, or no longer kept.

        A robot's sentence may partly mask a call, and a sentence and other talk together may sound like a call that
        nobody made. Without the sentence the call stands alone (as radio receivers cancel the stronger signal: P. Patel
        & J. Holtzman, "Analysis of a simple successive interference cancellation scheme", IEEE JSAC 12(5), 1994).
        """
        if sentence.received is None or (around := self._around(start, end)) is None:
            return None
        first, heard = around
        alone = sentence.received.between(first, len(heard))
        told = slice(max(sentence.start_sample - first, 0), max(sentence.end_sample - first, 0))
        word = slice(start - first, end - first)
        share = _share_over(heard, heard - alone, word, told)
        if share <= 0.0:
            return Residual(0.0, 0.0, 0.0)
        left, like = (self._listen(sound, word.start, word.stop) for sound in (heard - alone, alone))
        return Residual(max(left), share, max(like)) if left is not None and like is not None else None

    def with_noise(self, start: int, end: int) -> Probabilities | None:
        """The highest probabilities of the word, and of a call, between two samples, with white noise NOISE_POWER below
        the word; None if the sound is no longer kept.

        What the net takes for the word by chance, in a voice of which it has learned nothing, changes with a little
        noise; the mean of its answers is surer than each (as in test-time augmentation: G. Wang et al., "Aleatoric
        uncertainty estimation with test-time augmentation", Neurocomputing 338, 2019).
        """
        if (around := self._around(start, end)) is None:
            return None
        first, heard = around
        power = NOISE_POWER * np.mean(np.square(heard[start - first : end - first]))
        return self._listen(heard + np.sqrt(power) * _white(len(heard)), start - first, end - first)

    def _around(self, start: int, end: int) -> tuple[int, Samples] | None:
        """The sound that tells whether a word was said between two samples, and its first sample."""
        first = max(start - BEFORE, self._begin, self._history.begin)
        sound = self.since(first) if first <= start else None
        return (first, sound[: end + AFTER_CALL - first]) if sound is not None else None

    def _listen(self, sound: Samples, start: int, end: int) -> Probabilities | None:
        energies = energies_of(sound)
        chunks = energies[: len(energies) // CHUNK_FRAMES * CHUNK_FRAMES].reshape(-1, CHUNK_FRAMES, N_BANDS)
        self._net.reset()
        probabilities = [self._net.hear(chunk) for chunk in chunks][start // CHUNK_SAMPLES :]
        in_word = (end + AFTER - start) // CHUNK_SAMPLES
        word = _highest([each.word for each in probabilities[:in_word]])
        call = _highest([each.call for each in probabilities])
        return Probabilities(word, call) if word is not None and call is not None else None


def _share_over(heard: Samples, rest: Samples, word: slice, told: slice) -> float:
    """The share of `rest` at a word, which is what is left of `heard` without a sentence, that this sentence does not
    leave beside the word, 0 to 1. A poorly known one leaves itself everywhere, and what sounds like the word."""
    before, after = slice(told.start, min(word.start, told.stop)), slice(max(word.stop, told.start), told.stop)
    beside = _explained(heard, rest, before, after)
    if beside < LEAST_EXPLAINED:
        return 1.0
    there = _explained(heard, rest, word)
    return (beside - there) / (1.0 - there) if there < beside else 0.0


def _explained(heard: Samples, rest: Samples, *where: slice) -> float:
    """The share of the power of `heard` there that is not in `rest`; 0 where there is no sound."""
    total, left = (
        sum(float(np.sum(np.square(sound[each], dtype=np.float64))) for each in where) for sound in (heard, rest)
    )
    return 1.0 - left / total if total > 0.0 else 0.0


def _white(n: int) -> Samples:
    """White noise of power 1, the same each time: a hash of each sample's number (A. Appleby, MurmurHash3, 2011)."""
    hashed = np.arange(n, dtype=np.uint32)
    for shift, factor in ((16, 0x85EBCA6B), (13, 0xC2B2AE35), (16, 1)):
        hashed ^= hashed >> shift
        hashed *= np.uint32(factor)
    return np.asarray(hashed.view(np.int32) * np.float32(np.sqrt(3.0) / 2.0**31), np.float32)


def _highest(probabilities: Sequence[float]) -> float | None:
    """The highest probability that counts; None if there are too few."""
    windows = (probabilities[k : k + LOOKS] for k in range(len(probabilities) - LOOKS + 1))
    return max(map(second_highest, windows), default=None)


class KeywordEars(EarsAround):
    """`Ears` around others that also hear the keyword, in any voice and over any other sound."""

    def __init__(self, ears: Ears, net: KeywordNet, recent: RecentSound, check: Check) -> None:
        super().__init__(ears)
        self._check = check
        self._spotter = KeywordSpotter(net)
        self._recent = recent
        self._belief = Belief(recent.without)
        self._word: Word | None = None
        """The last word, until it is heard again with noise."""
        self._excess = 0.0
        """How much better than usual a robot's sentence explained that word when it was first heard."""
        self._span = (0, 0)
        self._spans: deque[tuple[int, int]] = deque(maxlen=SPANS_KEPT)
        """The words that the net has detected lately."""

    def push(self, samples: Samples, masked: bool = False) -> list[Event]:
        """As `Recogniser.push`, chunk by chunk: so a long block gives the same events as short ones."""
        parts = [samples[at : at + CHUNK_SAMPLES] for at in range(0, max(len(samples), 1), CHUNK_SAMPLES)]
        events = [event for part in parts for event in self._with_calls(self._ears.push(part, masked))]
        return events + self._interrupted() if masked else events

    def lost(self, n_samples: int) -> list[Event]:
        """As `Recogniser.lost`."""
        return self._with_calls(self._ears.lost(n_samples)) + self._interrupted()

    def flush(self) -> list[Event]:
        """As `Recogniser.flush`."""
        return self._with_calls(self._ears.flush()) + self._interrupted()

    def _with_calls(self, events: list[Event]) -> list[Event]:
        """The events of the other ears, and what follows from them and from the frames."""
        events = [self._supported(event) for event in events]
        told = [each for event in events for each in self._found(event)]
        for chunk in self.first.chunks:
            told += self._hear(chunk)
        return events + told

    def _hear(self, chunk: Chunk) -> list[Event]:
        self._recent.hear(chunk)
        now = (chunk.first_frame + len(chunk.energies)) * HOP_SAMPLES
        told: list[Event] = []
        word = self._spotter.hear(chunk)
        if word is not None:
            if self._word is None or word.start_frame != self._word.start_frame:
                self._excess = max(self.first.gain - USUAL_GAIN, 0.0) if self.first.ending != CALL else 0.0
            self._word = word
            self._span = (word.start_frame * HOP_SAMPLES, word.end_frame * HOP_SAMPLES)
            self._spans.append(self._span)
            told += self._believe(word.call, now)
        if self._word is not None and now >= self._span[1] + AFTER_CALL:
            told += self._hear_again(self._word, now)
            self._word = None
        return told + self._tell(self._belief.at(now, self.first.since))

    def _hear_again(self, word: Word, now: int) -> list[Event]:
        """Once all of it is there, listen with noise for a word that is still undecided."""
        again = self._recent.with_noise(*self._span) if self._belief.doubts(self._span[0]) else None
        return self._believe(logistic((logit(word.call) + logit(again.call)) / 2.0), now) if again is not None else []

    def _believe(self, call: float, now: int) -> list[Event]:
        """What follows from that probability that the last word was a call; checked if it counts, by itself or with
        another one."""
        if call >= FAIR:
            sound = self._recent.since(self._span[1] - round(CHECKED_BEFORE_S * SAMPLE_RATE_HZ))
            nats = self._check(sound) if sound is not None else 0.0
            checked = logistic(logit(call) - nats)
            call = max(checked, TWICE) if checked < CERTAIN <= call else checked
        awaited = bool(self.first.ending) or may_open(self.first.since, self._span[0])
        return self._tell(self._belief.word(*self._span, call, now, awaited, self._is_followed()))

    def _is_followed(self) -> bool:
        """Whether a robot's sentence explains the last word better than a call over it would."""
        word = self._word
        return word is not None and logit(word.probability) - NATS_A_GAIN * self._excess < logit(POSSIBLE)

    def _interrupted(self) -> list[Event]:
        """Drop the current word: sound was lost."""
        return self._tell(self._belief.unclear())

    def _supported(self, event: Event) -> Event:
        """The event, or garbled speech if a sentence ends with a call that the net did not hear: a search that knows
        little but the phrasebook finds it in "staff" and "step", too."""
        if not isinstance(event, Recognised) or event.words[-1] != CALL:
            return event
        begin, end = event.end_sample - LAST_WORD, event.end_sample + AFTER
        heard = any(start < end and begin < last for start, last in self._spans)
        return event if heard else Garbled(event.start_sample, event.end_sample)

    def _found(self, event: Event) -> list[Event]:
        if isinstance(event, Recognised):
            return self._tell(self._belief.sentence(event))
        return self._interrupted()

    def _tell(self, verdict: Verdict) -> list[Event]:
        """The verdict as an event, with the last position of the word."""
        return [verdict(*self._span)] if verdict is not None else []
