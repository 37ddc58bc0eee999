"""Skills offered to a daemon over its control socket: by `hvcpctl skills`, and by the daemon itself for its joints."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable, Mapping
from contextlib import closing, suppress
from pathlib import Path

import structlog

from hvcpd.config.settings import Settings
from hvcpd.daemon.control_socket import short_address, socket_path
from hvcpd.daemon.wheel_service import WheelService
from hvcpd.errors import NotDoneError
from hvcpd.hardware.joints import Joint
from hvcpd.ports import Wheels
from hvcpd.skills.guard import GuardLine, Line
from hvcpd.skills.host import Host
from hvcpd.skills.joints import JointRunner
from hvcpd.skills.runners import Runner

AGAIN_S = 1.0
"""Between two attempts to reach a daemon that has ended."""
MAX_LINE_BYTES = 1 << 16
"""Of the daemon's lines: a call with twelve arguments of 200 characters, each escaped, has 30 kB."""

_log = structlog.get_logger(__name__)


async def offer(path: Path, runners: Mapping[str, Runner]) -> None:
    """Offer skills to the daemon at `path` for ever. Raises NotDoneError if trying again cannot help."""
    host = Host(runners)
    while True:
        with suppress(OSError):
            with short_address(path) as address:
                reader, writer = await asyncio.open_unix_connection(address, limit=MAX_LINE_BYTES)
            with closing(writer):
                await host.serve(reader, writer)
        if host.refusal:
            raise NotDoneError(host.refusal)
        await asyncio.sleep(AGAIN_S)


def _tell_end(task: asyncio.Task[None]) -> None:
    if not task.cancelled() and (error := task.exception()) is not None:
        _log.warning("joints not offered", reason=str(error))


class JointService:
    """The joints of a robot: `joints` go to the wheels' driver, `begin` once that is open, `close` once it is closed.

    Should the daemon be killed, a process of its own has those let go that are declared so; the others stand still by
    their own watchdogs.
    """

    def __init__(self, settings: Settings, clock: Callable[[], float] = time.monotonic) -> None:
        self._settings = settings
        skills = settings.skills.items()
        self._named = {name: Joint(skill.joint, clock) for name, skill in skills if skill.joint is not None}
        self._task: asyncio.Task[None] | None = None
        self._guard: GuardLine | None = None

    @property
    def joints(self) -> tuple[Joint, ...]:
        """All joints."""
        return tuple(self._named.values())

    def begin(self, service: WheelService, wheels: Wheels) -> None:
        """Offer them as skills, now that their bus is open."""
        from hvcpd.hardware.wheels_find import FoundWheels  # loads the motors' SDK

        loose = tuple(joint.settings.id for joint in self.joints if joint.settings.stopped == "release")
        if loose and isinstance(wheels, FoundWheels):
            self._guard = GuardLine(line=Line(wheels.port, self._settings.wheels.baud_rate, loose))
        motions = {name: JointRunner(joint, service.exchange_now) for name, joint in self._named.items()}
        self._task = asyncio.get_running_loop().create_task(offer(socket_path(self._settings), motions))
        self._task.add_done_callback(_tell_end)

    async def close(self) -> None:
        """End calls under way, and the guard process."""
        if self._task is not None:
            self._task.cancel()
            with suppress(asyncio.CancelledError, NotDoneError):
                await self._task
        if self._guard is not None:
            await asyncio.to_thread(self._guard.close)
