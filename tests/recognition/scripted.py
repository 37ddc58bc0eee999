"""First ears that follow a script, a slow worker, and the channel ears around them."""

from __future__ import annotations

from collections.abc import Callable, MutableSequence, Sequence
from typing import Generic

from hvcpd.ports import Samples
from hvcpd.recognition.channel.search import ChannelSegment, SearchResult
from hvcpd.recognition.channel.stage import ChannelStage
from hvcpd.recognition.events import Event, Garbled, Recognised, Source
from hvcpd.recognition.stages import (
    Job,
    Result,
    SpeechRecogniser,
    Stage,
    SynchronousWorker,
    Worker,
)
from hvcpd.recognition.stream import Chunk, History
from tests.recognition.hisses import fresh, scene, spoken, through_a_room

AT, BLOCK = 40_000, 1600
HEARD = through_a_room(spoken("hi rob, water rose"), 1)
END = AT + len(HEARD)
SOUND = scene(160_000, (AT, HEARD))
RIGHT = ("hi", "rob", "water", "rose")
GARBLED = Garbled(AT, END)
SNR_DB = 12.0
Times = Sequence[tuple[int, int]]


class Script:
    """First ears that have signs of speech at some samples, and tell an event each once some sample was heard."""

    def __init__(self, events: Sequence[tuple[int, Event]] = (), speech: Times = ((AT, END),)) -> None:
        self.events, self.speech = list(events), speech
        self.now, self.session, self.front_end = 0, self, self
        self.possible_speech = self.speaking = self.busy = self.prepared = False
        self.since: int | None = None
        self.ending_word, self.gain = "", 0.0
        self.learned: object = None
        self.chunks: Sequence[Chunk] = ()
        self.history = History()

    def push(self, samples: Samples, masked: bool = False) -> list[Event]:
        before, self.now = self.now, self.now + len(samples)
        self.history.push(samples, masked)
        self.possible_speech = self.speaking = self.busy = any(
            begin < self.now and before < end for begin, end in self.speech
        )
        return [event for at, event in self.events if before < at <= self.now]

    def lost(self, n_samples: int) -> list[Event]:
        self.now += n_samples
        self.history.lose(n_samples)
        return []

    def snr_db(self, start_sample: int, end_sample: int) -> float:
        return SNR_DB

    def flush(self) -> list[Event]:
        return []

    def adopt(self, others: object) -> None:
        self.learned = others

    def prepare(self, go_on: Callable[[], bool]) -> None:
        self.prepared = go_on()


class Slow(Generic[Job, Result]):
    """A worker that has not ended until it is told to."""

    def __init__(self, room: int = 9) -> None:
        self.waiting: MutableSequence[tuple[Job, Callable[[Job], Result]]] = []
        self.room = room
        self.done: list[tuple[Job, Result]] = []

    def submit(self, job: Job, search: Callable[[Job], Result]) -> bool:
        if len(self.waiting) >= self.room:
            return False
        self.waiting.append((job, search))
        return True

    def end(self) -> None:
        self.done += [(job, search(job)) for job, search in self.waiting]
        self.waiting.clear()

    def results(self) -> Sequence[tuple[Job, Result]]:
        done, self.done = self.done, []
        return done


def alone(stage: Stage) -> SpeechRecogniser:
    """An ear with no other stage."""
    return SpeechRecogniser(stage.first_pass, [stage])


def recogniser(script: Script, worker: Worker[ChannelSegment, SearchResult] | None = None) -> SpeechRecogniser:
    return alone(ChannelStage(script, fresh("oak"), worker or SynchronousWorker()))


def run(
    to: SpeechRecogniser,
    first: int = 0,
    last: int = len(SOUND),
    sound: Samples = SOUND,
    own: Times = (),
    block: int = BLOCK,
) -> list[Event]:
    """Samples `first` up to `last`, the own voice's masked."""
    told: list[Event] = []
    for at in range(first, last, block):
        told += to.push(sound[at : min(at + block, last)], any(begin <= at < end for begin, end in own))
    return told


def guess(
    text: str = "hi rob water lily", sure: float = 0.9, source: Source = Source.TEMPLATES, end: int = END
) -> Recognised:
    return Recognised(tuple(text.split()), "oak", AT, end, sure, 10.0, (), source)


def the_sentence(told: Sequence[Event]) -> Recognised:
    [event] = told
    assert isinstance(event, Recognised)
    assert (event.words, event.source, event.snr_db) == (RIGHT, Source.CHANNEL, SNR_DB)
    assert abs(event.start_sample - AT) <= 32
    return event
