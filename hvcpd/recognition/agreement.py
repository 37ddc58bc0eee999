"""Chooses between two listeners that heard the same stretch: the template network or the coherent listener.

The coherent listener wins wherever it is sure, since no other sentence has these samples. While it follows a sentence,
the network's result waits. The network wins where the coherent listener is not sure, or loses the sentence on the way,
for example because of a room's echoes. The exception: the sentence surely went on after the network's end."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from hvcpd.recognition.coherent import CoherentListener
from hvcpd.recognition.events import Event, Garbled, Recognised
from hvcpd.recognition.paths import Coherent

Describe = Callable[[Coherent], Recognised]


WAIT = 12_800
"""Samples (0.8 s) that the network has for a sentence of which the coherent listener is not sure."""


class Agreement:
    """Merges the results of both listeners, chunk by chunk."""

    def __init__(self, coherent: CoherentListener) -> None:
        self.coherent = coherent
        self._held: Recognised | Garbled | None = None
        self._unsure: Garbled | None = None
        self._cut: tuple[str, ...] = ()
        """The words of that sentence, if somebody went on after them."""
        self._reported_until = 0
        """A sentence was reported up to this sample."""

    def settle(
        self, events: Sequence[Event], heard: Sequence[Coherent], since: int, now: int, describe: Describe
    ) -> tuple[list[Event], int]:
        """Return the events to report at sample `now`, from the results of the network and of the coherent listener,
        and the sample up to which the network need not listen any more, 0 if there is none.

        Whatever begins before sample `since` may be the end of something longer that was lost.
        """
        out: list[Event] = []
        dealt_with = 0
        for sentence in heard:
            start, end = sentence.words[0].start, sentence.words[-1].end
            if start < self._reported_until:
                continue
            if not sentence.sure or start < since:
                self._unsure = Garbled(start, end)
                self._cut = tuple(word.word for word in sentence.words) if sentence.cut else ()
                continue
            self._release(start, end)
            events = [event for event in events if not _overlaps(event, start, end)]
            out.append(describe(sentence))
            self._reported_until = dealt_with = end
        for event in events:
            out += self._judged(event)
        if self._held is not None and not self._follows(self._held):
            out += self.interrupt()
        return out + self._given_up(now), dealt_with

    def interrupt(self) -> list[Event]:
        """Drop the sentence in progress: it will not be understood."""
        held, self._held = self._held, None
        return self._reported(held) if held is not None else []

    def _judged(self, event: Event) -> list[Event]:
        if not isinstance(event, Recognised | Garbled):
            return [event]
        if not self._follows(event):
            return self._reported(event)
        followed = self.coherent.follows
        if isinstance(event, Recognised) and followed:
            n = len(event.words)
            if event.words[: len(followed.words)] == followed.words and n > len(followed.words):
                return self._reported(event)
            if followed.words[:n] == event.words and followed.is_sure_after(n):
                event = Garbled(event.start_sample, event.end_sample)
        self._held = event  # until the outcome of the sentence is known
        return []

    def _reported(self, event: Recognised | Garbled) -> list[Event]:
        unsure = self._unsure
        self._release(event.start_sample, event.end_sample)
        if isinstance(event, Recognised):
            if unsure is not None and self._unsure is None and event.words == self._cut:
                return [Garbled(event.start_sample, event.end_sample)]
            self._reported_until = event.end_sample
            self.coherent.dismiss(event.end_sample)
        return [event]

    def _given_up(self, now: int) -> list[Event]:
        """Return an uncertain sentence for which the network has no result."""
        if self._unsure is None or now < self._unsure.end_sample + WAIT or self._held is not None:
            return []
        unsure, self._unsure = self._unsure, None
        return [unsure]

    def _follows(self, event: Recognised | Garbled) -> bool:
        """Whether the coherent listener follows a sentence in this stretch."""
        path = self.coherent.follows
        return path is not None and path.first < event.end_sample

    def _release(self, start: int, end: int) -> None:
        """Mark this stretch as handled."""
        if self._held is not None and _overlaps(self._held, start, end):
            self._held = None
        if self._unsure is not None and _overlaps(self._unsure, start, end):
            self._unsure = None


def _overlaps(event: Event, start: int, end: int) -> bool:
    return isinstance(event, Recognised | Garbled) and event.start_sample < end and event.end_sample > start
