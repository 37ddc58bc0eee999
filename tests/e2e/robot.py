"""One robot as two processes: `hvcpd` and its fake motors. Looked at from outside only."""

from __future__ import annotations

import os
import shlex
import signal
import sqlite3
import subprocess
import sys
from collections.abc import Mapping
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path

from hil_fakes.motor_process import TrailPoint, last_point, read_trail
from hil_fakes.sound_server import DIE_WITH_PARENT, LOUDSPEAKER, MICROPHONE, wait_until
from hvcpd.control.live.daemon_client import DaemonClient
from hvcpd.control.live.transcript import AskedRows
from hvcpd.coordination.states import State
from hvcpd.errors import EX_UNAVAILABLE, NotDoneError, NotRunningError
from hvcpd.memory.store import TranscriptReader, TranscriptRecord
from hvcpd.ports import Pose
from tests.e2e.parts import PRIORITY, own_network

END_S = 60.0
"""For a process that is told to end; a robot waits up to 20 s to say that it leaves."""
STANDING_RAD_S = 0.05

_SETTINGS = """\
name: {name}
tasks: {tasks}
state_dir: {state}
start: {{x_m: {x_m}, y_m: {y_m}}}
audio: {{input_device: {microphone}, output_device: {loudspeaker}}}
wheels: {wheels}
seed: {seed}
voices: robots
"""
"""Only robots speak here: nobody listens for people, which would take processor time that the rest needs."""


@dataclass(frozen=True)
class Part:
    """Who is on stage: a robot's name, where it stands at first, and the seed of its chance."""

    name: str
    start: Pose
    seed: int


TASKS_KEPT = "SELECT number, state, owner FROM tasks"


class RobotProcess:
    """A robot on stage. `folder` takes all its files; `environment` leads to its sound devices."""

    def __init__(self, part: Part, folder: Path, tasks: Path, environment: Mapping[str, str]) -> None:
        self.name = name = part.name
        self._start = start = part.start
        self.memory = folder / f"{name.lower()}.sqlite3"
        self.log = folder / f"{name}.log"
        self._motor_log = folder / f"{name}-motors.log"
        self._trail = folder / f"{name}-trail.jsonl"
        self._port = folder / f"{name}-port"
        self._environment = environment
        self._settings = folder / f"{name}.yaml"
        own = [sys.executable, "-m", "hvcpd.cli", "--config", str(self._settings)]
        self._command = [*PRIORITY, *own_network(), *DIE_WITH_PARENT, *own]
        self._settings.write_text(
            _SETTINGS.format(
                name=name,
                tasks=tasks,
                state=folder,
                x_m=start.x_m,
                y_m=start.y_m,
                wheels=self._wheels(),
                microphone=MICROPHONE,
                loudspeaker=LOUDSPEAKER,
                seed=part.seed,
            )
        )
        self._motors: subprocess.Popen[str] | None = None
        self.daemon: subprocess.Popen[bytes] | None = None

    @property
    def control_socket(self) -> Path:
        """Where the daemon listens for hvcpctl."""
        return Path(self._environment["RUNTIME_DIRECTORY"]) / f"{self.name.lower()}.sock"

    def _wheels(self) -> str:
        """The settings' wheels."""
        return f"{{driver: dynamixel, port: {self._port}}}"

    # --- its two processes ------------------------------------------------------------------------------------------

    def start(self) -> None:
        """Switch the motors on, then the daemon."""
        pose = f"{self._start.x_m},{self._start.y_m},0"
        options = ["--port", str(self._port), "--trail", str(self._trail), f"--pose={pose}"]
        with self._motor_log.open("ab") as log:
            self._motors = subprocess.Popen(
                [*PRIORITY, sys.executable, "-m", "hil_fakes.motor_process", *options],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=log,
                text=True,
            )
        assert self._answer() == "ready", f"see {self._motor_log}"
        wait_until(lambda: self._trail.stat().st_size > 0, END_S, "the motors' time passes")
        self.start_daemon()

    def start_daemon(self) -> None:
        """Start the daemon, as a service manager does."""
        with self.log.open("ab") as log:
            self.daemon = subprocess.Popen(
                self._command,
                env={**os.environ, **self._environment},
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=log,
            )

    def restart_if_ended(self) -> None:
        """What a service manager does with a daemon that gave up a device; nothing else may end one."""
        assert self.daemon is not None
        status = self.daemon.poll()
        assert status in (None, EX_UNAVAILABLE), f"{self.name} ended with status {status}; see {self.log}"
        if status is not None:
            self.start_daemon()

    def kill_daemon(self) -> None:
        """kill -9, in the midst of whatever it does."""
        assert self.daemon is not None
        daemon, self.daemon = self.daemon, None
        daemon.kill()
        daemon.wait()

    def end_daemon(self) -> int:
        """Tell it to end; its exit status."""
        assert self.daemon is not None
        self.daemon.send_signal(signal.SIGTERM)
        daemon, self.daemon = self.daemon, None
        return daemon.wait(END_S)

    def command_motors(self, word: str) -> None:
        """Have the adapter unplugged or replugged."""
        assert self._motors is not None
        assert self._motors.stdin is not None
        self._motors.stdin.write(f"{word}\n")
        self._motors.stdin.flush()
        assert self._answer() == "done", f"see {self._motor_log}"

    def close(self) -> None:
        """End both processes."""
        if self.daemon is not None:
            self.kill_daemon()
        if self._motors is not None:
            self._motors.communicate(timeout=END_S)  # they end with their input

    def _answer(self) -> str:
        assert self._motors is not None
        assert self._motors.stdout is not None
        return self._motors.stdout.readline().strip()

    # --- what is seen from outside ----------------------------------------------------------------------------------

    def tasks(self) -> dict[int, tuple[str, str | None]]:
        """Its tasks, number to state and owner: as its daemon has them, or else its file; none while it is starting."""
        try:
            with closing(DaemonClient(self.control_socket)) as client:
                return {task["number"]: (task["state"], task["owner"]) for task in client.ask("tasks")["tasks"]}
        except NotDoneError:
            return {}
        except NotRunningError:
            pass
        try:
            with closing(sqlite3.connect(f"file:{self.memory}?mode=ro", uri=True)) as db:
                return {number: (state, owner) for number, state, owner in db.execute(TASKS_KEPT)}
        except sqlite3.OperationalError:  # there is none yet, or a daemon that has no socket yet keeps it
            return {}

    def transcript(self) -> tuple[TranscriptRecord, ...]:
        """All that it said and heard, as its daemon has it, or else its file."""
        rows: AskedRows | TranscriptReader
        try:
            rows = AskedRows(DaemonClient(self.control_socket))
        except NotRunningError:
            rows = TranscriptReader(self.memory)
        with closing(rows):
            return tuple(row.record for row in rows.rows())

    def said(self) -> list[str]:
        """Its own sentences."""
        return [record.text for record in self.transcript() if record.kind == "said"]

    def is_free(self) -> bool:
        """Whether it has no task, and no sentence of its own that waits to be said or answered."""
        try:
            with closing(DaemonClient(self.control_socket)) as client:
                return bool(client.ask("status")["state"] == State.READY.name.lower())
        except NotRunningError:
            return False

    def trail(self) -> tuple[TrailPoint, ...]:
        """Where it has truly been."""
        return read_trail(self._trail)

    @property
    def drives(self) -> bool:
        """Whether its wheels truly turn."""
        return last_point(self._trail).fastest_rad_s > STANDING_RAD_S

    def events(self, name: str) -> list[dict[str, str]]:
        """The lines of its log with this event."""
        return [
            dict(part.split("=", 1) for part in shlex.split(line))
            for line in self.log.read_text().splitlines()
            if f" event={name} " in line or f' event="{name}" ' in line
        ]
