"""A skill as a Python object: the template for one's own."""

from __future__ import annotations

import asyncio

from hvcpd.skills.objects import Result, SkillCall

SWING_S = 0.4
"""Of an arm, to and fro."""


class Wave:
    """Made once, without arguments: here is the place to open a camera or a port."""

    def __init__(self, swing_s: float = SWING_S) -> None:
        self._swing_s = swing_s

    async def perform(self, call: SkillCall) -> Result:
        """Wave so many `times`. Stopped, it gets asyncio.CancelledError, and has a quarter of a second."""
        times = int(float(call.arguments["times"]))
        for k in range(times):
            await asyncio.sleep(self._swing_s)  # the arm moves
            call.progress((k + 1) / times, f"wave {k + 1}")
        return Result(results={"waves": times})
