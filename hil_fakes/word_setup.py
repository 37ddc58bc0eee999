"""The set-up and the result of a mission at the level of words."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from hil_fakes.word_channel import Conditions
from hil_fakes.word_occurrences import BEGIN_S
from hil_fakes.word_seals import WordSeals
from hvcpd.config.shared_places import SharedPlace
from hvcpd.config.tasks import Place, TaskDefinition
from hvcpd.coordination.actions import Speech, Talk, Timing


@dataclass(frozen=True)
class Outage:
    """A robot is switched off without a word, and on again `back_s` later, with its saved memory; None: never."""

    name: str
    at_s: float
    back_s: float | None


@dataclass(frozen=True)
class WordPlan:
    """One mission. `late` are robots that are switched on only then, `leaving` those that end then;
    `earshot_m` is how far a voice carries; from `clear_m` on the chance that it is not understood grows to 1 there."""

    names: tuple[str, ...]
    tasks: tuple[TaskDefinition, ...]
    seed: int = 0
    conditions: Conditions = field(default_factory=Conditions)
    coordinator: str | None = None
    outages: tuple[Outage, ...] = ()
    late: Mapping[str, float] = field(default_factory=dict)
    leaving: Mapping[str, float] = field(default_factory=dict)
    earshot_m: float | None = None
    clear_m: float | None = None
    nearest_first: bool = False
    starts: Mapping[str, Place] = field(default_factory=dict)
    """Where robots begin; the others stand in a corner, 1 m from each other."""
    places: tuple[SharedPlace, ...] = ()
    """Where only one robot fits in."""
    unable: Mapping[str, frozenset[int]] = field(default_factory=dict)
    """The numbers of the tasks that each robot cannot do."""
    strangers: bool = False
    """No robot knows another one's name in advance."""
    speech: Speech = field(default_factory=Speech)
    """The delivery of all robots' sentences."""
    talks: Mapping[str, Talk] = field(default_factory=dict)
    """How much each robot says; the others say the usual."""
    softly_db: float = 0.0
    """The level of all robots' speech relative to the usual one: below 0 in quiet hours. `earshot_m` is for 0."""
    timing: Timing = field(default_factory=Timing)
    seals: WordSeals | None = None
    """Seals of a team with a key; None: no sentence is sealed."""
    clocks: Mapping[str, float] | None = None
    """The error of each robot's clock, s; robots not named have no clock. None: no task recurs, so nobody needs one."""
    fails: Callable[[str, int, float], bool] = lambda _robot, _task, _now: False
    """Whether a robot fails at a task at a time."""
    reason: str | None = None
    """The reason that it then gives."""
    begin_s: float = BEGIN_S
    """When it begins, s since 1970, where robots have clocks."""
    team: str = "plant"
    limit_s: float = 10_000.0
    settle_s: float = 20.0


@dataclass(frozen=True)
class WordResult:
    """The result of a mission. `agreed`: in the end every robot that was on believed that every task was done."""

    lost: int
    duplicates: int
    agreed: bool
    off_in_mid_task: bool
    ended_s: float
    sent: int
    collisions: int
    airtime_s: float
    misheard: int
    missed: int = 0
    """Occurrences of recurring tasks that nobody has carried out before the next one."""
    repeated: int = 0
    """How often an occurrence was carried out again."""
