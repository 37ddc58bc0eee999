"""Listens for the keyword beside the recogniser, and reports when to stand still, to go on and to stay stopped."""

from __future__ import annotations

from collections.abc import Sequence

from hvcpd.recognition.events import Event, Held, Recognised, Released, Urgent
from hvcpd.recognition.frontend import HOP_SAMPLES
from hvcpd.recognition.keyword.belief import Belief, BeliefSettings, Verdict
from hvcpd.recognition.keyword.net import Chances
from hvcpd.recognition.keyword.remainder import Remainder
from hvcpd.recognition.keyword.words import KeywordSpotter, Net
from hvcpd.recognition.paths import Coherent
from hvcpd.recognition.stream import Chunk

TEXTS = frozenset(("stop", "stopped"))
"""Words of which one in a sentence accounts for the detection."""


class KeywordListener:
    """Joins the net that hears the word with the decision about it; without a net it hears nothing."""

    def __init__(
        self, net: Net | None, remainder: Remainder | None = None, settings: BeliefSettings | None = None
    ) -> None:
        self._spotter = KeywordSpotter(net) if net is not None else None
        self._remainder = remainder
        self._belief = Belief(TEXTS, settings, self._left)
        self._span = (0, 0)

    @property
    def pending(self) -> bool:
        """Whether the word was heard; what is reported depends on the surrounding sentence."""
        return self._belief.held

    def hear(self, chunk: Chunk, events: Sequence[Event], sentence_ends: bool) -> list[Event]:
        """Process a chunk, and the recogniser's `events` for it.

        `sentence_ends`: the recogniser may soon report a sentence that ended just now.
        """
        if self._remainder is not None:
            self._remainder.hear(chunk)
        told = [event for found in events for event in self._found(found)]
        now = chunk.first_frame + len(chunk.energies)
        word = self._spotter.hear(chunk) if self._spotter is not None else None
        if word is not None:
            span = (word.start_frame * HOP_SAMPLES, word.end_frame * HOP_SAMPLES)
            self._span = span
            told += self._tell(self._belief.word(*span, word.call, now * HOP_SAMPLES, sentence_ends))
        return told + self._tell(self._belief.at(now * HOP_SAMPLES))

    def understood(self, sentences: Sequence[Coherent]) -> None:
        """Take the sentences found by their waveform, which may be among the next events."""
        if self._remainder is not None:
            self._remainder.understood(sentences)

    def interrupt(self) -> list[Event]:
        """Drop the current word: its sound was lost."""
        return self._tell(self._belief.unclear())

    def _left(self, sentence: Recognised, start: int, end: int) -> Chances | None:
        return self._remainder.chances(sentence, start, end) if self._remainder is not None else None

    def _found(self, event: Event) -> list[Event]:
        verdict = self._belief.sentence(event) if isinstance(event, Recognised) else self._belief.unclear()
        return self._tell(verdict)

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
