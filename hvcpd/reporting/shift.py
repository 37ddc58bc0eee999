"""A shift, read from one robot's transcript: who did what, how well they understood each other, what went wrong."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from hvcpd.config.tasks import TaskDefinition
from hvcpd.coordination.peers import team_of
from hvcpd.errors import PhraseError
from hvcpd.language import messages as m
from hvcpd.language.phrasebook import Phrasebook
from hvcpd.memory.store import TranscriptRow
from hvcpd.reporting.ends import ReportedEnds, told
from hvcpd.reporting.events import Event, Garbled, Heard, MissionRecord, Performed, Said, Started, TaskChanged
from hvcpd.reporting.occurrences import Occurrence
from hvcpd.reporting.story import Story, tell
from hvcpd.reporting.text import task_words

WORD_S = 0.4
"""Duration for which a word is drawn: the transcript keeps when a sentence began. An utterance of nine words lasts some
3.6 s."""
BINS = 32
"""Parts in which a shift's talk is counted: a quarter of an hour each where it lasts eight hours."""


@dataclass
class Member:
    """Somebody who spoke. `confidence` is the mean of what was heard, None for the robot whose transcript it is."""

    name: str
    team: str | None = None
    sentences: int = 0
    confidences: list[float] = field(default_factory=list)
    done: list[int] = field(default_factory=list)
    failed: list[int] = field(default_factory=list)
    report: m.Report | None = None
    """Its last one."""

    @property
    def confidence(self) -> float | None:
        """The mean."""
        return sum(self.confidences) / len(self.confidences) if self.confidences else None


@dataclass(frozen=True)
class Bin:
    """A part of the shift: when it begins (seconds since 1970), sentences heard, and speech not understood."""

    from_s: float
    heard: int
    garbled: int


@dataclass(frozen=True)
class Trouble:
    """What a person should know of: when (seconds since 1970), and what."""

    wall_s: float
    text: str


@dataclass(frozen=True)
class Shift:
    """Times are seconds since 1970; those of the `story` count from `begin_s`."""

    own: str
    begin_s: float
    end_s: float
    members: tuple[Member, ...]
    bins: tuple[Bin, ...]
    troubles: tuple[Trouble, ...]
    said: int
    """Sentences of the robot itself, whatever its name was then."""
    heard: int
    """Sentences that it heard from others and understood."""
    garbled: int
    unknown: int
    """Sentences that today's phrasebook does not have, as after a change of names."""
    story: Story
    due: tuple[Occurrence, ...] = ()
    """What became due, where that is known."""
    together: Mapping[int, int] = field(default_factory=dict)
    """The tasks for several robots, and for how many."""

    @property
    def understood(self) -> float | None:
        """The share of the speech heard that was understood, 0 to 1; None if none was heard."""
        return self.heard / (self.heard + self.garbled) if self.heard + self.garbled else None

    @property
    def done(self) -> Counter[int]:
        """How often each task was done: by several robots together is once, by some of them not yet."""
        deeds = Counter(number for member in self.members for number in member.done)
        return +Counter({number: n // self.together.get(number, 1) for number, n in deeds.items()})


def read_shift(
    rows: Sequence[TranscriptRow],
    phrasebook: Phrasebook,
    tasks: Sequence[TaskDefinition],
    span_s: tuple[float, float],
    due: tuple[Occurrence, ...] = (),
) -> Shift:
    """The shift that lasted from `span_s[0]` to `span_s[1]`, by the rows of that time that the clock was known at."""
    timed = [row for row in rows if row.wall_s is not None and span_s[0] <= row.wall_s <= span_s[1]]
    kinds = Counter(row.record.kind for row in timed)
    names_said = (row.record.speaker for row in reversed(timed) if row.record.kind == "said" and row.record.speaker)
    own = next(names_said, "the robot")  # by its last name
    begin_s = min((row.wall_s or 0.0 for row in timed), default=span_s[0])  # the clock may have been set back
    together = {task.number: task.robots for task in tasks if task.robots > 1}
    reader = _Reader(own, begin_s, {task.number: task.name for task in tasks}, together)
    for row in timed:
        reader.take(row, phrasebook)
    names = tuple(reader.members)
    named = tuple((task.number, task.name) for task in tasks)
    icons = tuple((task.number, task.icon) for task in tasks if task.icon)
    started = Started(0.0, names, (), (), "shift", 0, math.nan, named, icons)
    record = MissionRecord((started, *reader.events), (), np.zeros(0, np.float32))
    return Shift(
        own,
        begin_s,
        span_s[1],
        tuple(reader.members.values()),
        _bins(timed, begin_s, span_s[1]),
        tuple(reader.troubles),
        kinds["said"],
        kinds["heard"],
        reader.garbled,
        reader.unknown,
        tell(record),
        due,
        together,
    )


def _bins(rows: Iterable[TranscriptRow], begin_s: float, end_s: float) -> tuple[Bin, ...]:
    length_s = max(end_s - begin_s, 1.0) / BINS
    heard, garbled = Counter[int](), Counter[int]()
    for row in rows:
        k = min(int(((row.wall_s or 0.0) - begin_s) / length_s), BINS - 1)
        if row.record.kind == "heard":
            heard[k] += 1
        elif row.record.kind == "garbled" and not row.record.text:
            garbled[k] += 1
    return tuple(Bin(begin_s + k * length_s, heard[k], garbled[k]) for k in range(BINS))


class _Reader:
    """Takes rows one after the other."""

    def __init__(self, own: str, begin_s: float, names: dict[int, str], together: Mapping[int, int]) -> None:
        self.members: dict[str, Member] = {own: Member(own)}
        self.events: list[Event] = []
        self.troubles: list[Trouble] = []
        self.garbled = self.unknown = 0
        self._own, self._begin_s, self._names, self._together = own, begin_s, names, together
        self._ends = ReportedEnds(names)
        self._claimed: dict[int, list[str]] = {}
        """Who has each task, the latest to say so last."""
        self._next = 0

    def take(self, row: TranscriptRow, phrasebook: Phrasebook) -> None:
        """Count a row, and note what it tells of tasks."""
        record, wall_s = row.record, row.wall_s or 0.0
        at_s = wall_s - self._begin_s
        if record.kind == "garbled" and record.text:  # a note: what the robot did not believe, or stood still for
            self.troubles.append(Trouble(wall_s, record.text))
            return
        if record.kind == "garbled":
            self.garbled += 1
            self.events.append(Garbled(at_s, self._own))
            return
        speaker = record.speaker or "somebody"
        member = self._member(speaker)
        member.sentences += 1
        if record.confidence is not None:
            member.confidences.append(record.confidence)
        self._speak(at_s, speaker, record.text, record.confidence)
        try:
            utterance = phrasebook.parse_text(record.text)
        except PhraseError:
            self.unknown += 1
            return
        member.team = team_of(utterance) or member.team
        for who, statement in told(utterance, speaker):
            self._tell(statement, self._member(who), wall_s)

    def _member(self, name: str) -> Member:
        return self.members.setdefault(name, Member(name))

    def _speak(self, at_s: float, speaker: str, text: str, confidence: float | None) -> None:
        number, self._next = self._next, self._next + 1
        self.events.append(Said(at_s, at_s + WORD_S * len(text.split()), number, speaker, text, collided=False))
        heard = Heard(at_s, number, self._own, speaker, text, 1.0 if confidence is None else confidence, math.nan)
        self.events.append(heard)

    def _tell(self, statement: m.Statement, member: Member, wall_s: float) -> None:
        for ended, task in self._ends.new(member.name, statement, wall_s):
            if ended is m.Completed:
                member.done.append(task)
                self.events.append(Performed(wall_s - self._begin_s, member.name, task, math.nan, math.nan))
                self._change(task, "done", member.name, wall_s)
            else:
                member.failed.append(task)
                self._change(task, "open", member.name, wall_s)
                self.troubles.append(Trouble(wall_s, f"{member.name} gave up {self._task(task)}"))
        match statement:
            case m.Claim(task=ref) | m.Working(ref):  # of two claimed at once a robot goes to the first
                self._change(self._ends.number(ref), "claimed", member.name, wall_s)
            case m.Report():
                member.report = statement
            case m.Stop():
                self.troubles.append(Trouble(wall_s, f"“stop”, said by {member.name}"))
            case m.Unable(m.TaskByNumber(number)):
                self.troubles.append(Trouble(wall_s, f"{member.name} cannot do {self._task(number)}"))
            case m.NameTaken():
                self.troubles.append(Trouble(wall_s, f"two robots answer to the name {member.name}"))

    def _task(self, number: int) -> str:
        return task_words(number, self._names.get(number))

    def _change(self, number: int | None, state: str, robot: str, wall_s: float) -> None:
        if number is None:
            return
        at_s, owner = wall_s - self._begin_s, None if state == "open" else robot
        others = [name for name in self._claimed.get(number, ()) if name != robot]
        gone = max(len(others) + 1 - self._together.get(number, 1), 0)
        for name in others[:gone]:  # they have the task no longer, whether they said so or not
            self.events.append(TaskChanged(at_s, name, number, state, owner))
        self._claimed[number] = others[gone:] + [robot] * (state == "claimed")
        self.events.append(TaskChanged(at_s, robot, number, state, owner))
