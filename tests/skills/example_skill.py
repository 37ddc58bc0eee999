"""A skill as a Python object, for the tests: it waves, fails, makes a mistake, or hangs."""

from __future__ import annotations

import asyncio
import subprocess
import sys
from pathlib import Path
from typing import Any, NoReturn

from hvcpd.skills.objects import Result, SkillCall

WRONG: dict[str, Any] = {"list": [1], "true": True, "infinite": float("inf")}


class Wave:
    """Counts its calls, to show that it lives on."""

    def __init__(self) -> None:
        self._calls = 0

    async def perform(self, call: SkillCall) -> Result:
        sys.stdout.write("what it prints is no answer\n")
        times = int(float(call.arguments["times"]))
        if times == -1:
            return Result("the arm is stuck")
        if times < -1:
            call.progress(0.0, "")
            while True:
                pass
        self._calls += 1
        1 / times
        for k in range(times):
            call.progress((k + 1) / times, "")
            await asyncio.sleep(0)
        return Result(results={"waves": times, "calls": self._calls})


class Odd:
    """Answers as no skill should."""

    async def perform(self, call: SkillCall) -> Any:
        how = call.arguments["how"]
        if how == "leaves":
            return sys.exit(3)
        if how == "nests":
            child = subprocess.Popen(["sleep", "60"])
            Path(str(call.arguments["pid"])).write_text(str(child.pid))
            self._block()
        return {
            "nothing": None,
            "at length": Result("x" * 20_000),
            "lists": Result(results=WRONG | {"long": "x" * 20_000}),
            "no results": Result(results=None),  # type: ignore[arg-type]
        }[str(how)]

    def _block(self) -> NoReturn:
        while True:
            pass
