"""`hvcpctl bench`: the cost of a robot's start, speaking and listening on this computer."""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

from hvcpd.control.output import show
from hvcpd.errors import EX_FAILURE, EX_OK, HvcpdError

PATIENCE_S = 600.0
"""Time limit for one piece of work; a first start that takes ten seconds here takes about fifty on the slowest 64-bit
board."""
MOST_LOAD = 0.8
"""Limit for the share of one core that decoding speech in real time takes, in `hvcpctl doctor`, too; wheels, sound and
the system need the rest."""


class BenchError(HvcpdError):
    """A piece of work failed; the text has its last line of output."""


@dataclass(frozen=True)
class Row:
    """One line of the table: a piece of work, its amount, and the figure computed from it."""

    text: str
    work: str
    amount: int
    times: float = 1.0
    """Factor for the difference between the work and no work."""
    unit: str = "s"
    alone: bool = True
    """Whether to subtract the cost of what precedes the work."""


ROWS = (
    Row("first start, to READY", "start", 1, alone=False),
    Row("later starts, to READY", "start", 1, alone=False),
    Row("one sentence, not in the cache", "say", 2, 1 / 2),
    Row("then waveforms of ten of a peer's words", "waveforms", 10),
    Row("listening to quiet", "quiet", 20, 100 / 20, "% of a core"),
    Row("listening to a peer, with second passes", "speech", 20, 100 / 20, "% of a core"),
)
"""The order matters: the first start fills the cache of the others."""


@dataclass(frozen=True)
class Cost:
    """The cost of one process in s, or of a row in its unit; where it listens, the share of one core in the busiest
    second."""

    amount: float
    busiest: float | None = None


Measure = Callable[[str, Path, int], Cost]
"""Does an amount of work, which keeps its files in the folder."""


def table(measure: Measure, folder: Path) -> Iterator[tuple[Row, Cost]]:
    """Yield each row with its cost as soon as that is known. Raises what `measure` raises."""
    for row in ROWS:
        before = 0.0
        if row.alone:
            measure(row.work, folder, 0)  # renders what the cache lacks
            before = measure(row.work, folder, 0).amount
        cost = measure(row.work, folder, row.amount)
        yield row, Cost((cost.amount - before) * row.times, cost.busiest)


def seconds(work: str, folder: Path, amount: int) -> Cost:
    """Return the processor time of a process that does the work. Raises BenchError."""
    here = f"import sys; sys.path[:] = {sys.path!r}; from hvcpd.control.bench.work import main; "
    command = [sys.executable, "-c", f"{here}sys.exit(main({[work, str(folder), str(amount)]!r}))"]
    try:
        done = subprocess.run(command, capture_output=True, text=True, check=True, timeout=PATIENCE_S)
        measured = json.loads(done.stdout.splitlines()[-1])
    except (subprocess.SubprocessError, ValueError, IndexError) as error:
        last = (getattr(error, "stderr", None) or str(error)).strip().splitlines()[-1:]
        raise BenchError(f"{work}: {''.join(last)}") from error
    return Cost(measured["cpu_s"], measured["busiest"])


def run(options: argparse.Namespace, measure: Measure = seconds) -> int:
    """Print the table; 0 if the robot keeps real time here."""
    busiest = 0.0
    with tempfile.TemporaryDirectory(prefix="hvcpd-bench-") as folder:
        for row, cost in table(measure, Path(folder)):
            fields = {"what": row.text, "value": round(cost.amount, 3), "unit": row.unit, "busiest": cost.busiest}
            show(options.json, fields, f"{row.text:<48}{cost.amount:8.2f} {row.unit}")
            busiest = max(busiest, cost.busiest or 0.0)
    keeps = busiest <= MOST_LOAD
    verdict = "keeps real time" if keeps else "is too slow: stop other programs, or set fewer `names`"
    text = f"this computer {verdict}: the busiest second took {busiest:.0%} of one core"
    show(options.json, {"keeps_real_time": keeps, "busiest": round(busiest, 3)}, text)
    return EX_OK if keeps else EX_FAILURE
