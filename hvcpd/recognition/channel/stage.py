"""The channel stage of the recogniser: a second pass, through any channel, over what the first pass is not sure of.

A segment of sound is searched once signs of speech have ended, or, where they do not show its end, at a cut. Until then
the first pass's results are held: sentences of the templates, which a loudspeaker's frequency response can mislead, and
garbled speech.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence

from hvcpd.ports import samples_in
from hvcpd.recognition.channel.endpoints import (
    CLATTER,
    CUT_AFTER,
    CUT_AGAIN_AFTER,
    ONSET_STEP,
    ONSET_WINDOW,
    OpenSegment,
)
from hvcpd.recognition.channel.path import Path
from hvcpd.recognition.channel.recogniser import NOISE_LENGTH, ChannelRecogniser
from hvcpd.recognition.channel.search import ChannelSegment, SearchResult
from hvcpd.recognition.events import Event, Garbled, Recognised, Source
from hvcpd.recognition.stages import GOES_ON_WITHIN, QUIET, SecondPassStage, Worker
from hvcpd.recognition.stream import HISTORY_SAMPLES, LONGEST_SENTENCE, MAX_WAIT, NOISE_LEAD
from hvcpd.recognition.template_recogniser import TemplateRecogniser

ONSET_LAG = samples_in(0.25)
"""Longest time from the beginning of speech to its first sign; a sentence takes longer ("stop": 0.4 s)."""
FAINT_ONSET_LAG = samples_in(1.0)
"""The same for a voice that hardly rises over the noise, whose first word may not have risen at all."""
TORN_WITHIN = samples_in(0.2)
"""What a robot begins this soon after lost sound, or the own voice, may be the end of a longer sentence. Robots
wait for 0.5 s before they answer."""


class ChannelStage(SecondPassStage[ChannelSegment, SearchResult]):
    """The second pass for robots through any channel."""

    _searcher: ChannelRecogniser

    def __init__(
        self, first_pass: TemplateRecogniser, searcher: ChannelRecogniser, worker: Worker[ChannelSegment, SearchResult]
    ) -> None:
        super().__init__(first_pass, searcher, worker)
        self._whole_from = 0
        """The sound is complete from this sample on: nothing was lost or covered by the robot's own voice."""
        self._searched_until = 0
        """Onsets were searched up to this sample."""
        self._since: int | None = None
        """There have been signs of speech since this sample, with no QUIET among them."""
        self._last_sign = 0
        """The sample after the last sign of speech."""
        self._open: OpenSegment | None = None
        self._closed: list[OpenSegment] = []
        """Segments being searched, or searched a moment ago."""
        self._reported: deque[Recognised] = deque(maxlen=4)
        self._searched_at: int | None = None
        """When the last segment was submitted; None once its data are dropped."""

    @property
    def busy(self) -> bool:
        """As `Stage.busy`."""
        greeted = self._open is not None and self._open.greeted
        return greeted or any(each.result is None for each in self._closed)

    def _events_after(self, events: Sequence[Event]) -> list[Event]:
        out: list[Event] = []
        for event in events:
            out += self._take_event(event)
        for job, result in self._worker.results():
            for segment in [each for each in self._closed if each.job is job]:
                out += self._take_result(segment, job, result)
        for each in self._closed:
            over = self._is_over(each)
            if over or each.result is not None:
                out += self._release(each, over or not each.in_progress)
        self._closed = [each for each in self._closed if not self._is_over(each)]
        return out

    def _take_result(self, segment: OpenSegment, job: ChannelSegment, result: SearchResult) -> list[Recognised]:
        """Report the sentences of a search that are whole and not reported yet; wait for the end of one in progress."""
        segment.result = result
        whole = [each for each in result.sentences if each.start_sample >= segment.whole_from]
        found = [self._report(self._with_level(each)) for each in whole if not self._is_reported(each)]
        going_on = result.in_progress
        if going_on and (job.cut or going_on[0].end > segment.end):
            self._open = self._open or OpenSegment(segment.closed_at, segment.closed_at)
            self._open.continues = self._open.end_hidden = True
            self._open.cut_at = min(segment.closed_at + CUT_AGAIN_AFTER, result.sure_at)
        return found

    def _release(self, segment: OpenSegment, everything: bool = True) -> list[Event]:
        """Release a segment's held events: `everything`, or, while a sentence is in progress at its end, what the
        search agrees with, and what ended long ago, before that sentence began. Garbled speech in which no robot was
        heard is released at once, since in anybody's talk some path is in progress by chance."""
        result = segment.result or SearchResult()
        held = segment.held_events
        freed = [e for e in held if everything or self._agrees(e, result) or self._is_past(e, result)]
        segment.held_events = [event for event in held if event not in freed]
        return [each for event in freed for each in self._to_report(event, result)]

    def _end(self) -> list[Event]:
        self._close()
        return self._events_after([]) + [event for segment in self._closed for event in self._release(segment)]

    def _break_off(self, n_samples: int) -> None:
        self._close()
        self._whole_from = self._now + n_samples

    def _mask(self) -> None:
        self._break_off(0)

    def _follow(self) -> None:
        """Track onsets and signs of speech."""
        if self.first_pass.possible_speech:
            self._since = self._began if self._since is None else self._since
            self._last_sign = self._now
            self._note_sign(self._since)
        elif self._now - self._last_sign >= QUIET:
            self._since = None
        self._note_onset()
        if self._open is not None:
            if self._open.is_over(self._now):
                self._close()
            elif self._now >= self._open.cut_at:
                self._close(cut=True)
        elif self._searched_at is not None and self._now - self._searched_at >= HISTORY_SAMPLES:
            self._searched_at = None
            self._searcher.free_memory()

    def _note_sign(self, since: int) -> None:
        """Note a sign of speech in the newest block, as there have been `since` that sample."""
        at = self._began
        if self._open is None:
            begin, due = max(at - ONSET_LAG, self._whole_from), max(since + CLATTER, at + CUT_AFTER)
            self._open = OpenSegment(begin, self._now, due, end_hidden=self._now - since > CLATTER)
        self._open.note_sign(at, self._now)

    def _note_onset(self) -> None:
        """Search the newest sound for an onset."""
        first = self._now - ONSET_WINDOW
        if first < self._searched_until or first < self._whole_from:
            return
        self._searched_until = first + ONSET_STEP
        sound, lead = self.first_pass.history.unmasked(first - NOISE_LEAD, first, self._now)
        if len(sound) - lead < ONSET_WINDOW or lead < 2 * NOISE_LENGTH:  # too little to know the noise
            return
        found = self._searcher.onset(sound[lead : lead + ONSET_WINDOW], sound[:lead])
        if found is None or (self._open is not None and (self._open.greeted or not found.greeting)):
            return  # the search finds greetings wherever they are
        at = first + found.at
        searched = [each for each in self._closed if each.job is not None and (each.result is None or each.shows_end)]
        if any(at < each.end_sample for each in self._reported) or any(at < each.end for each in searched):
            return
        begin = max(at - (ONSET_LAG if found.greeting else FAINT_ONSET_LAG), self._whole_from)
        self._open = self._open or OpenSegment(begin, self._now)
        self._open.note_onset(found, at, begin, self._since)

    def _close(self, cut: bool = False) -> None:
        """Close the open segment, or `cut` it: submit it, unless all of it has been reported."""
        segment, self._open = self._open, None
        if segment is None:
            return
        if cut:
            segment.end = self._now
        before = next((each for each in reversed(self._closed) if each.in_progress), None)
        if before is not None and before.begin >= self._whole_from and segment.begin - before.end < GOES_ON_WITHIN:
            earliest = max(self._whole_from, segment.end - 2 * LONGEST_SENTENCE)
            segment.begin = max(min(segment.begin, before.first_start - ONSET_LAG), earliest)
            segment.held_events = before.held_events + segment.held_events
            self._closed.remove(before)
        segment.closed_at = self._now
        segment.whole_from = self._whole_from + TORN_WITHIN if self._whole_from else 0
        self._closed.append(segment)
        if self._is_accounted_for(segment):
            segment.result = SearchResult()
            return
        sound, lead = self.first_pass.history.unmasked(segment.begin - NOISE_LEAD, segment.begin, self._now)
        segment.job = ChannelSegment(sound, segment.begin - lead, lead, cut)
        self._searched_at = self._now
        if not self._worker.submit(segment.job, self._searcher.search):
            segment.result = SearchResult()

    def _is_accounted_for(self, segment: OpenSegment) -> bool:
        """Whether it is too short for a sentence, or all of it has been reported; not if a sentence goes on in it."""
        if segment.held_events or segment.continues:
            return False
        length = segment.end - segment.begin - ONSET_LAG
        reported = sum(_overlap(segment.begin, segment.end, each) for each in self._reported)
        return length < ONSET_LAG or reported > 0.6 * length

    def _take_event(self, event: Event) -> list[Event]:
        """The events to report at once for an event of the first pass."""
        if not isinstance(event, Recognised | Garbled):
            return [event]
        if isinstance(event, Recognised):
            if self._is_reported(event):
                return []
            if event.source is not Source.TEMPLATES:
                return [self._report(event)]
        elif any(_overlaps(event, each) for each in self._reported):
            return []
        there = next((each for each in self._closed if _covers(each, event)), None)
        if there is None:
            there = self._open = self._open or OpenSegment(event.start_sample, event.end_sample)
            if isinstance(event, Recognised):
                there.begin = max(min(there.begin, event.start_sample), self._whole_from)
        if there.result is not None and (not there.in_progress or self._agrees(event, there.result)):
            return self._to_report(event, there.result)
        there.held_events.append(event)
        if there is self._open:  # this speaker has ended, whatever other sound goes on
            self._close(cut=there.end_hidden)
        return []

    def _to_report(self, event: Recognised | Garbled, result: SearchResult) -> list[Event]:
        """The event to report for a held one; none if a sentence was found in its place.

        A sentence of the templates is reported unless the search contradicts it: its words may differ from their
        renderings in robots' voices.
        """
        if any(_overlaps(event, each) for each in self._reported):
            return []
        if isinstance(event, Recognised) and (self._agrees(event, result) or not contradicts(result.best, event)):
            return [self._report(event)]
        return [Garbled(event.start_sample, event.end_sample, result.robot)]

    def _is_past(self, event: Recognised | Garbled, result: SearchResult) -> bool:
        """Whether it ended MAX_WAIT ago, before any sentence began that is in progress."""
        late = self._now - event.end_sample > MAX_WAIT
        return late and all(path.starts[0] >= event.end_sample for path in result.in_progress)

    def _agrees(self, event: Recognised | Garbled, result: SearchResult) -> bool:
        """Whether the search finds this sentence likeliest, or lacks a word of it; of garbled speech: finds no
        robot."""
        if isinstance(event, Garbled):
            return not result.robot
        return event.words == result.likeliest or not self._searcher.unmodelled.isdisjoint(event.words)

    def _is_over(self, segment: OpenSegment) -> bool:
        return self._now - segment.closed_at > MAX_WAIT

    def _is_reported(self, sentence: Recognised) -> bool:
        """Whether it was reported, or is a part of what was."""
        text = f" {' '.join(sentence.words)} "
        there = [each for each in self._reported if _overlaps(sentence, each)]
        return any(text in f" {' '.join(each.words)} " or each.voice == sentence.voice for each in there)

    def _report(self, sentence: Recognised) -> Recognised:
        self._reported.append(sentence)
        if self._since is not None:  # the signs until then were that sentence's
            self._since = max(self._since, sentence.end_sample)
        return sentence


def contradicts(best: Path | None, sentence: Recognised) -> bool:
    """Whether the likeliest path follows other words through most of a sentence. At another speaking rate than those of
    the renderings a path follows a word or two of it."""
    if best is None or sentence.words[: len(best.words)] == best.words:
        return False
    length = sentence.end_sample - sentence.start_sample
    return _overlap(best.starts[0], best.end, sentence) > 0.5 * length


def _overlap(begin: int, end: int, event: Recognised | Garbled) -> int:
    return max(min(end, event.end_sample) - max(begin, event.start_sample), 0)


def _covers(closed: OpenSegment, event: Recognised | Garbled) -> bool:
    """Whether the sound that was submitted for a closed segment has some of an event; all of it, but for a faint
    beginning, if that is a sentence."""
    if isinstance(event, Garbled):
        return _overlap(closed.begin, closed.end, event) > 0
    return closed.begin <= event.start_sample + ONSET_LAG and event.end_sample <= closed.closed_at


def _overlaps(event: Recognised | Garbled, reported: Recognised) -> bool:
    """Whether most of an event, or of the reported sound, is the same sound."""
    shorter = min(event.end_sample - event.start_sample, reported.end_sample - reported.start_sample)
    return _overlap(reported.start_sample, reported.end_sample, event) > 0.5 * shorter
