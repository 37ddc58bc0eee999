"""One robot's knowledge: of its own work, its peers, and (`conversation`) the talk. The rules are functions of it.

Times are seconds of the robot's sample clock; -inf means never. Names that serve as keys are in lower case.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

from hvcpd.config.tasks import Action as TaskAction
from hvcpd.config.tasks import Place
from hvcpd.coordination.actions import Action, Rng, Role, SaveStopped, Timing
from hvcpd.coordination.board import Board
from hvcpd.coordination.conversation import (
    NEVER_S,
    Acquaintance,
    Doubts,
    HeardClaim,
    Missed,
    QuotedReport,
    Relays,
    Repair,
    Waiting,
)
from hvcpd.coordination.entry import Entry
from hvcpd.coordination.floor import RANK_MAX, Floor
from hvcpd.coordination.peers import Peers, name_hash
from hvcpd.coordination.place_state import PlaceState
from hvcpd.coordination.states import AT_WORK, PROPOSING, State
from hvcpd.language import messages as m

NOT_HEARD = (None, False, NEVER_S)


@dataclass
class Current:
    """The task or motion that the robot is agreeing on with others, or carries out. Another one begins with a new
    `Current`, so that nothing of the last one remains."""

    task: int | None = None
    """The task that it has claimed, reads back or carries out, or has just ordered."""
    ahead: int | None = None
    """A second task that it has claimed with the first, to be done after it."""
    ahead_sure: bool = False
    """Another robot has confirmed that claim, or nobody is there to do so."""
    ahead_s: float = math.inf
    """When it repeats that claim."""
    ahead_claims: int = 0
    """How often it has said it."""
    distance_m: int | None = None
    """The way to the task, in metres, if the claim states it."""
    task_ref: m.TaskRef | None = None
    way: tuple[TaskAction, ...] = ()
    """The way to the task as it set out on it."""
    motion: m.Motion | None = None
    """The motion that it was ordered to make, apart from tasks."""
    motion_sure: bool = False
    """The motion was heard surely: no confirmation is needed."""
    partner: str | None = None
    """The speaker that ordered it, or the robot that is being ordered."""
    may_be_outbid: bool = False
    """Its claim stated the way, and a voice that it did not understand followed: another robot may have been confirmed
    since."""
    owner_before: str | None = None
    """The task's owner before this robot claimed it."""
    claimed_s: float = NEVER_S
    """When it last spoke of its task."""
    assured_s: float = NEVER_S
    """Until when a robot that confirmed the claim keeps it."""
    objected_s: float = NEVER_S
    """Until then others may begin to object to that confirmation."""
    objected: bool = False
    """A voice began in that time, and was not understood."""
    doubted: tuple[str, int] | None = None
    """The speaker that reported the task of this number as done, and was not believed."""
    repeats: int = 0
    """How often the sentence that waits for an answer was said without one."""
    asked_since_s: float = NEVER_S
    """When that sentence was first said or, since then, a voice was last heard while it waited."""
    heard_at: int = 0
    """How often it had been said when a voice was last heard."""
    there: bool = False
    """Of a task for several robots: it has said that it is at its place."""
    confirmed_to: frozenset[str] = frozenset()
    """The robots that it has told since then that it does the task with them."""
    promised: frozenset[str] = frozenset()
    """All robots that it has told so there."""
    agreed: frozenset[str] = frozenset()
    """The robots at the place that have told this robot so."""
    rivals: frozenset[str] = frozenset()
    """Robots that do the same task, as they say, and for which there is no room."""


@dataclass
class Report:
    """The report that this robot owes the others."""

    tasks: tuple[int, ...] = ()
    """The one or two tasks that it has finished, or the one that it has given up, without a confirmation of its report;
    in this order."""
    failed: bool = False
    """It was given up, whatever was heard of it since."""
    reason: str | None = None
    """Why it was given up, if that can be said."""
    said: bool = False
    """Whether the sentence that waits for a confirmation contained the report."""

    @property
    def task(self) -> int | None:
        """The last of these tasks."""
        return self.tasks[-1] if self.tasks else None

    def drop(self, number: int) -> None:
        """The report of this task is no longer needed."""
        self.tasks = tuple(each for each in self.tasks if each != number)


@dataclass
class Body:
    """The readings of the robot's sensors."""

    here: Place | None = None
    home: Place | None = None
    """Its first known place, the destination of "come back"."""
    battery_v: float | None = None


@dataclass
class Knowledge:
    """All that one robot knows, and the actions that its rules have requested since the last were handed out."""

    role: Role
    timing: Timing
    rng: Rng
    board: Board
    peers: Peers
    floor: Floor
    state: State = State.WAKING
    latched: bool = False
    """It was stopped, and nobody has released it since."""
    timer_s: float = math.inf
    """When the state's time is over."""
    current: Current = field(default_factory=Current)
    report: Report = field(default_factory=Report)
    body: Body = field(default_factory=Body)
    missed: Missed = field(default_factory=Missed)
    claim_heard: HeardClaim = field(default_factory=HeardClaim)
    """The last one: others object to it."""
    report_quoted: QuotedReport | None = None
    """The last one: its speaker may deny it."""
    relays: Relays = field(default_factory=Relays)
    acquaintance: Acquaintance = field(default_factory=Acquaintance)
    waiting: Waiting = field(default_factory=Waiting)
    doubts: Doubts = field(default_factory=Doubts)
    repair: Repair = field(default_factory=Repair)
    places: tuple[PlaceState, ...] = ()
    clock_s: float | None = None
    """Seconds since 1970 at 0 of the sample clock; None: nobody knows the time."""
    due_next_s: float | None = None
    """When something is due next, s since 1970; None: to be calculated again."""
    spreading: dict[int, tuple[float, int]] = field(default_factory=dict)
    """Tasks whose last change is repeated: when, s, and how often it was said."""
    last_heard: tuple[m.Utterance | None, bool, float] = NOT_HEARD
    """The last sentence, whether it was believed, and when it was understood."""
    actions: list[Action] = field(default_factory=list)

    @cached_property
    def roster(self) -> frozenset[str]:
        """All robots of the team that were known at the start."""
        return frozenset(name.lower() for name in self.role.roster)

    @property
    def has_plain_report(self) -> bool:
        """Whether a report is due that can be said with another sentence: of a success, without a number."""
        tasks = self.report.tasks
        return bool(tasks) and not self.report.failed and not any(self.board[number].is_changed for number in tasks)

    def my_task(self) -> int:
        """The current task's number. Raises RuntimeError if there is none: a programming error."""
        if self.current.task is None:
            raise RuntimeError(f"no task in state {self.state}")
        return self.current.task

    def my_tasks(self) -> tuple[int, ...]:
        """The current task, if there is one, and the one after it, unless that now belongs to another robot or is
        done."""
        task, ahead = self.current.task, self.current.ahead
        is_mine = ahead is not None and self.board.owner_of_claim(ahead) == self.role.name
        return tuple(number for number in (task, ahead if is_mine else None) if number is not None)

    def is_at(self, number: int) -> bool:
        """Whether this robot is at work on the task, and not on the one before it."""
        return self.state in AT_WORK and self.current.task == number

    def acts(self, number: int) -> bool:
        """Whether this robot carries the task out."""
        return self.state is State.ACTING and self.current.task == number

    @property
    def has_read_back(self) -> bool:
        """Whether it has read an order back, and waits for the answer, or is about to repeat itself."""
        return self.state is State.READ_BACK or (self.state is State.READING_BACK and self.current.repeats > 0)

    def expire(self, now: float) -> None:
        """Forget who has tasks for several robots where that was not said again in time: never this robot's own claim,
        nor the robots that it is at work with."""
        own = self.my_tasks() if self.state in PROPOSING | AT_WORK else ()  # and not what it has just ordered
        at_work = self.state in AT_WORK
        for number in own:
            if self.board[number].is_shared and not at_work:
                self.board.claim(number, self.role.name, self.lease_end_s(now))
        self.board.expire(now, own if at_work else ())

    def do(self, action: Action) -> None:
        """Add an action to the next ones handed out."""
        self.actions.append(action)

    def latch(self, stopped: bool) -> None:
        """Remember over restarts that the robot is stopped, or no longer."""
        self.latched = stopped
        self.do(SaveStopped(stopped))

    def arm(self, now: float, after_s: float) -> None:
        """The state's time is over `after_s` from now."""
        self.timer_s = now + after_s

    def postpone(self, by_s: float) -> None:
        """Give the state more time, if it has an end at all."""
        self.timer_s += by_s

    def reconsider(self, now: float) -> None:
        """A task or robot has become free."""
        if self.state is State.READY:
            self.arm(now, self.timing.decide_s)

    def rank(self, asker: str, salt: int, now: float) -> int:
        """This robot's place among those present that could answer `asker`, in an order that `salt` shuffles.

        Each name has a number of its own. So a robot that knows of one peer fewer still agrees with the others on the
        order of all the rest: the first two answer in one slot only if the second does not know of the first.
        """
        return self._rank_among(self.peers.present(now), asker, salt)

    def rank_with_unheard(self, asker: str, salt: int, now: float) -> int:
        """The same with robots that have not spoken yet: they come before all robots whose names were heard, or after
        them once these believe that nobody else is there."""
        unheard = self.acquaintance.unheard - {asker.lower()}
        if self.role.roster and not self.acquaintance.introduced:
            others = [name for name in self.peers.present(now) if name != asker.lower()]
            before = len(others) if self.acquaintance.passed_over else 0
            return min(before + self._rank_among(unheard, asker, salt), RANK_MAX)
        return min(len(unheard) + self.rank(asker, salt, now), RANK_MAX)

    def _rank_among(self, names: Iterable[str], asker: str, salt: int) -> int:
        own_hash, asking = name_hash(self.role.name.lower(), salt), asker.lower()
        return min(sum(name_hash(name, salt) < own_hash for name in names if name != asking), RANK_MAX)

    def expected(self, now: float) -> frozenset[str]:
        """The robots that may answer now: those present, and those that may be and have not spoken yet."""
        return self.acquaintance.unheard.union(self.peers.present(now))

    def is_partner(self, name: str | None) -> bool:
        """Whether this speaker is the one with whom the present task or motion is being agreed on. A person may be
        called by name one time, and FRIEND another time; who ordered a motion without a name is FRIEND, too."""
        partner = self.current.partner or (m.FRIEND if self.current.motion is not None else None)
        if name is None or partner is None:
            return False
        return name == partner or (
            m.FRIEND in (name, partner) and self.may_be_person(name) and self.may_be_person(partner)
        )

    def is_person(self, name: str) -> bool:
        """Whether this speaker is surely no robot."""
        return name == m.FRIEND or name.lower() in self.peers.people()

    def may_be_person(self, name: str) -> bool:
        """Whether this speaker may be no robot: robots name their team, and people do not. Among the names that all
        were given are people's, too."""
        peer = self.peers.get(name)
        return peer is None or peer.team is None

    def lacks(self, entry: Entry) -> bool:
        """Whether this robot has no means for a task, or has given it up."""
        return entry.number in self.role.unable or self.role.name in entry.failed_by

    def lease_end_s(self, now: float) -> float:
        """When a lease that is renewed now ends: in a crowd each robot's turn comes more rarely."""
        return now + max(self.timing.lease_s, self.timing.lease_per_robot_s * len(self.peers.present(now)))


@dataclass(frozen=True)
class Heard:
    """A sentence that was understood, with a confidence of 0 to 1, at a time in s. `given_up`: the tasks that its
    addressee has given up, as the rest of the sentence tells; `began_s`: when it began, None: just now."""

    utterance: m.Utterance
    confidence: float
    now: float
    given_up: tuple[m.TaskRef, ...] = ()
    began_s: float | None = None

    @property
    def said_s(self) -> float:
        return self.now if self.began_s is None else self.began_s

    @property
    def speaker(self) -> str | None:
        return self.utterance.speaker

    @property
    def name(self) -> str:
        """The speaker's name, without which people say nothing but stop, resume, motions and questions."""
        return self.utterance.speaker or ""

    @property
    def to(self) -> m.Addressee | None:
        return self.utterance.addressee


Reaction = Callable[[Knowledge, Heard, Any], None]
"""A robot's response to a sentence; the sentence's statement is passed as well."""
Reactions = dict[type, Reaction]
"""Reactions by the statement's type."""
