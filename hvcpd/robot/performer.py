"""Carries out the actions of one task, one after the other, on the robot's clock. Pure."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum

from hvcpd.config.tasks import Action, Dock, Forward, GoTo, Place, SayAction, Tend, Turn, Use, Wait
from hvcpd.hardware import motion, navigator
from hvcpd.hardware.motion import MotionState
from hvcpd.hardware.navigator import Navigator
from hvcpd.ports import STANDSTILL, Pose, WheelCommand, WheelReading
from hvcpd.robot.records import SkillRecord, StuckRecord
from hvcpd.skills.life import (
    CANCELLED,
    NOBODY,
    OVER,
    TOO_LONG,
    Begin,
    Call,
    Cancel,
    OngoingCall,
    Order,
    Pause,
    Report,
    Resume,
    SkillState,
)

TENDING_SLACK_S = 30.0
"""A skill that tends counts as hanging when it takes this much longer than it was told."""


class Outcome(Enum):
    """The outcome of the actions."""

    GOING_ON = "going on"
    DONE = "done"
    FAILED = "failed"


@dataclass(frozen=True)
class Progress:
    """One step's result: wheel speeds, the outcome, a remark if an action asks for one, and the reason of a failure if
    a skill gave one."""

    wheels: WheelCommand
    outcome: Outcome
    remark: str | None = None
    reason: str | None = None


class Performer:
    """Owns the navigator and the skill in use. Call `begin`, then `step` at every block until the outcome is not
    GOING_ON; `take_orders` returns orders for the clients that offer skills, and `tell` takes their answers."""

    def __init__(self, driver: Navigator, home: Pose) -> None:
        """`home` is where it docks."""
        self._motion = driver
        self._home = home
        self._actions: tuple[Action, ...] = ()
        self._index = 0
        self._started = False
        self._from = home
        self._until_s = 0.0
        self._last_s = 0.0
        self._rested_s = 0.0
        self._skills: frozenset[str] = frozenset()
        self._ongoing: OngoingCall | None = None
        self._calls = 0
        self._task = 0
        self._orders: list[Order] = []
        self._news: list[tuple[Call, Report]] = []
        self._stuck: list[str] = []
        """Why the robot did not get where it was going."""

    @property
    def busy(self) -> bool:
        return self._index < len(self._actions)

    @property
    def way(self) -> tuple[Place, ...]:
        """The places to which it will drive, straight from one to the next, as far as they are known now."""
        way: list[Place] = []
        for n, action in enumerate(self._actions[self._index :]):
            match action:
                case GoTo(place):
                    way.append(place)
                case Dock():
                    way.append(Place(self._home.x_m, self._home.y_m))
                case Forward(distance_m) if n == 0 and self._started:
                    at = self._from
                    dx_m, dy_m = distance_m * math.cos(at.heading_rad), distance_m * math.sin(at.heading_rad)
                    way.append(Place(at.x_m + dx_m, at.y_m + dy_m))
                case Turn():
                    pass
                case _:
                    break
        return tuple(way)

    def begin(self, actions: tuple[Action, ...], task: int = 0) -> None:
        self.cancel()
        self._actions, self._task = actions, task

    def cancel(self) -> None:
        """Stand still, let go of a skill, and forget the remaining actions."""
        self._actions, self._index, self._started = (), 0, False
        self._motion.cancel()
        self._let_go(CANCELLED)

    def offer(self, skills: frozenset[str]) -> None:
        """Only these skills can be used from now on; a skill in use that is not among them has failed."""
        self._skills = skills
        if self._ongoing is not None and self._ongoing.call.skill not in skills:
            self.tell(Report(self._ongoing.call.number, SkillState.FAILED, text=NOBODY))

    def tell(self, report: Report) -> None:
        """A report of the client that carries a call out. That it goes on with one that is held changes nothing."""
        is_held = self._ongoing is not None and self._ongoing.state is SkillState.PAUSED
        if report.state in OVER or not is_held:
            self._note(report)

    def _note(self, report: Report) -> None:
        if self._ongoing is not None and self._ongoing.take(report):
            self._news.append((self._ongoing.call, report))

    def take_orders(self) -> tuple[Order, ...]:
        """The requests to the clients that offer skills; each is returned once."""
        orders, self._orders = tuple(self._orders), []
        return orders

    def take_records(self, now: float) -> list[SkillRecord | StuckRecord]:
        """The changes of calls, and the ways that failed, since the last call of this method."""
        records: list[SkillRecord | StuckRecord] = [SkillRecord(now, *news) for news in self._news]
        records += [StuckRecord(now, self._task, reason) for reason in self._stuck]
        self._news, self._stuck = [], []
        return records

    def rest(self, now: float) -> None:
        """Instead of `step`, while the wheels must stand: the plan stays, and none of its times count this block."""
        self._rested_s += now - self._last_s
        self._last_s = now
        self._motion.rest()
        ongoing = self._ongoing
        if ongoing is not None and not ongoing.is_over and ongoing.state is not SkillState.PAUSED:
            self._orders.append(Pause(ongoing.call.number))
            self.tell(Report(ongoing.call.number, SkillState.PAUSED, ongoing.last.share))

    def step(self, pose: Pose, now: float, reading: WheelReading | None) -> Progress:
        """Continue the current action at time `now` (s, sample clock); `reading` is None if there is no new one."""
        self._last_s = now
        now -= self._rested_s
        remark = None
        while self.busy:
            action = self._actions[self._index]
            if not self._started:
                self._started, self._from = True, pose
                remark = self._start(action, pose, now)
            state, wheels = self._go_on(action, pose, now, reading)
            if state is Outcome.GOING_ON:
                return Progress(wheels, state, remark)
            if state is Outcome.FAILED:
                reason = self._ongoing.last.text if self._ongoing is not None else None
                self.cancel()
                return Progress(STANDSTILL, state, remark, reason)
            self._index += 1
            self._started = False
            if remark is not None and self.busy:  # each step has one remark
                return Progress(STANDSTILL, Outcome.GOING_ON, remark)
        self._actions, self._index = (), 0
        return Progress(STANDSTILL, Outcome.DONE, remark)

    def _start(self, action: Action, pose: Pose, now: float) -> str | None:
        match action:
            case GoTo(place):
                self._motion.start(motion.GoTo(place.x_m, place.y_m), pose)
            case Forward(distance_m):
                self._motion.start(motion.Forward(distance_m), pose)
            case Turn(angle_deg):
                self._motion.start(motion.Turn(math.radians(angle_deg)), pose)
            case Dock():
                self._motion.start(navigator.Dock(self._home), pose)
            case Wait(duration_s):
                self._until_s = now + duration_s
            case SayAction(text):
                return text
        if (call := self._call_for(action)) is not None:
            self._ongoing = OngoingCall(call, now)
            self._news.append((call, self._ongoing.last))
            self._orders.append(Begin(call))
            if call.skill not in self._skills:
                self.tell(Report(call.number, SkillState.FAILED, text=NOBODY))
        return None

    def _call_for(self, action: Action) -> Call | None:
        """The call of a skill that an action makes, if it does."""
        if isinstance(action, Tend) and action.skill in self._skills:
            arguments = (("seconds", action.duration_s),)
            action = Use(action.skill, arguments, action.duration_s + TENDING_SLACK_S)
        if not isinstance(action, Use):
            return None
        self._calls += 1
        return Call(self._calls, self._task, action.skill, action.arguments, action.limit_s)

    def _let_go(self, reason: str) -> None:
        """The present call will not report any longer."""
        ongoing, self._ongoing = self._ongoing, None
        if ongoing is not None and not ongoing.is_over:
            self._orders.append(Cancel(ongoing.call.number))
            self._news.append(
                (ongoing.call, Report(ongoing.call.number, SkillState.FAILED, ongoing.last.share, reason))
            )

    def _go_on_with_skill(self, ongoing: OngoingCall, now: float) -> Outcome:
        if ongoing.state is SkillState.PAUSED:
            self._orders.append(Resume(ongoing.call.number))
            self._note(Report(ongoing.call.number, SkillState.RUNNING, ongoing.last.share))
        if not ongoing.is_over and ongoing.is_late(now):
            self._orders.append(Cancel(ongoing.call.number))
            self.tell(Report(ongoing.call.number, SkillState.FAILED, ongoing.last.share, TOO_LONG))
        if ongoing.state not in OVER:
            return Outcome.GOING_ON
        if ongoing.state is SkillState.FAILED:
            return Outcome.FAILED
        self._ongoing = None
        return Outcome.DONE

    def _go_on(
        self, action: Action, pose: Pose, now: float, reading: WheelReading | None
    ) -> tuple[Outcome, WheelCommand]:
        if isinstance(action, SayAction):
            return Outcome.DONE, STANDSTILL
        if self._ongoing is not None:
            return self._go_on_with_skill(self._ongoing, now), STANDSTILL
        if isinstance(action, Wait):
            return (Outcome.DONE if now >= self._until_s else Outcome.GOING_ON), STANDSTILL
        wheels = self._motion.step(pose, now, reading)
        match self._motion.state:
            case MotionState.ARRIVED:
                return Outcome.DONE, STANDSTILL
            case MotionState.FAILED:
                self._stuck.append(self._motion.reason)
                return Outcome.FAILED, STANDSTILL
            case _:
                return Outcome.GOING_ON, wheels
