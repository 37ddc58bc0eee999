"""A mission's events read as a story: who said what and who heard it, and how every task went."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from hvcpd.reporting.events import (
    Event,
    Garbled,
    Heard,
    MissionRecord,
    Performed,
    Plant,
    Said,
    Skill,
    Started,
    Summary,
    Switched,
    TaskChanged,
)
from hvcpd.reporting.palette import robot_slot
from hvcpd.reporting.text import listed, plural, skill_words

SLACK_S = 0.5
"""A listener may take the beginning of speech to be this much off: sound travels 29 ms, detection adds some frames."""


@dataclass(frozen=True)
class Line:
    """One utterance: `heard` by some, rightly or not; `garbled` to others; `missed` noticed nothing of it."""

    said: Said
    heard: tuple[Heard, ...]
    garbled: tuple[str, ...]
    missed: tuple[str, ...]


@dataclass(frozen=True)
class TaskStory:
    """One task. `claimed_s` is when its doer took it, None if unknown; `performed` are the physical acts."""

    number: int
    name: str
    plant: Plant | None
    owner: str | None
    claimed_s: float | None
    performed: tuple[Performed, ...]
    icon: str = ""

    @property
    def done_s(self) -> float | None:
        return self.performed[0].at_s if self.performed else None

    @property
    def distance_m(self) -> float | None:
        """From the robot to the task's place when it was carried out first."""
        if not self.performed or self.plant is None:
            return None
        return math.hypot(self.performed[0].x_m - self.plant.x_m, self.performed[0].y_m - self.plant.y_m)


@dataclass(frozen=True)
class Span:
    """A robot worked on a task from `from_s` to `to_s`, and it ended so: done, given up or unfinished."""

    robot: str
    task: int
    from_s: float
    to_s: float
    ended: str


@dataclass(frozen=True)
class SkillSpan:
    """A robot used a skill for a task, from the call to its `last` state; of a call cut short that is not its end."""

    from_s: float
    last: Skill

    @property
    def litres(self) -> float | None:
        """How much was poured, if that was told."""
        found = self.last.results.get("litres")
        return found if isinstance(found, float) else None

    @property
    def is_done(self) -> bool:
        """Whether it came to a good end."""
        return self.last.state == "finished"

    @property
    def words(self) -> str:
        """Outcome."""
        return skill_words(vars(self.last))


@dataclass(frozen=True)
class OnSpan:
    """What a robot used for a task was on from `on` to `off_s`."""

    on: Switched
    off_s: float


@dataclass(frozen=True)
class Story:
    """The whole mission, in the order of time."""

    started: Started
    summary: Summary | None
    end_s: float
    robots: tuple[str, ...]
    lines: tuple[Line, ...]
    tasks: tuple[TaskStory, ...]
    spans: tuple[Span, ...]
    performed: tuple[Performed, ...]
    skills: tuple[SkillSpan, ...]
    switched: tuple[OnSpan, ...]
    unplaced: tuple[Garbled | Heard, ...]
    """What listeners noticed although no robot spoke: a person, or noise."""

    @property
    def wrong(self) -> tuple[tuple[int, ...], tuple[int, ...]]:
        """The tasks that were not carried out, and those that were more than once."""
        return (self.summary.undone, self.summary.repeated) if self.summary is not None else ((), ())

    @property
    def slots(self) -> dict[str, int]:
        """The number of each robot's colour."""
        return {name: robot_slot(k) for k, name in enumerate(self.robots)}


def tell(record: MissionRecord) -> Story:
    """Read a record; one without Started or Summary (a mission cut short) can be read too."""
    events = record.events
    started = _started(events, record)
    summary = next((e for e in reversed(events) if isinstance(e, Summary)), None)
    changes = sorted((e for e in events if isinstance(e, TaskChanged)), key=lambda e: e.at_s)
    performed = sorted((e for e in events if isinstance(e, Performed)), key=lambda e: e.at_s)
    robots = _robots(started, events)
    lines, unplaced = _lines(events, robots)
    end_s = _end_s(events, record, summary)
    return Story(
        started,
        summary,
        end_s,
        robots,
        lines,
        _tasks(started, changes, performed),
        _spans(robots, changes, performed, end_s),
        tuple(performed),
        _skills(events),
        _switched(events, end_s),
        unplaced,
    )


def _skills(events: Iterable[Event]) -> tuple[SkillSpan, ...]:
    calls: dict[tuple[str, int], SkillSpan] = {}
    for event in events:
        if isinstance(event, Skill):
            key = (event.robot, event.call)
            calls[key] = SkillSpan(calls[key].from_s if key in calls else event.at_s, event)
    return tuple(sorted(calls.values(), key=lambda span: span.from_s))


def _switched(events: Iterable[Event], end_s: float) -> tuple[OnSpan, ...]:
    spans: list[OnSpan] = []
    on: dict[tuple[str, str], Switched] = {}
    for event in events:
        if isinstance(event, Switched):
            key = event.robot, event.skill
            begun = on.pop(key, None)
            spans += [OnSpan(begun, event.at_s)] if begun is not None else []
            on |= {key: event} if event.on else {}
    return tuple(sorted((*spans, *(OnSpan(each, end_s) for each in on.values())), key=lambda span: span.on.at_s))


def _started(events: Sequence[Event], record: MissionRecord) -> Started:
    found = next((e for e in events if isinstance(e, Started)), None)
    names = tuple(trail.robot for trail in record.trails)
    return found or Started(0.0, names, (), (), "unknown", 0, math.nan)


def _robots(started: Started, events: Iterable[Event]) -> tuple[str, ...]:
    """The team in its order, and after it whoever else took part."""
    names = dict.fromkeys(started.robots)
    for event in events:
        match event:
            case Said(speaker=name) | Heard(listener=name) | Garbled(listener=name):
                names.setdefault(name)
            case TaskChanged(robot=name) | Performed(robot=name) | Skill(robot=name):
                names.setdefault(name)
    return tuple(names)


def _end_s(events: Sequence[Event], record: MissionRecord, summary: Summary | None) -> float:
    ends = [summary.virtual_s] if summary else []
    ends += [float(trail.t_s[-1]) for trail in record.trails if len(trail.t_s)]
    ends += [e.end_s if isinstance(e, Said) else e.at_s for e in events if not isinstance(e, Summary)]
    return max((end for end in ends if math.isfinite(end)), default=1.0) or 1.0


def _lines(events: Sequence[Event], robots: Sequence[str]) -> tuple[tuple[Line, ...], tuple[Garbled | Heard, ...]]:
    spoken = sorted((e for e in events if isinstance(e, Said)), key=lambda e: (e.at_s, e.utterance))
    heard: dict[int, dict[str, Heard]] = {said.utterance: {} for said in spoken}
    garbled: dict[int, list[str]] = {said.utterance: [] for said in spoken}
    unplaced: list[Garbled | Heard] = []
    for event in events:
        if isinstance(event, Heard):
            if event.utterance in heard:
                heard[event.utterance][event.listener] = event
            else:
                unplaced.append(event)
        elif isinstance(event, Garbled):
            said = meant_by(event, spoken)
            if said is None:
                unplaced.append(event)
            else:
                garbled[said.utterance].append(event.listener)
    lines = (line_of(said, heard[said.utterance], garbled[said.utterance], robots) for said in spoken)
    return tuple(lines), tuple(unplaced)


def line_of(said: Said, heard: Mapping[str, Heard], garbled: Iterable[str], robots: Iterable[str]) -> Line:
    """An utterance with those of the robots that heard it, by name, and those to which it was garbled."""
    wrong = tuple(name for name in dict.fromkeys(garbled) if name not in heard)
    known = {said.speaker, *heard, *wrong}
    return Line(said, tuple(heard.values()), wrong, tuple(name for name in robots if name not in known))


def meant_by(garbled: Garbled, spoken: Iterable[Said]) -> Said | None:
    """The utterance of another robot that a garbled one most likely was: of those under way, the latest begun."""
    under_way = [
        said
        for said in spoken
        if said.speaker != garbled.listener and said.at_s - SLACK_S <= garbled.at_s <= said.end_s + SLACK_S
    ]
    return max(under_way, key=lambda said: said.at_s, default=None)


def all_went_well(summary: Summary) -> bool:
    """Whether every task was done exactly once."""
    return summary.lost == 0 and summary.duplicates == 0


def outcome(summary: Summary) -> str:
    """How a mission ended."""
    if all_went_well(summary):
        few = {1: "The task was done", 2: "Both tasks done, each"}
        return f"{few.get(summary.tasks, f'All {summary.tasks} tasks done, each')} exactly once"
    counts = {"not done": summary.lost, "done more than once": len(summary.repeated)}
    wrong = [f"{count} {what}" for what, count in counts.items() if count]
    stopped = f": {listed(summary.stopped)} stopped, and nobody said “resume”" if summary.stopped else ""
    return f"Of {plural(summary.tasks, 'task')}, {listed(wrong)}{stopped}"


def task_names(started: Started) -> dict[int, str]:
    """Every task's name by its number."""
    return dict(started.tasks) or {plant.task: plant.name for plant in started.plants}


def _tasks(started: Started, changes: Sequence[TaskChanged], performed: Sequence[Performed]) -> tuple[TaskStory, ...]:
    names = task_names(started)
    plants, icons = {plant.task: plant for plant in started.plants}, dict(started.icons)
    numbers = dict.fromkeys([*names, *(c.task for c in changes), *(act.task for act in performed)])
    stories = []
    for number in sorted(numbers):
        acts = tuple(act for act in performed if act.task == number)
        claims = [c for c in changes if c.task == number and c.state == "claimed" and c.robot == c.owner]
        owner = acts[0].robot if acts else (claims[-1].owner if claims else None)
        until_s = acts[0].at_s if acts else math.inf
        own = [c.at_s for c in claims if c.owner == owner and c.at_s <= until_s]
        name = names.get(number, f"task {number}")
        claimed_s, icon = own[-1] if own else None, icons.get(number, "")
        stories.append(TaskStory(number, name, plants.get(number), owner, claimed_s, acts, icon))
    return tuple(stories)


def _spans(
    robots: Sequence[str], changes: Sequence[TaskChanged], performed: Sequence[Performed], end_s: float
) -> tuple[Span, ...]:
    """From a robot's own claim, or the end of its task before, to its own act, or until it holds the task no longer by
    its own belief. A robot does one thing at a time: what it has claimed ahead waits, and a task whose end nobody heard
    ends with the next claim."""
    spans: list[Span] = []
    for robot in robots:
        held: list[int] = []
        since_s = 0.0
        marks = [(c.at_s, c.task, c.state if c.owner == robot else "other") for c in changes if c.robot == robot]
        marks += [(act.at_s, act.task, "performed") for act in performed if act.robot == robot]
        marks.sort(key=lambda mark: (mark[0], mark[2] == "claimed", mark[2] != "performed"))
        for number, (at_s, task, state) in enumerate(marks):
            if state == "claimed":
                done_later = {task for _, task, state in marks[number:] if state in ("performed", "done")}
                if held and held[0] not in {task, *done_later}:
                    spans.append(Span(robot, held[0], since_s, at_s, "unfinished"))
                    held = []
                since_s = since_s if held else at_s
                held += [task] if task not in held else []
            elif task in held:
                ended = "done" if state in ("performed", "done") else "given up"
                if task == held[0] or ended == "done":
                    spans.append(Span(robot, task, since_s, at_s, ended))
                    since_s = at_s
                held.remove(task)
        spans += [Span(robot, task, since_s, end_s, "unfinished") for task in held[:1]]
    return tuple(sorted(spans, key=lambda span: (span.from_s, span.robot)))
