"""What one robot knows: about its own work, its peers, and what was said. The rules are functions of it.

Times are seconds of the robot's sample clock; -inf means never. Names that serve as keys are in lower case.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

from hvcpd.config.tasks import Place
from hvcpd.coordination.actions import Action, Rng, Role, Timing
from hvcpd.coordination.board import Board
from hvcpd.coordination.floor import RANK_MAX, Floor
from hvcpd.coordination.passes import Pass
from hvcpd.coordination.peers import Peers, lot
from hvcpd.coordination.states import State
from hvcpd.language import messages as m

NEVER_S = -math.inf


@dataclass
class Current:
    """What the robot is settling with others, or carries out: a task or a motion."""

    task: int | None = None
    """The task that it has claimed, reads back or carries out, or has just ordered."""
    ahead: int | None = None
    """Another one that it has claimed with it, to be done after it."""
    way_m: int | None = None
    """The way to the task, in metres, if it is told with the claim."""
    task_ref: m.TaskRef | None = None
    motion: m.Motion | None = None
    """What it was told to do with its wheels, apart from tasks."""
    motion_sure: bool = False
    """The motion was heard surely: no confirmation is needed."""
    partner: str | None = None
    """Who ordered it, or is being ordered."""
    owner_before: str | None = None
    """Whose the task was before this robot claimed it."""
    claimed_s: float = NEVER_S
    """When it last spoke of its task."""
    assured_s: float = NEVER_S
    """Until when somebody who confirmed the claim keeps it."""
    doubted: tuple[str, int] | None = None
    """The speaker who said that the task of this number was done, and was not believed."""
    repeats: int = 0
    """How often the sentence that waits for an answer was said without one."""
    asked_since_s: float = NEVER_S
    """When that sentence was first said."""
    there: bool = False
    """Of a task for several robots: it has said that it is at its place;"""
    told: frozenset[str] = frozenset()
    """whom it has told since that it does the task with them;"""
    promised: frozenset[str] = frozenset()
    """whom it has told there at all;"""
    agreed: frozenset[str] = frozenset()
    """and who has said so, being there, to this robot."""

    def clear(self) -> None:
        """Nothing is settled or carried out any more."""
        self.task = self.ahead = self.task_ref = self.partner = self.motion = None


@dataclass
class Report:
    """The report that this robot owes the others."""

    task: int | None = None
    """A task that it has finished or given up, and nobody has confirmed to have heard so."""
    before: int | None = None
    """Another one that it finished before that one."""
    failed: bool = False
    """It was given up, whatever was heard of it since."""
    reason: str | None = None
    """Why it was given up, if that can be said."""
    said: bool = False
    """Whether the sentence that waits for a confirmation held the report."""

    @property
    def tasks(self) -> tuple[int, ...]:
        """What was finished or given up, the first before the last."""
        return tuple(number for number in (self.before, self.task) if number is not None)

    def drop(self, number: int) -> None:
        """Nobody wants to know of this task any more."""
        left = [each for each in self.tasks if each != number]
        self.task, self.before = left[-1] if left else None, None if len(left) < 2 else left[0]


@dataclass
class Body:
    """What the robot's sensors say."""

    here: Place | None = None
    home: Place | None = None
    """Where it was when it first knew its place: where "come back" leads."""
    battery_v: float | None = None


@dataclass
class Missed:
    """What the robot may have missed."""

    heard_work: bool = False
    """Work went on before its first word or while it was switched off: it asks what is left."""
    ask_again_s: float = NEVER_S
    """It does not ask what is left again before then."""
    asked: int = 0
    """How often it has asked whether what may be done is done, since all was certain."""
    last_s: float = NEVER_S
    """When it last turned out that this robot, or one it spoke to, had missed something."""


@dataclass(frozen=True)
class HeardClaim:
    """Somebody's claim, and what the board said of each of its tasks before: state, owner, end of the lease."""

    speaker: str
    before: Mapping[int, tuple[str, str | None, float]]
    at_s: float


@dataclass(frozen=True)
class QuotedReport:
    """A report that somebody passed on in the name of `speaker`."""

    speaker: str
    number: int
    at_s: float


RelayedMessage = tuple[str, str, m.Statement | None]
"""Speaker, addressee and statement."""


@dataclass
class Relays:
    """What was passed on, by whomever, and between whom it must be."""

    passed_on: dict[RelayedMessage, tuple[int, float]] = field(default_factory=dict)
    """How often, and when last."""
    apart: dict[frozenset[str], float] = field(default_factory=dict)
    """Pairs that do not hear each other, and when that was last seen."""


@dataclass
class Acquaintance:
    """Who knows this robot's name, and what it did to make its own and others' names known."""

    unheard: frozenset[str] = frozenset()
    """Whom it was told of beforehand, and who may be there and wait for a turn to say a first word."""
    all_heard_s: float = math.inf
    """By then everybody of them who is there has said something."""
    introduced: bool = False
    """Whether it has said its own name."""
    passed_over: bool = False
    """The others take whoever has not said a word for not there."""
    greetings: int = 0
    """How often it has greeted."""
    known_by: set[str] = field(default_factory=set)
    """Robots that have said this robot's name: it need not be spelled for them."""
    spelled_s: float = NEVER_S
    """When this robot last spelled its name."""
    own_name_heard_s: tuple[float, ...] = ()
    """When another voice used this robot's name."""
    strangers: bool = False
    """Somebody has spelled its name: there are robots about that were not known beforehand."""
    call_s: float | None = None
    """When this robot asks who is here, because it has nobody to give an order to."""
    calls: int = 0
    """How often it has asked so."""
    garbled_s: tuple[float, ...] = ()
    """When speech was not understood, lately."""
    ask_s: float = NEVER_S
    """It does not ask for names again before then."""
    pause_s: float | None = None
    """Between two questions for names; None before the first."""
    respell_s: float | None = None
    """Between two spellings of its name; None before the first."""
    respelled_s: float = NEVER_S
    """When it last spelled its name because somebody may not know it."""
    met: int = 0
    """How many peers there were when it last asked for names."""


@dataclass
class Waiting:
    """How a robot that only takes orders waits for one."""

    giver: str | None = None
    """The robot that was last heard to give an order, or whose order somebody was heard to answer."""
    asked: int = 0
    """How often it asked what is left since it last had an order."""
    until_s: float | None = None
    """When its patience ends."""


@dataclass
class Doubts:
    """What was asked of and told to each speaker whose seal was wrong or missing, by name."""

    asked: dict[str, tuple[float, int]] = field(default_factory=dict)
    """When first, and how often, it was asked to say its sentence again."""
    told: dict[str, tuple[float, float]] = field(default_factory=dict)
    """When it was last told that it is not trusted, and for how long it is not told so again, s."""


@dataclass
class Repair:
    """How well the two sides of an exchange understand each other."""

    last_said: m.Utterance | None = None
    asked: int = 0
    """How often this robot had something said again."""
    was_asked: int = 0
    """How often it was asked to say something again."""
    speak_slowly: bool = False
    resume_s: float = NEVER_S
    """When "resume" was heard last."""
    foreign_until_s: float = NEVER_S
    """Until then speech that is not understood may be code words of a message for others."""

    def reset(self) -> None:
        """A new exchange begins."""
        self.asked, self.was_asked, self.speak_slowly = 0, 0, False


@dataclass
class Knowledge:
    """All that one robot knows, and the actions that its rules have asked for since they were last handed out."""

    role: Role
    timing: Timing
    rng: Rng
    board: Board
    peers: Peers
    floor: Floor
    state: State = State.WAKING
    timer_s: float = math.inf
    """When the state's time is over."""
    current: Current = field(default_factory=Current)
    report: Report = field(default_factory=Report)
    body: Body = field(default_factory=Body)
    missed: Missed = field(default_factory=Missed)
    claim_heard: HeardClaim | None = None
    """The last one: what others object to."""
    report_quoted: QuotedReport | None = None
    """The last one: what its speaker may deny."""
    relays: Relays = field(default_factory=Relays)
    acquaintance: Acquaintance = field(default_factory=Acquaintance)
    waiting: Waiting = field(default_factory=Waiting)
    doubts: Doubts = field(default_factory=Doubts)
    repair: Repair = field(default_factory=Repair)
    passes: tuple[Pass, ...] = ()
    clock_s: float | None = None
    """Seconds since 1970 at 0 of the sample clock; None: nobody knows the time."""
    due_next_s: float | None = None
    """When something is due next, s since 1970; None: to be reckoned anew."""
    spreading: dict[int, tuple[float, int]] = field(default_factory=dict)
    """Tasks whose last change is said again: when, s, and how often it was said."""
    last_heard: tuple[m.Utterance, float] | None = None
    actions: list[Action] = field(default_factory=list)

    @cached_property
    def roster(self) -> frozenset[str]:
        """All robots of the team that were known at the start."""
        return frozenset(name.lower() for name in self.role.roster)

    def my_task(self) -> int:
        """The current task's number. Raises RuntimeError if there is none: our own mistake."""
        if self.current.task is None:
            raise RuntimeError(f"no task in state {self.state}")
        return self.current.task

    def my_tasks(self) -> tuple[int, ...]:
        """The current task, if there is one, and the one after it, unless that has become another's or is done."""
        task, ahead = self.current.task, self.current.ahead
        is_mine = ahead is not None and self.board.owner_of_claim(ahead) == self.role.name
        return tuple(number for number in (task, ahead if is_mine else None) if number is not None)

    def do(self, action: Action) -> None:
        """Hand an action out with the next ones."""
        self.actions.append(action)

    def arm(self, now: float, after_s: float) -> None:
        """The state's time is over `after_s` from now."""
        self.timer_s = now + after_s

    def postpone(self, by_s: float) -> None:
        """Give the state more time, if it has an end at all."""
        self.timer_s += by_s

    def reconsider(self, now: float) -> None:
        """Something became free."""
        if self.state is State.READY:
            self.arm(now, self.timing.decide_s)

    def rank(self, asker: str, salt: int, now: float) -> int:
        """This robot's place among those present who could answer `asker`, in an order that `salt` shuffles.

        Each name has a number of its own. So a robot that knows of one peer fewer still agrees with the others on the
        order of all the rest: the first two answer in one slot only if the second does not know of the first.
        """
        return self._rank_among(self.peers.present(now), asker, salt)

    def rank_in_team(self, now: float) -> int:
        """The same for everybody, among all that may be there, heard or not."""
        return self._rank_among(self.expected(now), "", 0)

    def rank_with_unheard(self, asker: str, salt: int, now: float) -> int:
        """The same with those who have not said a word yet: they come before all whose names were heard, or after them
        once these believe that nobody else is there."""
        unheard = self.acquaintance.unheard - {asker.lower()}
        if self.role.roster and not self.acquaintance.introduced:
            others = [name for name in self.peers.present(now) if name != asker.lower()]
            before = len(others) if self.acquaintance.passed_over else 0
            return min(before + self._rank_among(unheard, asker, salt), RANK_MAX)
        return min(len(unheard) + self.rank(asker, salt, now), RANK_MAX)

    def _rank_among(self, names: Iterable[str], asker: str, salt: int) -> int:
        own_lot, asking = lot(self.role.name.lower(), salt), asker.lower()
        return min(sum(lot(name, salt) < own_lot for name in names if name != asking), RANK_MAX)

    def expected(self, now: float) -> frozenset[str]:
        """The robots that may answer now: those present, and those that may be and have not spoken yet."""
        return self.acquaintance.unheard.union(self.peers.present(now))

    def lease_end_s(self, now: float) -> float:
        """When a lease that is renewed now ends: in a crowd each one's turn comes more rarely."""
        return now + max(self.timing.lease_s, self.timing.lease_per_robot_s * len(self.peers.present(now)))


@dataclass(frozen=True)
class Heard:
    """A sentence that was understood, with a confidence of 0 to 1, at a time in s."""

    utterance: m.Utterance
    confidence: float
    now: float

    @property
    def speaker(self) -> str | None:
        return self.utterance.speaker

    @property
    def to(self) -> m.Addressee | None:
        return self.utterance.addressee


Reaction = Callable[[Knowledge, Heard, Any], None]
"""What a robot does about a sentence, whose statement is handed to it too."""
Reactions = dict[type, Reaction]
"""The same by the statement's type."""
