"""Times a newcomer's path on a fresh clone: `python -m benchmarks.newcomer`.

Clones the committed tree into a temporary folder with caches of its own, and does there what README and docs say. Only
what pip has in its cache is shared with this computer. A sentence counts from when the terminal shows it; a mission
begins to speak at that moment.
"""

from __future__ import annotations

import argparse
import os
import re
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import suppress
from itertools import chain
from pathlib import Path

from release.prose import ROOT, pages, words_a_sentence

SENTENCE = re.compile(rb"Hi (all|team|[A-Z])")
"""How every first sentence begins."""
LIMIT_S = 600.0
"""A step that takes longer has failed."""
WORDS_A_MINUTE = 238.0
"""Silent reading of English non-fiction by adults (Brysbaert 2019)."""
HELP_LINES, HELP_COLUMNS = 24, 80
"""A terminal as it opens."""


def until_shown(command: Sequence[str], folder: Path, environment: dict[str, str], wanted: re.Pattern[bytes]) -> float:
    """Seconds from the start of `command` until its output has `wanted`; it is ended then. NaN if it never has."""
    began_s, seen = time.monotonic(), b""
    with subprocess.Popen(
        command,
        cwd=folder,
        env=environment,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        start_new_session=True,
    ) as process:
        assert process.stdout is not None
        try:
            while time.monotonic() - began_s < LIMIT_S and (some := os.read(process.stdout.fileno(), 65536)):
                seen = seen[-200:] + some
                if wanted.search(seen):
                    return time.monotonic() - began_s
        finally:
            with suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)
    return float("nan")


def took_s(command: Sequence[str], folder: Path, environment: dict[str, str]) -> float:
    """Seconds that `command` takes; NaN if it fails."""
    began_s = time.monotonic()
    result = subprocess.run(command, cwd=folder, env=environment, capture_output=True, timeout=LIMIT_S)
    if result.returncode != 0:
        sys.stderr.buffer.write(result.stderr[-2000:])
        return float("nan")
    return time.monotonic() - began_s


def on_a_fresh_clone(folder: Path) -> Iterator[tuple[str, str, float, float]]:
    """Times in seconds, each with its goal."""
    clone, cache = folder / "hvcpd", folder / "cache"
    environment = {**os.environ, "XDG_CACHE_HOME": str(cache), "PYTHONUNBUFFERED": "1"}
    pip = subprocess.run([sys.executable, "-m", "pip", "cache", "dir"], capture_output=True, text=True, check=True)
    environment["PIP_CACHE_DIR"] = pip.stdout.strip()
    cloned_s = took_s(["git", "clone", "--quiet", str(ROOT), str(clone)], folder, environment)
    demo_s = cloned_s + until_shown(["make", "demo"], clone, environment, SENTENCE)
    yield "From `git clone` to the first sentence of `make demo`", "s", demo_s, 60.0
    duet = [".venv/bin/hvcpctl", "duet", "--no-console", "--pipe"]
    for when in ("the first time", "later"):
        yield (
            f"`hvcpctl duet` to the first sentence, {when}",
            "s",
            until_shown(duet, clone, environment, SENTENCE),
            20.0,
        )
    took_s(["make", "setup-dev"], clone, environment)
    yield "`make docs`, once the linters are installed", "s", took_s(["make", "docs"], clone, environment), 60.0


def of_this_tree() -> list[tuple[str, str, float, float]]:
    """Lengths of the texts that a newcomer reads, each with its goal."""
    tutorial = len((ROOT / "docs/tutorials/own-tasks.md").read_text(encoding="utf-8").split())
    longest = max(words_a_sentence(page.read_text(encoding="utf-8")) for page in pages())
    from hvcpd.control.overview import OVERVIEW

    lines = OVERVIEW.splitlines()
    return [
        ("README", "words", float(len((ROOT / "README.md").read_text(encoding="utf-8").split())), 500.0),
        ("Own tasks in a mission, reading time", "min", tutorial / WORDS_A_MINUTE, 5.0),
        ("Mean sentence of the page with the longest sentences", "words", longest, 30.0),
        ("`hvcpctl --help`, height", "lines", float(len(lines)), float(HELP_LINES)),
        ("`hvcpctl --help`, width", "columns", float(max(map(len, lines))), float(HELP_COLUMNS)),
    ]


def main() -> int:
    """Print the table; 1 if a goal is missed."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.newcomer", description=__doc__)
    parser.add_argument("--read-only", action="store_true", help="measure only what is read; clone nothing")
    read_only = parser.parse_args().read_only
    sys.stdout.write("| What | Measured | Goal |\n|---|---|---|\n")
    missed = 0
    with tempfile.TemporaryDirectory(prefix="hvcpd-newcomer-") as folder:
        for what, unit, value, goal in chain(of_this_tree(), () if read_only else on_a_fresh_clone(Path(folder))):
            sys.stdout.write(f"| {what} | {value:.1f} {unit} | {goal:.0f} |\n")
            sys.stdout.flush()
            missed += not value <= goal
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
