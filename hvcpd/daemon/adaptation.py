"""Keeps what is learned of people's voices while the robot lives."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterable, Iterator, Mapping, ValuesView
from functools import partial
from pathlib import Path

import structlog

from hvcpd.daemon.second_pass import SecondPass
from hvcpd.errors import StoreError
from hvcpd.memory.people import person_path, read_person, write_person
from hvcpd.people.enrolled import STRANGER, Person, SpokenSentence, voice_of
from hvcpd.people.speaker_adaptation import ConfirmedSentences
from hvcpd.recognition.events import Recognised
from hvcpd.recognition.second_pass import Segment
from hvcpd.robot.records import HeardRecord, Record, SaidRecord

Write = Callable[[Path, tuple[SpokenSentence, ...]], None]

LEAST = 3
"""Confirmed sentences from which the voice of somebody who is not enrolled is kept."""

_log = structlog.get_logger(__name__)


class CurrentPeople(Mapping[str, Person]):
    """The people enrolled `now`, by name in lower case: each access asks for a value that is only replaced as a whole,
    so another thread sees the people from before a change or from after it."""

    def __init__(self, now: Callable[[], Mapping[str, Person]]) -> None:
        self._now = now

    def __getitem__(self, name: str) -> Person:
        return self._now()[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._now())

    def __len__(self) -> int:
        return len(self._now())

    def values(self) -> ValuesView[Person]:
        """All of one moment."""
        return self._now().values()


class Adaptation:
    """`take` what the robot reports; files are written in a thread, one after the other.

    Sentences that enrolled people confirm count at once. Who is not enrolled is after LEAST confirmed sentences, which
    count from the next start or reload on: the turns of the team depend on who is a robot.
    """

    def __init__(
        self,
        own_name: str,
        people: Mapping[str, Person],
        learned: Callable[[Person], None],
        state_dir: Path,
        second: SecondPass[Segment, Recognised | None],
    ) -> None:
        """`people` as in CurrentPeople; `learned` is called with the people of whom there are more sentences."""
        self._learning = ConfirmedSentences(own_name)
        self._people = people
        self._learned = learned
        self._state_dir = state_dir
        self._second = second
        self._strangers: dict[str, tuple[SpokenSentence, ...]] = {}
        """What people who are not enrolled have confirmed, by their names in lower case."""
        self._robots: set[str] = set()
        """Names, in lower case, that were said in a robot's voice."""
        self._turn = asyncio.Lock()
        self._under_way: set[asyncio.Task[None]] = set()

    def take(self, records: Iterable[Record]) -> None:
        """Notice what was said, read back and confirmed."""
        for segment, sentence in self._second.take_sentences():
            if sentence is not None:
                self._learning.found(segment, sentence)
        for record in records:
            if isinstance(record, SaidRecord):
                self._learning.said(record.utterance)
            elif isinstance(record, HeardRecord):
                self._hear(record)

    async def settled(self) -> None:
        """Wait until all is written."""
        while self._under_way:
            await asyncio.wait(self._under_way)

    def _hear(self, record: HeardRecord) -> None:
        name = (record.utterance.speaker or "").lower()
        if record.voice not in (STRANGER, voice_of(name)):
            self._robots.add(name)
        confirmed = self._learning.heard(record.utterance, record.start_s, record.at_s)
        if confirmed is None or name in self._robots:
            return
        if name in self._people:
            self._keep(self._people[name], confirmed[1:])
            return
        sentences = (*self._strangers.get(name, ()), confirmed[1])
        self._strangers[name] = sentences
        if len(sentences) == LEAST:
            del self._strangers[name]
            self._write_later(confirmed[0], partial(_begin, confirmed[0]), sentences)

    def _keep(self, person: Person, more: tuple[SpokenSentence, ...]) -> None:
        self._learned(person.with_sentences(more))
        self._write_later(person.name, _add, more)

    def _write_later(self, name: str, write: Write, more: tuple[SpokenSentence, ...]) -> None:
        task = asyncio.get_running_loop().create_task(self._write(name, write, more))
        self._under_way.add(task)
        task.add_done_callback(self._under_way.discard)

    async def _write(self, name: str, write: Write, more: tuple[SpokenSentence, ...]) -> None:
        async with self._turn:
            try:
                await asyncio.to_thread(write, person_path(self._state_dir, name), more)
            except StoreError as error:
                _log.warning("voice not learned", name=name, reason=str(error))
                return
        said, remedy = (" / ".join(" ".join(each.words) for each in more), f"hvcpctl enrol {name} --remove")
        _log.info("voice learned", name=name, said=said, to_forget_it=remedy)


def _add(path: Path, more: tuple[SpokenSentence, ...]) -> None:
    """Add sentences to those on file, which may be others by now than this robot knows: a user enrols words, or
    removes the person, of whom then nothing is written. Raises StoreError."""
    write_person(path, read_person(path).with_sentences(more))


def _begin(name: str, path: Path, more: tuple[SpokenSentence, ...]) -> None:
    """As `_add`, for a person whom this robot does not know, of whom there may be no file. Raises StoreError."""
    person = read_person(path) if path.is_file() else Person(name)
    write_person(path, person.with_sentences(more))
