"""How fast a skill begins, and how fast all is safe: after a cancel at a random moment, and after kill -9 of the host.

    python -m benchmarks.skills [--calls 1000] [--kills 50] [--seed 1]

Pins are files, the programs and Python objects are real processes. Prints a table for docs/skills.md.
"""

from __future__ import annotations

import argparse
import asyncio
import os
import random
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

from hvcpd.config.skill_settings import PinSettings
from hvcpd.skills.life import Call
from hvcpd.skills.objects import Object
from hvcpd.skills.runners import Program, Runner

LONGEST_S = 0.3
"""A call is cancelled after a random part of this."""

HOST = """
import asyncio, sys
from hvcpd.config.skill_settings import PinSettings
from hvcpd.skills.guard import GuardLine
from hvcpd.skills.life import Call
from hvcpd.skills.pins import Pin
guard = GuardLine({17: True})
asyncio.run(Pin(PinSettings(17)).perform(Call(1, 1, "pour", (("seconds", 60.0),), 60.0), lambda share, text: None))
"""
SKILL = """
import asyncio
from hvcpd.skills.objects import Result
class Hold:
    async def perform(self, call):
        open(call.arguments["file"], "w").close()
        await asyncio.sleep(60)
        return Result()
"""


def call(**arguments: float | str) -> Call:
    return Call(1, 1, "hold", tuple(arguments.items()), 60.0)


async def timed(
    runner: Runner, what: Call, begun: Callable[[], bool], chance: random.Random
) -> tuple[float, float, float]:
    """One call: s until it has begun, s from the cancel until it was safe, the longest that the loop was held up."""
    loop, longest_s = asyncio.get_running_loop(), 0.0
    asked_s = time.monotonic()
    task = loop.create_task(runner.perform(what, lambda _share, _text: None))  # type: ignore[arg-type]
    while not begun():
        before_s = time.monotonic()
        await asyncio.sleep(0)
        longest_s = max(longest_s, time.monotonic() - before_s)
    began_s = time.monotonic() - asked_s
    await asyncio.sleep(LONGEST_S * chance.random())
    cancelled_s = time.monotonic()
    task.cancel()
    with suppress(asyncio.CancelledError):
        await task
    return began_s, time.monotonic() - cancelled_s, longest_s


async def rows(calls: int, chance: random.Random, folder: Path) -> None:
    from hvcpd.skills.pins import Pin

    mark = folder / "begun"
    deaf = "trap '' TERM; touch \"$0\"; while :; do sleep 60; done"
    hold = Object("hold")
    await hold.open()
    await asyncio.sleep(1.0)
    pin = Pin(PinSettings(17))
    kinds: tuple[tuple[str, Runner, Call, Callable[[], bool]], ...] = (
        ("pin", pin, call(seconds=60.0), lambda: pin._device.value == 1),
        ("program", Program(("sh", "-c", 'touch "$0"; exec sleep 60', str(mark))), call(), mark.exists),
        ("program, deaf to SIGTERM", Program(("sh", "-c", deaf, str(mark))), call(), mark.exists),
        ("Python object", hold, call(file=str(mark)), mark.exists),
    )
    for name, runner, what, begun in kinds:
        found = []
        for _ in range(calls):
            mark.unlink(missing_ok=True)
            found.append(await timed(runner, what, begun, chance))
        tell(name, [row[0] for row in found], [row[1] for row in found])
    await hold.close()
    await pin.close()


def tell(name: str, began_s: list[float], safe_s: list[float]) -> None:
    began, safe = sorted(began_s), sorted(safe_s)
    slow = sum(each > 0.5 for each in safe)
    start = f"{1e3 * began[len(began) // 2]:.1f} | {1e3 * began[-1]:.0f}" if began else "– | –"
    print(
        f"| {name} | {len(safe)} | {start} | {1e3 * safe[len(safe) // 2]:.1f} | {1e3 * safe[-1]:.0f} | {slow} |",
        flush=True,
    )


def killed(chance: random.Random, pins: Path) -> float:
    """From kill -9 of the host until its pin is off, s."""
    from hil_fakes.pins import is_on

    with subprocess.Popen([sys.executable, "-c", HOST]) as host:
        while not is_on(pins, 17):
            if host.poll() is not None:
                raise SystemExit("the host has ended by itself: is gpiozero installed, and the package with its fakes?")
            time.sleep(0.005)
        time.sleep(1.0 + LONGEST_S * chance.random())
        host.kill()
        began_s = time.monotonic()
        while is_on(pins, 17):
            time.sleep(0.001)
        took_s = time.monotonic() - began_s
        time.sleep(1.0)  # until the guard has let go of the pin
        return took_s


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--calls", type=int, default=250)
    parser.add_argument("--kills", type=int, default=20)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    chance = random.Random(options.seed)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        os.environ |= {"GPIOZERO_PIN_FACTORY": "files", "HVCPD_FAKE_PINS": name, "PYTHONPATH": name}
        (folder / "hold-1.0.dist-info").mkdir()
        (folder / "hold-1.0.dist-info" / "METADATA").write_text("Name: hold\nVersion: 1.0\n")
        (folder / "hold-1.0.dist-info" / "entry_points.txt").write_text("[hvcpd.skills]\nhold = holding:Hold\n")
        (folder / "holding.py").write_text(SKILL)
        print("| Skill | Calls | begun, ms: median | most | safe, ms: median | most | later than 500 ms |")
        print("|---|---|---|---|---|---|---|")
        asyncio.run(rows(options.calls, chance, folder))
        tell("pin, host killed", [], [killed(chance, folder) for _ in range(options.kills)])


if __name__ == "__main__":
    main()
