"""The output of `hvcpctl drive`: a live table on a terminal, plain lines elsewhere, JSON lines for programs."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import partial

from rich.console import Console
from rich.live import Live
from rich.table import Table

from hvcpd.control.output import show
from hvcpd.hardware.drive_session import Snapshot
from hvcpd.hardware.kinematics import Drive
from hvcpd.hardware.motion import MotionState
from hvcpd.hardware.registers import hardware_error_text
from hvcpd.hardware.wheels_sense import MotorHealth
from hvcpd.ports import Pose, WheelReading

SHOWN_EVERY_S = 0.25
"""JSON lines of a journey."""


class DriveShow:
    """A context manager; the live table stands while it is open."""

    def __init__(self, as_json: bool, action: str, dry_run: bool) -> None:
        self._json = as_json
        self._tell = partial(show, as_json)
        self._action = action
        self._dry_run = dry_run
        self._console = Console()
        self._live: Live | None = None
        self._shown_s = -math.inf

    def __enter__(self) -> DriveShow:
        return self

    def __exit__(self, *exception: object) -> None:
        self.end_live()

    def moment(self, moment: Snapshot) -> None:
        """Show one moment of a journey."""
        if self._json:
            if not 0.0 <= moment.at_s - self._shown_s < SHOWN_EVERY_S:
                self._shown_s = moment.at_s
                at_s = round(moment.at_s, 2)
                self._tell({"event": "moving", "at_s": at_s, **_pose(moment.pose), **_details(moment)})
        elif self._console.is_terminal and not self._dry_run:
            if self._live is None:
                self._live = Live(console=self._console, refresh_per_second=8)
                self._live.start()
            self._live.update(_table(self._action, moment))

    def status(self, reading: WheelReading, pose: Pose, motors: Sequence[MotorHealth], port: str) -> None:
        """Show the wheels' state."""
        voltage = "unknown" if reading.voltage_v is None else f"{reading.voltage_v:.1f} V"
        self._tell(
            {"event": "status", "port": port, **_pose(pose), **_reading(reading), "motors": list(map(_motor, motors))},
            f"port      {port or 'none (dry run)'}",
            f"battery   {voltage}",
            f"odometry  left {reading.left_rad:.3f} rad, right {reading.right_rad:.3f} rad since the start",
            *map(_motor_line, motors),
        )

    def stopped(self, what: Sequence[str]) -> None:
        """Report what has confirmed a stop."""
        self._tell({"event": "stopped", "confirmed": list(what)}, f"stopped and switched off: {', '.join(what)}")

    def would_stop(self) -> None:
        """Say what a stop would do."""
        text = "would stop the wheels and switch them off, without a handshake"
        self._tell({"event": "stopped", "dry_run": True, "confirmed": []}, text)

    def end(self, pose: Pose, way_m: float, state: MotionState, reason: str) -> None:
        """Show how a journey ended."""
        self.end_live()
        fields = {"event": "end", "state": state.value, "reason": reason, "dry_run": self._dry_run}
        where = f"x {_plain(pose.x_m, 3)} m, y {_plain(pose.y_m, 3)} m, heading {_degrees(pose)}°"
        what = f"{state.value}{': ' + reason + ';' if reason else ''}"
        text = f"{'would have ' if self._dry_run else ''}{what} at {where}, after {way_m:.2f} m"
        self._tell({**fields, **_pose(pose), "way_m": round(way_m, 3)}, text)

    def step(self, name: str, pose: Pose) -> None:
        """Show what a run of the calibration would be."""
        self.end_live()
        text = f"would drive {name}, and then ask where the robot stands (x ahead, y left, in metres)"
        self._tell({"event": "run", "name": name, **_pose(pose)}, text)

    def end_live(self) -> None:
        """Remove the live table, so that other text can be printed."""
        if self._live is not None:
            self._live.stop()
            self._live = None

    def calibrated(self, before: Drive, after: Drive) -> None:
        """Show the result as lines for the settings file."""
        values = {
            "wheel_radius_m": round(after.wheel_radius_m, 6),
            "radius_ratio": round(after.radius_ratio, 5),
            "separation_m": round(after.separation_m, 5),
        }
        old = (before.wheel_radius_m, before.radius_ratio, before.separation_m)
        lines = [f"  {key}: {value}  # was {was:g}" for (key, value), was in zip(values.items(), old, strict=True)]
        self._tell({"event": "calibrated", **values}, "write this into the settings file:", "wheels:", *lines)


def _pose(pose: Pose) -> dict[str, object]:
    heading_deg = round(math.degrees(pose.heading_rad), 2) + 0.0
    return {"x_m": round(pose.x_m, 4) + 0.0, "y_m": round(pose.y_m, 4) + 0.0, "heading_deg": heading_deg}


def _plain(value: float, digits: int) -> str:
    """Without the minus sign of a number that is rounded to zero."""
    return f"{round(value, digits) + 0.0:.{digits}f}"


def _degrees(pose: Pose) -> str:
    return _plain(math.degrees(pose.heading_rad), 1)


def _reading(reading: WheelReading) -> dict[str, object]:
    return {
        "voltage_v": reading.voltage_v and round(reading.voltage_v, 2),
        "left_rad": round(reading.left_rad, 4),
        "right_rad": round(reading.right_rad, 4),
    }


def _details(moment: Snapshot) -> dict[str, object]:
    return {
        "speed_m_s": round(moment.twist.linear_m_s, 3),
        "turn_rad_s": round(moment.twist.angular_rad_s, 3),
        "progress": round(moment.progress, 3),
        "fault": moment.fault,
        "voltage_v": moment.reading and moment.reading.voltage_v and round(moment.reading.voltage_v, 2),
    }


def _motor(motor: MotorHealth) -> dict[str, object]:
    return {
        "id": motor.motor_id,
        "torque": motor.torque_on,
        "voltage_v": round(motor.voltage_v, 2),
        "temperature_c": motor.temperature_c,
        "load": round(motor.load, 3),
        "error": hardware_error_text(motor.hardware_error) if motor.hardware_error else None,
    }


def _motor_line(motor: MotorHealth) -> str:
    torque = "on" if motor.torque_on else "off"
    heat = "" if motor.temperature_c is None else f", {motor.temperature_c} °C"
    error = f", {hardware_error_text(motor.hardware_error)}" if motor.hardware_error else ""
    return f"motor {motor.motor_id}   torque {torque}, {motor.voltage_v:.1f} V{heat}, load {motor.load:.0%}{error}"


def _table(action: str, moment: Snapshot) -> Table:
    table = Table(title=f"drive {action}", show_header=False)
    reading = moment.reading
    voltage = f"{reading.voltage_v:.1f} V" if reading is not None and reading.voltage_v is not None else "–"
    effort = f"{max(abs(reading.left_effort), abs(reading.right_effort)):.0%}" if reading is not None else "–"
    for name, value in (
        ("progress", f"{moment.progress:.0%}"),
        ("place", f"x {_plain(moment.pose.x_m, 3)} m  y {_plain(moment.pose.y_m, 3)} m"),
        ("heading", f"{_degrees(moment.pose)}°"),
        ("speed", f"{moment.twist.linear_m_s:.2f} m/s  {moment.twist.angular_rad_s:.2f} rad/s"),
        ("battery", voltage),
        ("effort", effort),
        ("state", moment.fault or moment.state.value),
    ):
        table.add_row(name, value)
    return table
