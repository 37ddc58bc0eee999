"""Where the robot stands, kept for a daemon that ends in mid-mission and is started again.

Odometry begins anew with each process. Whoever switches a robot on puts it where the settings say that it starts; but
a daemon that failed, or was killed, comes back wherever it had got to. So the pose is kept while the robot lives, and
forgotten at every orderly end. It counts only within one boot of the computer: a robot that was switched off may have
been carried.
"""

from __future__ import annotations

import asyncio
import json
import math
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

import structlog

from hvcpd.config.files import write_whole
from hvcpd.daemon.worker_thread import WorkerThread
from hvcpd.ports import Pose, WheelReading

EVERY_S = 0.2
"""Interval (sample clock) at which a moving robot's pose is kept. No sync: it need not outlive a loss of power."""

BOOT_ID = Path("/proc/sys/kernel/random/boot_id")
"""Another text after each boot of the computer, random(4)."""

MAX_BYTES = 1000
"""Largest size of the file, which has about 150."""

KEYS = ("x_m", "y_m", "heading_rad", "left_rad", "right_rad")
"""Keys of the file, beside "boot"."""

_log = structlog.get_logger(__name__)


@dataclass(frozen=True)
class KeptPose:
    """The robot's pose, and the angles of its wheels there, as the motors count them."""

    pose: Pose
    reading: WheelReading


class PoseKeeper:
    """Saves the pose in `path`, in a thread; if the disk fails, only the pose is lost, and that is logged once."""

    def __init__(self, path: Path, boot_id: Path = BOOT_ID) -> None:
        self._path = path
        self._boot_id = boot_id
        self._kept: Pose | None = None
        self._kept_s = -math.inf
        self._thread = WorkerThread("pose")
        self._failing = False
        self._over = False

    def recall(self) -> KeptPose | None:
        """The last pose of an earlier daemon of this boot that did not shut down properly, or None."""
        try:
            with self._path.open("rb") as file:
                found = json.loads(file.read(MAX_BYTES))
            numbers = [float(found[key]) for key in KEYS]
            boot = found["boot"]
        except (OSError, ValueError, KeyError, TypeError, RecursionError):
            return None
        here = self._boot()
        if not (here and boot == here and all(map(math.isfinite, numbers))):
            return None
        return KeptPose(Pose(*numbers[:3]), WheelReading(left_rad=numbers[3], right_rad=numbers[4]))

    def note(self, pose: Pose, reading: WheelReading | None, now: float) -> None:
        """Save the pose with its reading at time `now` (sample clock, s), if it has changed."""
        if reading is None or now - self._kept_s < EVERY_S or self._thread.n_under_way:
            return
        if self._kept is not None and pose.near(self._kept):
            return
        self._kept, self._kept_s = pose, now
        numbers = (pose.x_m, pose.y_m, pose.heading_rad, reading.left_rad, reading.right_rad)
        self._thread.run(self._write, numbers).add_done_callback(self._landed)

    async def settled(self) -> None:
        """Wait until nothing is being written."""
        await self._thread.settled()

    @contextmanager
    def forgotten_at_the_end(self) -> Iterator[None]:
        """Context of the daemon: unless it fails there, `close` deletes the pose. A shutdown is no failure."""
        try:
            yield
        except asyncio.CancelledError:
            self._over = True
            raise
        self._over = True

    async def close(self) -> None:
        """Finish writing; after a proper shutdown, delete the pose."""
        await self.settled()
        if self._over:
            with suppress(OSError):
                self._path.unlink(missing_ok=True)

    def _boot(self) -> str:
        try:
            return self._boot_id.read_text().strip()
        except OSError:
            return ""

    def _write(self, numbers: tuple[float, ...]) -> None:
        kept = {"boot": self._boot(), **dict(zip(KEYS, numbers, strict=True))}
        write_whole(self._path, json.dumps(kept).encode())

    def _landed(self, flight: asyncio.Future[None]) -> None:
        error = flight.exception()
        if error is None:
            self._failing = False
        elif not isinstance(error, OSError):
            raise error
        elif not self._failing:
            self._failing = True
            _log.warning("pose not kept", path=str(self._path), reason=error.strerror or str(error))
