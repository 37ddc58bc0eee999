"""Two robots on stage: processes, sound server, air and motors, and what is kept of it all when something fails."""

from __future__ import annotations

import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Generic, TypeVar

from hil_fakes.sound_server import SoundServer, wait_until
from hvcpd.ports import Pose
from tests.e2e.parts import PRIORITY
from tests.e2e.robot import Part, RobotProcess
from tests.undisturbed import MISSION, undisturbed

START_S = 120.0
"""From nothing to listening: a cold start renders some thousand words, on a machine with other work to do."""
MISSION_S = 900.0
"""For five plants; they take a minute and a half on a machine with little else to do."""
LAST_LINES = 12
"""Of each log, told if something fails: where CI runs, the files are lost."""

PARTS = (Part("Rob", Pose(0.0, 0.0), seed=1), Part("Bot", Pose(0.0, 0.2), seed=2))
NAMES = [part.name.lower() for part in PARTS]
"""As the sound server knows them."""

PLACES = {
    "green": (0.20, 0.00),
    "violet": (0.25, 0.20),
    "indigo": (0.15, 0.10),
    "orange": (0.30, 0.10),
    "yellow": (0.10, 0.25),
}
Tasks = Mapping[int, tuple[str, tuple[float, float]]]
"""Number to name and place in m."""
TASKS: Tasks = {number: (f"water the {colour} rose", place) for number, (colour, place) in enumerate(PLACES.items(), 1)}
"""The paper's five plants, so near to each other that nobody drives for long."""
THREE: Tasks = dict(list(TASKS.items())[:3])
"""Enough for both robots to drive more than once between them, in half the time."""
FOUR: Tasks = dict(list(TASKS.items())[:4])
"""Two for each: who is in trouble while it drives to its first has not lost all when it is out of it."""


Robot = TypeVar("Robot", bound=RobotProcess)


class Stage(Generic[Robot]):
    """The robots `robots`, what they have to do, and the means to do them harm."""

    def __init__(self, folder: Path, units: Path, stack: ExitStack, kind: type[Robot], tasks: Tasks) -> None:
        self.tasks = tasks
        file = folder / "tasks.yaml"
        file.write_text("tasks:\n" + "".join(_task(n, name, x, y) for n, (name, (x, y)) in tasks.items()))
        (folder / "units").symlink_to(units)
        # Paths of sockets must be short, so they are not in the folder that is kept.
        runtime = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="sound-")))
        self.server = stack.enter_context(SoundServer(runtime, NAMES, folder / "server.log", PRIORITY))
        self._air = _start_air(self.server, folder, stack)
        self.robots = [kind(part, folder, file, self._environment(part, runtime)) for part in PARTS]
        for robot in self.robots:
            stack.callback(robot.close)

    def _environment(self, part: Part, runtime: Path) -> dict[str, str]:
        return {**self.server.environment(part.name.lower()), "RUNTIME_DIRECTORY": str(runtime)}

    def start(self) -> None:
        """Switch the robots on, one after the other, and wait until both listen; it takes all of the processor."""
        with undisturbed():
            for robot in self.robots:
                robot.start()
            self.wait(lambda: all(robot.events("listening") for robot in self.robots), START_S, "both robots listen")

    def wait(self, condition: Callable[[], bool], timeout_s: float, what: str) -> None:
        """Wait in real time until `condition` holds; a daemon that loses its wheels for long begins anew."""

        def holds() -> bool:
            for robot in self.robots:
                robot.restart_if_ended()
            assert self._air.poll() is None, "there is no air; see air.log"
            return condition()

        wait_until(holds, timeout_s, what)

    def wait_for_all_done(self) -> None:
        """Until each robot knows that all plants are watered, and nobody waits for an answer: who is told to end in the
        midst of a report may have no time left to say that it leaves."""

        def holds() -> bool:
            return all(self._all_done(robot) for robot in self.robots) and all(r.is_free() for r in self.robots)

        self.wait(holds, MISSION_S, "every robot knows all as done, and is free")

    def _all_done(self, robot: Robot) -> bool:
        return [state for state, _ in robot.tasks().values()] == ["done"] * len(self.tasks)


@contextmanager
def staged(folder: Path, units: Path, kind: type[Robot], tasks: Tasks = TASKS) -> Iterator[Stage[Robot]]:
    """A stage, set up and taken down; recordings and logs stay in `folder` if something fails, and else go."""
    try:
        with undisturbed(MISSION), ExitStack() as stack:
            yield Stage(folder, units, stack, kind, tasks)
    except BaseException as error:
        error.add_note(f"What was heard (WAV), logs, memories and trails are in {folder}")
        for log in sorted(folder.glob("*.log")):
            error.add_note(f"{log.name}:\n" + "\n".join(log.read_text(errors="replace").splitlines()[-LAST_LINES:]))
        raise
    shutil.rmtree(folder)


def _task(number: int, name: str, x_m: float, y_m: float) -> str:
    place = f"{{x_m: {x_m}, y_m: {y_m}}}"
    return f"  - {{number: {number}, name: {name}, place: {place}, actions: [go to place, {{water: 1}}]}}\n"


def _start_air(server: SoundServer, folder: Path, stack: ExitStack) -> subprocess.Popen[bytes]:
    options = ["--server", str(server.socket), "--robots", ",".join(NAMES), "--record", str(folder)]
    command = [*PRIORITY, sys.executable, "-m", "hil_fakes.real_air", *options]
    with (folder / "air.log").open("wb") as log:
        air = subprocess.Popen(command, stdin=subprocess.PIPE, stderr=log)
    stack.callback(air.communicate)
    return air
