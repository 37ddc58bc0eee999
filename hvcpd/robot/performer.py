"""Carries out the actions of one task, one after the other, on the robot's clock. Pure."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum

from hvcpd.config.tasks import Action, Forward, GoTo, SayAction, Turn, Wait
from hvcpd.hardware import motion
from hvcpd.hardware.motion import MotionState
from hvcpd.hardware.navigator import Navigator
from hvcpd.ports import STANDSTILL, Pose, WheelCommand, WheelReading


class Outcome(Enum):
    """What became of the actions."""

    GOING_ON = "going on"
    DONE = "done"
    FAILED = "failed"


@dataclass(frozen=True)
class Progress:
    """One step's result: wheel speeds, the outcome, and a remark to be made, if an action asks for one."""

    wheels: WheelCommand
    outcome: Outcome
    remark: str | None = None


class Performer:
    """Owns the navigator. `begin`, then `step` at every block until the outcome is not GOING_ON."""

    def __init__(self, navigator: Navigator) -> None:
        self._motion = navigator
        self._actions: tuple[Action, ...] = ()
        self._index = 0
        self._started = False
        self._until_s = 0.0
        self._last_s = 0.0
        self._rested_s = 0.0

    @property
    def busy(self) -> bool:
        return self._index < len(self._actions)

    def begin(self, actions: tuple[Action, ...]) -> None:
        self.cancel()
        self._actions = actions

    def cancel(self) -> None:
        """Stand still and forget what was left to do."""
        self._actions, self._index, self._started = (), 0, False
        self._motion.cancel()

    def rest(self, now: float) -> None:
        """Instead of `step`, while the wheels must stand: the plan stays, and for all its times this does not count."""
        self._rested_s += now - self._last_s
        self._last_s = now
        self._motion.rest()

    def step(self, pose: Pose, now: float, reading: WheelReading | None) -> Progress:
        """Go on with the current action at time `now` (s, sample clock); `reading` is None if there is no new one."""
        self._last_s = now
        now -= self._rested_s
        remark = None
        while self.busy:
            action = self._actions[self._index]
            if not self._started:
                self._started = True
                remark = self._start(action, pose, now) or remark
            state, wheels = self._go_on(action, pose, now, reading)
            if state is Outcome.GOING_ON:
                return Progress(wheels, state, remark)
            if state is Outcome.FAILED:
                self.cancel()
                return Progress(STANDSTILL, state, remark)
            self._index += 1
            self._started = False
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
            case Wait(duration_s):
                self._until_s = now + duration_s
            case SayAction(text):
                return text
        return None

    def _go_on(
        self, action: Action, pose: Pose, now: float, reading: WheelReading | None
    ) -> tuple[Outcome, WheelCommand]:
        if isinstance(action, SayAction):
            return Outcome.DONE, STANDSTILL
        if isinstance(action, Wait):
            return (Outcome.DONE if now >= self._until_s else Outcome.GOING_ON), STANDSTILL
        wheels = self._motion.step(pose, now, reading)
        match self._motion.state:
            case MotionState.ARRIVED:
                return Outcome.DONE, STANDSTILL
            case MotionState.FAILED:
                return Outcome.FAILED, STANDSTILL
            case _:
                return Outcome.GOING_ON, wheels
