"""Ears that hear the keyword, too: they report when to stand still, to go on and to stay stopped."""

from __future__ import annotations

from collections import deque

from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from hvcpd.recognition.around import EarsAround
from hvcpd.recognition.events import Ears, Event, Garbled, Held, Recognised, Released, Source, Urgent
from hvcpd.recognition.frontend import HOP_SAMPLES
from hvcpd.recognition.keyword.belief import Belief, BeliefSettings, Verdict
from hvcpd.recognition.keyword.remainder import Remainder
from hvcpd.recognition.keyword.words import KeywordSpotter, Net
from hvcpd.recognition.stream import CHUNK_SAMPLES, Chunk

TEXTS = frozenset(("stop", "stopped"))
"""Words of which one in a sentence accounts for the detection."""
CALL = "stop"
LAST_WORD, LATE = 4 * SAMPLE_RATE_HZ // 5, 3 * SAMPLE_RATE_HZ // 10
"""Samples before (0.8 s) and after (0.3 s) the end of a sentence within which its last word is detected."""
SPANS_KEPT = 32
"""Words of half a minute, if they came one after the other: a sentence is reported within 13 s of its beginning."""


class KeywordEars(EarsAround):
    """`Ears` around others that also hear the keyword, in any voice and over any other sound."""

    def __init__(
        self, ears: Ears, net: Net, remainder: Remainder | None = None, settings: BeliefSettings | None = None
    ) -> None:
        super().__init__(ears)
        self._spotter = KeywordSpotter(net)
        self._remainder = remainder
        self._belief = Belief(TEXTS, settings, remainder.probabilities if remainder is not None else None)
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

    def succeed(self, predecessor: KeywordEars) -> None:
        """Continue from `predecessor`, with what it knows of the keyword."""
        self._ears.succeed(predecessor._ears)
        self._spotter, self._remainder = predecessor._spotter, predecessor._remainder
        self._belief, self._span, self._spans = predecessor._belief, predecessor._span, predecessor._spans

    def _with_calls(self, events: list[Event]) -> list[Event]:
        """The events of the other ears, and what follows from them and from the frames."""
        events = [self._supported(event) for event in events]
        told = [each for event in events for each in self._found(event)]
        for chunk in self._ears.chunks:
            told += self._hear(chunk)
        return events + told

    def _hear(self, chunk: Chunk) -> list[Event]:
        if self._remainder is not None:
            self._remainder.hear(chunk)
        now = (chunk.first_frame + len(chunk.energies)) * HOP_SAMPLES
        told: list[Event] = []
        word = self._spotter.hear(chunk)
        if word is not None:
            self._span = (word.start_frame * HOP_SAMPLES, word.end_frame * HOP_SAMPLES)
            self._spans.append(self._span)
            told += self._tell(self._belief.word(*self._span, word.call, now, self._ears.ends))
        return told + self._tell(self._belief.at(now))

    def _interrupted(self) -> list[Event]:
        """Drop the current word: sound was lost."""
        return self._tell(self._belief.unclear())

    def _supported(self, event: Event) -> Event:
        """The event, or garbled speech if templates alone found a call that the net did not hear."""
        if not isinstance(event, Recognised) or event.source is not Source.TEMPLATES or event.words[-1] != CALL:
            return event
        begin, end = event.end_sample - LAST_WORD, event.end_sample + LATE
        heard = any(start < end and begin < last for start, last in self._spans)
        return event if heard else Garbled(event.start_sample, event.end_sample)

    def _found(self, event: Event) -> list[Event]:
        if isinstance(event, Recognised):
            return self._tell(self._belief.sentence(event))
        return self._interrupted()

    def _tell(self, verdict: Verdict) -> list[Event]:
        """The verdict as an event, with the last position of the word."""
        match verdict:
            case Verdict.HELD:
                return [Held(*self._span)]
            case Verdict.RELEASED:
                return [Released(*self._span)]
            case Verdict.SAID:
                return [Urgent(*self._span)]
            case Verdict.UNCHANGED:
                return []
