"""Learns people's voices while the robot lives: by sentences that a robot read back, and the same person confirmed."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, ValuesView
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import structlog

from hvcpd.coordination.peers import team_of
from hvcpd.daemon.second_pass import SecondPass
from hvcpd.daemon.worker_thread import WorkerThread
from hvcpd.errors import StoreError
from hvcpd.language.addressees import FRIEND
from hvcpd.language.messages import Claim, Confirmed, Motion, Order, Statement, ToRobot, Utterance, WillMove
from hvcpd.memory.people import is_enrolled, person_path, read_person, write_person
from hvcpd.people.enrolled import Person, SpokenSentence, is_of_person
from hvcpd.people.phones import net_inputs
from hvcpd.people.second_pass import Found
from hvcpd.ports import SAMPLE_RATE_HZ
from hvcpd.recognition.events import Recognised
from hvcpd.recognition.stages import Segment
from hvcpd.robot.records import HeardRecord, Record, SaidRecord

Write = Callable[[Path, tuple[SpokenSentence, ...]], None]

LEAST = 3
"""Confirmed sentences from which the voice of somebody who is not enrolled is kept."""

CONFIRMED_S = 20.0
"""Time after the sentence in which a confirmation refers to it: the robot has read it back by then."""

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


@dataclass
class _Candidate:
    speaker: str
    at_s: float
    segment: Segment
    words: tuple[str, ...]
    statement: Statement | None
    read_back: bool = False


class ConfirmedSentences:
    """Finds sentences of people that a robot read back and the same person confirmed: their words are certain."""

    def __init__(self, own_name: str) -> None:
        self._own_name = own_name.lower()
        self._found: tuple[Segment, Recognised] | None = None
        self._candidate: _Candidate | None = None

    def said(self, utterance: Utterance) -> None:
        """Note a sentence that the robot says: it may read the candidate back to its speaker."""
        candidate, to = self._candidate, utterance.addressee
        if candidate is None or not isinstance(to, ToRobot) or to.name.lower() != candidate.speaker:
            return
        ordered = candidate.statement
        if isinstance(ordered, Order):
            candidate.read_back |= utterance.statement == Claim(ordered.task)
        elif isinstance(ordered, Motion):
            candidate.read_back |= utterance.statement == WillMove(ordered)

    def found(self, segment: Segment, sentence: Recognised) -> None:
        """Note a second-pass result for a segment of sound."""
        self._found = (segment, sentence)

    def heard(self, utterance: Utterance, start_s: float, now: float) -> tuple[str, SpokenSentence] | None:
        """Take a recognised sentence that began at `start_s`; return the speaker's name and earlier sentence if it
        confirms one."""
        speaker = (utterance.speaker or "").lower()
        found, self._found = self._found, None
        candidate = self._candidate
        if speaker == FRIEND:
            self._candidate = None  # the same person may have denied it, or ordered something else
        if speaker in ("", FRIEND, self._own_name):
            return None
        if candidate is not None and speaker == candidate.speaker:
            self._candidate = None
        if isinstance(utterance.statement, Confirmed):
            if candidate is None or candidate.speaker != speaker or not candidate.read_back:
                return None
            if now - candidate.at_s > CONFIRMED_S:
                return None
            return utterance.speaker or "", SpokenSentence(candidate.words, net_inputs(candidate.segment))
        if found is not None:
            segment, sentence = found
            if not segment.later and abs(sentence.start_sample / SAMPLE_RATE_HZ - start_s) < 0.001:
                self._candidate = _Candidate(speaker, now, segment, sentence.words, utterance.statement)
        return None


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
        second: SecondPass[Segment, Found],
        robots: Iterable[str] = (),
    ) -> None:
        """`people` as in CurrentPeople; `learned` is called with the people of whom there are more sentences; `robots`:
        names that are known to be robots'."""
        self._learning = ConfirmedSentences(own_name)
        self._people = people
        self._learned = learned
        self._state_dir = state_dir
        self._second = second
        self._strangers: dict[str, tuple[SpokenSentence, ...]] = {}
        """What people who are not enrolled have confirmed, by their names in lower case."""
        self._robots = {name.lower() for name in robots}
        """Names, in lower case, that have named their team, or were said in a robot's voice."""
        self._thread = WorkerThread("voices")

    def take(self, records: Iterable[Record]) -> None:
        """Note what was said, read back and confirmed."""
        for segment, sentence in self._second.take_sentences():
            if isinstance(sentence, Recognised):
                self._learning.found(segment, sentence)
        for record in records:
            if isinstance(record, SaidRecord):
                self._learning.said(record.utterance)
            elif isinstance(record, HeardRecord):
                self._hear(record)

    async def settled(self) -> None:
        """Wait until all is written."""
        await self._thread.settled()

    def _hear(self, record: HeardRecord) -> None:
        name = (record.utterance.speaker or "").lower()
        if team_of(record.utterance) is not None or not is_of_person(record.voice):
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
            self._thread.run(self._write, confirmed[0], partial(_begin, confirmed[0]), sentences)

    def _keep(self, person: Person, more: tuple[SpokenSentence, ...]) -> None:
        self._learned(person.with_sentences(more))
        self._thread.run(self._write, person.name, _add, more)

    def _write(self, name: str, write: Write, more: tuple[SpokenSentence, ...]) -> None:
        try:
            write(person_path(self._state_dir, name), more)
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
    person = read_person(path) if is_enrolled(path) else Person(name)
    write_person(path, person.with_sentences(more))
