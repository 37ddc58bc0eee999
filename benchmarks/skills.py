"""Times skills: how fast they begin, and how fast they are safe after a cancel at a random moment and after kill -9.

    python -m benchmarks.skills [--calls 1000] [--kills 50] [--hung 100] [--only PART] [--seed 1]

Pins are files, programs and Python objects are real processes, a joint's motor is fake, on a pseudo-terminal. Prints
the tables of docs/skills.md. A figure with all of n good has, by the rule of three, at most 3/n bad ones (95 %).
"""

from __future__ import annotations

import argparse
import asyncio
import gc
import os
import random
import tempfile
import time
from collections.abc import Awaitable, Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path

from benchmarks.skills_killed import kill_rows
from benchmarks.skills_served import BLOCK_S, PATIENT_S, STANDS_RAD_S, served_rows
from hil_fakes.dynamixel.bus import FakeBus
from hil_fakes.dynamixel.motor import JOINT, FakeMotor, turtlebot3_pair
from hil_fakes.dynamixel.pump import RealTimePump
from hvcpd.config.skill_settings import JointSettings, PinSettings
from hvcpd.daemon.wheel_service import WheelService
from hvcpd.hardware.joints import Joint
from hvcpd.hardware.wheels import DynamixelWheels
from hvcpd.ports import STANDSTILL
from hvcpd.skills.joints import JointRunner
from hvcpd.skills.life import Call
from hvcpd.skills.objects import PythonRunner
from hvcpd.skills.runners import FailedError, ProgramRunner, Runner

LONGEST_S = 0.3
"""A call is cancelled after a random part of this."""
SAFE_WITHIN_S = 0.5

WARM_UP = 10
PARTS = ("cancel", "served", "joint", "hung", "kill")

SKILL = """
import asyncio, os
from hvcpd.skills.objects import Result
class Hold:
    async def perform(self, call):
        open(call.arguments["file"], "w").close()
        try:
            await asyncio.sleep(60)
        finally:
            os.unlink(call.arguments["file"])
        return Result()
"""


@dataclass
class Times:
    """Of all calls of one kind, s."""

    began: list[float] = field(default_factory=list)
    safe: list[float] = field(default_factory=list)
    held_up: list[float] = field(default_factory=list)
    """The longest that the event loop was held up in each, s of processor time."""
    failed: int = 0
    """Calls that had ended before they were cancelled."""


@dataclass(frozen=True)
class Kind:
    """One kind of skill: how it is called, and when it has begun and is safe."""

    name: str
    runner: Runner
    call: Call
    begun: Callable[[], bool]
    safe: Callable[[], bool] = lambda: True
    before: Callable[[], Awaitable[None]] | None = None


def call(**arguments: float | str) -> Call:
    return Call(1, 1, "hold", tuple(arguments.items()), 60.0)


async def timed(kind: Kind, rng: random.Random, times: Times) -> None:
    """One call, cancelled at a random moment."""
    if kind.before is not None:
        await kind.before()
    loop, longest_s = asyncio.get_running_loop(), 0.0
    asked_s = time.monotonic()
    task = loop.create_task(kind.runner.perform(kind.call, lambda _share, _text: None))
    while not kind.begun():
        if task.done():
            times.failed += 1
            return
        before_s = time.thread_time()
        await asyncio.sleep(0)
        longest_s = max(longest_s, time.thread_time() - before_s)
    began_s = time.monotonic() - asked_s
    await asyncio.sleep(LONGEST_S * rng.random())
    if task.done():  # a busy machine slept for longer
        times.failed += 1
        return
    times.began.append(began_s)
    times.held_up.append(longest_s)
    cancelled_s = time.monotonic()
    task.cancel()
    with suppress(asyncio.CancelledError, FailedError):
        await task
    while not kind.safe():
        await asyncio.sleep(0.001)
    times.safe.append(time.monotonic() - cancelled_s)


def tell(name: str, times: Times) -> None:
    began, safe, held = sorted(times.began), sorted(times.safe), sorted(times.held_up)
    slow = sum(each > SAFE_WITHIN_S for each in safe)
    row = [
        f"{name} | {len(safe)}",
        *(f"{1e3 * each[len(each) // 2]:.1f} | {1e3 * each[-1]:.0f}" for each in (began, safe)),
    ]
    print(f"| {' | '.join(row)} | {slow} | {1e3 * held[-1]:.1f} |", flush=True)
    if times.failed:
        print(f"({name}: {times.failed} more calls had ended before they were cancelled)", flush=True)


@contextmanager
def joint_bus(**settings: object) -> Iterator[tuple[FakeMotor, Joint, WheelService]]:
    """A joint with its wheels on a pseudo-terminal, served as a daemon serves a robot that stands."""
    motor = FakeMotor(3, start_ticks=2048, shaft=JOINT)
    joint = Joint(JointSettings(3, **settings), time.monotonic)  # type: ignore[arg-type]
    with FakeBus((*turtlebot3_pair(), motor)) as bus, RealTimePump(bus.advance):
        yield motor, joint, WheelService(DynamixelWheels(bus.path, timeout_s=PATIENT_S, joints=(joint,)))


async def joint_row(stopped: str, calls: int, rng: random.Random) -> None:
    with joint_bus(stopped=stopped) as (motor, joint, service):
        await service.open()
        now_s, ends = 0.0, [-80.0, 80.0]

        async def serve() -> None:
            nonlocal now_s
            while True:
                service.serve(STANDSTILL, now_s)
                await asyncio.sleep(BLOCK_S)
                now_s += BLOCK_S

        def stands() -> bool:
            is_let_go = motor.memory.get("torque_enable") == 0
            return abs(motor.true_speed_rad_s) < STANDS_RAD_S and is_let_go is (stopped == "release")

        serving, times = asyncio.create_task(serve()), Times()
        for _ in range(calls):
            ends.reverse()
            motion = JointRunner(joint, service.exchange_now)
            begun = lambda: abs(motor.true_speed_rad_s) > STANDS_RAD_S  # noqa: E731
            await timed(Kind("", motion, call(angle_deg=ends[0]), begun, stands), rng, times)
        tell(f"joint, {stopped}", times)
        serving.cancel()
        await service.close()


async def rows(calls: int, rng: random.Random, folder: Path) -> None:
    from hvcpd.skills.pins import PinRunner

    mark = folder / "begun"
    deaf = "trap '' TERM; touch \"$0\"; while :; do sleep 60; done"
    hold = PythonRunner("hold")
    await hold.open()
    await asyncio.sleep(1.0)
    pin = PinRunner(PinSettings(17))

    async def unmark() -> None:
        mark.unlink(missing_ok=True)

    plain = ProgramRunner(("sh", "-c", 'touch "$0"; exec sleep 60', str(mark)))
    stubborn = ProgramRunner(("sh", "-c", deaf, str(mark)))
    kinds = (
        Kind("pin", pin, call(seconds=60.0), lambda: pin._device.value == 1, lambda: pin._device.value == 0),
        Kind("program", plain, call(), mark.exists, before=unmark),
        Kind("program, deaf to SIGTERM", stubborn, call(), mark.exists, before=unmark),
        Kind("Python object", hold, call(file=str(mark)), mark.exists, before=unmark),
    )
    for kind in kinds:
        times = Times()
        for _ in range(calls):
            await timed(kind, rng, times)
        tell(kind.name, times)
    await hold.close()
    await pin.close()


async def joint_rows(calls: int, rng: random.Random) -> None:
    for stopped in ("hold", "release"):
        await joint_row(stopped, calls, rng)


async def hung(count: int, folder: Path) -> None:
    """Programs and objects that hang, ended one after the other: what of this process's is left of them."""
    mark = folder / "begun"
    deaf = ProgramRunner(("sh", "-c", "trap '' TERM; touch \"$0\"; sleep 60 & while :; do sleep 60; done", str(mark)))

    def left() -> tuple[int, int, int, int]:
        gc.collect()
        children = Path(f"/proc/self/task/{os.getpid()}/children").read_text().split()
        resident_kib = int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") // 1024
        return len(os.listdir("/proc/self/fd")), len(children), len(asyncio.all_tasks()), resident_kib  # noqa: PTH208

    async def end(runner: Runner, what: Call) -> None:
        mark.unlink(missing_ok=True)
        task = asyncio.ensure_future(runner.perform(what, lambda _share, _text: None))
        while not mark.exists():
            await asyncio.sleep(0.005)
        task.cancel()
        await asyncio.wait([task])

    async def end_both() -> None:
        held = PythonRunner("hold")
        await end(held, call(file=str(mark)))
        await held.close()
        await end(deaf, call())

    for _ in range(WARM_UP):  # what the loop and the allocator need for any process at all is there from now on
        await end_both()
    before = left()
    for _ in range(count // 2):
        await end_both()
    print(f"\n{count} hung skills: open files, children, tasks, KiB of memory: {before} before, {left()} after")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--calls", type=int, default=250)
    parser.add_argument("--kills", type=int, default=20)
    parser.add_argument("--hung", type=int, default=100)
    parser.add_argument("--only", choices=PARTS, help="one part (default: all)")
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    rng = random.Random(options.seed)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        os.environ |= {"GPIOZERO_PIN_FACTORY": "files", "FAKE_PINS": name, "PYTHONPATH": name}
        (folder / "hold-1.0.dist-info").mkdir()
        (folder / "hold-1.0.dist-info" / "METADATA").write_text("Name: hold\nVersion: 1.0\n")
        (folder / "hold-1.0.dist-info" / "entry_points.txt").write_text("[hvcpd.skills]\nhold = holding:Hold\n")
        (folder / "holding.py").write_text(SKILL)
        parts = PARTS if options.only is None else (options.only,)
        print("| Skill | Calls | begun, ms: median | most | safe, ms: median | most | later than 500 ms | loop, ms |")
        print("|---|---|---|---|---|---|---|---|")
        if "cancel" in parts:
            asyncio.run(rows(options.calls, rng, folder))
        if "joint" in parts:
            asyncio.run(joint_rows(options.calls, rng))
        if "served" in parts:
            asyncio.run(served_rows(options.calls, rng, folder))
        if "hung" in parts:
            asyncio.run(hung(options.hung, folder))
        if "kill" in parts:
            kill_rows(options.kills, rng, folder)


if __name__ == "__main__":
    main()
