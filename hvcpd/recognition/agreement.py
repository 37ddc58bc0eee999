"""Which of two listeners is told: the network of templates, or the coherent one, where both heard the same stretch.

The coherent one is believed wherever it is sure, since no other sentence has these samples. While it follows a
sentence, what the network says of it waits. Where it is not sure, or loses the sentence on the way, as among a room's
echoes, the network is believed; unless the sentence surely went on after the network's end."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from hvcpd.recognition.coherent import CoherentListener
from hvcpd.recognition.events import Event, Garbled, Recognised
from hvcpd.recognition.paths import Coherent

Describe = Callable[[Coherent], Recognised]


WAIT = 12_800
"""Samples (0.8 s) that the network has for a sentence of which the coherent listener is not sure."""


class Agreement:
    """Settles what both heard, chunk by chunk."""

    def __init__(self, coherent: CoherentListener) -> None:
        self.coherent = coherent
        self._held: Recognised | Garbled | None = None
        self._unsure: Garbled | None = None
        self._cut: tuple[str, ...] = ()
        """The words of that, if somebody went on after them."""
        self._told_until = 0
        """Until this sample, a sentence was told."""

    def settle(
        self, events: Sequence[Event], heard: Sequence[Coherent], since: int, now: int, describe: Describe
    ) -> tuple[list[Event], int]:
        """What is to be told at sample `now` of what the network has concluded and the coherent listener has heard; and
        until which sample the network need not listen any more, 0 if nothing is dealt with.

        What begins before sample `since` may be the end of something longer that was lost.
        """
        out: list[Event] = []
        dealt_with = 0
        for sentence in heard:
            start, end = sentence.words[0].start, sentence.words[-1].end
            if start < self._told_until:
                continue
            if not sentence.sure or start < since:
                self._unsure = Garbled(start, end)
                self._cut = tuple(word.word for word in sentence.words) if sentence.cut else ()
                continue
            self._release(start, end)
            events = [event for event in events if not _overlaps(event, start, end)]
            out.append(describe(sentence))
            self._told_until = dealt_with = end
        for event in events:
            out += self._judged(event)
        if self._held is not None and not self._follows(self._held):
            out += self.interrupt()
        return out + self._given_up(now), dealt_with

    def interrupt(self) -> list[Event]:
        """What was under way will not be understood."""
        held, self._held = self._held, None
        return self._told(held) if held is not None else []

    def _judged(self, event: Event) -> list[Event]:
        if not isinstance(event, Recognised | Garbled):
            return [event]
        if not self._follows(event):
            return self._told(event)
        followed = self.coherent.follows
        if isinstance(event, Recognised) and followed:
            n = len(event.words)
            if event.words[: len(followed.words)] == followed.words and n > len(followed.words):
                return self._told(event)
            if followed.words[:n] == event.words and followed.is_sure_after(n):
                event = Garbled(event.start_sample, event.end_sample)
        self._held = event  # until it is known what comes of the sentence
        return []

    def _told(self, event: Recognised | Garbled) -> list[Event]:
        unsure = self._unsure
        self._release(event.start_sample, event.end_sample)
        if isinstance(event, Recognised):
            if unsure is not None and self._unsure is None and event.words == self._cut:
                return [Garbled(event.start_sample, event.end_sample)]
            self._told_until = event.end_sample
            self.coherent.dismiss(event.end_sample)
        return [event]

    def _given_up(self, now: int) -> list[Event]:
        """A sentence that was not sure, and of which the network had nothing to say."""
        if self._unsure is None or now < self._unsure.end_sample + WAIT or self._held is not None:
            return []
        unsure, self._unsure = self._unsure, None
        return [unsure]

    def _follows(self, event: Recognised | Garbled) -> bool:
        """Whether the coherent listener follows a sentence in that stretch."""
        path = self.coherent.follows
        return path is not None and path.first < event.end_sample

    def _release(self, start: int, end: int) -> None:
        """That stretch is dealt with."""
        if self._held is not None and _overlaps(self._held, start, end):
            self._held = None
        if self._unsure is not None and _overlaps(self._unsure, start, end):
            self._unsure = None


def _overlaps(event: Event, start: int, end: int) -> bool:
    return isinstance(event, Recognised | Garbled) and event.start_sample < end and event.end_sample > start
