"""Processes that tests start."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any


@contextmanager
def python(*words: str, **options: Any) -> Iterator[subprocess.Popen[str]]:
    """A process of Python that ends with the test, however that ends; its output is read by the test."""
    with subprocess.Popen([sys.executable, *words], stdout=subprocess.PIPE, text=True, **options) as process:
        try:
            yield process
        finally:
            process.kill()
