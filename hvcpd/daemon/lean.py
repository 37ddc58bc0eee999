"""What keeps the idle daemon small on a computer with 1 GB."""

from __future__ import annotations

import ctypes
import sys
from importlib import import_module

UNWANTED = ("rich", "ssl")
"""What asyncio and structlog load only in case it is wanted, and do without where it is missing: tracebacks in colour
and TLS, together 10 MB. The daemon writes plain lines and has no network."""


def load_libraries() -> None:
    """Load asyncio and structlog without `UNWANTED`, unless either was loaded before."""
    absent = [name for name in UNWANTED if name not in sys.modules]
    sys.modules.update(dict.fromkeys(absent))  # type: ignore[arg-type]  # None: "import of … halted"
    try:
        for name in ("asyncio", "structlog"):
            import_module(name)
    finally:
        for name in absent:
            del sys.modules[name]


def give_back_memory() -> None:
    """Return to the system what building the templates needed for a while, some 5 MB; malloc_trim(3), glibc only."""
    trim = getattr(ctypes.CDLL(None), "malloc_trim", None)
    if trim is not None:
        trim(0)
