"""A second process that makes all skills safe when their host itself is killed; it waits for the host's end.

Over a pipe the host reports, line by line, everything that must be made safe at present; when the pipe breaks, the
guard does so. A frozen host (Ctrl-Z) can make nothing safe and keeps its pins from others: once its beat is missing,
the guard kills it.

    python -m hvcpd.skills.guard

is started by the host; its devices are open in advance, so that it needs no time then.
"""

from __future__ import annotations

import asyncio
import json
import os
import select
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import Any

LET_GO_S = 5.0
"""Longest time for which the guard retries pins still in use, and joints that do not confirm that they let go: a
killed process may hold them for a moment longer."""
AGAIN_S = 0.01
"""Between two tries."""
REPLY_S = 0.034
"""Wait for a joint's reply; the SDK's own value, as `hvcpd.hardware.wheels_bus` has it."""

BEAT_S = 0.1
"""Between two beats of a host, each an empty line."""
SILENT_S = 0.5
"""A host without a beat for this long twice in a row is frozen. Twice: if both were frozen, it has time to beat
first."""


MARK = "SKILL_GUARD"
"""The variable in a program's environment with its guard's process number. By it the guard finds a program whose host
was killed before it could report the program's group."""


@dataclass(frozen=True)
class Line:
    """A serial line with Dynamixel joints whose torque must be released: port, baud rate, the motors' identifiers."""

    port: str
    baud_rate: int
    ids: tuple[int, ...]


class GuardLine:
    """The host's end of the pipe."""

    def __init__(self, pins: Mapping[int, bool] | None = None, line: Line | None = None) -> None:
        """`pins`: each pin that may be on, and whether it is on when it is high."""
        words = (sys.executable, "-m", "hvcpd.skills.guard")
        self._process = subprocess.Popen(words, stdin=subprocess.PIPE, start_new_session=True, bufsize=0)
        assert self._process.stdin is not None
        self._pipe = self._process.stdin
        joints_line = {"line": asdict(line)} if line is not None else {}
        self._tell({"pins": [[pin, high] for pin, high in (pins or {}).items()], **joints_line})

    @property
    def pid(self) -> int:
        """Its process."""
        return self._process.pid

    @property
    def mark(self) -> dict[str, str]:
        """The mark in the environment of each program that it guards."""
        return {MARK: str(self._process.pid)}

    async def beat(self) -> None:
        """Report for ever that the event loop runs; from the first beat on it must not stop before `close`."""
        os.set_blocking(self._pipe.fileno(), False)
        while True:
            with suppress(OSError):
                self._pipe.write(b"\n")
            await asyncio.sleep(BEAT_S)

    def arm(self, group: int | None = None, safe: tuple[str, ...] = ()) -> None:
        """If this process dies, kill that process group, if it is known, and run that program; without them only pins
        must be made safe from now on."""
        self._tell({"group": group, "safe": list(safe)})

    def close(self) -> None:
        """Everything is safe: end the guard."""
        self._tell({"bye": True})
        with suppress(OSError):
            self._pipe.close()
        self._process.wait(timeout=5.0)

    def _tell(self, value: Mapping[str, Any]) -> None:
        with suppress(OSError):
            self._pipe.write(json.dumps(value).encode() + b"\n")


def watch(pipe: int) -> None:
    """Wait for the end of the file descriptor `pipe`, and then make safe everything in the last report."""
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, signal.SIG_IGN)
    group, safe, pins = None, [], []
    line_of_joints: Line | None = None
    for line in _lines(pipe):
        try:
            value = json.loads(line)
        except ValueError:
            continue  # a beat, or a line cut off in the middle
        if value.get("bye"):
            return
        if "pins" in value:
            pins = value["pins"]
            if "line" in value:
                line_of_joints = Line(**value["line"])
            threading.Thread(target=_load, args=(pins, line_of_joints), daemon=True).start()
        else:
            group, safe = value["group"], value["safe"]
    if group is not None:
        with suppress(ProcessLookupError, PermissionError):
            os.killpg(group, signal.SIGKILL)
    for pid in _marked():
        with suppress(ProcessLookupError, PermissionError):
            os.kill(pid, signal.SIGKILL)
    running = _started(safe)
    _make_safe(pins, line_of_joints)
    if running is not None:
        with suppress(subprocess.TimeoutExpired):
            running.wait(LET_GO_S)


def _lines(pipe: int) -> Iterator[bytes]:
    """The host's reports until it is dead; it is killed if its beat has begun and then stops."""
    host, rest, beats, silences = os.getppid(), b"", False, 0
    while True:
        if not select.select([pipe], [], [], SILENT_S if beats else None)[0]:
            silences += 1
            if silences == 2:
                with suppress(OSError):
                    os.kill(host, signal.SIGKILL)
                    os.write(sys.stderr.fileno(), b"hvcpctl skills was frozen: it is ended, and all left safe\n")
            continue
        silences, found = 0, os.read(pipe, select.PIPE_BUF)
        if not found:
            return
        *whole, rest = (rest + found).split(b"\n")
        beats = beats or b"" in whole
        yield from whole


def _marked() -> Iterator[int]:
    """The processes with this guard's mark."""
    mark = f"{MARK}={os.getpid()}".encode()
    for path in Path("/proc").glob("[0-9]*/environ"):
        with suppress(OSError):
            if mark in path.read_bytes().split(b"\0"):
                yield int(path.parent.name)


def _load(pins: Iterable[object], joints: Line | None) -> None:
    """Import the modules for pins and joints in advance, because that takes long."""
    if pins:
        import gpiozero  # noqa: F401

        import hvcpd.hardware.gpio
    if joints is not None:
        import hvcpd.hardware.joints  # noqa: F401


def _started(words: list[str]) -> subprocess.Popen[bytes] | None:
    with suppress(OSError):
        return subprocess.Popen(words, stdin=subprocess.DEVNULL) if words else None
    return None


def _make_safe(pins: Iterable[tuple[int, bool]], joints: Line | None) -> None:
    """Switch all pins off and release all joints, repeatedly until all are safe, or LET_GO_S are over."""
    waiting: list[Callable[[], bool]] = [partial(_is_off, pin, high) for pin, high in pins]
    if joints is not None:
        waiting += [partial(_is_released, joints, motor_id) for motor_id in joints.ids]
    until_s = time.monotonic() + LET_GO_S
    while (waiting := [safe for safe in waiting if not safe()]) and time.monotonic() < until_s:
        time.sleep(AGAIN_S)


def _is_off(pin: int, active_high: bool) -> bool:
    from hvcpd.errors import DeviceError
    from hvcpd.hardware.gpio import device

    try:
        device("DigitalOutputDevice", pin, active_high=active_high, initial_value=False)
    except DeviceError:
        return False
    return True


def _is_released(line: Line, motor_id: int) -> bool:
    from hvcpd.errors import DeviceError
    from hvcpd.hardware.joints import switched_torque_off
    from hvcpd.hardware.wheels_bus import DynamixelBus

    bus = DynamixelBus(line.port, line.baud_rate, REPLY_S)
    try:
        bus.open()
        return bool(switched_torque_off(bus, motor_id))
    except DeviceError:
        return False
    finally:
        bus.close()


if __name__ == "__main__":
    watch(sys.stdin.fileno())
