"""Keeps the idle daemon small on a computer with 1 GB."""

from __future__ import annotations

import ctypes
import gc
import sys
from importlib import import_module

UNWANTED = ("rich", "colorama", "ssl", "_hashlib", "_uuid", "bz2", "lzma")
"""Modules that these libraries load only in case, and do without if they are missing: colours, TLS, OpenSSL's hashes,
the kernel's way to unique numbers, and other packing than zlib's, together 14 MB. The daemon writes plain lines, has no
network, and hashes little."""
LIBRARIES = ("asyncio", "structlog", "hashlib", "hmac", "zipfile")


def load_libraries() -> None:
    """Load `LIBRARIES` without `UNWANTED`, unless either was loaded before."""
    absent = [name for name in UNWANTED if name not in sys.modules]
    sys.modules.update(dict.fromkeys(absent))  # type: ignore[arg-type]  # None: "import of … halted"
    try:
        for name in LIBRARIES:
            import_module(name)
    finally:
        for name in absent:
            del sys.modules[name]


M_TRIM_THRESHOLD, M_MMAP_THRESHOLD, M_ARENA_MAX = -1, -3, -8
"""Parameters of mallopt(3), malloc.h."""
OWN_PAGES_BYTES = 1 << 18
"""Larger arrays have pages of their own, which go back at once, where no gap of the heap has room for them: a voice's
templates while they are made."""
FREE_TOP_BYTES = 1 << 24
"""Kept at the heap's end until `give_back_memory`: with 128 KB a first start takes twice as long."""
FREE_TOP_LATER_BYTES = 1 << 18
"""Kept at the heap's end after `give_back_memory`."""


def tune_allocator() -> None:
    """Use one heap for all threads, and separate pages for large blocks: 3 MB less when idle.

    glibc only; to be called before there are threads.
    """
    mallopt = getattr(ctypes.CDLL(None), "mallopt", None)
    if mallopt is not None:
        mallopt(M_ARENA_MAX, 1)
        mallopt(M_MMAP_THRESHOLD, OWN_PAGES_BYTES)
        mallopt(M_TRIM_THRESHOLD, FREE_TOP_BYTES)


def exempt_modules() -> None:
    """Exempt what is loaded from garbage collection, as modules never end: a full collection looks at 4,000 objects
    instead of 57,000 and takes 1 ms instead of 60 (on x86-64), in which sound would be lost."""
    gc.collect()
    gc.freeze()


def give_back_memory() -> None:
    """Return to the system what building templates needed for a while, 5 to 25 MB; malloc_trim(3), glibc only."""
    gc.collect()
    library = ctypes.CDLL(None)
    if hasattr(library, "malloc_trim") and hasattr(library, "mallopt"):
        library.mallopt(M_TRIM_THRESHOLD, FREE_TOP_LATER_BYTES)
        library.malloc_trim(0)
