"""Which of two listeners is told: the network of templates, or the coherent one, where it heard the same stretch.

The coherent one is believed wherever it is sure, since no other sentence has these samples. While it follows a
sentence, the network's word that there was none waits, and a sentence of the network that contradicts it is garbled.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

from hvcpd.recognition.coherent import CoherentListener
from hvcpd.recognition.events import Event, Garbled, Recognised
from hvcpd.recognition.paths import Coherent

Describe = Callable[[Coherent], Recognised]


class Agreement:
    """Settles what both heard, chunk by chunk."""

    def __init__(self, coherent: CoherentListener) -> None:
        self.coherent = coherent
        self._held: Recognised | Garbled | None = None
        self._told_until = 0
        """Until this sample, a sentence was told."""

    def settle(self, events: Sequence[Event], heard: Sequence[Coherent], since: int, describe: Describe) -> list[Event]:
        """What is to be told of what the network has concluded and the coherent listener has heard by now.

        What begins before sample `since` may be the end of something longer that was lost.
        """
        out: list[Event] = []
        for sentence in heard:
            start, end = sentence.words[0].start, sentence.words[-1].end
            self._release(start, end)
            events = [event for event in events if not _overlaps(event, start, end)]
            if start < self._told_until:
                continue
            out.append(describe(sentence) if sentence.sure and start >= since else Garbled(start, end))
            self._told_until = end
        for event in events:
            out += self._judged(event)
        if self._held is not None and not self._follows(self._held):
            out += self.interrupt()
        return out

    def interrupt(self) -> list[Event]:
        """What was under way will not be understood."""
        held, self._held = self._held, None
        if isinstance(held, Recognised):
            self._tell(held)
        return [held] if held is not None else []

    def _judged(self, event: Event) -> list[Event]:
        if not isinstance(event, Recognised | Garbled) or not self._follows(event):
            if isinstance(event, Recognised):
                self._tell(event)
            return [event]
        followed = self.coherent.follows
        if isinstance(event, Recognised) and followed and event.words[: len(followed.words)] != followed.words:
            event = Garbled(event.start_sample, event.end_sample)
        if isinstance(event, Recognised) and followed and len(event.words) > len(followed.words):
            self._tell(event)
            return [event]
        self._held = event  # until it is known whether somebody goes on
        return []

    def _tell(self, event: Recognised) -> None:
        self._told_until = event.end_sample
        self.coherent.dismiss(event.end_sample)

    def _follows(self, event: Recognised | Garbled) -> bool:
        """Whether the coherent listener follows a sentence in that stretch."""
        path = self.coherent.follows
        return path is not None and path.first < event.end_sample

    def _release(self, start: int, end: int) -> None:
        if self._held is not None and _overlaps(self._held, start, end):
            self._held = None


def _overlaps(event: Event, start: int, end: int) -> bool:
    return isinstance(event, Recognised | Garbled) and event.start_sample < end and event.end_sample > start
