"""The daemon's memory: what it must not load, and what it gives back."""

from __future__ import annotations

import subprocess
import sys
import weakref

from hvcpd.daemon.allocator import give_back_memory

_PROBE = """
import sys
from hvcpd.cli import main
main(["--name", "Rob", "--check"])
loaded = set(sys.modules)
import rich.console, ssl
unwanted = {"rich", "rich.console", "ssl", "_hashlib", "scipy", "cryptography", "soundfile", "markupsafe", "shtab"}
unwanted |= {"bz2", "colorama", "difflib", "importlib.resources", "lzma", "_uuid"}
print(sorted(loaded & unwanted))
"""


def test_the_daemon_loads_nothing_that_it_can_do_without_and_others_still_can() -> None:
    done = subprocess.run([sys.executable, "-c", _PROBE], capture_output=True, text=True, timeout=120, check=False)
    assert done.stdout.splitlines()[-1:] == ["[]"], done.stderr


def test_what_was_loaded_before_stays() -> None:
    probe = (
        "import ssl; from hvcpd.daemon.allocator import load_libraries; load_libraries(); import sys, ssl as again; "
    )
    probe += "assert again is ssl and sys.modules['asyncio'].sslproto.ssl is ssl"
    subprocess.run([sys.executable, "-c", probe], timeout=120, check=True)


def test_what_only_refers_to_itself_is_given_back_too() -> None:
    class Speaker:
        def __init__(self) -> None:
            self.cache = self.render

        def render(self) -> None: ...

    gone = weakref.ref(Speaker())
    give_back_memory()
    assert gone() is None


def test_a_collection_does_not_look_at_modules() -> None:
    probe = "import gc, hvcpd.daemon.main_loop; from hvcpd.daemon.allocator import exempt_modules; exempt_modules(); "
    probe += "print(len(gc.get_objects()))"
    done = subprocess.run([sys.executable, "-c", probe], capture_output=True, text=True, timeout=120, check=True)
    assert int(done.stdout) < 1_000
