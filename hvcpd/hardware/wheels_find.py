"""Finds the wheels: which port, which kind, and everything that is wrong with them at once, with its remedy.

The daemon's start, `hvcpctl drive` and `hvcpctl doctor` use the same handshake.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Literal

from hvcpd.config.settings import WheelSettings
from hvcpd.errors import DeviceError
from hvcpd.hardware import opencr, registers, wheels_handshake, wheels_opencr_handshake
from hvcpd.hardware.joints import Joint
from hvcpd.hardware.registers import Register
from hvcpd.hardware.wheels import DynamixelWheels
from hvcpd.hardware.wheels_base import BusWheels
from hvcpd.hardware.wheels_bus import (
    TIMEOUT_S,
    BusError,
    DynamixelBus,
    MakePort,
    PortLostError,
    RefusedError,
    answer,
    in_use,
    twice,
)
from hvcpd.hardware.wheels_opencr import OpenCRWheels
from hvcpd.hardware.wheels_port import WaitingPort
from hvcpd.ports import WheelCommand, WheelReading

Kind = Literal["dynamixel", "opencr"]

AUTO = "auto"
PORT_NAMES = ("serial/by-id/*", "ttyACM*", "ttyUSB*")
"""Under /dev, the best first: names by identity stay the same when an adapter is plugged in again."""
OTHER_SPEEDS = (57_600, 115_200, 1_000_000, 2_000_000, 3_000_000, 4_000_000)
"""In baud; 57,600 is how motors leave the factory (e-Manual, xl430-w250)."""
NO_JOINTS = (
    "OpenCR with TurtleBot3 firmware does not let joints through; flash it with usb_to_dxl, or use a U2D2, or take the "
    "joints out of `skills`"
)
KINDS = {"dynamixel": "two DYNAMIXEL motors", "opencr": "OpenCR with TurtleBot3 firmware"}


@dataclass(frozen=True)
class WheelFinding:
    """The result of the handshake. `kind` is what has answered at the port; without problems both are known."""

    kind: Kind | None = None
    port: str = ""
    problems: tuple[str, ...] = ()
    facts: tuple[str, ...] = ()

    @property
    def ok(self) -> bool:
        """Whether the wheels may be driven."""
        return not self.problems


def candidate_ports(directory: Path = Path("/dev")) -> list[str]:
    """The serial ports that may lead to wheels, each device once, by its most stable name."""
    seen: set[Path] = set()
    ports = []
    for pattern in PORT_NAMES:
        for path in sorted(directory.glob(pattern)):
            if path.resolve() not in seen:
                seen.add(path.resolve())
                ports.append(str(path))
    return ports


def stable_name(port: str, directory: Path = Path("/dev")) -> str:
    """The port's name by identity, if it has one: it is the same after the adapter was plugged in again."""
    there = Path(port)
    if not there.exists():
        return port
    return next((str(p) for p in sorted(directory.glob(PORT_NAMES[0])) if p.resolve() == there.resolve()), port)


def holders(port: str, proc: Path = Path("/proc")) -> list[str]:
    """Programs that have the port open, as "name (pid)", as far as we may see."""
    target = Path(port).resolve()
    found = []
    for process in sorted(proc.glob("[0-9]*")):
        try:
            if any(link.resolve() == target for link in (process / "fd").iterdir()):
                found.append(f"{(process / 'comm').read_text().strip()} ({process.name})")
        except OSError:  # gone meanwhile, or another user's
            continue
    return found


def examine(settings: WheelSettings, make_port: MakePort = WaitingPort, directory: Path = Path("/dev")) -> WheelFinding:
    """Find the wheels that the settings name and inspect them; nothing is changed, nothing moves."""
    ports = candidate_ports(directory) if settings.port == AUTO else [stable_name(settings.port, directory)]
    if not ports:
        return WheelFinding(
            problems=("no serial port at all: plug in the robot's USB cable (OpenCR or U2D2) and switch the robot on",)
        )
    problems: list[str] = []
    for port in ports:
        finding = _examine_port(settings, port, make_port)
        if finding.kind is not None:
            return finding
        problems += finding.problems
    return WheelFinding(problems=tuple(problems))


def stop_anyway(settings: WheelSettings, make_port: MakePort) -> list[str]:
    """Stop the wheels and switch them off, whatever is wrong with them; return which devices confirmed it, in words.

    Without a handshake: an empty battery or a missing motor must not keep the others turning. Raises DeviceError if
    nothing confirmed it, with what the handshake finds.
    """
    stopped = []
    for port in candidate_ports() if settings.port == AUTO else [stable_name(settings.port)]:
        bus = DynamixelBus(port, settings.baud_rate, TIMEOUT_S, make_port)
        try:
            bus.open()
            if settings.driver != "dynamixel" and _stopped(bus, opencr.DEVICE_ID, opencr.LINEAR_X, opencr.MOTOR_TORQUE):
                stopped.append(f"{port}: OpenCR")
            for motor_id in settings.ids if settings.driver != "opencr" else ():
                if _stopped(bus, motor_id, registers.GOAL_VELOCITY, registers.TORQUE_ENABLE):
                    stopped.append(f"{port}: motor {motor_id}")
        except (DeviceError, PortLostError):
            continue
        finally:
            bus.close()
    if not stopped:
        problems = examine(settings, make_port).problems
        raise DeviceError("; ".join(problems) or "nothing confirmed the stop; switch the robot off")
    return stopped


def _stopped(bus: DynamixelBus, device_id: int, speed: Register, torque: Register) -> bool:
    """Whether the device confirmed a speed of zero, or no torque."""
    confirmed = False
    for register in (speed, torque):
        data = opencr.command_block(0, 0) if register is opencr.LINEAR_X else register.encode(0)
        try:
            bus.write_block(device_id, register.address, data, register.name)
            confirmed = True
        except PortLostError:
            raise
        except RefusedError:  # a tripped watchdog refuses goals, and then it stands already
            continue
        except BusError:
            return confirmed
    return confirmed


def _examine_port(settings: WheelSettings, port: str, make_port: MakePort) -> WheelFinding:
    bus = DynamixelBus(port, settings.baud_rate, TIMEOUT_S, make_port)
    try:
        bus.open()
    except DeviceError as error:
        held = holders(port) if in_use(error.__cause__) else []
        return WheelFinding(None, port, (f"{error}{'; it is held by ' + ', '.join(held) if held else ''}",))
    try:
        kind = _kind(settings, bus)
        if kind is None:
            return WheelFinding(None, port, (_nobody(settings, port, bus, make_port),))
        is_there = _answers(bus, _ids(settings, kind))
        problems = [] if is_there else _other_kind(settings, bus)
        if not problems:
            problems = _inspect(settings, kind, bus)
            if kind == "dynamixel" and not is_there:
                problems += _elsewhere(settings, port, bus, make_port)
        facts = twice(lambda: tuple(_facts(settings, kind, bus))) if not problems else ()
    except BusError as error:
        return WheelFinding(None, port, (str(error),))
    finally:
        bus.close()
    found = kind if is_there or not problems else None
    return WheelFinding(found, port, tuple(f"{port}: {problem}" for problem in problems), facts)


def _kind(settings: WheelSettings, bus: DynamixelBus) -> Kind | None:
    if settings.driver == "dynamixel" or settings.driver == "opencr":
        return settings.driver
    kinds: tuple[Kind, ...] = ("opencr", "dynamixel")
    return next((kind for kind in kinds if _answers(bus, _ids(settings, kind))), None)


def _ids(settings: WheelSettings, kind: Kind) -> Sequence[int]:
    return (opencr.DEVICE_ID,) if kind == "opencr" else settings.ids


def _inspect(settings: WheelSettings, kind: Kind, bus: DynamixelBus) -> list[str]:
    if kind == "opencr":
        return wheels_opencr_handshake.inspect(bus)
    return wheels_handshake.inspect(bus, *settings.ids)


def _other_kind(settings: WheelSettings, bus: DynamixelBus) -> list[str]:
    """Whether the other kind of wheels answers."""
    there: Kind = "dynamixel" if settings.driver == "opencr" else "opencr"
    if settings.driver == AUTO or not _answers(bus, _ids(settings, there)):
        return []
    return [f"{KINDS[there]} found, but wheels.driver is {settings.driver}: set it to {there} or auto"]


def _answers(bus: DynamixelBus, ids: Sequence[int]) -> bool:
    return any(answer(partial(bus.ping, device_id)) is not None for device_id in ids)


def _nobody(settings: WheelSettings, port: str, bus: DynamixelBus, make_port: MakePort) -> str:
    if bus.hears(opencr.DEVICE_ID, wheels_opencr_handshake.LATE_S):
        return f"{port}: OpenCR (ID {opencr.DEVICE_ID}): {wheels_opencr_handshake.LATE}"
    seen = wheels_handshake.strangers(bus.find(wheels_handshake.SEARCH_S), settings.ids)
    if seen:
        return (
            f"{port}: neither OpenCR (ID {opencr.DEVICE_ID}) nor motors {settings.left_id} and {settings.right_id} "
            f"answer, but {seen} do: if these are the wheels, set wheels.left_id and wheels.right_id"
        )
    elsewhere = _elsewhere(settings, port, bus, make_port)
    if elsewhere:
        return f"{port}: {elsewhere[0]}"
    left, right = settings.ids
    return (
        f"{port}: nothing answers, neither OpenCR (ID {opencr.DEVICE_ID}) nor motors {left} and {right}, at any speed; "
        "is the robot switched on, its battery charged, and is this its port?"
    )


def _elsewhere(settings: WheelSettings, port: str, bus: DynamixelBus, make_port: MakePort) -> list[str]:
    """Whether the motors answer at another speed; closes the bus, since a port is open once only."""
    bus.close()
    for speed in OTHER_SPEEDS:
        if speed == settings.baud_rate:
            continue
        other = DynamixelBus(port, speed, TIMEOUT_S, make_port)
        try:
            other.open()
            if _answers(other, settings.ids):
                return [f"the motors answer at {speed} baud: set wheels.baud_rate to {speed}"]
        except (BusError, DeviceError):
            continue
        finally:
            other.close()
    return []


def _facts(settings: WheelSettings, kind: Kind, bus: DynamixelBus) -> Iterator[str]:
    if kind == "opencr":
        yield f"{wheels_opencr_handshake.read_state(bus).voltage_v:.1f} V"
        return
    for side, health in zip(("left", "right"), wheels_handshake.read_health(bus, settings.ids), strict=True):
        yield f"{side} motor (ID {health.motor_id}) {health.voltage_v:.1f} V, {health.temperature_c} °C"


class FoundWheels:
    """The wheels that the settings ask for, found and checked when they are opened; as `hvcpd.ports.Wheels`."""

    def __init__(
        self,
        settings: WheelSettings,
        make_port: MakePort,
        directory: Path = Path("/dev"),
        joints: Sequence[Joint] = (),
    ) -> None:
        self._joints = joints
        self._settings = settings
        self._make_port = make_port
        self._directory = directory
        self._wheels: BusWheels | None = None

    @property
    def driver(self) -> BusWheels:
        """The driver that was found. Raises DeviceError before `open`."""
        if self._wheels is None:
            raise DeviceError("the wheels are not open")
        return self._wheels

    @property
    def port(self) -> str:
        """Where they were found. Raises DeviceError before `open`."""
        return self.driver.port

    def open(self) -> None:
        """Handshake, then standstill under torque. Raises DeviceError that names all that is wrong."""
        finding = examine(self._settings, self._make_port, self._directory)
        if finding.problems or finding.kind is None:
            raise DeviceError("; ".join(finding.problems))
        speed = self._settings.baud_rate
        if finding.kind == "opencr" and self._joints:
            raise DeviceError(f"{finding.port}: {NO_JOINTS}")
        if finding.kind == "opencr":
            self._wheels = OpenCRWheels(finding.port, speed, make_port=self._make_port)
        else:
            self._wheels = DynamixelWheels(
                finding.port,
                speed,
                self._settings.ids,
                make_port=self._make_port,
                joints=self._joints,
            )
        self._wheels.open()

    def exchange(self, command: WheelCommand) -> WheelReading:
        """As `hvcpd.hardware.wheels_base.BusWheels.exchange`."""
        return self.driver.exchange(command)

    def close(self) -> None:
        """Stop the wheels, switch torque off, close the port. Never raises; may be called twice."""
        if self._wheels is not None:
            self._wheels.close()
