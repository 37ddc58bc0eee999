"""The same examples on every run, on every machine; a failure here is a failure everywhere."""

from __future__ import annotations

import asyncio
import inspect
import os
import sys
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

import pytest
from hypothesis import settings

from hvcpd.daemon.allocator import exempt_modules
from tests import slow
from tests.skipping import summary

# Else every process that tests start compiles hvcpd anew, and every worker all tests, in a quarter of a minute.
sys.dont_write_bytecode = False
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)

settings.register_profile("hvcpd", derandomize=True, database=None, deadline=None, print_blob=True)
settings.load_profile("hvcpd")


@pytest.hookimpl(tryfirst=True)  # marks are read by what comes after
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Marks what was measured to be slow, and sorts the modules by how long they take: each worker is given one module
    after another in this order, and none is left with a long one at the end."""
    took_s = slow.seconds()
    for item in items:
        name = slow.name_of(item.nodeid)
        if name in took_s:
            item.add_marker("slow")
        if took_s.get(name, 0.0) > slow.LONG_S:
            item.add_marker("long")
    of_modules_s = slow.of_modules(took_s)
    # What takes the same time stays in its order.
    items.sort(key=lambda item: -of_modules_s.get(slow.module_of(slow.name_of(item.nodeid)), 0.0))


def pytest_collection_finish() -> None:
    """What was collected stays to the end, and full garbage collections, which each daemon asks for every ten seconds
    of its time, leave it out: else `tests.daemon.test_main_loop` takes 28 s of processor time instead of 24."""
    exempt_modules()


@pytest.hookimpl(tryfirst=True)
def pytest_pyfunc_call(pyfuncitem: pytest.Function) -> bool | None:
    """Runs a test that is a coroutine in an event loop of its own, for 300 s at the most: a busy machine takes long."""
    if not inspect.iscoroutinefunction(pyfuncitem.obj):
        return None
    given = {name: pyfuncitem.funcargs[name] for name in inspect.signature(pyfuncitem.obj).parameters}
    asyncio.run(asyncio.wait_for(pyfuncitem.obj(**given), 300.0))
    return True


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Under xdist this runs once, in the process that gathers all reports."""
    skipped = terminalreporter.stats.get("skipped", [])
    for line in summary(report.longrepr[2] for report in skipped if isinstance(report.longrepr, tuple)):
        terminalreporter.write_line(line)


@pytest.fixture(scope="session", autouse=True)
def user_cache(tmp_path_factory: pytest.TempPathFactory, pytestconfig: pytest.Config) -> Iterator[Path]:
    """The user's cache folder in this run: one for all workers, and never the real one.

    Only rendered units, and what was found when words were compared, are kept from run to run, in pytest's own cache:
    both are found by a digest of their content and of the source that makes them, so a run finds what it would have
    made.
    """
    base = tmp_path_factory.getbasetemp()
    folder = (base.parent if "PYTEST_XDIST_WORKER" in os.environ else base) / "user-cache"
    (folder / "hvcpd").mkdir(parents=True, exist_ok=True)
    if getattr(pytestconfig, "cache", None) is not None:  # it can be switched off
        for kept in ("units", "vocabulary"):
            with suppress(FileExistsError):  # another worker was first
                (folder / "hvcpd" / kept).symlink_to(pytestconfig.cache.mkdir(kept))
    with pytest.MonkeyPatch.context() as environment:
        environment.setenv("XDG_CACHE_HOME", str(folder))
        yield folder


@pytest.fixture(scope="session")
def units(user_cache: Path) -> Path:
    """Rendered units that all tests of a run share, as several robots on one computer do."""
    folder = user_cache / "hvcpd" / "units"
    folder.mkdir(parents=True, exist_ok=True)
    return folder


@pytest.fixture(scope="session")
def compared(user_cache: Path) -> Path:
    """What was found when words were compared, likewise: for a robot it takes half a second."""
    folder = user_cache / "hvcpd" / "vocabulary"
    folder.mkdir(parents=True, exist_ok=True)
    return folder
