"""What the files of fake pins (`hil_fakes.pins`) hold, for programs that play what is wired to them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Edge:
    """A pin changed to `level`, by the monotonic clock of all processes of the computer."""

    at_s: float
    level: bool


def drive(folder: Path, pin: int, level: bool) -> None:
    """Something outside, a switch for example, gives an input a level."""
    whole, new = folder / f"{pin}.level", folder / f"{pin}.level.new"
    folder.mkdir(parents=True, exist_ok=True)
    new.write_text("1" if level else "0")
    new.replace(whole)


def edges(folder: Path, pin: int) -> Sequence[Edge]:
    """All changes of a pin until now."""
    path = folder / f"{pin}.log"
    lines = path.read_text().splitlines() if path.exists() else []
    return [Edge(float(at), level == "1") for at, level in (line.split() for line in lines)]


def is_on(folder: Path, pin: int) -> bool:
    """Whether the pin is high now."""
    found = edges(folder, pin)
    return bool(found) and found[-1].level
