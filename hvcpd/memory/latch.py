"""The stop latch: a small file beside the robot's memory that says whether the next start may go on.

It is separate from the memory because it must outlive it: a lost memory must not set wheels in motion. So it is written
as a permission. A start goes on only if the whole line says "free" and names the very memory that was found; a line
that is missing, cut short or of another memory leaves the robot stopped. Revoking a permission needs no space and no
new file: a file that is truncated to nothing, or deleted, permits nothing.
"""

from __future__ import annotations

import hashlib
import os
import stat
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from enum import Enum
from functools import partial
from pathlib import Path

from hvcpd.config.files import sync_folder
from hvcpd.errors import StoreError, writing

MAX_BYTES = 100
"""Largest size of the file, which has at most 50."""

IDENTITY_BITS = 62
"""Bits of the number that tells one memory from any other: a positive integer of SQLite's."""


class Permit(Enum):
    """The latch's decision about the next start."""

    FREE = "free"
    STOPPED = "stopped"
    UNSURE = "unsure"
    """Not all of the robot's knowledge could be written, or the line cannot be read: the next start is stopped, too."""
    NEW = "new"
    """A first memory is being made: there is nothing yet that could be lost."""


@dataclass(frozen=True)
class Latched:
    """A line of the latch: the permit, and the identities of the memory and of the seals' counters that go with it."""

    permit: Permit
    memory: int | None = None
    seals: int | None = None

    @property
    def line(self) -> bytes:
        """The line of the file; its end shows that it is complete."""
        names = ("-" if number is None else f"{number:016x}" for number in (self.memory, self.seals))
        return " ".join((self.permit.value, *names)).encode("ascii") + b"\n"


UNREADABLE = Latched(Permit.UNSURE)


def latched_of(line: bytes) -> Latched:
    """The meaning of a line; UNREADABLE unless it is, byte for byte, one that was written whole."""
    try:
        word, *numbers = line.decode("ascii").split()
        memory, seals = (None if number == "-" else int(number, 16) for number in numbers)
        found = Latched(Permit(word), memory, seals)
    except ValueError:
        return UNREADABLE
    return found if found.line == line else UNREADABLE


def spare_places(latch: Path, runtime: Path) -> tuple[Path, ...]:
    """Spare places for a stop if the latch's own disk accepts no writes: the file `runtime` beside the control socket,
    and one in the folder for temporary files. The first outlives the daemon, the second may outlive a boot; neither
    need."""
    digest = hashlib.sha256(os.fsencode(latch.absolute())).hexdigest()[:16]
    # Not `tempfile.gettempdir`, which takes another folder, or fails, where the disk is full.
    temporary = Path(os.environ.get("TMPDIR") or "/tmp")
    return runtime, temporary / f"hvcpd-{os.geteuid()}-{digest}.stopped"


class StopLatch:
    """The latch in the file `path`; the files `spares` are used only while that file cannot be written."""

    def __init__(self, path: Path, spares: Sequence[Path] = ()) -> None:
        self.path = path
        self._spares = tuple(spares)
        self._held: int | None = None
        """The file as it was last written: it can be cut short even where nothing can be opened for writing."""
        self._kept: Latched | None = None
        """What is on the disk, unless somebody else has changed it; None after a failure."""

    def read(self) -> Latched | None:
        """The content of the file; None if there is none, UNREADABLE if it cannot be read."""
        try:
            descriptor = os.open(self.path, os.O_RDONLY | os.O_CLOEXEC | os.O_NOFOLLOW | os.O_NONBLOCK)
        except FileNotFoundError:
            return None
        except OSError:
            return UNREADABLE
        try:
            return latched_of(os.read(descriptor, MAX_BYTES))
        except OSError:
            return UNREADABLE
        finally:
            os.close(descriptor)

    def spare(self) -> Path | None:
        """A spare place that says "stopped", if one does; other users' files there do not count."""
        return next((path for path in self._spares if _is_own_file(path)), None)

    def write(self, latched: Latched) -> None:
        """Keep this over kill -9 and power cuts; it is on the disk when this returns.

        What is there already is not written again: a full disk may have no room for a second file. Raises StoreError if
        the next start may do more than this permits, or less; its text begins with that consequence.
        """
        if latched == self._kept == self.read() and self.spare() is None:
            return
        self._kept = None
        if latched.permit in (Permit.FREE, Permit.NEW):
            remedy = "make the file and its folder writable for the daemon's user"
            with writing(self.path, StoreError, "the next start will be stopped: ", remedy):
                self._replace(latched.line)
                for path in self._spares:
                    if _is_own_file(path):
                        path.unlink()
        else:
            self._revoke(latched.line)
        self._kept = latched

    def close(self) -> None:
        """Close the file; may be called twice."""
        if self._held is not None:
            os.close(self._held)
            self._held = None

    def _revoke(self, line: bytes) -> None:
        first: OSError | None = None
        self._cut_if_moved()
        for means in (partial(self._replace, line), self._cut, self._delete):
            try:
                means()
            except OSError as error:
                first = first or error
            else:
                if self._forbids():
                    return
        kept = next((path for path in self._spares if _made(path)), None)
        reason = (first.strerror if first is not None else None) or "its old content may still be there"
        if kept is None:
            raise StoreError(
                f"after a restart the robot may go on: {self.path}: a stop cannot be kept: {reason}; make its disk "
                "writable, or keep the robot switched off"
            )
        raise StoreError(
            f"after a loss of power the robot may go on: {self.path}: a stop cannot be kept there, only in {kept}: "
            f"{reason}; make its disk writable"
        )

    def _forbids(self) -> bool:
        """Whether the next start will be stopped: without a latch that is so where there is a memory that had one."""
        found = self.read()
        if found is None:
            return self.path.parent.is_dir() and any(self.path.parent.iterdir())
        return found.permit not in (Permit.FREE, Permit.NEW)

    def _cut_if_moved(self) -> None:
        """A user who has moved the folder away may move it back."""
        if self._held is not None:
            with suppress(OSError):
                if not self.path.exists() or not os.path.samestat(self.path.stat(), os.fstat(self._held)):
                    os.ftruncate(self._held, 0)

    def _replace(self, line: bytes) -> None:
        self.path.parent.mkdir(parents=True, exist_ok=True)
        fresh = self.path.with_name(f"{self.path.name}.new")
        flags = os.O_RDWR | os.O_CREAT | os.O_TRUNC | os.O_CLOEXEC | os.O_NOFOLLOW
        descriptor = os.open(fresh, flags, 0o600)
        try:
            if os.write(descriptor, line) != len(line):
                raise OSError(None, "the disk is full")
            os.fsync(descriptor)
            fresh.replace(self.path)
        except OSError:
            os.close(descriptor)
            with suppress(OSError):
                fresh.unlink()
            raise
        self.close()
        self._held = descriptor
        sync_folder(self.path.parent)

    def _cut(self) -> None:
        """Cut the file short: neither a full disk nor the folder's permissions are in the way."""
        flags = os.O_WRONLY | os.O_CLOEXEC | os.O_NOFOLLOW | os.O_NONBLOCK  # no target of a link; a pipe has no reader
        descriptor = self._held if self._held is not None else os.open(self.path, flags)
        try:
            os.ftruncate(descriptor, 0)
            os.fsync(descriptor)
            if not os.path.samestat(self.path.lstat(), os.fstat(descriptor)):
                raise FileNotFoundError(None, "another file is in its place")
        finally:
            if descriptor != self._held:
                os.close(descriptor)

    def _delete(self) -> None:
        self.path.unlink()
        sync_folder(self.path.parent)


def _made(path: Path) -> bool:
    """Whether an empty file could be made there, or exists: that takes no space."""
    try:
        flags = os.O_WRONLY | os.O_CREAT | os.O_CLOEXEC | os.O_NOFOLLOW | os.O_NONBLOCK
        descriptor = os.open(path, flags, 0o600)
        os.fsync(descriptor)
        os.close(descriptor)
        sync_folder(path.parent)
    except OSError:
        return False
    return _is_own_file(path)


def _is_own_file(path: Path) -> bool:
    try:
        status = path.lstat()
    except OSError:
        return False
    return stat.S_ISREG(status.st_mode) and status.st_uid == os.geteuid()
