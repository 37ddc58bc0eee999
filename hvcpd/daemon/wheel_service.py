"""The wheels in one worker thread: a bus cycle takes milliseconds, and the event loop must not wait for it."""

from __future__ import annotations

import asyncio

import structlog

from hvcpd.daemon.worker_thread import WorkerThread
from hvcpd.errors import DeviceError
from hvcpd.ports import STANDSTILL, WheelCommand, WheelReading, Wheels

MOVING_S = 0.05
"""Interval of exchanges with a moving robot's wheels (sample clock): that of ROBOTIS's own node."""
STANDING_S = 0.1
"""Interval of exchanges with a robot that stands: well within the motors' bus watchdog of 0.24 s; ROBOTIS's own
interval for OpenCR's heartbeat."""
LEASE_S = 0.25
"""Real time without a new command after which a moving robot is told to stop; it then stands within half a second."""
LOST_S = 10.0
"""Duration of the wheels' failure after which the daemon gives up: by then the motion has failed (4 s) and the failure
was said aloud (5 s)."""
SLACK_S = 1e-6
"""Tolerance for the arithmetic of the sample clock."""

_log = structlog.get_logger(__name__)


class WheelService:
    """Drives the wheels: `take_reading`, then `serve` at every block; neither blocks. A halt is sent at once."""

    def __init__(self, wheels: Wheels, lease_s: float = LEASE_S, lost_s: float = LOST_S) -> None:
        self._wheels = wheels
        self._lease_s = lease_s
        self._lost_s = lost_s
        self._thread = WorkerThread("wheels")
        self.wanted = STANDSTILL
        """How the wheels are to turn."""
        self._sent = STANDSTILL
        self._sent_s = -STANDING_S
        self._due = False
        self._now = 0.0
        self._lapse: asyncio.TimerHandle | None = None
        self._reading: WheelReading | None = None
        self._failing_since_s: float | None = None
        self._reason = ""
        self._broken: BaseException | None = None
        self._closing = False

    async def open(self) -> None:
        """Find the motors and switch them on. Raises DeviceError."""
        await self._thread.run(self._wheels.open)

    def serve(self, command: WheelCommand, now: float) -> None:
        """Set the wheels' speeds from time `now` on (sample clock, s). Raises DeviceError once the wheels are lost."""
        if self._broken is not None:
            raise self._broken
        self._now = now
        if self._failing_since_s is not None and now - self._failing_since_s >= self._lost_s:
            raise DeviceError(f"the wheels have not answered for {self._lost_s:g} s: {self._reason}")
        halt = command == STANDSTILL and STANDSTILL not in (self._sent, self.wanted)
        every_s = STANDING_S if command == STANDSTILL else MOVING_S
        self.wanted = command
        self._due |= halt or now - self._sent_s >= every_s - SLACK_S
        self._renew_lease()
        self._send()

    def take_reading(self) -> WheelReading | None:
        """The encoders' reading since the last call, or None."""
        reading, self._reading = self._reading, None
        return reading

    @property
    def fault(self) -> str | None:
        """Why the wheels do not answer at present; None if they do."""
        return self._reason if self._failing_since_s is not None else None

    def exchange_now(self) -> None:
        """Make the next exchange at once, because another device on the bus must not wait."""
        self._due = True
        self._send()

    def halt(self) -> None:
        """Halt now, without waiting for the next block of sound."""
        self.wanted, self._due = STANDSTILL, True
        self._renew_lease()
        self._send()

    async def settled(self) -> None:
        """Wait until no exchange is under way."""
        await self._thread.settled()

    async def close(self) -> None:
        """Stop the wheels, switch them off, end the thread. Never raises for a device."""
        self._closing = True
        if self._lapse is not None:
            self._lapse.cancel()
        await self.settled()
        await self._thread.run(self._wheels.close)
        await self._thread.close()

    def _renew_lease(self) -> None:
        if self._lapse is not None:
            self._lapse.cancel()
            self._lapse = None
        if self.wanted != STANDSTILL:
            self._lapse = asyncio.get_running_loop().call_later(self._lease_s, self._stop)

    def _stop(self) -> None:
        _log.warning("wheels stopped", reason=f"no new command for {self._lease_s:g} s")
        self._lapse = None
        self.wanted = STANDSTILL
        self._due = True
        self._send()

    def _send(self) -> None:
        if not self._due or self._thread.n_under_way or self._closing:
            return
        self._due = False
        self._sent, self._sent_s = self.wanted, self._now
        self._thread.run(self._wheels.exchange, self.wanted).add_done_callback(self._landed)

    def _landed(self, flight: asyncio.Future[WheelReading]) -> None:
        error = flight.exception() if not flight.cancelled() else asyncio.CancelledError()
        if error is None:
            self._reading = flight.result()
            if self._failing_since_s is not None:
                _log.info("wheels answer again", after_s=round(self._now - self._failing_since_s, 1))
                self._failing_since_s = None
        elif not isinstance(error, DeviceError):
            self._broken = error
        elif self._failing_since_s is not None:
            self._reason = str(error)
        else:
            self._failing_since_s, self._reason = self._now, str(error)
            _log.warning("wheels failed", reason=str(error))
        self._send()
