"""Collects and counts what C libraries write to standard error: ALSA has a line for each underrun.

An error handler of ALSA's would need a callback, memory that is written and executed, which the unit forbids. So file
descriptor 2 becomes a pipe that never blocks who writes, and Python's `sys.stderr` and fatal tracebacks keep the real
one.
"""

from __future__ import annotations

import faulthandler
import fcntl
import os
import sys
from collections import Counter
from contextlib import suppress

import structlog

from hvcpd.reporting.text import clean

STDERR = 2
"""The file descriptor; unistd.h."""
MAX_KINDS = 100
"""Number of different lines that are counted to choose the example."""
MAX_LINE_LENGTH = 300
"""Characters of the example."""
READ_BYTES = 1 << 16
"""A pipe holds as much (pipe(7)): about 900 of ALSA's lines. What does not fit before it is read is not counted."""

_log = structlog.get_logger(__name__)


class LibraryOutput:
    """Collects from `begin` to `end`. Call `drain` at least once a second, and `report` if there is a log."""

    def __init__(self) -> None:
        self._reader: int | None = None
        self._real = STDERR
        self._before = sys.stderr
        self._unfinished = b""
        self._count = 0
        self._kinds: Counter[str] = Counter()

    def begin(self) -> None:
        """Take over file descriptor 2, if Python's own standard error uses it; otherwise do nothing."""
        try:
            if sys.stderr.fileno() != STDERR:
                return
            self._real = fcntl.fcntl(STDERR, fcntl.F_DUPFD_CLOEXEC, STDERR + 1)
            self._reader, writer = os.pipe2(os.O_NONBLOCK | os.O_CLOEXEC)
        except (OSError, ValueError, AttributeError):
            return
        self._before = sys.stderr
        self._before.flush()
        os.dup2(writer, STDERR)
        os.close(writer)
        sys.stderr = os.fdopen(
            self._real, "w", buffering=1, encoding=self._before.encoding, errors="backslashreplace", closefd=False
        )
        faulthandler.enable(sys.stderr)

    def drain(self) -> None:
        """Count what was written since the last call, at most what the pipe holds: more may come as fast."""
        if self._reader is None:
            return
        with suppress(BlockingIOError):
            *lines, self._unfinished = (self._unfinished + os.read(self._reader, READ_BYTES)).split(b"\n")
            self._unfinished = self._unfinished[-READ_BYTES:]
            for line in lines:
                self._take(line)

    def report(self) -> None:
        """Log the number of lines since the last report, and the most frequent one; nothing if there are none."""
        self.drain()
        if self._count:
            ((example, _),) = self._kinds.most_common(1)
            _log.warning("libraries complained", lines=self._count, example=example)
        self._count = 0
        self._kinds.clear()

    def end(self) -> None:
        """Report the rest, and restore file descriptor 2."""
        if self._reader is None:
            return
        self.drain()
        self._take(self._unfinished)
        self.report()
        os.dup2(self._real, STDERR)
        faulthandler.disable()
        sys.stderr.flush()
        sys.stderr = self._before
        os.close(self._real)
        os.close(self._reader)
        self._reader = None

    def _take(self, line: bytes) -> None:
        if not line.strip():
            return
        self._count += 1
        text = clean(line.decode(errors="backslashreplace").strip()[:MAX_LINE_LENGTH])
        if text in self._kinds or len(self._kinds) < MAX_KINDS:
            self._kinds[text] += 1
