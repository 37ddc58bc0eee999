"""The cost of a robot's work on a Raspberry Pi 3B+, estimated by counting instructions; the rows of `hvcpctl bench`.

    python -m benchmarks.pi [--folder out/arm64] [--without-shipped] [--memory]

hvcpd's arm64 package runs under qemu-user with a plugin that counts (benchmarks/counting.c, built with cc), and this
working copy likewise on x86-64. An ESTIMATE, within a factor of two, until `hvcpctl bench` has run on a Pi:

    cycles = 1.0 integer + 1.0 branch + 1.5 load or store + 2.0 floating-point and vector;  1.4e9 cycles a second

Two for vectors: the Cortex-A53's units are 64 bits wide, and an operation on 128 bits takes them twice (LLVM,
llvm/lib/Target/AArch64/AArch64SchedA53.td). The others are chosen: its two instructions a cycle at best are taken to
make up for caches that miss and operands that are late. The intervals are that factor, not a spread of runs.

`--memory` counts no instructions, but the resident pages of the whole daemon while it listens to a quiet room: at
READY, and later, while it makes ready what noise may hide; and at READY of a later start. They are counted, not
estimated; where the program has freed memory, too many, for qemu-user keeps the pages.
"""

from __future__ import annotations

import argparse
import shutil
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import closing
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
SETTLED_S = (0.0, 60.0, 120.0)
"""After READY, each after the one before."""

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


def print_memory(root: Path) -> None:
    """Start the daemon twice, and print its resident memory while it listens."""
    with tempfile.TemporaryDirectory(prefix="hvcpd-pi-") as place:
        folder = Path(place)
        (folder / "state").mkdir()
        config = folder / "hvcpd.yaml"
        config.write_text(f"name: Rob\nstate_dir: {folder / 'state'}\nwheels: {{driver: none}}\n")
        with closing(socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)) as notified:
            notified.bind(str(folder / "notify"))
            notified.settimeout(PATIENCE_S)
            print_start(root, config, notified, "first start", SETTLED_S)
            print_start(root, config, notified, "later start", (0.0,))


def print_start(root: Path, config: Path, notified: socket.socket, which: str, settled_s: Sequence[float]) -> None:
    """Start the daemon, and print its resident memory at READY and later."""
    environment = {**arm64.environment(root), "NOTIFY_SOCKET": str(config.with_name("notify"))}
    environment["PYTHONPATH"] += f":{REPOSITORY}"  # for the quiet room; hvcpd is the package's
    program = ["-m", "tests.daemon.quiet_robot", "--mode", "follow", "--config", str(config)]
    robot = subprocess.Popen(arm64.command(root, program), env=environment, cwd=root)
    try:
        while b"READY=1" not in notified.recv(65_536):
            pass
        for after_s in settled_s:
            time.sleep(after_s)
            text = f"resident, listening, {which}, {after_s:g} s later"
            print(f"{text:<48}{arm64.resident_mb(robot.pid):8.1f} MB", flush=True)
    finally:
        robot.kill()
        robot.wait()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--folder", type=Path, default=Path("out/arm64"), help="for the root of arm64")
    parser.add_argument("--without-shipped", action="store_true", help="leave out the words that come with the package")
    parser.add_argument("--memory", action="store_true", help="count the daemon's pages instead of instructions")
    options = parser.parse_args()
    options.folder = options.folder.absolute()
    root = arm64.make_root(options.folder)
    arm64.put_hvcpd(root, options.folder)
    if options.without_shipped:
        shutil.rmtree(root / arm64.LIBRARIES / SHIPPED)
    if options.memory:
        print_memory(root)
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
