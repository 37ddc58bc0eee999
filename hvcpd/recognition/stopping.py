"""Two ears for the one word that stops: one knows the robots' voices and sentences, one hears anybody (`keyword`).

Over a robot's sentence the first knows what that sentence should sound like, and so what else was said; the second has
learned the word from many people. Either may halt the robot and stop it; it goes on when neither has a doubt left.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from hvcpd.recognition.events import Event, Held, Released, Urgent
from hvcpd.recognition.halting import Halting
from hvcpd.recognition.keyword.listener import KeywordListener
from hvcpd.recognition.paths import Coherent
from hvcpd.recognition.stream import Chunk

SAME_SAMPLES = 4800
"""Two calls within 0.3 s are one: the ears differ by so much about where it was."""


class Stopping:
    """Tells what either ear tells, once."""

    def __init__(self, known: Halting, anybody: KeywordListener) -> None:
        self._known = known
        self._anybody = anybody
        self._held = [False, False]
        self._said: Urgent | None = None

    def succeed(self, predecessor: Stopping) -> None:
        """Go on with what the predecessor's ear for anybody has heard."""
        self._anybody, self._held = predecessor._anybody, [False, predecessor._held[1]]

    @property
    def pending(self) -> bool:
        """Whether the word was heard, and what is told of it depends on the sentence around it."""
        return self._known.pending or self._anybody.pending

    def hear(
        self, chunk: Chunk, noise: NDArray[np.float32], events: Sequence[Event], speech: bool, sentence_ends: bool
    ) -> list[Event]:
        """As `Halting.hear` and `KeywordListener.hear`."""
        known = self._known.hear(chunk, noise, events, speech, sentence_ends)
        return self._joined(known, self._anybody.hear(chunk, events, speech, sentence_ends))

    def understood(self, sentences: Sequence[Coherent]) -> None:
        """As `Halting.understood`."""
        self._known.understood(sentences)

    def interrupt(self) -> list[Event]:
        """What was being said is lost."""
        return self._joined(self._known.interrupt(), self._anybody.interrupt())

    def _joined(self, *found: Sequence[Event]) -> list[Event]:
        return [event for ear, events in enumerate(found) for event in events if self._is_news(ear, event)]

    def _is_news(self, ear: int, event: Event) -> bool:
        """Whether it is to be told; what one ear has told, the other need not tell again."""
        self._held[ear] = isinstance(event, Held)
        if isinstance(event, Urgent):
            before, self._said = self._said, event
            return before is None or event.start_sample >= before.end_sample - SAME_SAMPLES
        return not isinstance(event, Released) or not any(self._held)
