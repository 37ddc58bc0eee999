"""The people stage of the recogniser: a second pass over speech that no robot's voice explains.

Until its result comes, and for MAX_WAIT at most, the speech counts as still going on. A sentence that cannot go on
is reported at once. What may be the first part of one is kept until nobody has spoken for GOES_ON_WITHIN; if somebody
goes on before, both parts are searched as one. Talk that lasts longer than any sentence is handed on as it comes, from
pause to pause (`LongTalk`).
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hvcpd.people.second_pass import Found, SecondPassRecogniser
from hvcpd.ports import SAMPLE_RATE_HZ
from hvcpd.recognition.events import Event, Garbled, Recognised
from hvcpd.recognition.frontend import HOP_SAMPLES
from hvcpd.recognition.shared_front_end import MIN_SPEECH_FRAMES, WAIT_FRAMES
from hvcpd.recognition.stages import GOES_ON_WITHIN, MAX_WAIT, QUIET, SecondPassStage, Segment, Worker
from hvcpd.recognition.stream import LONGEST_SENTENCE, Chunk
from hvcpd.recognition.template_recogniser import TemplateRecogniser

SHORT_LOSS = SAMPLE_RATE_HZ // 10
"""A loss shorter than this (0.1 s) loses no word. Speech that begins as long after it counts as whole if nobody had
spoken for QUIET before."""
PAUSE_FRAMES = 24
"""0.24 s: the closures of stop consonants are shorter, the pauses between two sentences longer."""
PAUSE_SHARE = 0.35
"""Share of the range from the noise to the voice, in dB; fainter sound belongs to a pause."""
LEAST_RANGE_DB = 8.0
"""With a smaller range between the faintest and the loudest level, pauses cannot be told from speech."""
DRIFT_DB = 0.03
"""The loudest level falls by this much with each frame, 3 dB/s, and the faintest rises as fast."""
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
        self._talk = LongTalk(LONGEST_SENTENCE)
        self._stretches: list[Stretch] = []
        """Parts of talk for the second pass."""
        self._understood_until = 0
        """All speech before this sample has been understood."""

    @property
    def busy(self) -> bool:
        """As `Stage.busy`."""
        return bool(self._waiting or self._kept)

    def _follow(self) -> None:
        speaking = self.first_pass.speaking
        if speaking:
            self._spoke_until = self._now
            if self._kept and self._last is not None:  # somebody goes on: it was no whole sentence
                self._kept = [Garbled(self._last.start, self._last.end)]
                self._kept_until = self._now + GOES_ON_WITHIN
        self._stretches += self._talk.push(self.first_pass.chunks, speaking)

    def _break_off(self, n_samples: int) -> None:
        whole = self._now - self._spoke_until >= QUIET and 0 < n_samples <= SHORT_LOSS
        self._torn_until = max(self._torn_until, self._now + n_samples + (SHORT_LOSS if whole else QUIET))

    def _events_after(self, events: Sequence[Event]) -> list[Event]:
        out: list[Event] = []
        for event in events:
            if not (isinstance(event, Garbled) and not event.robot and self._submitted(event)):
                out += [*self._release(), event]
        ends = [event.end_sample for event in out if isinstance(event, Recognised)]
        self._understood_until = max([self._understood_until, *ends])
        for stretch in self._stretches:
            self._search_within(stretch)
        self._stretches = []
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
        if segment.within_talk:
            return [found] if found is not None else []
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
        return [Garbled(segment.start, segment.end) for segment in late if not segment.within_talk]

    def _search_within(self, stretch: Stretch) -> None:
        """Submit a part of talk for a second pass."""
        heard_from = max(self._understood_until, self._torn_until)
        starts = [start for start in stretch.starts if start >= heard_from]
        segment = Segment.of(self.first_pass.history, starts, stretch.end, within_talk=True) if starts else None
        if segment is not None and self._worker.submit(segment, self._searcher.search):
            self._waiting.append(segment)

    def _segment(self, start: int, end: int, later: Sequence[int] = ()) -> Segment | None:
        """The speech between two samples; None if it is too long, may be torn, is being searched, or no longer kept."""
        is_searched = any(each.start < end and start < each.end for each in self._waiting)
        if start < self._torn_until or end - start > LONGEST_SENTENCE or is_searched:
            return None
        return Segment.of(self.first_pass.history, (start, *later), end)


@dataclass(frozen=True)
class Stretch:
    """Speech from one pause to another, in samples; `starts`, the earliest first: possible beginnings of a sentence
    that ends with it."""

    starts: tuple[int, ...]
    end: int


class LongTalk:
    """Segments talk that lasts longer than any sentence at its pauses, as soon as each pause is heard."""

    def __init__(self, longest_samples: int) -> None:
        """`longest_samples`: shorter talk is left to listeners that search it as a whole."""
        self._longest = longest_samples // HOP_SAMPLES
        self._at = 0
        self._end_talk()

    def _end_talk(self) -> None:
        """Start again: nobody speaks any more, or sound was lost."""
        self._since: int | None = None
        self._loud_db, self._faint_db = -120.0, 0.0
        self._silent = 0
        self._faint = PAUSE_FRAMES
        self._began: int | None = None
        self._starts: deque[int] = deque(maxlen=MOST_PAUSES + 1)

    def push(self, chunks: Sequence[Chunk], busy: bool) -> list[Stretch]:
        """Take the next frames, and whether somebody speaks."""
        found: list[Stretch] = []
        for chunk in chunks if busy or self._since is not None else ():
            if chunk.first_frame != self._at:
                self._end_talk()
            self._at = chunk.first_frame
            for level_db in (10.0 * np.log10(chunk.energies.sum(axis=1))).tolist():
                found += self._hear(level_db, busy)
                self._at += 1
        return found

    def _hear(self, level_db: float, busy: bool) -> list[Stretch]:
        self._loud_db = max(level_db, self._loud_db - DRIFT_DB)
        self._faint_db = min(level_db, self._faint_db + DRIFT_DB)
        self._silent = 0 if busy else self._silent + 1
        if self._silent >= WAIT_FRAMES:  # it ends the talk, whose speech is reported as a whole then
            self._end_talk()
        elif busy and self._since is None:
            self._since = self._at
        if self._since is None:
            return []
        range_db = self._loud_db - self._faint_db
        pauses = range_db >= LEAST_RANGE_DB and level_db < self._faint_db + PAUSE_SHARE * range_db
        self._faint = self._faint + 1 if pauses else 0
        if not pauses and self._began is None:
            self._began = self._at
        if self._faint != PAUSE_FRAMES or self._began is None:
            return []
        self._starts.append(self._began)
        self._began, end = None, self._at - (PAUSE_FRAMES - 1)
        starts = tuple(
            s * HOP_SAMPLES for s in self._starts if MIN_SPEECH_FRAMES <= end - s <= LONGEST_SENTENCE // HOP_SAMPLES
        )
        return [Stretch(starts, end * HOP_SAMPLES)] if starts and end - self._since > self._longest else []
