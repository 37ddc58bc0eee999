"""Recordings of speech that was not understood, to find out why: only when asked for, few and bounded.

The last seconds of sound are kept in memory while a folder is set, and a stretch of them is written in a thread.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable
from contextlib import suppress
from datetime import datetime
from pathlib import Path

import numpy as np
import structlog

from hvcpd.config.settings import ClipSettings
from hvcpd.daemon.worker_thread import WorkerThread
from hvcpd.errors import HvcpdError
from hvcpd.hardware.soundfile import write_wav
from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from hvcpd.robot.records import GarbledRecord, Record

KEPT_S = 20.0
"""Length of the sound kept in memory, 1.3 MB: the longest that counts as one segment of speech, with its
surroundings."""
BEFORE_S, AFTER_S = 0.5, 0.2
"""Kept around the speech: enough to hear the noise that it came out of."""
MAX_WAITING = 4
"""Clips that may wait for the disk; beyond, they are not kept."""

_log = structlog.get_logger(__name__)


class Clips:
    """`take` every block; `settings` is asked each time, so that a reload takes effect at once. `clock` is local time,
    for file names."""

    def __init__(
        self, settings: Callable[[], ClipSettings], name: str, clock: Callable[[], datetime] = datetime.now
    ) -> None:
        self._settings = settings
        self._name = name.lower()
        self._clock = clock
        self._blocks: deque[tuple[float, Samples]] = deque()
        self._thread = WorkerThread("clips")

    def take(self, heard: Samples, now: float, records: Iterable[Record]) -> None:
        """Take a block of shape (n,), float32, that ended at `now` (sample clock, s), and what came of it."""
        settings = self._settings()
        if settings.folder is None:
            self._blocks.clear()
            return
        self._blocks.append((now, heard))
        while now - self._blocks[0][0] > KEPT_S:  # by time: without a card blocks are empty, for days
            self._blocks.popleft()
        for record in records:
            if isinstance(record, GarbledRecord):
                self._keep(self._stretch(record.start_s - BEFORE_S, record.end_s + AFTER_S), settings)

    @property
    def kept_s(self) -> float:
        """Length of the sound in memory, s."""
        return sum(_length_s(block) for _, block in self._blocks)

    async def close(self) -> None:
        """Write what waits."""
        await self._thread.settled()

    def _stretch(self, start_s: float, end_s: float) -> Samples:
        """The blocks that lie in this time, whole."""
        inside = [block for at_s, block in self._blocks if at_s > start_s and at_s - _length_s(block) < end_s]
        return np.concatenate(inside) if inside else np.zeros(0, np.float32)

    def _keep(self, samples: Samples, settings: ClipSettings) -> None:
        if samples.size and self._thread.n_under_way < MAX_WAITING:
            self._thread.run(self._write, samples, settings)

    def _write(self, samples: Samples, settings: ClipSettings) -> None:
        folder = settings.folder or Path()
        path = folder / f"garbled-{self._name}-{self._clock():%Y%m%dT%H%M%S.%f}.wav"
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            write_wav(path, samples, 0o640)
            self._delete_oldest(path, settings)
        except (OSError, HvcpdError) as error:
            _log.warning("clip not kept", path=str(path), reason=str(error))
        else:
            _log.info("clip kept", path=str(path), duration_s=round(samples.size / SAMPLE_RATE_HZ, 2))

    def _delete_oldest(self, newest: Path, settings: ClipSettings) -> None:
        """Delete the oldest clips beyond the limits; only files that have our names. Names later than the newest's are
        of a clock that was ahead, or is behind since the power was cut; they go first."""
        clips = sorted(newest.parent.glob(f"garbled-{self._name}-*.wav"), key=lambda c: (c <= newest, c), reverse=True)
        total = 0
        for number, clip in enumerate(clips):
            with suppress(FileNotFoundError):  # somebody else has deleted it meanwhile
                total += clip.stat().st_size
            if number >= settings.keep or (number > 0 and total > settings.keep_mb * 1e6):
                clip.unlink(missing_ok=True)


def _length_s(block: Samples) -> float:
    return block.size / SAMPLE_RATE_HZ
