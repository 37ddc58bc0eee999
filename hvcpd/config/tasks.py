"""The task repository: what there is to do, where, and by which actions."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from hvcpd.config.recurrence import Recurrence
from hvcpd.config.shared_places import SharedPlace
from hvcpd.config.skills import USUAL_LIMIT_S, Skill, Value
from hvcpd.ports import Place as Place

TENDING = ("water",)
"""Actions that a task file need not declare: told how long, s. A robot with no skill of that name stands and waits."""


@dataclass(frozen=True)
class GoTo:
    """Drive to a place, by the straight line."""

    place: Place


@dataclass(frozen=True)
class Forward:
    """Drive straight on; a negative distance is backward."""

    distance_m: float


@dataclass(frozen=True)
class Turn:
    """Turn on the spot; counter-clockwise positive, as REP-103 has it."""

    angle_deg: float


@dataclass(frozen=True)
class Dock:
    """Drive back to the start pose in the robot's settings, for example its charger."""


@dataclass(frozen=True)
class Wait:
    """Stand still for a while."""

    duration_s: float


@dataclass(frozen=True)
class Tend(Wait):
    """One of TENDING, for this time: by the skill of that name if the robot has it; otherwise it stands and waits."""

    skill: str = TENDING[0]


@dataclass(frozen=True)
class Use:
    """Use a skill; it fails after `limit_s`. `arguments` are in the order of its parameters."""

    skill: str
    arguments: tuple[tuple[str, Value], ...] = ()
    limit_s: float = USUAL_LIMIT_S


@dataclass(frozen=True)
class SayAction:
    """Say these words to all: "Hi all, I am Rob, the tea is ready"."""

    text: str


Motion = GoTo | Forward | Turn | Dock

Action = Motion | Wait | SayAction | Use


@dataclass(frozen=True)
class TaskDefinition:
    """One task: its number and name, as they are spoken, its place if it has one, and what to do in order."""

    number: int
    name: str
    place: Place | None
    actions: tuple[Action, ...]
    icon: str = ""
    """Its mark in pictures: one of `hvcpd.config.icons.ICONS` or a single character; empty: a neutral one."""
    every: Recurrence | None = None
    """When it is due again; None: it is done once and for ever."""
    priority: int = 0
    """Of tasks that can be done now, those of the highest are done first."""
    after: frozenset[int] = frozenset()
    """The numbers of the tasks that must be done before it."""
    deadline_s: float | None = None
    """Time from becoming due to being late, s; among equals, the one that is late soonest is done first."""
    robots: int = 1
    """How many robots carry it out, all at the same time."""
    on_demand: bool = False
    """It is to be done only when somebody wants it done."""

    @property
    def places(self) -> tuple[Place, ...]:
        """Where a robot must stand for the task to be done: wherever its actions send it, and at the task's own place
        if something is tended, or a skill used, there. Whatever else they ask for is done wherever the robot is."""
        sent = [action.place for action in self.actions if isinstance(action, GoTo)]
        if self.place is not None and any(isinstance(action, Tend | Use) for action in self.actions):
            sent.append(self.place)
        return tuple(dict.fromkeys(sent))

    @property
    def skills(self) -> frozenset[str]:
        """The skills that it cannot be done without."""
        return frozenset(action.skill for action in self.actions if isinstance(action, Use))


@dataclass(frozen=True)
class TaskRepository:
    """All tasks, in the order of the file, and the names of those that are spoken of but that nobody here can do."""

    tasks: tuple[TaskDefinition, ...]
    other_tasks: tuple[str, ...] = ()
    alternatives: tuple[tuple[str, str], ...] = ()
    """Words, and phrases that count as them when they are heard: ("indigo", "in the go")."""
    skills: tuple[Skill, ...] = ()
    """What its actions may use, besides what every robot can."""
    places: tuple[SharedPlace, ...] = ()
    """Where only one robot fits in at a time."""

    @property
    def failures(self) -> tuple[str, ...]:
        """The reasons for which its skills may fail, as they are spoken, each once."""
        return tuple(dict.fromkeys(reason for skill in self.skills for reason in skill.entry.failures))

    def lacking(self, skills: Iterable[str]) -> frozenset[int]:
        """The numbers of the tasks that a robot with only these skills cannot do."""
        known = frozenset(skills)
        return frozenset(task.number for task in self.tasks if not task.skills <= known)

    @property
    def driving(self) -> frozenset[int]:
        """The numbers of the tasks that need wheels."""
        return frozenset(task.number for task in self.tasks if any(isinstance(a, Motion) for a in task.actions))

    @property
    def remarks(self) -> tuple[str, ...]:
        """The sentences that its actions have robots say, each once."""
        said = (a.text for task in self.tasks for a in task.actions if isinstance(a, SayAction))
        return tuple(dict.fromkeys(said))

    def by_number(self, number: int) -> TaskDefinition | None:
        """The task of that number, or None."""
        return next((task for task in self.tasks if task.number == number), None)

    def by_name(self, name: str) -> TaskDefinition | None:
        """The task of that name, or None."""
        return next((task for task in self.tasks if task.name == name), None)


def default_tasks_path() -> Path:
    """The task repository that comes with the package: the paper's five plants."""
    return Path(__file__).with_name("default_tasks.yaml")
