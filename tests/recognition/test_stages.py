"""Speech that was not understood is looked at again, and the robot waits for it, but not for long."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import pytest

from hvcpd.people.second_pass import Found
from hvcpd.people.stage import PeopleStage
from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from hvcpd.recognition.events import Event, Garbled, Recognised
from hvcpd.recognition.stages import Segment, SpeechRecogniser, SynchronousWorker
from hvcpd.recognition.stream import Chunk, FrameStream, History
from tests.recognition.scripted import Slow, alone

BLOCK = 1600
SENTENCE = Recognised(("stop",), "stranger", 32000, 40000, 0.9, 20.0, ())


class Script:
    """First ears that tell what they are told to tell at the end of a block, counted from 0."""

    busy = speaking = possible_speech = False

    def __init__(self, events: dict[int, list[Event]]) -> None:
        self.events = events
        self.heard = 0
        self.chunks: list[Chunk] = []
        self._frames = FrameStream()
        self.history = History()
        self.session = self.front_end = self

    def push(self, samples: Samples, masked: bool = False) -> list[Event]:
        before, self.heard = self.heard // BLOCK, self.heard + len(samples)
        self.chunks = list(self._frames.push(samples, masked))
        self.history.push(samples, masked)
        return [event for k in range(before, self.heard // BLOCK) for event in self.events.get(k, [])]

    def snr_db(self, start_sample: int, end_sample: int) -> float:
        return 20.0

    def lost(self, n_samples: int) -> list[Event]:
        self.history.lose(n_samples)
        return []

    def adopt(self, others: object) -> None:
        pass

    def prepare(self, go_on: Callable[[], bool]) -> None:
        pass


class Looker:
    """Finds what it is told to find, and keeps what it was shown."""

    def __init__(self, found: Found, goes_on: bool = False) -> None:
        self.found = found
        self.has_successors = goes_on
        self.segments: list[Segment] = []
        self.prepared = 0

    def prepare(self, go_on: Callable[[], bool]) -> None:
        self.prepared += go_on()

    def search(self, segment: Segment) -> Found:
        self.segments.append(segment)
        return self.found

    def may_go_on(self, words: Sequence[str]) -> bool:
        return self.has_successors


def test_what_takes_long_is_made_ready_before_anybody_speaks() -> None:
    looker = Looker(None)
    alone(PeopleStage(Script({}), looker, SynchronousWorker())).prepare(lambda: True)
    assert looker.prepared == 1


def block(number: int) -> Samples:
    """One that tells its number."""
    return np.full(BLOCK, number / 1024, np.float32)


def numbers(sound: Samples) -> set[int]:
    return {round(1024 * float(x)) for x in sound}


def run(recogniser: SpeechRecogniser, n: int, first: int = 0) -> list[Event]:
    return [event for k in range(first, first + n) for event in recogniser.push(block(k))]


def test_a_sentence_takes_the_place_of_what_was_garbled() -> None:
    looker = Looker(SENTENCE)
    recogniser = alone(PeopleStage(Script({29: [Garbled(32000, 40000)]}), looker, SynchronousWorker()))
    assert run(recogniser, 40) == [SENTENCE]
    [segment] = looker.segments
    assert (segment.start, segment.end) == (32000, 40000)
    # The sound tells its own place: each block holds its number.
    assert 1024 * segment.sound[segment.lead] == 32000 // BLOCK
    assert len(segment.sound) - segment.lead >= 8000


def test_what_nobody_understands_stays_garbled() -> None:
    recogniser = alone(PeopleStage(Script({29: [Garbled(32000, 40000)]}), Looker(None), SynchronousWorker()))
    assert run(recogniser, 40) == [Garbled(32000, 40000)]


def test_whom_garbled_speech_is_for_is_told_when_nobody_goes_on() -> None:
    garbled = Garbled(32000, 40000)
    for_me, worker = replace(garbled, addressed=True), Slow[Segment, Found]()
    recogniser = alone(PeopleStage(Script({29: [garbled]}), Looker(for_me, goes_on=True), worker))
    told = run(recogniser, 31)
    worker.end()
    assert (told, run(recogniser, 3, first=31)) == ([], [])
    assert run(recogniser, 20, first=34) == [for_me]


def test_a_sentence_that_was_understood_is_not_looked_at() -> None:
    looker = Looker(None)
    recogniser = alone(PeopleStage(Script({29: [SENTENCE]}), looker, SynchronousWorker()))
    assert run(recogniser, 40) == [SENTENCE]
    assert looker.segments == []


def test_the_robot_waits_for_a_slow_look_and_then_hears_it() -> None:
    worker = Slow()
    recogniser = alone(PeopleStage(Script({29: [Garbled(32000, 40000)]}), Looker(SENTENCE), worker))
    assert run(recogniser, 35) == []
    assert recogniser.busy
    worker.end()
    assert recogniser.push(block(35)) == [SENTENCE]
    assert not recogniser.busy


def test_who_waits_too_long_calls_it_garbled_and_hears_no_more_of_it() -> None:
    worker = Slow()
    recogniser = alone(PeopleStage(Script({29: [Garbled(32000, 40000)]}), Looker(SENTENCE), worker))
    assert run(recogniser, 60) == [Garbled(32000, 40000)]
    worker.end()
    assert run(recogniser, 5) == []


def test_too_much_to_do_is_garbled_at_once() -> None:
    worker = Slow(room=1)
    events: dict[int, list[Event]] = {29: [Garbled(32000, 40000)], 32: [Garbled(44000, 50000)]}
    recogniser = alone(PeopleStage(Script(events), Looker(None), worker))
    assert run(recogniser, 33) == [Garbled(44000, 50000)]


def test_what_may_go_on_is_told_when_nobody_goes_on() -> None:
    recogniser = alone(
        PeopleStage(Script({29: [Garbled(32000, 40000)]}), Looker(SENTENCE, goes_on=True), SynchronousWorker())
    )
    assert run(recogniser, 34) == []
    assert recogniser.busy  # nobody answers half a sentence
    assert run(recogniser, 1, 34) == [SENTENCE]
    assert not recogniser.busy


def while_somebody_speaks(script: Script, recogniser: SpeechRecogniser) -> list[Event]:
    """The events of blocks 30 to 39, in which somebody goes on."""
    script.speaking = True
    events = run(recogniser, 10, 30)
    script.speaking = False
    return events


@pytest.mark.parametrize("half", [None, replace(SENTENCE, words=("hi", "rob"))])
def test_a_sentence_with_a_long_pause_is_looked_at_as_one(half: Recognised | None) -> None:
    looker = Looker(half, goes_on=True)
    script = Script({29: [Garbled(32000, 40000)], 44: [Garbled(52000, 64000)]})
    recogniser = alone(PeopleStage(script, looker, SynchronousWorker()))
    assert run(recogniser, 30) == []
    assert while_somebody_speaks(script, recogniser) == []
    looker.found, looker.has_successors = SENTENCE, False
    assert run(recogniser, 10, 40) == [SENTENCE]
    [_, whole] = looker.segments
    assert (whole.start, whole.end, whole.later) == (32000, 64000, (52000,))


def test_the_first_half_of_a_sentence_is_not_told_although_the_second_comes_late() -> None:
    """The channel search may hold the second half for two seconds."""
    looker = Looker(replace(SENTENCE, words=("hi", "rob")), goes_on=True)
    script = Script({29: [Garbled(32000, 40000)], 64: [Garbled(52000, 64000)]})
    recogniser = alone(PeopleStage(script, looker, SynchronousWorker()))
    assert run(recogniser, 30) == []
    assert while_somebody_speaks(script, recogniser) == []
    assert run(recogniser, 20, 40) == [Garbled(32000, 40000)]
    looker.found, looker.has_successors = SENTENCE, False
    assert run(recogniser, 10, 60) == [SENTENCE]


def test_a_sentence_is_told_although_another_search_of_it_goes_on() -> None:
    """The channel search may still hold its last sound: that is nobody who goes on."""
    recogniser = alone(
        PeopleStage(Script({29: [Garbled(32000, 40000)]}), Looker(SENTENCE, goes_on=True), SynchronousWorker())
    )
    assert run(recogniser, 30) == []
    recogniser.first_pass.busy = True  # type: ignore[misc]
    assert run(recogniser, 10, 30) == [SENTENCE]


def test_what_is_said_long_after_is_looked_at_alone() -> None:
    looker = Looker(None)
    recogniser = alone(
        PeopleStage(Script({29: [Garbled(32000, 40000)], 44: [Garbled(57000, 64000)]}), looker, SynchronousWorker())
    )
    assert run(recogniser, 60) == [Garbled(32000, 40000), Garbled(57000, 64000)]
    assert [segment.start for segment in looker.segments] == [32000, 57000]


def test_endless_talk_is_not_looked_at() -> None:
    looker = Looker(SENTENCE)
    long = Garbled(32000, 32000 + 13 * SAMPLE_RATE_HZ)
    recogniser = alone(PeopleStage(Script({155: [long]}), looker, SynchronousWorker()))
    assert run(recogniser, 157) == [long]
    assert looker.segments == []


def test_the_own_voice_is_not_in_the_sound() -> None:
    looker = Looker(None)
    recogniser = alone(PeopleStage(Script({29: [Garbled(32000, 40000)]}), looker, SynchronousWorker()))
    for k in range(30):
        recogniser.push(block(k), masked=10 <= k < 18)
    assert not set(range(10, 18)) & numbers(looker.segments[0].sound)


def test_what_is_no_sound_is_not_looked_at() -> None:
    looker = Looker(None)
    recogniser = alone(PeopleStage(Script({29: [Garbled(32000, 40000)]}), looker, SynchronousWorker()))
    for k in range(30):
        recogniser.push(np.full(BLOCK, (np.nan, np.inf, -1e20)[k % 3], np.float32))
    assert np.abs(looker.segments[0].sound).max() <= 1.0


def test_what_was_asked_before_something_was_learned_is_still_told() -> None:
    worker, first, second = Slow(), Looker(SENTENCE), Looker(None)
    recogniser = alone(PeopleStage(Script({29: [Garbled(32000, 40000)], 49: [Garbled(72000, 80000)]}), first, worker))
    run(recogniser, 30)
    recogniser.adopt(alone(PeopleStage(Script({}), second, Slow())))
    assert recogniser.busy
    worker.end()
    assert run(recogniser, 20, 30) == [SENTENCE]
    worker.end()
    assert [len(first.segments), len(second.segments)] == [1, 1]


def test_what_is_said_at_once_after_the_start_is_looked_at() -> None:
    looker = Looker(SENTENCE)
    recogniser = alone(PeopleStage(Script({9: [Garbled(0, 8000)]}), looker, SynchronousWorker()))
    assert run(recogniser, 12) == [SENTENCE]
    assert [segment.lead for segment in looker.segments] == [0]


@pytest.mark.parametrize(
    ("lost", "quiet_blocks", "after", "seen"),
    [
        (BLOCK, 10, 0, False),  # its first sound may be lost
        (BLOCK, 10, BLOCK, True),
        (BLOCK, 4, BLOCK, False),  # it may go on with what was said before
        (BLOCK + 1, 10, BLOCK, False),  # a word may have been lost
        (0, 10, BLOCK, False),  # nobody knows how much was
        (0, 10, 5 * BLOCK, True),
    ],
)
def test_speech_that_may_be_torn_is_not_looked_at(lost: int, quiet_blocks: int, after: int, seen: bool) -> None:
    looker, script = Looker(SENTENCE), Script({})
    recogniser = alone(PeopleStage(script, looker, SynchronousWorker()))
    script.speaking = True
    run(recogniser, 10)
    script.speaking = False
    run(recogniser, quiet_blocks, 10)
    recogniser.lost(lost)
    start = (10 + quiet_blocks) * BLOCK + lost + after
    script.events[29] = [Garbled(start, start + 8000)]
    run(recogniser, 30 - 10 - quiet_blocks, 10 + quiet_blocks)
    assert bool(looker.segments) == seen


def test_speech_with_a_gap_in_it_is_not_looked_at() -> None:
    looker = Looker(SENTENCE)
    recogniser = alone(PeopleStage(Script({29: [Garbled(32000, 40000)]}), looker, SynchronousWorker()))
    run(recogniser, 21)
    recogniser.lost(BLOCK)
    run(recogniser, 9, 21)
    assert not looker.segments
