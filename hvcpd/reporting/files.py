"""Files that are whole or not there."""

from __future__ import annotations

import errno
import os
import tempfile
from pathlib import Path

_FILE_MODE = 0o666
"""What open() asks for, before the umask."""


def write_whole(path: Path, data: bytes) -> None:
    """Write `path` in one step: who reads it sees the old content or the new, never a part. Raises OSError.

    A device, a pipe or the like is written to, not replaced; of a link, what it leads to is replaced.
    """
    if path.exists() and not path.is_file() and not path.is_dir():
        path.write_bytes(data)
        return
    path = path.resolve()
    if path.is_dir():
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(path))
    handle, name = tempfile.mkstemp(prefix=f".{path.name}.", dir=path.parent)
    partial = Path(name)
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(data)
        partial.chmod(_FILE_MODE & ~_umask())  # mkstemp makes it private; a report is for whoever may read there
        partial.replace(path)
    finally:
        partial.unlink(missing_ok=True)


def _umask() -> int:
    mask = os.umask(0o077)
    os.umask(mask)
    return mask
