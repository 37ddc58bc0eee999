"""A joint on the wheels' bus as a skill: it turns to an angle, and reports whether it arrived or met an obstacle."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Mapping
from typing import Any

from hvcpd.hardware.joints import Joint, JointState
from hvcpd.skills.life import Call
from hvcpd.skills.runners import FailedError, Tell, number_of

LOOK_S = 0.02
"""Between two checks of the bus thread's readings; it reads the motor every 0.05 to 0.1 s."""
BLOCKED = "something is in the way"


class JointRunner:
    """Carries calls out with `joint`; `at_once` triggers the next exchange on the bus."""

    def __init__(self, joint: Joint, at_once: Callable[[], None]) -> None:
        self._joint = joint
        self._at_once = at_once
        self._goal = 0
        self._goal_deg = 0.0
        self._is_held = False

    async def perform(self, call: Call, tell: Tell) -> Mapping[str, Any]:
        """Turn to the call's angle; a joint that fails, or is stopped, is left as its settings declare."""
        settings = self._joint.settings
        self._goal_deg, self._is_held = number_of(call, settings.angle), False
        try:
            self._turn()
            state = await self._until_over()
        except ValueError as error:
            raise FailedError(str(error)) from None
        except asyncio.CancelledError:
            self._stop()
            raise
        if state.fault is not None or (state.blocked and settings.blocked == "failed"):
            self._stop()
            raise FailedError(state.fault or BLOCKED)
        tell(1.0, "something holds it" if state.blocked else "")
        return {settings.angle: round(state.angle_deg, 1), "load": round(state.load, 2)}

    def hold(self, on: bool) -> None:
        """Pause the motion."""
        self._is_held = on
        if on:
            self._goal = self._joint.pause()
            self._at_once()
        else:
            self._turn()

    async def close(self) -> None:
        """The bus leaves the joint as it is declared when the wheels are closed."""

    def _turn(self) -> None:
        self._goal = self._joint.turn(self._goal_deg)
        self._at_once()

    def _stop(self) -> None:
        self._joint.stop()
        self._at_once()

    async def _until_over(self) -> JointState:
        while True:
            state = self._joint.state
            if state.goal == self._goal and not self._is_held and (state.there or state.blocked or state.fault):
                return state
            await asyncio.sleep(LOOK_S)
