"""Processes that are bound by the permissions of files, also if the superuser runs the tests."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys

import pytest

_BOUND = ("setpriv", "--bounding-set", "-dac_override,-dac_read_search") if os.geteuid() == 0 else ()
"""Without the superuser's right to open every file (capabilities(7); util-linux, setpriv(1))."""

needs_permissions = pytest.mark.skipif(
    os.geteuid() == 0 and shutil.which("setpriv") is None, reason="not installed: setpriv (Debian: util-linux)"
)


def bound(*arguments: object) -> subprocess.CompletedProcess[str]:
    """What became of `python arguments`, run by a user who may open only what its permissions allow."""
    command = [*_BOUND, sys.executable, *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, timeout=120, check=False, stdin=subprocess.DEVNULL)
