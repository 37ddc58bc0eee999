"""Keeps what is learned of enrolled people's voices while the robot lives; it counts at once."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterable, Iterator, Mapping, ValuesView
from pathlib import Path

import structlog

from hvcpd.daemon.second_pass import SecondPass
from hvcpd.errors import StoreError
from hvcpd.people.enrolled import Person, Takes, person_path, read_person, write_person
from hvcpd.people.takes import ConfirmedTakes
from hvcpd.recognition.events import Recognised
from hvcpd.recognition.second_pass import Segment
from hvcpd.robot.records import HeardRecord, Record, SaidRecord

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
    """`take` what the robot reports; files are written in a thread, one after the other."""

    def __init__(
        self,
        own_name: str,
        people: Mapping[str, Person],
        learned: Callable[[Person], None],
        state_dir: Path,
        second: SecondPass[Segment, Recognised | None],
    ) -> None:
        """`people` as in CurrentPeople; `learned` is told of whom there are more takes."""
        self._learning = ConfirmedTakes(own_name)
        self._people = people
        self._learned = learned
        self._state_dir = state_dir
        self._second = second
        self._turn = asyncio.Lock()
        self._under_way: set[asyncio.Task[None]] = set()

    def take(self, records: Iterable[Record]) -> None:
        """Notice what was asked, said again and confirmed."""
        for segment, sentence in self._second.take_sentences():
            if sentence is not None:
                self._learning.found(segment, sentence)
        for record in records:
            if isinstance(record, SaidRecord):
                self._learning.said(record.utterance, record.at_s)
            elif isinstance(record, HeardRecord):
                confirmed = self._learning.heard(record.utterance, record.start_s, record.at_s)
                if confirmed is not None and confirmed[0].lower() in self._people:
                    self._keep(*confirmed)

    async def settled(self) -> None:
        """Wait until all is written."""
        while self._under_way:
            await asyncio.wait(self._under_way)

    def _keep(self, name: str, takes: Takes) -> None:
        person = self._people[name.lower()].with_takes(takes)
        self._learned(person)
        task = asyncio.get_running_loop().create_task(self._write(person.name, takes))
        self._under_way.add(task)
        task.add_done_callback(self._under_way.discard)

    async def _write(self, name: str, takes: Takes) -> None:
        async with self._turn:
            try:
                await asyncio.to_thread(_add, person_path(self._state_dir, name), takes)
            except StoreError as error:
                _log.warning("voice not learned", name=name, reason=str(error))
            else:
                _log.info("voice learned", name=name, words=" ".join(sorted(takes)))


def _add(path: Path, takes: Takes) -> None:
    """More takes to those on file, which may be others by now than this robot knows: a user enrols words, or removes
    the person, of whom then nothing is written. Raises StoreError."""
    write_person(path, read_person(path).with_takes(takes))
