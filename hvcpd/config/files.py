"""Files that are whole or not there, and folders to write them in."""

from __future__ import annotations

import errno
import os
import secrets
import stat
import tempfile
from contextlib import suppress
from pathlib import Path

STANDARD_OUTPUT = Path("/dev/stdout")


def write_whole(path: Path, data: bytes, mode: int | None = None) -> None:
    """Write `path` atomically: readers see the old content or the new, never a part. Raises OSError.

    Of a link, what it leads to is replaced; the new file has the owner and the permissions of the old one. One that is
    write-protected is left as it is. A device, a pipe or the like is written to, not replaced. A file that is the
    standard output grows, as the shell's >> wants it.

    With a `mode` the file is private: it has these permissions at most, and is on the disk when this returns; a stream
    is refused. A new one belongs to the owner of its folder: what root makes among the robot's files is the robot's.
    """
    target = Path(os.path.realpath(path))  # which, unlike Path.resolve, raises nothing for a ring of links
    old = target.stat() if target.exists() else None
    if old is not None and stat.S_ISDIR(old.st_mode):
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(path))
    if old is not None and not os.access(target, os.W_OK):  # its folder alone decides whether it can be replaced
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES), str(path))
    is_stream = path == STANDARD_OUTPUT or (old is not None and not stat.S_ISREG(old.st_mode))
    if is_stream and mode is not None:
        raise OSError(errno.ENXIO, "this is a device or a pipe", str(path))
    if is_stream:
        with path.open("ab") as stream:
            stream.write(data)
        return
    partial = target.with_name(f".{secrets.token_hex(8)}.part")
    flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_NOFOLLOW | os.O_CLOEXEC
    handle = os.open(partial, flags, 0o666 if mode is None else mode)
    try:
        with os.fdopen(handle, "wb") as file:
            if old is not None or mode is not None:
                _give(handle, old or target.parent.stat())
            if old is not None:
                with suppress(OSError):  # a disk that knows no permissions
                    os.fchmod(handle, stat.S_IMODE(old.st_mode) & (0o777 if mode is None else mode))
            file.write(data)
            if mode is not None:
                file.flush()
                os.fsync(handle)
        partial.replace(target)
    finally:
        partial.unlink(missing_ok=True)
    if mode is not None:
        sync_folder(target.parent)


def _give(file: int | Path, like: os.stat_result) -> None:
    """Give it the group and the owner of another, where this user may, and the disk knows such."""
    for uid, gid in ((-1, like.st_gid), (like.st_uid, -1)):
        with suppress(OSError):
            os.chown(file, uid, gid)


def sync_folder(folder: Path) -> None:
    """Have the disk know which files are in the folder. Raises OSError."""
    descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def require_place(path: Path) -> None:
    """Raises OSError where no file of this name can be written: there is no folder for it, or it is one. To be called
    before work whose result would be lost."""
    number = errno.EISDIR if path.is_dir() else 0 if path.parent.is_dir() else errno.ENOENT
    if number:
        raise OSError(number, os.strerror(number), str(path))


def make_folder(folder: Path) -> None:
    """Make the folder, and those above it, if need be. Raises OSError.

    It belongs to the owner of the folder above.
    """
    if not folder.is_dir():
        folder.parent.mkdir(parents=True, exist_ok=True)
        folder.mkdir(exist_ok=True)
        _give(folder, folder.parent.stat())


def make_writable(folder: Path) -> None:
    """Make the folder if need be, and try to write there. Raises OSError if that cannot be done."""
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryFile(dir=folder) as file:
        file.write(b"x")  # a full disk still takes an empty file
