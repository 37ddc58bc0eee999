"""A disk that is full."""

from __future__ import annotations

import resource
import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager

NO_BYTECODE = {"PYTHONDONTWRITEBYTECODE": "1"}
"""For processes with such a disk: Python keeps a compiled module also if only a part of it was written, and fails from
then on."""


@contextmanager
def no_new_bytes(beyond: int = 0) -> Iterator[None]:
    """No file can grow beyond so many bytes, as on a full disk (Python ignores SIGXFSZ, so that writes fail)."""
    assert signal.getsignal(signal.SIGXFSZ) is signal.SIG_IGN
    bytecode, sys.dont_write_bytecode = sys.dont_write_bytecode, True  # as NO_BYTECODE
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (beyond, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
        sys.dont_write_bytecode = bytecode
