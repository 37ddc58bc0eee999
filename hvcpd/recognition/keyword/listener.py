"""Ears that hear the keyword, too: they report when to stand still, to go on and to stay stopped."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence

import numpy as np

from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from hvcpd.recognition.around import EarsAround
from hvcpd.recognition.events import Ears, Event, Garbled, Recognised, Source
from hvcpd.recognition.fitted import logistic, logit
from hvcpd.recognition.frontend import HOP_SAMPLES, N_BANDS, energies_of
from hvcpd.recognition.keyword.belief import CERTAIN, FAIR, Belief, Verdict
from hvcpd.recognition.keyword.net import LOOKS, KeywordNet, KeywordSpotter, Probabilities, Word, second_highest
from hvcpd.recognition.stream import CHUNK_FRAMES, CHUNK_SAMPLES, Chunk

CALL = "stop"
LAST_WORD = 4 * SAMPLE_RATE_HZ // 5
"""Samples (0.8 s) before the end of a sentence from which on its last word is detected."""
AFTER = 3 * SAMPLE_RATE_HZ // 10
"""Samples (0.3 s) after the end of a word within which the net detects it."""
AFTER_CALL = 3 * SAMPLE_RATE_HZ // 4
"""Samples (0.75 s) after the end of a word within which the net knows whether it was a call."""
SPANS_KEPT = 32
"""Words of half a minute, if they came one after the other: a sentence is reported within 13 s of its beginning."""
KEPT_CHUNKS = 300
"""12 s of sound are kept, 0.8 MB: a long sentence, the rest after it, and the sound before it."""
BEFORE = 3 * SAMPLE_RATE_HZ // 2
"""The net starts this long (1.5 s) before the word: its receptive field."""
CHECKED_BEFORE_S = 1.6
"""Sound before a word's end by which a call is checked: the word, a name before it, and what is or is not said before
that."""
TWICE = 0.71
"""Least probability that is left of a certain call where the check objects: two of them are certain, so that nobody
calls in vain."""

Check = Callable[[Samples], float]
"""What another listener takes from the log odds of a call, nats, by the sound from CHECKED_BEFORE_S before the word's
end on."""


class Residual:
    """The sound, and the keyword in it once a sentence with known samples is subtracted.

    A robot's sentence may partly mask a call, and a sentence and other talk together may sound like a call that nobody
    made. Without the sentence the call stands alone (as radio receivers cancel the stronger signal: P. Patel & J.
    Holtzman, "Analysis of a simple successive interference cancellation scheme", IEEE JSAC 12(5), 1994).
    """

    def __init__(self, net: KeywordNet) -> None:
        """`net`: its own instance, because it starts again each time."""
        self._net = net
        self._kept = deque[Samples](maxlen=KEPT_CHUNKS)
        self._end = 0

    def hear(self, chunk: Chunk) -> None:
        """Push the next samples."""
        first = chunk.first_frame * HOP_SAMPLES
        if first != self._end:
            self._kept.clear()
        self._kept.append(chunk.samples)
        self._end = first + len(chunk.samples)

    def since(self, start: int) -> Samples | None:
        """The sound from sample `start` on; None if that is not kept."""
        first = start - (self._end - sum(map(len, self._kept)))
        return np.concatenate(self._kept)[first:] if first >= 0 else None

    def probabilities(self, sentence: Recognised, start: int, end: int) -> Probabilities | None:
        """The highest probabilities of the word, and of a call, between samples `start` and `end` without that
        sentence; None if the sentence's samples are unknown, or no longer kept."""
        oldest = self._end - sum(map(len, self._kept))
        first = max(start - BEFORE, oldest)
        if sentence.received is None or first > start:
            return None
        heard = np.concatenate(self._kept)[first - oldest : end + AFTER_CALL - oldest]
        energies = energies_of(heard - sentence.received.between(first, len(heard)))
        chunks = energies[: len(energies) // CHUNK_FRAMES * CHUNK_FRAMES].reshape(-1, CHUNK_FRAMES, N_BANDS)
        self._net.reset()
        probabilities = [self._net.hear(chunk) for chunk in chunks][(start - first) // CHUNK_SAMPLES :]
        in_word = (end + AFTER - start) // CHUNK_SAMPLES
        word = _highest([each.word for each in probabilities[:in_word]])
        call = _highest([each.call for each in probabilities])
        return Probabilities(word, call) if word is not None and call is not None else None


def _highest(probabilities: Sequence[float]) -> float | None:
    """The highest probability that counts; None if there are too few."""
    windows = (probabilities[k : k + LOOKS] for k in range(len(probabilities) - LOOKS + 1))
    return max(map(second_highest, windows), default=None)


class KeywordEars(EarsAround):
    """`Ears` around others that also hear the keyword, in any voice and over any other sound."""

    def __init__(self, ears: Ears, net: KeywordNet, residual: Residual, check: Check) -> None:
        super().__init__(ears)
        self._check = check
        self._spotter = KeywordSpotter(net)
        self._residual = residual
        self._belief = Belief(residual.probabilities)
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
        for chunk in self._ears.chunks:
            told += self._hear(chunk)
        return events + told

    def _hear(self, chunk: Chunk) -> list[Event]:
        self._residual.hear(chunk)
        now = (chunk.first_frame + len(chunk.energies)) * HOP_SAMPLES
        told: list[Event] = []
        word = self._spotter.hear(chunk)
        if word is not None:
            self._span = (word.start_frame * HOP_SAMPLES, word.end_frame * HOP_SAMPLES)
            self._spans.append(self._span)
            told += self._tell(self._belief.word(*self._span, self._call(word), now, self._ears.ends))
        return told + self._tell(self._belief.at(now))

    def _call(self, word: Word) -> float:
        """The probability of a call, checked if it counts, by itself or with another one."""
        if word.call < FAIR:
            return word.call
        sound = self._residual.since(word.end_frame * HOP_SAMPLES - round(CHECKED_BEFORE_S * SAMPLE_RATE_HZ))
        nats = self._check(sound) if sound is not None else 0.0
        checked = logistic(logit(word.call) - nats)
        return max(checked, TWICE) if checked < CERTAIN <= word.call else checked

    def _interrupted(self) -> list[Event]:
        """Drop the current word: sound was lost."""
        return self._tell(self._belief.unclear())

    def _supported(self, event: Event) -> Event:
        """The event, or garbled speech if the search for robots found a call that the net did not hear. It hears robots
        better than people: of 50 people's calls in quiet it missed one that the phone net heard."""
        if not isinstance(event, Recognised) or event.source is Source.PEOPLE or event.words[-1] != CALL:
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
