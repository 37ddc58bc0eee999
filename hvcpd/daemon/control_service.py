"""The control socket of a daemon: opened first, closed last, and notified of every step."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import replace
from typing import Any

import structlog

from hvcpd.daemon.control_events import FREQUENT, EventSource, SoundTap, odom_of
from hvcpd.daemon.control_socket import SocketFile, socket_path
from hvcpd.daemon.control_status import Body
from hvcpd.daemon.reloading import Reloader, Rereading
from hvcpd.daemon.request_handler import RequestHandler
from hvcpd.errors import RunningError
from hvcpd.ports import Samples, WheelReading
from hvcpd.reporting.events import Memory, as_json
from hvcpd.robot.records import RobotOutput, SkillRecord
from hvcpd.robot.robot import Robot

CHECK_S = 5.0
"""Interval (sample clock) at which the socket's file is checked, by one stat() of it."""

_log = structlog.get_logger(__name__)


class ControlService:
    """The control socket for other programs on this computer; without a socket the robot runs anyway."""

    def __init__(self, body: Body, rereading: Rereading | None = None) -> None:
        self.body = body
        self.reloader = Reloader(body, rereading)
        self.handler = RequestHandler(body, self.reloader)
        self._server = self.handler.server
        self._events = EventSource(body.wiring.settings.name, body.meter)
        self._tap = SoundTap()
        self._file: SocketFile | None = None
        self._fault = ""
        self._check_s = 0.0
        self._memory = Memory(0.0, body.wiring.settings.name, None, None, None)

    async def open(self) -> None:
        """Begin to serve. Raises RunningError if another daemon has this one's socket."""
        settings = self.body.wiring.settings
        if not settings.control.enabled:
            return
        self._file = SocketFile(socket_path(settings), settings.name)
        self._listen(self._file)

    def _listen(self, file: SocketFile) -> None:
        try:
            self._server.open(file.listen())
        except OSError as error:
            file.remove()
            if (fault := str(error)) != self._fault:
                _log.warning(
                    "no control socket",
                    path=str(error.filename or file.path),
                    reason=error.strerror or fault,
                    remedy="make its folder, writable for the daemon's user, or clear its place, or set "
                    "`control.socket` to another file",
                )
            self._fault = fault
        else:
            self._fault = ""
            _log.info("control socket", path=str(file.path))

    def _keep_socket(self, now: float) -> None:
        """Make the socket again where it is gone: otherwise nobody could stop the robot by it."""
        if self._file is None or now < self._check_s:
            return
        self._check_s = now + CHECK_S
        if not self._file.is_there:
            self._file.remove()
            with suppress(RunningError):  # another daemon of this name has been started meanwhile
                self._listen(self._file)

    async def close(self) -> None:
        """Stop serving, and close all connections."""
        await self._server.close()

    def release(self) -> None:
        """Release the lock, so that another daemon of this name can start."""
        if self._file is not None:
            self._file.remove()

    def begin(self, robot: Robot) -> None:
        """Begin to answer requests: the robot is ready."""
        self.body.robot = self.reloader.robot = robot
        self.body.skills.begin(robot)
        self.body.tell_unable()
        if self.body.journal.stopped:
            robot.coordination.stop(robot.now)
        if self.body.journal.loss is not None:
            robot.coordination.tell_memory_lost(robot.now)

    def note(self, robot: Robot, heard: Samples, reading: WheelReading | None, output: RobotOutput) -> None:
        """Publish one step of the robot: its input `heard`, shape (n,), float32, and its `output`."""
        self.body.skills.take(output.skills, robot.now)  # first of all: a cancel is not to wait
        for record in output.records:
            self.body.tally.take(record)
            if isinstance(record, SkillRecord):
                self.body.skills.note(record)
        self.body.heard |= heard.size > 0
        if reading is not None and reading.voltage_v is not None:
            self.body.voltage_v = reading.voltage_v
        is_reading = self.body.meter.take(heard) and any(map(self._server.followed, FREQUENT))
        for event in self._events.of_step(robot, output.records, is_reading):
            self.publish(as_json(event))
        if reading is not None and self._server.followed("odom"):
            self.publish(as_json(odom_of(robot, reading)))
        self._keep_socket(robot.now)
        self._pass_sound(heard, robot.now)
        self._note_memory(robot.now)
        self._move_base(robot)

    def publish(self, event: Mapping[str, Any]) -> None:
        """Send an event to all clients that have subscribed to its kind."""
        self._server.publish(event)

    def _pass_sound(self, heard: Samples, now: float) -> None:
        if not (self._server.followed("sound") and self.body.wiring.settings.control.sound):
            self._tap.rest()
            return
        sound = self._tap.take(heard, now)
        if sound is not None:
            self.publish(as_json(sound))

    def _note_memory(self, now: float) -> None:
        journal = self.body.journal
        memory = replace(self._memory, fault=journal.fault, unkept=journal.latch.unkept, loss=journal.loss)
        if memory != self._memory:
            self._memory = memory
            self.publish(as_json(replace(memory, at_s=now)))

    def _move_base(self, robot: Robot) -> None:
        base, wheels = self.body.base, self.body.wheels
        if base is None or wheels is None:
            return
        base.watch(robot, self.body.wiring, self.body.lacking)
        drive = base.drive(robot, wheels.wanted)
        if drive is not None:
            self.publish(as_json(drive))
