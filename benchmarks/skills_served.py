"""Times skills from the robot's decision on: through its performer, the control socket, and the process that offers
the skill, which is the real `hvcpctl skills`, a client of a few lines, or the real `hvcpctl ros` with a roscore.

A part of `python -m benchmarks.skills`. The robot's step comes every 25 ms, as blocks of sound do; a decision falls
into a step, and its order leaves with it.
"""

from __future__ import annotations

import asyncio
import logging
import os
import random
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import structlog

from hil_fakes.dynamixel.bus import FakeBus
from hil_fakes.dynamixel.motor import turtlebot3_pair
from hil_fakes.dynamixel.pump import RealTimePump
from hil_fakes.pin_files import is_on
from hvcpd.config.task_file import load_tasks
from hvcpd.config.tasks import Action, Turn, Use
from hvcpd.daemon.control_protocol import RefusalError, Request
from hvcpd.daemon.control_server import Client, ControlServer
from hvcpd.daemon.control_socket import SocketFile
from hvcpd.daemon.skill_service import SkillService
from hvcpd.daemon.wheel_service import WheelService
from hvcpd.hardware.kinematics import Odometry
from hvcpd.hardware.navigator import Navigator
from hvcpd.hardware.wheels import DynamixelWheels
from hvcpd.ports import Pose
from hvcpd.robot.performer import Performer
from hvcpd.robot.records import SkillRecord
from hvcpd.robot.robot import Robot
from tests.e2e.ros_robot import Roscore, missing

PATIENT_S = 0.2
"""Fakes on a busy machine answer late."""
BLOCK_S = 0.025
POLL_S = 0.0005
HELD_S = 0.3
"""A call is cancelled after a random part of this."""
EARLY_S = 0.05
"""One call in EARLY_ONES is cancelled within a random part of this after the decision, when it may not have begun."""
EARLY_ONES = 5
WATCHED_S = 0.5
"""For so long such a call is watched: it may begin after its cancel was sent."""
GIVEN_UP_S = 60.0
STANDS_RAD_S = 0.02
"""A joint or wheel that turns no faster stands: it is a degree a second."""

SETTINGS = """
name: Rob
tasks: tasks.yaml
state_dir: .
control: {socket: d.sock}
skills:
  pour: {gpio: {pin: 17, amount: seconds, per_s: 1}}
  program: {run: [sh, -c, 'echo $$ > "$0.new"; mv "$0.new" "$0"; exec sleep 60', "{file}"]}
  deaf: {run: [sh, -c, 'trap "" TERM; echo $$ > "$0.new"; mv "$0.new" "$0"; while :; do sleep 60; done', "{file}"]}
"""
TASKS = """
skills:
  pour: {parameters: {seconds: {}}}
  program: &file {parameters: {file: {type: text}}}
  deaf: *file
  hold: *file
  lamp: *file
  arm: {parameters: {x_m: {}}}
tasks: [{number: 1, name: water the green rose, actions: [{wait: 1}]}]
"""
CLIENT = """
import json, socket, sys
from pathlib import Path
with socket.socket(socket.AF_UNIX) as robot:
    robot.connect(sys.argv[1])
    robot.sendall(b'{"id": 1, "command": "offer", "skills": ["lamp"]}\\n')
    for line in robot.makefile():
        match json.loads(line):
            case {"event": "perform", "arguments": {"file": name}}:
                Path(name).touch()
            case {"event": "cancel"}:
                Path(name).unlink()
"""
ROS = {"action": "arm", "type": "move_base_msgs/MoveBase", "goal": {"target_pose": {"header": {"frame_id": "{x_m}"}}}}


class Daemon:
    """A daemon's end of the control socket at `path`, without its ears: performer, services and server are real."""

    def __init__(self, path: Path, wheels: WheelService | None = None) -> None:
        tasks = load_tasks(path.parent / "tasks.yaml")
        self.service = SkillService(lambda: tasks)
        self.performer = Performer(Navigator(), Pose(0.0, 0.0))
        self.service.begin(cast(Robot, SimpleNamespace(performer=self.performer)))
        hello = {"event": "hello", "protocol": 1, "name": "Rob"}
        self._server = ControlServer(self._serve, lambda: hello, self.service.gone)
        self._file = SocketFile(path, "Rob")
        self._wheels, self._odometry = wheels, Odometry(Pose(0.0, 0.0))
        self._now = 0.0
        self.held_up_s = 0.0
        """The longest that one step took, and one request, s of processor time."""

    async def live(self) -> None:
        """Step until cancelled."""
        self._server.open(self._file.listen())
        try:
            while True:
                self.step()
                await asyncio.sleep(BLOCK_S)
                self._now += BLOCK_S
        finally:
            await self._server.close()
            self._file.remove()

    def step(self) -> None:
        """One block: the performer, then the wheels, then the skills, as in the daemon."""
        began_s = time.thread_time()
        reading = self._wheels.take_reading() if self._wheels is not None else None
        pose = self._odometry.update(reading) if reading is not None else self._odometry.pose
        progress = self.performer.step(pose, self._now, reading)
        if self._wheels is not None:
            self._wheels.serve(progress.wheels, self._now)
        self.service.take(self.performer.take_orders(), self._now)
        for record in self.performer.take_records(self._now):
            if isinstance(record, SkillRecord):
                self.service.note(record)
        self.held_up_s = max(self.held_up_s, time.thread_time() - began_s)

    async def _serve(self, request: Request, client: Client) -> Mapping[str, Any]:
        began_s = time.thread_time()
        try:
            return self._answer(request, client)
        finally:
            self.held_up_s = max(self.held_up_s, time.thread_time() - began_s)

    def _answer(self, request: Request, client: Client) -> Mapping[str, Any]:
        arguments = dict(request.arguments)
        match request.command:
            case "offer":
                return self.service.offer(client, arguments["skills"])
            case "progress" | "done" | "failed" as command:
                getattr(self.service, command)(client, arguments)
                return {}
            case "config":
                return {"settings": [{"key": "skills", "value": {"arm": {"run": [], "ros": ROS}}}]}
            case "tasks":
                return {"now_s": self._now, "tasks": []}
            case "subscribe":
                return {}
        raise RefusalError("unknown_command", request.command)


@dataclass
class Times:
    """Of all calls of one kind, s."""

    began: list[float] = field(default_factory=list)
    safe: list[float] = field(default_factory=list)
    held_up_s: float = 0.0


@dataclass(frozen=True)
class Kind:
    """One kind of skill: the action that calls it, when it acts, and when it is safe."""

    name: str
    action: Action
    acts: Callable[[], bool]
    is_safe: Callable[[], bool]


async def until(holds: Callable[[], bool], what: str) -> float:
    """Wait; the monotonic time when it held."""
    given_up_s = time.monotonic() + GIVEN_UP_S
    while not holds():
        if time.monotonic() > given_up_s:
            raise SystemExit(f"{what}: not within {GIVEN_UP_S:g} s")
        await asyncio.sleep(POLL_S)
    return time.monotonic()


async def timed(daemon: Daemon, kind: Kind, calls: int, rng: random.Random) -> Times:
    """`calls` of them, each cancelled at a random moment."""
    times = Times()
    daemon.held_up_s = 0.0
    for number in range(calls):
        asked_s = time.monotonic()
        daemon.performer.begin((kind.action,), 1)
        daemon.step()
        is_early = number % EARLY_ONES == 0
        if is_early:
            await asyncio.sleep(EARLY_S * rng.random())
        else:
            times.began.append(await until(kind.acts, f"{kind.name} begins") - asked_s)
            await asyncio.sleep(HELD_S * rng.random())
        if not is_early and not kind.acts():
            raise SystemExit(f"{kind.name} has ended by itself")
        cancelled_s = time.monotonic()
        daemon.performer.cancel()
        daemon.step()
        times.safe.append(await safe_after(kind, cancelled_s, is_early))
    times.held_up_s = daemon.held_up_s
    return times


async def safe_after(kind: Kind, cancelled_s: float, is_early: bool) -> float:
    """How long after its cancel a call was safe for good, s."""
    safe_s = await until(kind.is_safe, f"{kind.name} is safe") - cancelled_s
    while is_early and time.monotonic() < cancelled_s + WATCHED_S:
        await asyncio.sleep(POLL_S)
        if not kind.is_safe():
            safe_s = await until(kind.is_safe, f"{kind.name} is safe") - cancelled_s
    return safe_s


def tell(name: str, times: Times) -> None:
    """A row of the table."""
    columns = [f"{name} | {len(times.safe)}"]
    for each, limit_s in ((sorted(times.began), 0.02), (sorted(times.safe), 0.5)):
        late = sum(one > limit_s for one in each)
        columns.append(f"{1e3 * each[len(each) // 2]:.1f} | {1e3 * each[-1]:.0f} | {late}")
    print(f"| {' | '.join(columns)} | {1e3 * times.held_up_s:.2f} |", flush=True)


def _runs(mark: Path) -> bool:
    """Whether the process whose number a file has still runs."""
    with suppress(OSError, ValueError):
        os.kill(int(mark.read_text()), 0)
        return True
    return False


def kinds(folder: Path) -> tuple[Kind, ...]:
    """All but driving, with their marks in `folder`."""
    mark = folder / "mark"
    of_file = (("file", str(mark)),)
    ends = lambda: not _runs(mark)  # noqa: E731
    gone = lambda: not mark.exists()  # noqa: E731
    return (
        Kind("pin", Use("pour", (("seconds", 60.0),), 90.0), lambda: is_on(folder, 17), lambda: not is_on(folder, 17)),
        Kind("program", Use("program", of_file, 90.0), lambda: _runs(mark), ends),
        Kind("program, deaf to SIGTERM", Use("deaf", of_file, 90.0), lambda: _runs(mark), ends),
        Kind("Python object", Use("hold", of_file, 90.0), mark.exists, gone),
        Kind("client of the socket", Use("lamp", of_file, 90.0), mark.exists, gone),
        Kind("action of ROS 1", Use("arm", (("x_m", 1.0),), 90.0), mark.exists, gone),
    )


@contextmanager
def child(*words: str, environment: Mapping[str, str] | None = None) -> Iterator[None]:
    """A process that is ended afterwards; what it says is left out."""
    whole = {**os.environ, **(environment or {})}
    process = subprocess.Popen(words, env=whole, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        yield
    finally:
        process.terminate()
        process.wait(GIVEN_UP_S)


@contextmanager
def offering(folder: Path, wanted: str) -> Iterator[None]:
    """What offers a skill: `hvcpctl skills` for those in the settings, a client, or `hvcpctl ros` with its ROS."""
    path, run = str(folder / "d.sock"), (sys.executable, "-m", "hvcpd.control.cli")
    with ExitStack() as stack:
        if wanted == "lamp":
            stack.enter_context(child(sys.executable, "-c", CLIENT, path))
        elif wanted == "arm":
            core = Roscore(folder, "core")
            stack.callback(core.close)
            words = ("--action", "arm", "--type", ROS["type"], "--takes-s", "60", "--mark", str(folder / "mark"))
            fake = (sys.executable, "-m", "hil_fakes.ros_actions", *map(str, words))
            while not core.answers():
                time.sleep(0.1)
            stack.enter_context(child(*fake, environment=core.environment))
            stack.enter_context(child(*run, "ros", "--socket", path, "--ros", "1", environment=core.environment))
        else:
            stack.enter_context(child(*run, "skills", "--config", str(folder / "hvcpd.yaml"), "--socket", path))
        yield


async def served_rows(calls: int, rng: random.Random, folder: Path) -> None:
    """Print the table."""
    structlog.configure(wrapper_class=structlog.make_filtering_bound_logger(logging.WARNING))
    (folder / "hvcpd.yaml").write_text(SETTINGS)
    (folder / "tasks.yaml").write_text(TASKS)
    print("\n| From the decision | Calls | acts, ms: median | most | later than 20 ms | safe, ms: median | most "
          "| later than 500 ms | daemon's loop, ms |\n|" + "---|" * 9)  # fmt: skip
    for kind in kinds(folder):
        assert isinstance(kind.action, Use)
        skill = kind.action.skill
        if skill == "arm" and missing():
            print(f"({kind.name}: {missing()})")
            continue
        daemon = Daemon(folder / "d.sock")
        living = asyncio.create_task(daemon.live())
        await asyncio.sleep(2 * BLOCK_S)
        with await asyncio.to_thread(_entered, offering(folder, skill)):
            await until(lambda: skill in daemon.service.offered, f"{skill} is offered")  # noqa: B023
            await asyncio.sleep(2.0)
            tell(kind.name, await timed(daemon, kind, calls, rng))
        living.cancel()
        await asyncio.wait([living])
    await _driving(calls, rng, folder)


def _entered(offers: Any) -> ExitStack:
    """The context, entered; a thread does so, because it waits."""
    stack = ExitStack()
    stack.enter_context(offers)
    return stack


async def _driving(calls: int, rng: random.Random, folder: Path) -> None:
    """A robot that turns on the spot, on fake wheels; there is nothing to offer."""
    pair = turtlebot3_pair()
    with FakeBus(pair) as bus, RealTimePump(bus.advance):
        wheels = WheelService(DynamixelWheels(bus.path, timeout_s=PATIENT_S))
        await wheels.open()
        daemon = Daemon(folder / "d.sock", wheels)
        living = asyncio.create_task(daemon.live())
        turning = Kind(
            "driving",
            Turn(350.0),
            lambda: any(abs(motor.true_speed_rad_s) > STANDS_RAD_S for motor in pair),
            lambda: all(abs(motor.true_speed_rad_s) < STANDS_RAD_S for motor in pair),
        )
        tell(turning.name, await timed(daemon, turning, calls, rng))
        living.cancel()
        await asyncio.wait([living])
        await wheels.close()
