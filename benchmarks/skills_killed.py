"""Kills the daemon, `hvcpctl skills`, and a daemon with a joint by kill -9, and times how soon a pin is off and a joint
safe.

A part of `python -m benchmarks.skills`.
"""

from __future__ import annotations

import random
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from hil_fakes.dynamixel.bus import FakeBus
from hil_fakes.dynamixel.motor import JOINT, FakeMotor, turtlebot3_pair
from hil_fakes.dynamixel.pump import RealTimePump
from hil_fakes.pin_files import edges, is_on

SETTLED_S = 0.5
"""What a child is given at least before it is killed; and as much again at random."""
STANDS_RAD_S = 0.02
GIVEN_UP_S = 60.0
"""Nothing that is waited for takes so long, but on a machine that does nothing any more."""

DAEMON = """
import json, socket, sys, time
listener = socket.socket(socket.AF_UNIX)
listener.bind(sys.argv[1])
listener.listen()
client, _ = listener.accept()
def send(**line): client.sendall(json.dumps(line).encode() + b"\\n")
print(time.monotonic(), flush=True)
send(event="perform", call=1, task=1, skill="pour", arguments={"seconds": 60.0}, limit_s=90.0)
try:
    while True:
        send(event="beat")
        time.sleep(0.1)
except OSError:
    pass
"""
HOST = """
import asyncio, sys
from pathlib import Path
from hvcpd.config.skill_settings import PinSettings
from hvcpd.daemon.skill_hosting import offer
from hvcpd.skills.guard import GuardLine
from hvcpd.skills.pins import PinRunner
guard = GuardLine({17: True})
asyncio.run(offer(Path(sys.argv[1]), {"pour": PinRunner(PinSettings(17))}))
"""
JOINT_DAEMON = """
import asyncio, sys, time
from hvcpd.config.skill_settings import JointSettings
from hvcpd.daemon.wheel_service import WheelService
from hvcpd.hardware.joints import Joint
from hvcpd.hardware.wheels import DynamixelWheels
from hvcpd.ports import STANDSTILL
from hvcpd.skills.guard import GuardLine, Line
port, stopped = sys.argv[1:]
joint = Joint(JointSettings(3, stopped=stopped, speed_deg_s=30.0), time.monotonic)
service = WheelService(DynamixelWheels(port, timeout_s=0.2, joints=(joint,)))
async def main():
    await service.open()
    guard = GuardLine(line=Line(port, 1_000_000, (3,))) if stopped == "release" else None
    await asyncio.sleep(2.0)
    joint.turn(90.0)
    now = 0.0
    while True:
        service.serve(STANDSTILL, now)
        await asyncio.sleep(0.025)
        now += 0.025
asyncio.run(main())
"""


@contextmanager
def child(code: str, *words: str) -> Iterator[subprocess.Popen[str]]:
    """A process that is dead afterwards."""
    with subprocess.Popen([sys.executable, "-c", code, *words], stdout=subprocess.PIPE, text=True) as process:
        try:
            yield process
        finally:
            process.kill()


def until(holds: Callable[[], bool], process: subprocess.Popen[str] | None = None) -> float:
    """How long it took until it held, s."""
    began_s = time.monotonic()
    while not holds():
        if process is not None and process.poll() is not None:
            raise SystemExit("a process has ended by itself: is gpiozero installed, and the package with its fakes?")
        if time.monotonic() - began_s > GIVEN_UP_S:
            raise SystemExit(f"it has not come to that within {GIVEN_UP_S:g} s")
        time.sleep(0.001)
    return time.monotonic() - began_s


def pin_killed(which: str, number: int, rng: random.Random, pins: Path) -> tuple[float, float]:
    """From the kill until the pin is off, and before it from the daemon's word until the pin was on, s."""
    path = pins / f"{which}-{number}.sock"
    with child(DAEMON, str(path)) as daemon:
        until(path.exists, daemon)
        with child(HOST, str(path)) as host:
            assert daemon.stdout is not None
            asked_s = float(daemon.stdout.readline())
            until(lambda: is_on(pins, 17), host)
            began_s = edges(pins, 17)[-1].at_s - asked_s
            time.sleep(SETTLED_S * (1.0 + rng.random()))
            (daemon if which == "daemon" else host).kill()
            took_s = until(lambda: not is_on(pins, 17))
    time.sleep(1.0)  # until the guard has let go of the pin
    return took_s, began_s


def joint_killed(stopped: str, rng: random.Random) -> float:
    """From the kill of the process that has the bus until the joint stands, with its torque as declared, s."""
    motor = FakeMotor(3, start_ticks=1100, shaft=JOINT)
    with FakeBus((*turtlebot3_pair(), motor)) as bus, RealTimePump(bus.advance):
        with child(JOINT_DAEMON, bus.path, stopped) as process:
            until(lambda: abs(motor.true_speed_rad_s) > STANDS_RAD_S, process)
            time.sleep(SETTLED_S * (1.0 + rng.random()))
            process.kill()
            wanted = 0 if stopped == "release" else 1
            took_s = until(
                lambda: abs(motor.true_speed_rad_s) < STANDS_RAD_S and motor.memory.get("torque_enable") == wanted
            )
        time.sleep(0.5)
    return took_s


def kill_rows(kills: int, rng: random.Random, pins: Path) -> None:
    """Print how soon all was safe after kill -9, and what lay between a daemon's word and a pin that was on."""
    found: dict[str, list[float]] = {}
    begun: list[float] = []
    for number in range(kills):
        for which in ("daemon", "hvcpctl skills"):
            took_s, began_s = pin_killed(which, number, rng, pins)
            found.setdefault(f"pin, {which} killed", []).append(took_s)
            begun.append(began_s)
        for stopped in ("hold", "release"):
            found.setdefault(f"joint, {stopped}, daemon killed", []).append(joint_killed(stopped, rng))
    print("\n| kill -9 | Trials | safe, ms: median | most | later than 500 ms |\n|---|---|---|---|---|")
    for name, times in found.items():
        times.sort()
        slow = sum(each > 0.5 for each in times)
        print(f"| {name} | {len(times)} | {1e3 * times[len(times) // 2]:.0f} | {1e3 * times[-1]:.0f} | {slow} |")
    begun.sort()
    late = sum(each > 0.02 for each in begun)
    middle, most = 1e3 * begun[len(begun) // 2], 1e3 * begun[-1]
    print(f"\nFrom the daemon's word to a pin that is on: median {middle:.1f} ms, most {most:.0f} ms, "
          f"later than 20 ms {late} of {len(begun)}")  # fmt: skip
