"""Files that are whole or not there, and folders to write them in."""

from __future__ import annotations

import errno
import os
import secrets
import tempfile
from pathlib import Path

STANDARD_OUTPUT = Path("/dev/stdout")


def write_whole(path: Path, data: bytes) -> None:
    """Write `path` atomically: readers see the old content or the new, never a part. Raises OSError.

    A device, a pipe or the like is written to, not replaced; of a link, what it leads to is replaced. A file that is
    the standard output grows, as the shell's >> wants it.
    """
    if path == STANDARD_OUTPUT or (path.exists() and not path.is_file() and not path.is_dir()):
        with path.open("ab") as stream:
            stream.write(data)
        return
    path = path.resolve()
    if path.is_dir():
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(path))
    partial = path.with_name(f".{secrets.token_hex(8)}.part")
    try:
        with partial.open("xb") as file:
            file.write(data)
        partial.replace(path)
    finally:
        partial.unlink(missing_ok=True)


def make_writable(folder: Path) -> None:
    """Make the folder if need be, and try to write there. Raises OSError if that cannot be done."""
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryFile(dir=folder) as file:
        file.write(b"x")  # a full disk still takes an empty file
