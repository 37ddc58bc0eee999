"""What tests take: what `make check` leaves out besides the tests marked as slow, and what `make test` begins with.

    make slow

measures all tests and writes those to `slow.txt` that took longer than LIMIT_S, with what all cases of each took
together; the list is as good as the computer was quiet.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping
from pathlib import Path
from xml.etree import ElementTree

LIMIT_S = 0.05
"""Two processes run what is left in about 20 s: 4,000 tests of 10 ms on average."""
LIST = Path(__file__).with_name("slow.txt")


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
        name, took_s = _name(case), float(case.get("time", 0.0))
        longest_s[name] = max(longest_s.get(name, 0.0), took_s)
        total_s[name] = total_s.get(name, 0.0) + took_s
    return {name: total_s[name] for name in sorted(longest_s) if longest_s[name] > LIMIT_S}


def _name(case: ElementTree.Element) -> str:
    return f"{case.get('classname')}::{case.get('name', '').split('[')[0]}"


if __name__ == "__main__":
    rows = (f"{took_s:.1f} {name}\n" for name, took_s in measured(Path(sys.argv[1])).items())
    LIST.write_text("".join(rows), encoding="utf-8")
