"""Speech that the robots' recogniser rejects goes to a listener that knows people.

Until its result comes, and for MOST_WAIT_S at most, the speech counts as still going on. A sentence that cannot go on
is reported at once. What may be the first part of one is kept until nobody has spoken for PATIENCE_S; if somebody goes
on before, both parts are searched as one. Talk that lasts longer than any sentence is handed on as it comes, from pause
to pause (`long_talk`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Protocol

from hvcpd.ports import SAMPLE_RATE_HZ
from hvcpd.recognition.events import Ears, Event, Garbled, Recognised
from hvcpd.recognition.long_talk import MOST_PAUSES, LongTalk, Stretch
from hvcpd.recognition.second_pass import AFTER_S, PAUSES_S, LaterEars, Segment, SegmentListener, Worker

LEAD_S = 3.0
"""Sound kept before the speech, for its noise: the noise tracker's memory."""
PAUSE_S = 0.5
"""Speech this soon after lost sound may be the end of a longer sentence: torn speech has been heard as "stop"."""
SHORT_S = 0.1
"""A loss shorter than this loses no word. Speech after it counts as whole if nobody had spoken for PAUSE_S before, and
after ONSET_S of quiet."""
ONSET_S = 0.1
"""Quiet between lost sound and speech after which the speech begins with its first sound."""
LONGEST_S = 12.0
"""No sentence of the phrasebook takes longer; other talk does, and is searched from pause to pause."""
MOST_WAIT_S = 3.0
"""Then the speech is garbled: a robot that has not answered by then is asked again anyway."""
PATIENCE_S = 1.0
"""Quiet after speech before it counts as ended where the sentence might go on."""


class PeopleListener(SegmentListener[Segment, Recognised | None], Protocol):
    """A listener for sentences of people."""

    def may_go_on(self, words: Sequence[str]) -> bool:
        """Whether more words would make another sentence of these."""


class SecondEars(LaterEars[Segment, Recognised | None]):
    """Ears with a second pass for people's speech."""

    _listener: PeopleListener

    def __init__(self, ears: Ears, listener: PeopleListener, worker: Worker[Segment, Recognised | None]) -> None:
        super().__init__(ears, listener, worker, round((LEAD_S + LONGEST_S + 2 * MOST_WAIT_S) * SAMPLE_RATE_HZ))
        self._spoke_until = -round(PAUSE_S * SAMPLE_RATE_HZ)
        """Somebody else spoke last before this sample."""
        self._torn_until = 0
        """Speech that begins before this sample may lack its beginning."""
        self._waiting: list[Segment] = []
        self._last: Segment | None = None
        """The last speech that was searched, if it was not surely a whole sentence."""
        self._kept: list[Event] = []
        """What was found in it, until nobody goes on: until the sample `_kept_until`."""
        self._kept_until = 0
        self._talk = LongTalk(round(LONGEST_S * SAMPLE_RATE_HZ))
        self._stretches: list[Stretch] = []
        """Parts of talk for the second pass."""
        self._understood_until = 0
        """All speech before this sample has been understood."""

    @property
    def busy(self) -> bool:
        """Whether somebody else is speaking, or has spoken and may still be understood."""
        return self._ears.busy or bool(self._waiting or self._kept)

    def _follow(self) -> None:
        speaking = self._ears.speaking
        if speaking:
            self._spoke_until = self._now
            if self._kept and self._last is not None:  # somebody goes on: it was no whole sentence
                self._kept = [Garbled(self._last.start, self._last.end)]
                self._kept_until = self._now + round(PATIENCE_S * SAMPLE_RATE_HZ)
        self._stretches += self._talk.push(self._ears.chunks, speaking)

    def _break_off(self, n_samples: int) -> None:
        quiet = self._now - self._spoke_until >= PAUSE_S * SAMPLE_RATE_HZ
        whole = quiet and 0 < n_samples <= SHORT_S * SAMPLE_RATE_HZ
        until = self._now + n_samples + round((ONSET_S if whole else PAUSE_S) * SAMPLE_RATE_HZ)
        self._torn_until = max(self._torn_until, until)

    def take(self, events: Sequence[Event]) -> list[Event]:
        """The results of the first ears' events, and of finished second passes."""
        out: list[Event] = []
        for event in events:
            if not (isinstance(event, Garbled) and not event.robot and self._submitted(event)):
                out += [*self._let_go(), event]
        ends = [event.end_sample for event in out if isinstance(event, Recognised)]
        self._understood_until = max([self._understood_until, *ends])
        while self._stretches:
            self._look_within(self._stretches.pop(0))
        for segment, found in self._worker.findings():
            if segment in self._waiting:
                self._waiting.remove(segment)
                out += self._taken(segment, found)
        if self._now >= self._kept_until:
            out += self._let_go()
        return out + self._given_up()

    def flush(self) -> list[Event]:
        """As `LaterEars.flush`: what was kept, too."""
        return super().flush() + self._let_go()

    def _submitted(self, event: Garbled) -> bool:
        """Submit speech, with the speech kept before it, to the second pass; whether that was possible."""
        segment = self._segment(event)
        if segment is None:
            return False
        joined = self._joined(segment)
        if not self._worker.submit(joined or segment, self._listener):
            return False
        if joined is not None:
            self._kept.clear()
        self._waiting.append(joined or segment)
        return True

    def _joined(self, segment: Segment) -> Segment | None:
        """The last speech and the segment after it, as one; None if it was not soon after, or both are too long."""
        last = self._last
        if last is None or segment.start - last.end > PATIENCE_S * SAMPLE_RATE_HZ:
            return None
        whole = self._segment(Garbled(last.start, segment.end))
        later = (*last.later, segment.start)[-MOST_PAUSES:]
        return replace(whole, later=later) if whole is not None else None

    def _taken(self, segment: Segment, found: Recognised | None) -> list[Event]:
        """The events of a finished second pass."""
        if segment.within_talk:
            return [found] if found is not None else []
        events = self._let_go()
        if found is not None and not self._listener.may_go_on(found.words):
            self._last = None
            return [*events, found]
        self._last = segment
        self._kept = [found if found is not None else Garbled(segment.start, segment.end)]
        self._kept_until = segment.end + round(PATIENCE_S * SAMPLE_RATE_HZ)
        return events

    def _let_go(self) -> list[Event]:
        """The event for the last speech: nobody goes on."""
        events, self._kept = self._kept, []
        return events

    def _given_up(self) -> list[Event]:
        late = [segment for segment in self._waiting if self._now - segment.end > MOST_WAIT_S * SAMPLE_RATE_HZ]
        for segment in late:
            self._waiting.remove(segment)
        return [Garbled(segment.start, segment.end) for segment in late if not segment.within_talk]

    def _look_within(self, stretch: Stretch) -> None:
        """Submit a part of talk for a second pass."""
        heard_from = max(self._understood_until, self._torn_until)
        starts = [start for start in stretch.starts if start >= heard_from]
        if not starts:
            return
        begin, end = starts[0] - round(LEAD_S * SAMPLE_RATE_HZ), stretch.end + round(PAUSES_S * SAMPLE_RATE_HZ)
        sound, lead = self._history.around(begin, starts[0], end)
        if len(sound) - lead < stretch.end - starts[0]:
            return
        later = tuple(starts[1:])
        segment = Segment(sound, lead, starts[0], stretch.end, starts[0] - lead, within_talk=True, later=later)
        if self._worker.submit(segment, self._listener):
            self._waiting.append(segment)

    def _segment(self, event: Garbled) -> Segment | None:
        """The sound of an event; None if it is too long, may be torn, or is no longer kept."""
        if event.start_sample < self._torn_until:
            return None
        if event.end_sample - event.start_sample > LONGEST_S * SAMPLE_RATE_HZ or self._waiting_at(event):
            return None
        begin = event.start_sample - round(LEAD_S * SAMPLE_RATE_HZ)
        end = event.end_sample + round(AFTER_S * SAMPLE_RATE_HZ)
        sound, lead = self._history.around(begin, event.start_sample, end)
        if len(sound) - lead < event.end_sample - event.start_sample:
            return None
        return Segment(sound, lead, event.start_sample, event.end_sample, event.start_sample - lead)

    def _waiting_at(self, event: Garbled) -> bool:
        return any(p.start < event.end_sample and event.start_sample < p.end for p in self._waiting)
