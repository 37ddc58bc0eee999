"""The README's table of figures: `python -m release.figures` measures them (an hour on a busy computer) and writes it.

Each figure is a count that a benchmark prints. docs/figures.json keeps the commands, what they printed and the day, so
that a test can compare. `--table` writes the table anew from that file, `--only NAME` measures one figure.
"""

from __future__ import annotations

import argparse
import json
import re
import subprocess
import sys
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from hvcpd.evaluation.statistics import wilson

ROOT = Path(__file__).parents[1]
RESULTS = ROOT / "docs" / "figures.json"
README = ROOT / "README.md"
_TABLE = re.compile(r"(<!-- figures:.*?-->\n).*?(<!-- end of figures -->)", re.S)


@dataclass(frozen=True)
class Figure:
    """A row: what was counted, by which command, and the pattern of a line that has `right` and `n`; lines add up."""

    name: str
    what: str
    command: str
    pattern: str

    def read(self, printed: str) -> tuple[int, int]:
        """How many of how many. Raises ValueError where the output has no such line."""
        found = [(int(m["right"]), int(m["n"])) for m in re.finditer(self.pattern, printed, re.M)]
        if not found:
            raise ValueError(f"{self.name}: `{self.command}` printed no line like {self.pattern}")
        return sum(right for right, _ in found), sum(n for _, n in found)


_MISSIONS = "python -m benchmarks.missions audio --seeds 1-10 --modes volunteer"
_STOP = "python -m benchmarks.stop --kinds robots --over-db none,0 --cases call --calls 20 --minutes 0"
FIGURES = (
    Figure(
        "missions",
        "Missions of two robots with every task done exactly once",
        _MISSIONS,
        r"^volunteer: (?P<right>\d+) of (?P<n>\d+) good",
    ),
    Figure(
        "sentences",
        "Sentences understood in these missions",
        _MISSIONS,
        r"^volunteer +\d+ +(?:yes|NO) +\d+ +\d+ +\d+ +(?P<n>\d+) +(?P<right>\d+) ",
    ),
    Figure(
        "noise",
        "Robots' sentences understood in noise 10 dB louder than the speech",
        "python -m benchmarks.hearing --rows noise --noise pink --snr 20,0,-10 --sentences 30",
        r"^pink noise, SNR -10 dB +(?P<right>\d+)/(?P<n>\d+)",
    ),
    Figure(
        "chapel",
        "First sentences understood in the echoes of a chapel",
        "python -m benchmarks.hearing --rows worlds --conditions chapel --modes first --sentences 20 --no-peer",
        r"^chapel, quiet.* first +(?P<right>\d+)/(?P<n>\d+)",
    ),
    Figure(
        "stop",
        "Calls of “stop” over equally loud talk that halt a robot within 0.5 s",
        _STOP,
        r"^robots, \+0 dB over a robot, .*?: (?P<right>\d+) of (?P<n>\d+) halted within 0.5 s",
    ),
)


def read_results() -> dict[str, dict[str, Any]]:
    """What was measured, by the figure's name: command, printed, date."""
    found: dict[str, dict[str, Any]] = json.loads(RESULTS.read_text(encoding="utf-8"))
    return found


def table(results: dict[str, dict[str, Any]]) -> str:
    """The rows as Markdown, with 95 % intervals after Wilson."""
    lines = ["| What | Result | 95 % interval |", "|---|---|---|"]
    for figure in FIGURES:
        right, n = figure.read(results[figure.name]["printed"])
        low, high = wilson(right, n)
        lines.append(f"| {figure.what} | {right} of {n} | {100 * low:.0f} to {100 * high:.0f} % |")
    days = sorted({results[figure.name]["date"] for figure in FIGURES})
    lines += ["", f"Measured {' to '.join(dict.fromkeys((days[0], days[-1])))}, all in simulation."]
    return "\n".join(lines)


def with_table(readme: str, results: dict[str, dict[str, Any]]) -> str:
    """The text of the README with the table between its marks."""
    return _TABLE.sub(lambda found: f"{found[1]}{table(results)}\n{found[2]}", readme)


def measure(command: str) -> str:
    """What a benchmark prints. Raises CalledProcessError."""
    words = [sys.executable, *command.split()[1:]]
    return subprocess.run(words, cwd=ROOT, stdout=subprocess.PIPE, text=True, check=True).stdout


def main() -> int:
    """Measure, keep what was printed, and write the table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--table", action="store_true", help="measure nothing")
    parser.add_argument("--only", choices=[figure.name for figure in FIGURES], help="measure this one")
    options = parser.parse_args()
    results = read_results() if RESULTS.exists() else {}
    printed: dict[str, str] = {}
    for figure in () if options.table else FIGURES:
        if options.only in (None, figure.name):
            if figure.command not in printed:
                printed[figure.command] = measure(figure.command)
            today = datetime.now(UTC).date().isoformat()
            results[figure.name] = {"command": figure.command, "date": today, "printed": printed[figure.command]}
    RESULTS.write_text(json.dumps(results, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
    README.write_text(with_table(README.read_text(encoding="utf-8"), results), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
