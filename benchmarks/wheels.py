"""The wheels' figures: processor time of a cycle, courses, fault schedules, kill -9. All on fakes, without a robot.

    python -m benchmarks.wheels [--trials 1000] [--cycles 2000] [--kills 5] [--kinds dynamixel,opencr]

Exit status 1 if a limit is missed; the limits stand beside the figures.
"""

from __future__ import annotations

import argparse
import asyncio
import collections
import resource
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from hil_fakes.dynamixel.bus import FakeBus
from hil_fakes.dynamixel.motor import FakeMotor, turtlebot3_pair
from hil_fakes.dynamixel.opencr import FakeOpenCR
from hil_fakes.dynamixel.pump import RealTimePump
from hil_fakes.fault_schedule import Fault
from hil_fakes.true_pose import TrueWheels
from hil_fakes.virtual_robot import Kind
from hil_fakes.wheel_course import FIGURE_OF_EIGHT, SQUARE, calibrate_by_tape, drive_course
from hil_fakes.wheel_trial import run_trial, stop_limit_s
from hvcpd.daemon.wheel_service import WheelService
from hvcpd.hardware.kinematics import BURGER
from hvcpd.hardware.wheels import DynamixelWheels
from hvcpd.hardware.wheels_opencr import OpenCRWheels
from hvcpd.ports import STANDSTILL, WheelCommand, Wheels

RATE_HZ = 50
MAX_SHARE = 0.02
MAX_WAIT_S = 0.001
AHEAD = WheelCommand(2.0, 2.0)
UNEQUAL = TrueWheels(left_radius_m=0.033 * 0.995, right_radius_m=0.033 * 1.005, separation_m=0.162)
STANDING_RAD_S = 0.05


class Score:
    """Prints figures against their limits and remembers misses."""

    def __init__(self) -> None:
        self.missed = 0

    def tell(self, what: str, figure: str, good: bool | None = None) -> None:
        mark = "" if good is None else ("  ok" if good else "  MISSED")
        self.missed += good is False
        print(f"{what:<64}{figure}{mark}", flush=True)


def devices(kind: Kind) -> list[FakeMotor | FakeOpenCR]:
    return [FakeOpenCR()] if kind == "opencr" else list(turtlebot3_pair())


def driver(kind: Kind, path: str) -> Wheels:
    return OpenCRWheels(path) if kind == "opencr" else DynamixelWheels(path)


def cycle(score: Score, kind: Kind, cycles: int) -> None:
    """Processor time of the driver's thread; the fake's own thread is not counted."""
    with FakeBus(devices(kind)) as bus:
        wheels = driver(kind, bus.path)
        wheels.open()
        for _ in range(50):
            wheels.exchange(AHEAD)
        cpu_s, wall_s = time.thread_time(), time.perf_counter()
        for _ in range(cycles):
            wheels.exchange(AHEAD)
        cpu_s, wall_s = (time.thread_time() - cpu_s) / cycles, (time.perf_counter() - wall_s) / cycles
        wheels.close()
    share = cpu_s * RATE_HZ
    score.tell(
        f"{kind}: processor time of a cycle of both wheels", f"{cpu_s * 1e6:.0f} us ({wall_s * 1e6:.0f} us wall)"
    )
    score.tell(f"{kind}: share of a core at {RATE_HZ} Hz (limit 2 %)", f"{share:.2%}", share <= MAX_SHARE)


def waiting(score: Score, kind: Kind, blocks: int) -> None:
    """How long the event loop is held up by `serve`, with the bus in its worker thread and the fake in a process of
    its own. In the last quarter the fake is frozen, so that the worker tries to heal.

    A block that took longer than the limit is the bus's doing unless the kernel gave the processor to another process
    meanwhile (involuntary context switches of this thread, getrusage(2)) and the thread itself computed for less.
    """
    with fake_process(kind) as (process, path):
        held, ours, others = asyncio.run(_hold_ups(kind, path, blocks, process))
    held.sort()
    text = f"{held[blocks // 2] * 1e6:.0f} us, {held[int(blocks * 0.99)] * 1e6:.0f} us"
    score.tell(f"{kind}: event loop held up: median, 99 %", text)
    score.tell(f"{kind}: blocks of {blocks} held up by the bus for 1 ms (limit 0)", str(ours), ours == 0)
    score.tell(f"{kind}: blocks so held up by other processes, longest", f"{others}, {held[-1] * 1e3:.1f} ms")


async def _hold_ups(kind: Kind, path: str, blocks: int, process: subprocess.Popen[str]) -> tuple[list[float], int, int]:
    service = WheelService(driver(kind, path))
    await service.open()
    held, ours, others = [], 0, 0
    for block in range(blocks):
        if block == blocks * 3 // 4:
            process.send_signal(signal.SIGSTOP)
        switches = resource.getrusage(resource.RUSAGE_THREAD).ru_nivcsw
        start_s, cpu_s = time.perf_counter(), time.thread_time()
        service.serve(AHEAD if block % 40 else STANDSTILL, block * 0.002)
        service.take_reading()
        held.append(time.perf_counter() - start_s)
        if held[-1] > MAX_WAIT_S:
            taken = resource.getrusage(resource.RUSAGE_THREAD).ru_nivcsw > switches
            excused = taken and time.thread_time() - cpu_s < MAX_WAIT_S
            others, ours = others + excused, ours + (not excused)
        await asyncio.sleep(0.002)
    process.send_signal(signal.SIGCONT)
    await service.close()
    return held, ours, others


@contextmanager
def fake_process(kind: Kind) -> Iterator[tuple[subprocess.Popen[str], str]]:
    """A fake robot in a process of its own, and its port."""
    command = [sys.executable, "-m", "hil_fakes.dynamixel", kind]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout is not None
            yield process, process.stdout.readline().strip()
        finally:
            process.terminate()


def courses(score: Score, kind: Kind) -> None:
    drive = calibrate_by_tape(BURGER, UNEQUAL, seed=1, kind=kind)
    for name, course in (("square of 1 m", SQUARE), ("figure of eight", FIGURE_OF_EIGHT)):
        raw = drive_course(course, BURGER, UNEQUAL, seed=2, kind=kind)
        results = [drive_course(course, drive, UNEQUAL, seed=seed, kind=kind) for seed in range(5)]
        worst = max(result.closing_share for result in results)
        turned = max(abs(result.heading_deg) for result in results)
        score.tell(
            f"{kind}: {name}, wheels 1 % unequal, not calibrated", f"{raw.closing_share:.2%}, {raw.heading_deg:.1f} deg"
        )
        text = f"{worst:.2%}, {turned:.1f} deg"
        score.tell(f"{kind}: {name}, calibrated (limits 1 %, 2 deg)", text, worst <= 0.01 and turned <= 2.0)


def trials(score: Score, kind: Kind, count: int) -> None:
    start_s = time.perf_counter()
    states: collections.Counter[str] = collections.Counter()
    stops: dict[str, float] = collections.defaultdict(float)
    broken, virtual_s, faults = 0, 0.0, 0
    for seed in range(count):
        verdict = run_trial(seed, kind)
        states[verdict.state.value] += 1
        virtual_s += verdict.virtual_s
        faults += len(verdict.events)
        for fault, stop_s in verdict.stop_s.items():
            stops[fault.value] = max(stops[fault.value], stop_s)
        if verdict.broken:
            broken += 1
            print(f"  seed {seed}: {verdict.broken[0]}")
    wall_s = time.perf_counter() - start_s
    score.tell(
        f"{kind}: journeys under fault schedules", f"{count} with {faults} faults, {virtual_s:.0f} s in {wall_s:.0f} s"
    )
    score.tell(f"{kind}: ended", ", ".join(f"{name} {n}" for name, n in sorted(states.items())))
    score.tell(f"{kind}: with a rule broken (limit 0)", str(broken), broken == 0)
    for name, stop_s in sorted(stops.items()):
        limit_s = stop_limit_s(kind, Fault(name))
        score.tell(
            f"{kind}: longest stop after {name} (limit {limit_s:g} s)", f"{stop_s:.2f} s", stop_s <= limit_s + 0.01
        )


def kill(score: Score, kind: Kind, count: int) -> None:
    """A real process drives, is killed, and the fake's time is taken until its wheels stand."""
    longest_s = max(_killed(kind) for _ in range(count))
    limit_s = stop_limit_s(kind, Fault.HANG)
    score.tell(
        f"{kind}: kill -9 in mid-motion, longest of {count} (limit {limit_s:g} s)",
        f"{longest_s:.2f} s",
        longest_s <= limit_s,
    )


def _killed(kind: Kind) -> float:
    there = devices(kind)
    motors = [m for d in there for m in ((d.left, d.right) if isinstance(d, FakeOpenCR) else (d,))]
    changed = threading.Condition()

    def fastest() -> float:
        return max(abs(motor.true_speed_rad_s) for motor in motors)

    with FakeBus(there) as bus:

        def advance(dt_s: float) -> None:
            with changed:
                bus.advance(dt_s)
                changed.notify_all()

        def when(condition: Callable[[], bool]) -> float:
            with changed:
                if not changed.wait_for(condition, 30.0):
                    raise SystemExit("the process does not drive")
                return bus.line.now_s

        command = [sys.executable, "-m", "hvcpd.control.cli", "drive", "forward", "5", "--port", bus.path]
        with RealTimePump(advance), subprocess.Popen(command, stdout=subprocess.DEVNULL) as process:
            when(lambda: fastest() > 5.5)  # near top speed, 6.06 rad/s
            process.kill()
            killed_s = bus.line.now_s
            return when(lambda: fastest() <= STANDING_RAD_S) - killed_s


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--trials", type=int, default=1000)
    parser.add_argument("--cycles", type=int, default=2000)
    parser.add_argument("--kills", type=int, default=5)
    parser.add_argument("--kinds", default="dynamixel,opencr")
    options = parser.parse_args()
    score = Score()
    for kind in options.kinds.split(","):
        cycle(score, kind, options.cycles)
        waiting(score, kind, options.cycles)
        courses(score, kind)
        kill(score, kind, options.kills)
        trials(score, kind, options.trials)
    peak_mb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    score.tell("peak memory of this benchmark", f"{peak_mb:.0f} MB")
    sys.exit(1 if score.missed else 0)


if __name__ == "__main__":
    main()
