"""Looks for everything that the daemon needs, without opening any of it, and tells all that is missing at once."""

from __future__ import annotations

import os
import stat
import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from hvcpd.assembly.sound import make_phrasebook
from hvcpd.assembly.vocabulary import check, refusal
from hvcpd.config.quiet_hours import CLOCK_SET_S
from hvcpd.config.settings import AudioSettings, ControlSettings, Settings, WheelSettings
from hvcpd.config.skill_settings import StopButtonSettings
from hvcpd.config.task_doubts import doubts
from hvcpd.daemon.devices import Devices
from hvcpd.daemon.latch_service import stop_latch
from hvcpd.daemon.wiring import Wiring, wire_up
from hvcpd.errors import EX_CANTCREAT, EX_CONFIG, EX_OK, EX_UNAVAILABLE, ConfigError, DeviceError
from hvcpd.hardware.audio import KIND, Direction, SoundDevice, find_device
from hvcpd.hardware.gpio import missing
from hvcpd.memory.latch import UNREADABLE, Permit, StopLatch
from hvcpd.reporting.text import plural
from hvcpd.security.keyring import KeyFile
from hvcpd.skills.checks import faults

Access = Callable[[Path, int], bool]
"""Whether this process may use a file so; `os.access` has the form."""


@dataclass(frozen=True)
class Finding:
    """The result of one check: what was found, or what is wrong and the remedy (then with an exit status)."""

    subject: str
    text: str
    exit_status: int = EX_OK
    doubtful: bool = False
    """Whether it works, but may be a mistake, or could work better."""
    figures: Mapping[str, float] = field(default_factory=dict)

    @property
    def ok(self) -> bool:
        """Whether the robot can work with this."""
        return self.exit_status == EX_OK

    @property
    def grade(self) -> str:
        """Its severity: ok, note or wrong."""
        return "wrong" if not self.ok else "note" if self.doubtful else "ok"


@dataclass(frozen=True)
class Preflight:
    """All findings; `wiring` is there if tasks, lexicon and phrasebook are good."""

    findings: tuple[Finding, ...]
    wiring: Wiring | None

    @property
    def exit_status(self) -> int:
        """The exit status of the first finding that is wrong; EX_OK if nothing is."""
        return next((finding.exit_status for finding in self.findings if not finding.ok), EX_OK)


def examine(
    settings: Settings,
    devices: Devices,
    device_directory: Path = Path("/dev"),
    allow_confusable: bool = False,
    skill_places: Mapping[str, str] | None = None,
) -> Preflight:
    """Look for tasks, enrolled people, a revoked name, skills, confusable words (unless `allow_confusable`), memory, a
    kept stop, clips, control socket, microphone, loudspeaker, port, stop button.

    They are looked for in this order; no device is opened, and no directory made. `skill_places` has the line of each
    skill, for what is wrong with it.
    """
    findings: list[Finding] = []
    wiring: Wiring | None = None
    try:
        wiring = wire_up(settings, allow_confusable)
        findings.append(Finding("tasks", f"{plural(len(wiring.tasks.tasks), 'task')} in {settings.tasks}"))
        robots = {name.casefold() for name in wiring.names} - wiring.people.keys()
        followers = len(robots) - 1 if settings.mode != "volunteer" else None
        doubtful = doubts(wiring.tasks, followers)
        findings += [Finding("tasks", f"{settings.tasks}: {text}", doubtful=True) for text in doubtful]
        if wiring.damage is not None:
            text = f"{wiring.damage}; or the robot sets the file aside, and starts stopped, without what it says"
            findings.append(Finding("tasks", text, doubtful=True))
        findings += [Finding("people", text, doubtful=True) for text in wiring.unknown]
        if wiring.keys is not None:
            findings += find_revoked(settings.name, wiring.keys)
        wrong = tuple(faults(settings, wiring.tasks, programs_too=False, skill_places=skill_places))
        findings += [Finding("skills", text, EX_CONFIG) for text in wrong]
        if not allow_confusable:
            findings.append(find_confusable(wiring))
    except ConfigError as error:
        findings.append(Finding("tasks", str(error), error.exit_status))
    findings += find_quiet_hours(settings, time.time())
    findings.append(find_memory(settings.state_dir))
    if wiring is not None and findings[-1].ok:
        findings += find_stop(stop_latch(wiring), settings.memory_path)
    findings += find_clips(settings.clips.folder)
    findings += find_control(settings.control)
    findings.extend(find_sound(settings.audio, devices))
    findings.append(find_port(settings.wheels, device_directory))
    findings += find_stop_button(settings.stop_button, device_directory)
    return Preflight(tuple(findings), wiring)


def find_confusable(wiring: Wiring, allowable: bool = True) -> Finding:
    """Whether tasks and names sound different enough; kept in the state directory, if that is there already.

    `allowable`: --allow-confusable can still be given.
    """
    settings = wiring.settings
    there = os.access(settings.state_dir, os.F_OK) and settings.state_dir.is_dir()
    book = make_phrasebook(wiring.names, settings.teams, wiring.tasks)
    sound = wiring.sound if there else replace(wiring.sound, cache=None)
    cache = settings.state_dir / "vocabulary" if there else None
    found = check(book, wiring.names, sound, cache, chosen_only=True)
    why = refusal(found, settings.tasks, allowable)
    if why is not None:
        return Finding("vocabulary", why, EX_CONFIG)
    return Finding("vocabulary", "tasks and names sound different enough")


def find_revoked(name: str, keys: KeyFile) -> Iterator[Finding]:
    """Whether the team's key file says that nobody shall believe this robot."""
    if keys.is_revoked(name):
        text = f"this robot, {name}, is revoked: the team believes nothing that it says; remove `revoked {name}` from"
        yield Finding("key", f"{text} the key file, or give the robot another name", doubtful=True)


def find_quiet_hours(settings: Settings, wall_s: float) -> Iterator[Finding]:
    """The quiet hours, if the settings have any: a robot without a clock, or whose clock (`wall_s`, s since 1970) was
    never set, cannot keep them."""
    quiet = settings.quiet
    if quiet.hours is None:
        return
    if not settings.clock:
        text = f"quiet.hours: {quiet.hours} is never kept, because this robot has no clock (`clock: false`); remove one"
    elif wall_s < CLOCK_SET_S:
        text = f"quiet.hours: {quiet.hours} is not kept, because the computer's clock was never set; `sudo date -s '…'`"
    else:
        softer = f", {-quiet.level_db:g} dB softer" if quiet.level_db else ""
        yield Finding("quiet hours", f"{quiet.hours}, by this computer's clock: terse{softer}")
        return
    yield Finding("quiet hours", text, doubtful=True)


def nearest_there(directory: Path) -> Path:
    """The directory itself, or its nearest parent that exists, as far as this user may look."""
    return next(path for path in (directory, *directory.absolute().parents) if os.access(path, os.F_OK))


def directory_fault(key: str, directory: Path, access: Access = os.access) -> str | None:
    """Why the daemon cannot write in the directory that the setting `key` names, or make it; None if it can."""
    other = f"set `{key}` to another"
    nearest, reason = nearest_there(directory), _not_a_name(directory)
    if reason is not None:
        return f"{key}: {directory}: {reason}; {other}"
    if nearest != directory and os.access(directory.parent, os.X_OK) and directory.is_symlink():
        return f"{key}: {directory} is a link to nothing; mount its disk, or {other}"
    if not nearest.is_dir():
        return f"{key}: {nearest} is not a directory; {other}"
    if not access(nearest, os.W_OK | os.X_OK):
        what = "cannot be written" if nearest == directory else f"cannot be made in {nearest}"
        return f"{key}: {directory} {what}; make it, writable for the daemon's user, or {other}"
    return None


def _not_a_name(path: Path) -> str | None:
    """Why nothing can have this path, for example because it is too long; None if something has or can."""
    try:
        path.lstat()
    except (FileNotFoundError, NotADirectoryError, PermissionError):
        return None
    except OSError as error:
        return error.strerror
    return None


def _usable(directory: Path) -> str:
    return f"{directory} {'is writable' if nearest_there(directory) == directory else 'will be made'}"


def find_memory(directory: Path, access: Access = os.access) -> Finding:
    """Whether the robot's memory can be kept in `directory`, or the directory be made."""
    fault = directory_fault("state_dir", directory, access)
    return Finding("memory", _usable(directory)) if fault is None else Finding("memory", fault, EX_CANTCREAT)


def find_clips(folder: Path | None) -> Iterator[Finding]:
    """Whether recordings can be kept, if the settings want them; without them the robot runs, too."""
    if folder is not None:
        fault = directory_fault("clips.folder", folder)
        yield Finding("clips", fault or _usable(folder), doubtful=fault is not None)


def find_control(settings: ControlSettings) -> Iterator[Finding]:
    """Whether the control socket can be made where the settings name it; without one the robot runs, too."""
    path = settings.socket
    if path is None or not settings.enabled:
        return
    fault = directory_fault("control.socket", path.parent)
    if fault is None and (reason := _not_a_name(path)) is not None:
        fault = f"control.socket: {path}: {reason}; set `control.socket` to another"
    if fault is None and os.path.lexists(path) and not path.is_socket():
        fault = f"control.socket: {path} is no socket; move it away, or set `control.socket` to another"
    yield Finding("control", fault or f"{path}, for `hvcpctl`", doubtful=fault is not None)


def find_stop(latch: StopLatch, memory: Path) -> Iterator[Finding]:
    """Whether the robot will start stopped, by its latch; nothing if it will not."""
    found, spare, release = latch.read(), latch.spare(), 'once it runs, say "resume", or: hvcpctl resume'
    if found is None and memory.exists():
        yield Finding("stop", f"{latch.path}: missing, so the robot will start stopped; {release}", doubtful=True)
    elif found == UNREADABLE:
        text = f"{latch.path}: damaged or unreadable, so the robot will start stopped; check its disk; {release}"
        yield Finding("stop", text, doubtful=True)
    elif spare is not None or (found is not None and found.permit in (Permit.STOPPED, Permit.UNSURE)):
        yield Finding("stop", f"the robot is stopped by {spare or latch.path}; {release}")


def _with_its_rate(_backend: Any, _direction: Direction, device: SoundDevice) -> str:
    return f"{device.name!r}, {device.rate_hz:g} Hz by itself"


def find_sound(
    settings: AudioSettings, devices: Devices, told: Callable[[Any, Direction, SoundDevice], str] = _with_its_rate
) -> Iterator[Finding]:
    """The microphone and the loudspeaker, or one finding if no sound card can be listed at all. `told` is the text for
    a device of the backend that was found."""
    try:
        backend = devices.sound_backend()
    except DeviceError as error:
        yield Finding("sound", str(error), error.exit_status)
        return
    sides: tuple[tuple[Direction, str | None], ...] = (
        ("input", settings.input_device),
        ("output", settings.output_device),
    )
    for direction, name in sides:
        try:
            yield Finding(KIND[direction], told(backend, direction, find_device(backend, direction, name)))
        except DeviceError as error:
            yield Finding(KIND[direction], str(error), error.exit_status)


def find_port(settings: WheelSettings, device_directory: Path, access: Access = os.access) -> Finding:
    """Whether the wheels' serial port exists, is a device, and is accessible."""
    if settings.driver == "none":
        return Finding("wheels", "none, as wheels.driver says; the robot stands")
    if settings.driver == "ros":
        return Finding("wheels", f"by ROS ({settings.ros_mode}); the robot stands until `hvcpctl ros` runs beside it")
    if not settings.on_serial_port:
        return Finding("wheels", f"by the driver {settings.driver}")
    from hvcpd.hardware.groups import group_of
    from hvcpd.hardware.wheels_find import candidate_ports  # not for a robot without a port: it loads the motors' SDK

    others = candidate_ports(device_directory)
    if settings.port == "auto":
        return Finding("wheels", f"will look at {', '.join(others)}") if others else _port_fault(_other_ports(others))
    port = Path(settings.port)
    try:
        status = port.stat()
    except OSError as error:
        return _port_fault(f"no {port} ({error.strerror}); {_other_ports(others)}")
    if not stat.S_ISCHR(status.st_mode):
        return _port_fault(f"{port} is not a serial port; {_other_ports(others)}")
    if not access(port, os.R_OK | os.W_OK):
        group = group_of(settings.port)
        return _port_fault(
            f"no permission to use {port}; `sudo usermod -aG {group} USER` for the daemon's user, then log in again"
        )
    return Finding("wheels", f"{port}, {settings.baud_rate} baud, motors {settings.left_id} and {settings.right_id}")


def find_stop_button(settings: StopButtonSettings, device_directory: Path) -> Iterator[Finding]:
    """Whether the stop button's pin can be used, if the settings have one: otherwise the robot would not start."""
    if settings.pin is None:
        return
    why = missing(device_directory)
    if why is not None:
        yield Finding("stop button", f"stop_button: pin {settings.pin} cannot be used: {why}", EX_UNAVAILABLE)
        return
    pressed = "open" if settings.normally_closed else "closed"
    yield Finding("stop button", f"pin {settings.pin}, pressed while its switch is {pressed}")


def _port_fault(text: str) -> Finding:
    return Finding("wheels", f"wheels.port: {text}", EX_UNAVAILABLE)


def _other_ports(there: list[str]) -> str:
    if there:
        return f"set wheels.port to one of {', '.join(there)}"
    return "plug in the motors' adapter (there is no serial port at all), or set wheels.driver to none"
