"""docs/architecture.md, runtime.md and faults.md name the packages, files, contracts and bounds that there are."""

from __future__ import annotations

import ast
import re
import tomllib
from pathlib import Path

from hvcpd.coordination.states import State, Trigger
from hvcpd.coordination.table import TRANSITIONS
from hvcpd.daemon import journal_service, pose_keeper, wheel_service
from hvcpd.daemon.control_protocol import MAX_LINE_BYTES
from hvcpd.daemon.control_server import MAX_CLIENTS, MAX_UNREAD_BYTES
from hvcpd.hardware import motion
from hvcpd.recognition import decoder
from hvcpd.skills import host

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
RUNTIME = (ROOT / "docs" / "runtime.md").read_text(encoding="utf-8")
FAULTS = (ROOT / "docs" / "faults.md").read_text(encoding="utf-8")
PACKAGE = ROOT / "hvcpd"
FILES = frozenset(
    path.relative_to(ROOT).as_posix()
    for folder in ("hvcpd", "hil_fakes", "etc")
    for path in (ROOT / folder).rglob("*")
    if "__pycache__" not in path.parts
)


def contract(name: str) -> dict[str, list[str]]:
    pyproject = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    [found] = [each for each in pyproject["tool"]["importlinter"]["contracts"] if each["name"] == name]
    return found


def test_the_layers_are_those_of_the_contract() -> None:
    layers = contract("The house: one-way imports")["layers"]
    block = "\n".join(f"       {layer}" for layer in layers)
    assert f"\n\n{block}\n\n" in PAGE


def test_every_room_and_module_at_the_top_level_is_in_the_table() -> None:
    rooms = {path.name for path in PACKAGE.iterdir() if (path / "__init__.py").exists()}
    modules = {path.name for path in PACKAGE.glob("*.py")} - {"__init__.py"}
    assert len(modules) <= 5
    assert {room for room in rooms if f"`hvcpd/{room}/`" not in PAGE} == set()
    assert {module for module in modules if f"`hvcpd/{module}`" not in PAGE} == set()


def test_every_file_that_is_named_exists() -> None:
    named = set(re.findall(r"`([\w/]+\.(?:py|yaml))`", PAGE + RUNTIME + FAULTS))
    assert len(named) > 50
    assert {name for name in named if not any(f"/{file}".endswith(f"/{name}") for file in FILES)} == set()


def names_in(path: Path) -> set[str]:
    """What a module defines: `Robot`, `Robot.step`, `TRANSITIONS`."""
    found: set[str] = set()
    for node in ast.parse(path.read_text(encoding="utf-8")).body:
        for each in node.targets if isinstance(node, ast.Assign) else [node]:
            name = getattr(each, "name", None) or getattr(getattr(each, "target", each), "id", None)
            inner = node.body if isinstance(node, ast.ClassDef) else []
            found |= {name, *(f"{name}.{member.name}" for member in inner if hasattr(member, "name"))}
    return found


def test_what_is_said_to_stand_in_a_file_stands_there() -> None:
    named = re.findall(r"`([\w/]+\.py)`\s+\(`([\w.]+)`", PAGE + RUNTIME + FAULTS)
    assert len(named) > 25
    for file, name in named:
        paths = [ROOT / each for each in FILES if f"/{each}".endswith(f"/{file}")]
        assert any(name in names_in(path) for path in paths), f"{file} has no {name}"


def test_the_one_state_that_has_no_row_for_stop_is_named() -> None:
    [without] = [state.name for state in State if (state, Trigger.STOP) not in TRANSITIONS]
    assert f"Every state but `{without}` has a row for it" in PAGE
    assert f"every state but `{without}` has a transition for it" in (ROOT / "docs" / "protocol.md").read_text("utf-8")


def test_the_bounds_are_those_of_the_code() -> None:
    line_kib, unread_kib = MAX_LINE_BYTES >> 10, MAX_UNREAD_BYTES >> 10
    assert f"{MAX_CLIENTS} clients, {line_kib} KiB a line, {unread_kib} KiB unread each" in RUNTIME
    assert f"{journal_service.MAX_WAITING} records; further" in RUNTIME
    assert wheel_service.LEASE_S == motion.LEASE_S
    assert f"after {motion.LEASE_S:g} s without a new command" in RUNTIME
    assert f"the motion's lease ends after {motion.LEASE_S:g} s" in FAULTS
    assert f"after {host.BEATS_MISSED_S:g} s without a beat" in FAULTS
    assert f"saved at most {pose_keeper.EVERY_S:g} s before" in FAULTS
    recognition = (ROOT / "docs" / "recognition.md").read_text(encoding="utf-8")
    assert f"There are {decoder.CAPACITY:,} back-pointers" in recognition


def test_each_thread_is_started_in_the_file_that_is_named() -> None:
    named = re.findall(r"^\| `([\w-]+)`, one [^|]*\| `([\w/]+\.py)`", RUNTIME, re.M)
    assert len(named) == 9
    for thread, file in named:
        texts = [(PACKAGE / each).read_text(encoding="utf-8") for each in (file, "daemon/main_loop.py")]
        assert any(f'"{thread}"' in text for text in texts), file
