"""Chooses between two listeners that heard the same stretch: the template network or the coherent listener.

The coherent listener wins wherever it is sure, since no other sentence has these samples. While it follows a sentence,
the network concludes nothing (`Recogniser.hear`). The network wins where the coherent listener is not sure, or loses
the sentence on the way, for example because of a room's echoes. The exception: the sentence surely went on after the
network's end."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from hvcpd.recognition.coherent import CoherentListener
from hvcpd.recognition.events import Event, Garbled, Recognised
from hvcpd.recognition.paths import Coherent

Describe = Callable[[Coherent], Recognised]


class Agreement:
    """Merges the results of both listeners, chunk by chunk."""

    def __init__(self, coherent: CoherentListener) -> None:
        self._coherent = coherent
        self._cut: Recognised | None = None
        """The last sentence after which somebody went on, but not with a word that was found."""
        self._reported_until = 0
        """A sentence was reported up to this sample."""

    def settle(
        self, events: Sequence[Event], heard: Sequence[Coherent], since: int, describe: Describe
    ) -> tuple[list[Event], int]:
        """Return the events to report, from the results of the network and of the coherent listener, and the sample up
        to which the network need not listen any more, 0 if there is none.

        Whatever begins before sample `since` may be the end of something longer that was lost.
        """
        out: list[Event] = []
        dealt_with = 0
        for sentence in heard:
            start, end = sentence.words[0].start, sentence.words[-1].end
            if start < self._reported_until:
                continue
            if sentence.sure and start >= since:
                events = [event for event in events if not _overlaps(event, start, end)]
                out.append(describe(sentence))
                self._reported_until = dealt_with = end
            elif sentence.cut:
                self._cut = describe(sentence)
        return out + [self._believed(event) for event in events], dealt_with

    def _believed(self, event: Event) -> Event:
        """An event of the network: garbled, if it is a sentence that went on."""
        if not isinstance(event, Recognised):
            return event
        cut = self._cut
        if cut is not None and cut.words == event.words and _overlaps(event, cut.start_sample, cut.end_sample):
            return Garbled(event.start_sample, event.end_sample)
        self._reported_until = event.end_sample
        self._coherent.dismiss(event.end_sample)
        return event


def _overlaps(event: Event, start: int, end: int) -> bool:
    return isinstance(event, Recognised | Garbled) and event.start_sample < end and event.end_sample > start
