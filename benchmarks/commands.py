"""What commands cost: the processor time of whole processes, user and system, from start to end.

    python -m benchmarks.commands [--runs 20] [--only stop,say]

The median of the runs and its 95 % interval (by order statistics). The commands take turns, so that all suffer from a
machine that becomes slower. Python alone, and with NumPy, is what no command that makes sound can do without.
"""

from __future__ import annotations

import argparse
import os
import resource
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from statistics import median

from scipy.stats import binom

from tests.control.obliging import obliging_robot

CTL = ("-c", "import sys; from hvcpd.control.cli import main; sys.exit(main())")
DAEMON = ("-c", "import sys; from hvcpd.cli import main; sys.exit(main())")
SENTENCE = "Hi Bot, I am Rob, water the yellow rose"
ROWS: dict[str, tuple[str, ...]] = {
    "python": ("-c", "pass"),
    "numpy": ("-c", "import numpy"),
    "help": (*CTL, "--help"),
    "stop": (*CTL, "stop"),
    "status": (*CTL, "status", "--json"),
    "task": (*CTL, "task", "again", "3"),
    "say by a robot": (*CTL, "say", SENTENCE),
    "say, words rendered before": (*CTL, "say", SENTENCE, "-o", "said.wav"),
    "config": (*CTL, "config"),
    "hvcpd --check": (*DAEMON, "--check"),
}


def processor_s(words: Sequence[str], environment: dict[str, str], folder: Path) -> float:
    """What one run takes. A check that finds no sound card counts, too."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run([sys.executable, *words], env=environment, cwd=folder, capture_output=True, check=False)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def described(values: Sequence[float]) -> str:
    """The median and its interval."""
    ordered, rank = sorted(values), max(int(binom.ppf(0.025, len(values), 0.5)), 1)
    return f"{median(values):6.3f} s  [{ordered[rank - 1]:.3f}, {ordered[-rank]:.3f}]"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, default=20)
    parser.add_argument("--only", default="", help="rows that begin so, separated by commas")
    options = parser.parse_args()
    rows = {name: words for name, words in ROWS.items() if name.startswith(tuple(options.only.split(",")))}
    taken: dict[str, list[float]] = {name: [] for name in rows}
    with tempfile.TemporaryDirectory(prefix="hvcpd-commands-") as place, obliging_robot(Path(place)) as found:
        environment = {**os.environ, **found, "PYTHONPATH": str(Path(__file__).parents[1]), "XDG_CACHE_HOME": place}
        environment.pop("PYTHONDONTWRITEBYTECODE", None)
        for run in range(options.runs + 1):
            for name, words in rows.items():
                cost_s = processor_s(words, environment, Path(place))
                if run:  # the first compiles the modules, and renders the words
                    taken[name].append(cost_s)
    for name, values in taken.items():
        print(f"{name:<28}{described(values)}")


if __name__ == "__main__":
    main()
