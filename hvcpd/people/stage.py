"""The people stage of the recogniser: a second pass over speech that no robot's voice explains.

Until its result comes, and for MAX_WAIT at most, the speech counts as still going on. A sentence that cannot go on
is reported at once. What may be the first part of one is kept until nobody has spoken for GOES_ON_WITHIN; if somebody
goes on before, both parts are searched as one.
"""

from __future__ import annotations

from collections.abc import Sequence

from hvcpd.people.second_pass import Found, SecondPassRecogniser
from hvcpd.ports import samples_in
from hvcpd.recognition.events import Event, Garbled, Recognised
from hvcpd.recognition.stages import GOES_ON_WITHIN, QUIET, SecondPassStage, Segment, Worker
from hvcpd.recognition.stream import LONGEST_SENTENCE, MAX_WAIT
from hvcpd.recognition.template_recogniser import TemplateRecogniser

SHORT_LOSS = samples_in(0.1)
"""A loss shorter than this loses no word. Speech that begins as long after it counts as whole if nobody had
spoken for QUIET before."""
MOST_PAUSES = 2
"""Maximum number of pauses within a sentence: after the greeting and after the name."""


class PeopleStage(SecondPassStage[Segment, Found]):
    """The second pass for people's speech."""

    _searcher: SecondPassRecogniser

    def __init__(
        self, first_pass: TemplateRecogniser, searcher: SecondPassRecogniser, worker: Worker[Segment, Found]
    ) -> None:
        super().__init__(first_pass, searcher, worker)
        self._spoke_until = -QUIET
        """Somebody else spoke last before this sample."""
        self._torn_until = 0
        """Speech that begins before this sample may lack its beginning."""
        self._waiting: list[Segment] = []
        self._last: Segment | None = None
        """The last speech that was searched, if it was not surely a whole sentence."""
        self._kept: list[Event] = []
        """What was found in it, until nobody goes on: until the sample `_kept_until`."""
        self._kept_until = 0

    @property
    def busy(self) -> bool:
        """As `Stage.busy`."""
        return bool(self._waiting or self._kept)

    def _follow(self) -> None:
        if self.first_pass.speaking:
            self._spoke_until = self._now
            if self._kept and self._last is not None:  # somebody goes on: it was no whole sentence
                self._kept = [Garbled(self._last.start, self._last.end)]
                self._kept_until = self._now + GOES_ON_WITHIN

    def _break_off(self, n_samples: int) -> None:
        whole = self._now - self._spoke_until >= QUIET and 0 < n_samples <= SHORT_LOSS
        self._torn_until = max(self._torn_until, self._now + n_samples + (SHORT_LOSS if whole else QUIET))

    def _events_after(self, events: Sequence[Event]) -> list[Event]:
        out: list[Event] = []
        for event in events:
            if not (isinstance(event, Garbled) and not event.robot and self._submitted(event)):
                out += [*self._release(), event]
        for segment, found in self._worker.results():
            if segment in self._waiting:
                self._waiting.remove(segment)
                out += self._take_result(segment, found)
        if self._now >= self._kept_until:
            out += self._release()
        return out + self._timed_out()

    def _submitted(self, event: Garbled) -> bool:
        """Submit speech, with the speech kept before it, to the second pass; whether that was possible."""
        segment = self._segment(event.start_sample, event.end_sample)
        if segment is None:
            return False
        joined = self._joined(segment)
        if not self._worker.submit(joined or segment, self._searcher.search):
            return False
        if joined is not None:
            self._kept.clear()
        self._waiting.append(joined or segment)
        return True

    def _joined(self, segment: Segment) -> Segment | None:
        """The last speech and the segment after it, as one; None if it was not soon after, or both are too long."""
        last = self._last
        if last is None or segment.start - last.end > GOES_ON_WITHIN:
            return None
        return self._segment(last.start, segment.end, (*last.later, segment.start)[-MOST_PAUSES:])

    def _take_result(self, segment: Segment, found: Found) -> list[Event]:
        """The events of a finished second pass."""
        found = self._with_level(found) if isinstance(found, Recognised) else found
        events = self._release()
        if isinstance(found, Recognised) and not self._searcher.may_go_on(found.words):
            self._last = None
            return [*events, found]
        self._last = segment
        self._kept = [found if found is not None else Garbled(segment.start, segment.end)]
        self._kept_until = segment.end + GOES_ON_WITHIN
        return events

    def _release(self) -> list[Event]:
        """The event for the last speech: nobody goes on."""
        events, self._kept = self._kept, []
        return events

    def _end(self) -> list[Event]:
        return self._release()

    def _timed_out(self) -> list[Event]:
        late = [segment for segment in self._waiting if self._now - segment.end > MAX_WAIT]
        for segment in late:
            self._waiting.remove(segment)
        return [Garbled(segment.start, segment.end) for segment in late]

    def _segment(self, start: int, end: int, later: Sequence[int] = ()) -> Segment | None:
        """The speech between two samples; None if it is too long, may be torn, is being searched, or no longer kept."""
        is_searched = any(each.start < end and start < each.end for each in self._waiting)
        if start < self._torn_until or end - start > LONGEST_SENTENCE or is_searched:
            return None
        return Segment.of(self.first_pass.history, (start, *later), end)
