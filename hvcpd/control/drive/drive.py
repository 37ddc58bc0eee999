"""`hvcpctl drive`: drives one robot by hand; with `--dry-run` only in a simulation."""

from __future__ import annotations

import argparse
import math
import signal
import sys
import time
from typing import TextIO

from hvcpd.config.interruption import handled
from hvcpd.config.settings import Settings
from hvcpd.config.settings_file import load_settings
from hvcpd.control.drive.drive_show import DriveShow
from hvcpd.daemon.devices import make_wheels
from hvcpd.errors import EX_FAILURE, EX_OK, ConfigError, DeviceError
from hvcpd.hardware.calibration import CalibrationError, Measured, calibrate
from hvcpd.hardware.drive_session import DriveSession, RehearsedWheels
from hvcpd.hardware.kinematics import drive_of
from hvcpd.hardware.motion import Forward, MotionState, Turn
from hvcpd.hardware.navigator import Dock, Journey, Waypoints
from hvcpd.hardware.wheels_bus import MakePort
from hvcpd.hardware.wheels_find import FoundWheels, stop_anyway
from hvcpd.hardware.wheels_port import WaitingPort
from hvcpd.ports import STANDSTILL, Pose, Wheels

MAX_MEASURED_M = 3.0
"""Longest run that is believed; runs are 1 m long, so a larger number was in centimetres or a typing error."""


class TapeMeasure:
    """Questions on `out` (standard error by default), answers from `source` (standard input)."""

    def __init__(self, source: TextIO | None = None, out: TextIO | None = None) -> None:
        self._source = source or sys.stdin
        self._out = out or sys.stderr

    def ready(self, name: str) -> None:
        """Have the start marked, and wait until the person says that the robot may drive. Raises ConfigError."""
        self._question(
            f"next: {name}. Mark on the floor the point midway between the wheels and the heading, step back, "
            "then press Enter: "
        )

    def ask(self, name: str) -> Measured:
        """Where the robot stands after a run; asks until two numbers come. Raises ConfigError when none can."""
        question = f"{name}: where is that point now, from its last mark? metres ahead, metres to the left: "
        while True:
            answer = self._question(question)
            try:
                x_m, y_m = (float(part) for part in answer.replace(",", " ").split())
            except ValueError:
                self._out.write(f"{answer.strip()!r} is not two numbers such as 0.012 -0.034\n")
                continue
            if math.isfinite(x_m) and math.isfinite(y_m) and math.hypot(x_m, y_m) <= MAX_MEASURED_M:
                return Measured(x_m, y_m)
            self._out.write(f"{answer.strip()} is further than {MAX_MEASURED_M:g} m away; give metres\n")

    def _question(self, text: str) -> str:
        self._out.write(text)
        self._out.flush()
        answer = self._source.readline()
        if not answer:
            self._out.write("\n")
            raise ConfigError("drive calibrate: the input has ended; a person must answer, so run it on a terminal")
        return answer


SETTLE_S = 0.4
"""After a journey the wheels come to rest before their place is reported."""


def run(options: argparse.Namespace, make_port: MakePort = WaitingPort) -> int:
    """Carry out one action; the wheels stand and are switched off when this returns."""
    settings = _settings(options)
    journeys = _journeys(options)
    show = DriveShow(options.json, options.action, options.dry_run)
    if options.action == "stop":
        if options.dry_run:
            show.would_stop()
        elif settings.wheels.on_serial_port:
            show.stopped(stop_anyway(settings.wheels, make_port))
        else:
            _stop(settings)
            show.stopped([f"wheels of the driver {settings.wheels.driver}"])
        return EX_OK
    wheels, session = _session(options, settings, make_port)
    # SIGTERM ends the command like Ctrl-C: through every `finally`, so that the wheels stand. SIGINT too: whoever
    # starts commands in the background may have it ignored, and wheels must still obey it.
    with handled(signal.default_int_handler, signal.SIGTERM, signal.SIGINT), show:
        try:
            wheels.open()
            if options.action == "calibrate":
                _calibrate(options, settings, session, show)
                return EX_OK
            for journey in journeys:
                if session.carry_out(journey, show.moment) is not MotionState.ARRIVED:
                    break
            return _report(options, wheels, session, show)
        finally:
            wheels.close()


def _stop(settings: Settings) -> None:
    """Stop wheels of a driver without a handshake of its own. Raises DeviceError."""
    wheels = make_wheels(settings.wheels)
    assert wheels is not None  # `_settings` has refused a robot without wheels
    wheels.open()
    wheels.close()


def _settings(options: argparse.Namespace) -> Settings:
    overrides = {"wheels.port": options.port, "wheels.driver": options.driver}
    settings = load_settings(options.config, overrides, name_needed=False)
    if settings.wheels.driver == "none" and not options.dry_run:
        raise ConfigError("wheels.driver is none: this robot has no wheels; set it to auto, or give --driver")
    if settings.wheels.driver == "ros" and not options.dry_run:
        raise ConfigError(
            "wheels.driver is ros: ROS drives the wheels; stop them with `hvcpctl stop`, or give --driver"
        )
    return settings


def _session(options: argparse.Namespace, settings: Settings, make_port: MakePort) -> tuple[Wheels, DriveSession]:
    drive = drive_of(settings.wheels)
    if options.dry_run:
        paper = RehearsedWheels()
        return paper, DriveSession(paper, paper.clock, paper.sleep, drive)
    wheels = make_wheels(settings.wheels, make_port=make_port)
    assert wheels is not None  # `_settings` has refused a robot without wheels
    return wheels, DriveSession(wheels, time.monotonic, time.sleep, drive)


def _journeys(options: argparse.Namespace) -> list[Journey]:
    """The motions of the action. Raises ConfigError for an odd number of coordinates."""
    match options.action:
        case "forward":
            return [Forward(options.metres)]
        case "turn":
            return [Turn(math.radians(options.degrees))]
        case "goto":
            numbers = options.places
            if len(numbers) % 2:
                raise ConfigError(f"drive goto: {numbers[-1]:g} alone is no place; give X Y for each")
            places = tuple(zip(numbers[::2], numbers[1::2], strict=True))
            return [Waypoints(places), *([Dock(Pose(0.0, 0.0))] if options.back else [])]
        case _:
            return []


def _report(options: argparse.Namespace, wheels: Wheels, session: DriveSession, show: DriveShow) -> int:
    navigator = session.navigator
    if options.action == "status":
        reading = wheels.exchange(STANDSTILL)
        session.odometry.update(reading)
        driver = wheels.driver if isinstance(wheels, FoundWheels) else None
        show.status(reading, session.odometry.pose, driver.health() if driver else (), driver.port if driver else "")
        return EX_OK
    if navigator.state is MotionState.ARRIVED:
        session.rest(SETTLE_S)
    show.end(session.odometry.pose, session.way_m, navigator.state, session.reason)
    return EX_OK if navigator.state is MotionState.ARRIVED else EX_FAILURE


def _calibrate(options: argparse.Namespace, settings: Settings, session: DriveSession, show: DriveShow) -> None:
    drive = drive_of(settings.wheels)
    tape = TapeMeasure()

    def ready(name: str) -> None:
        show.end_live()
        if not options.dry_run:
            tape.ready(name)
            session.rest(SETTLE_S)  # the person may have moved it meanwhile

    def perform(journey: Journey) -> None:
        if session.carry_out(journey, show.moment) is not MotionState.ARRIVED:
            raise CalibrationError(f"the run failed: {session.reason}")
        session.rest(SETTLE_S)

    def ask(name: str) -> Measured:
        show.end_live()
        if options.dry_run:
            show.step(name, session.odometry.pose)
            return Measured(1.0, 0.0) if name == "straight on" else Measured(0.0, 0.0)
        return tape.ask(name)

    try:
        result = calibrate(drive, lambda: session.odometry.pose, perform, ask, ready)
    except DeviceError as error:
        raise CalibrationError(str(error)) from error
    if not options.dry_run:
        show.calibrated(drive, result)
