"""The cost of a robot's work on a Raspberry Pi 3B+, estimated by counting instructions; the rows of `hvcpctl bench`.

    python -m benchmarks.pi [--folder out/arm64] [--without-shipped] [--memory [--emulator FILE]]

hvcpd's arm64 package runs under qemu-user with a plugin that counts (benchmarks/counting.c, built with cc), and this
working copy likewise on x86-64. An ESTIMATE, within a factor of two, until `hvcpctl bench` has run on a Pi:

    cycles = 1.0 integer + 1.0 branch + 1.5 load or store + 2.0 floating-point and vector;  1.4e9 cycles a second

Two for vectors: the Cortex-A53's units are 64 bits wide, and an operation on 128 bits takes them twice (LLVM,
llvm/lib/Target/AArch64/AArch64SchedA53.td). The others are chosen: its two instructions a cycle at best are taken to
make up for caches that miss and operands that are late. The intervals are that factor, not a spread of runs.

`--memory` counts no instructions, but the resident pages of the whole daemon while it listens to a quiet room: at
READY of a first start; then of a later one, for which this computer has rendered all words, at READY, when all is
prepared, and a minute later.
They are counted, not estimated, with a qemu that gives freed pages back, which 7.2
(Debian 12) does not, and 10.0 (Debian 13) does: `apt-get download qemu-user` there, `dpkg-deb -x`, and `--emulator`.
"""

from __future__ import annotations

import argparse
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from hvcpd.control.bench.bench import ROWS, Row
from release import arm64
from release.libraries import REPOSITORY, SHIPPED

CYCLES = np.array([1.0, 1.0, 1.5, 2.0])
CLOCK_HZ = 1.4e9
"""Of the BCM2837B0 on the 3B+."""
FACTOR = 2.0
X86 = "qemu-x86_64"
PLUGIN = Path(__file__).with_name("counting.c")
PATIENCE_S = 3_600.0
SETTLED_S = 60.0
"""In which the heap is trimmed."""

Counts = NDArray[np.float64]
"""Instructions by kind, as `CYCLES` has them; of x86-64 all are of the first."""


class Counted:
    """A computer under qemu: `command` makes a program's command line of its arguments and of options for qemu."""

    def __init__(
        self, command: Callable[[Sequence[str], Sequence[str]], list[str]], plugin: Path, env: Mapping[str, str]
    ) -> None:
        self._command, self._plugin, self._env = command, plugin, env
        self._folder = tempfile.TemporaryDirectory(prefix="hvcpd-pi-")

    def row(self, row: Row) -> Counts:
        """The cost of a row of the table; `row.times` is not applied."""
        before = np.zeros(len(CYCLES))
        if row.alone:
            self._counts(row.work, 0)  # renders what the cache lacks
            before = self._counts(row.work, 0)
        return self._counts(row.work, row.amount) - before

    def _counts(self, work: str, amount: int) -> Counts:
        with tempfile.NamedTemporaryFile("r") as out:
            program = ["-m", "hvcpd.control.bench.work", work, self._folder.name, str(amount)]
            command = self._command(program, ["-plugin", str(self._plugin), "-d", "plugin", "-D", out.name])
            subprocess.run(
                command, check=True, env=self._env, cwd=self._folder.name, stdout=subprocess.DEVNULL, timeout=PATIENCE_S
            )
            return np.array([float(count) for count in out.read().split()])


def print_memory(root: Path, emulator: str) -> None:
    """Print the resident memory of a first and a later start."""
    here = [sys.executable], {**os.environ, "PYTHONPATH": str(REPOSITORY), "OPENBLAS_NUM_THREADS": "1"}
    there = arm64.command(root, (), ("-R", hex(arm64.RESERVED)), emulator), dict(arm64.environment(root))
    there[1]["PYTHONPATH"] += f":{REPOSITORY}"  # for the quiet room; hvcpd is the package's
    with tempfile.TemporaryDirectory(prefix="hvcpd-pi-") as place:
        config = Path(place) / "hvcpd.yaml"
        (Path(place) / "state").mkdir()
        config.write_text(f"name: Rob\nstate_dir: {place}/state\nwheels: {{driver: none}}\n")
        with quiet_robot(*there, config) as robot:
            tell("first start, READY", robot)
        with quiet_robot(*here, config) as robot:
            await_prepared(robot)
        with quiet_robot(*there, config) as robot:
            tell("later start, READY", robot)
            await_prepared(robot)
            tell("all prepared", robot)
            time.sleep(SETTLED_S)
            tell(f"{SETTLED_S:g} s later", robot)


def tell(when: str, robot: subprocess.Popen[str]) -> None:
    """Print its resident memory."""
    text = f"resident, listening, {when}"
    print(f"{text:<48}{arm64.resident_mb(robot.pid):8.1f} MB", flush=True)


@contextmanager
def quiet_robot(python: Sequence[str], env: Mapping[str, str], config: Path) -> Iterator[subprocess.Popen[str]]:
    """A daemon in a quiet room, once it listens."""
    program = ["-m", "tests.daemon.quiet_robot", "--mode", "follow", "--config", str(config)]
    robot = subprocess.Popen([*python, *program], env=env, cwd=config.parent, stderr=subprocess.PIPE, text=True)
    try:
        await_line(robot, "listening")
        yield robot
    finally:
        robot.kill()
        robot.wait()


def await_prepared(robot: subprocess.Popen[str]) -> None:
    """Wait until it has made ready all that it can."""
    await_line(robot, "waveforms of the others' voices ready")


def await_line(robot: subprocess.Popen[str], text: str) -> None:
    """Read its log up to a line with this text. Raises EOFError if it ends before."""
    assert robot.stderr is not None
    if not any(text in line for line in robot.stderr):
        raise EOFError(f"it ended with status {robot.wait()} before {text!r}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--folder", type=Path, default=Path("out/arm64"), help="for the root of arm64")
    parser.add_argument("--without-shipped", action="store_true", help="leave out the words that come with the package")
    parser.add_argument("--memory", action="store_true", help="count the daemon's pages instead of instructions")
    parser.add_argument("--emulator", default=arm64.EMULATOR, help="for --memory; default: %(default)s")
    options = parser.parse_args()
    options.folder = options.folder.absolute()
    root = arm64.make_root(options.folder)
    arm64.put_hvcpd(root, options.folder)
    if options.without_shipped:
        shutil.rmtree(root / arm64.LIBRARIES / SHIPPED)
    if options.memory:
        print_memory(root, options.emulator)
        return
    plugin = options.folder / "counting.so"
    subprocess.run(["cc", "-O2", "-shared", "-fPIC", str(PLUGIN), "-o", str(plugin)], check=True)
    pi = Counted(lambda program, more: arm64.command(root, program, more), plugin, arm64.environment(root))
    here = {
        **arm64.environment(root),
        "PYTHONPATH": str(REPOSITORY),
    }  # this working copy, which renders all words itself
    x86 = Counted(lambda program, more: [X86, *more, sys.executable, *program], plugin, here)
    print(f"{'instructions / 1e9':<48}{'x86-64':>8}{'arm64':>8}   Pi 3B+, estimated within a factor of {FACTOR:g}")
    for row in ROWS:
        theirs, ours = x86.row(row).sum(), pi.row(row)
        value = float(ours @ CYCLES) / CLOCK_HZ * row.times
        span = f"{value:.2g} {row.unit} ({value / FACTOR:.2g} to {value * FACTOR:.2g})"
        print(f"{row.text:<48}{theirs / 1e9:8.2f}{ours.sum() / 1e9:8.2f}   {span}", flush=True)


if __name__ == "__main__":
    main()
