"""The tests that `make check` leaves out besides those marked as slow: one of their cases took longer than LIMIT_S.

    make slow

measures all tests and writes their names to `slow.txt`; the list is as good as the computer was quiet.
"""

from __future__ import annotations

import sys
from pathlib import Path
from xml.etree import ElementTree

LIMIT_S = 0.1
"""Two processes run what is left in about 20 s: 2,800 tests of 10 ms on average."""
LIST = Path(__file__).with_name("slow.txt")


def names() -> frozenset[str]:
    """The functions that are left out, as `tests.room.test_module::test_function`."""
    return frozenset(LIST.read_text(encoding="utf-8").split())


def name_of(node: str) -> str:
    """The function of pytest's node identifier, as in the list."""
    path, *classes, function = node.split("::")
    module = path.removesuffix(".py").replace("/", ".")
    return f"{'.'.join([module, *classes])}::{function.split('[')[0]}"


def measured(report: Path) -> list[str]:
    """The functions of a JUnit report that took too long."""
    cases = ElementTree.parse(report).iter("testcase")
    slow = {_name(case) for case in cases if float(case.get("time", 0.0)) > LIMIT_S}
    return sorted(slow)


def _name(case: ElementTree.Element) -> str:
    return f"{case.get('classname')}::{case.get('name', '').split('[')[0]}"


if __name__ == "__main__":
    LIST.write_text("".join(f"{name}\n" for name in measured(Path(sys.argv[1]))), encoding="utf-8")
