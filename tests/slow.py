"""What tests take: what `make check` leaves out besides the tests marked as slow, what `make test` leaves to `make
test-long`, and what each begins with.

    make slow

measures all tests and writes those to `slow.txt` of which a case took longer than SLOW_S, with what all cases of each
took together, in seconds of processor time: so the list does not depend on what else the computer did. Processes that
a test started count once they have ended.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Mapping
from pathlib import Path
from resource import RUSAGE_CHILDREN, RUSAGE_SELF, getrusage
from xml.etree import ElementTree

import pytest

SLOW_S = 0.05
"""Two processes run what is left in 20 s: 4,000 tests of 10 ms on average."""
LONG_S = 5.0
"""All cases of a test together. These tests, a fortieth of all, take more than half of the time."""
PROPERTY = "processor_s"
BEFORE_S = pytest.StashKey[float]()
PATH = f"properties/property[@name='{PROPERTY}']"
LIST = Path(__file__).with_name("slow.txt")


@pytest.hookimpl(wrapper=True, tryfirst=True)
def pytest_runtest_protocol(item: pytest.Item) -> Iterator[None]:
    """As a plugin: notes the processor time before a test with its fixtures."""
    item.stash[BEFORE_S] = _processor_s()
    return (yield)


@pytest.hookimpl(wrapper=True, tryfirst=True)
def pytest_runtest_teardown(item: pytest.Item) -> Iterator[None]:
    """Writes what the test took into the report."""
    try:
        return (yield)
    finally:
        item.user_properties.append((PROPERTY, f"{_processor_s() - item.stash[BEFORE_S]:.3f}"))


def _processor_s() -> float:
    used = (getrusage(RUSAGE_SELF), getrusage(RUSAGE_CHILDREN))
    return sum(each.ru_utime + each.ru_stime for each in used)


def seconds() -> dict[str, float]:
    """The functions that are left out, as `tests.room.test_module::test_function`, and what each took, s."""
    rows = (line.split() for line in LIST.read_text(encoding="utf-8").splitlines())
    return {name: float(took_s) for took_s, name in rows}


def of_modules(took_s: Mapping[str, float]) -> dict[str, float]:
    """The same for whole modules, `tests.room.test_module`."""
    found: dict[str, float] = {}
    for name, each_s in took_s.items():
        found[module_of(name)] = found.get(module_of(name), 0.0) + each_s
    return found


def module_of(name: str) -> str:
    """The module of a function in the list, which may be of a class."""
    return name.split("::")[0].partition(".Test")[0]


def name_of(node: str) -> str:
    """The function of pytest's node identifier, as in the list."""
    path, *classes, function = node.split("::")
    module = path.removesuffix(".py").replace("/", ".")
    return f"{'.'.join([module, *classes])}::{function.split('[')[0]}"


def measured(report: Path) -> dict[str, float]:
    """The functions of a JUnit report of which a case took too long, and what all their cases took, s."""
    longest_s: dict[str, float] = {}
    total_s: dict[str, float] = {}
    for case in ElementTree.parse(report).iter("testcase"):
        name, took_s = _name(case), sum(float(each.get("value", 0.0)) for each in case.iterfind(PATH))
        longest_s[name] = max(longest_s.get(name, 0.0), took_s)
        total_s[name] = total_s.get(name, 0.0) + took_s
    return {name: total_s[name] for name in sorted(longest_s) if longest_s[name] > SLOW_S}


def _name(case: ElementTree.Element) -> str:
    return f"{case.get('classname')}::{case.get('name', '').split('[')[0]}"


if __name__ == "__main__":
    rows = (f"{took_s:.1f} {name}\n" for name, took_s in measured(Path(sys.argv[1])).items())
    LIST.write_text("".join(rows), encoding="utf-8")
