"""A fake robot's wheels on a serial port, in real time, for programs in other processes.

python -m hil_fakes.dynamixel dynamixel      # or opencr; prints the port to open, runs until Ctrl-C
"""

from __future__ import annotations

import argparse
import signal
import sys
from collections.abc import Sequence

from hil_fakes.dynamixel.bus import FakeBus
from hil_fakes.dynamixel.motor import FakeMotor, turtlebot3_pair
from hil_fakes.dynamixel.opencr import FakeOpenCR
from hil_fakes.dynamixel.pump import RealTimePump


def main(arguments: Sequence[str] | None = None) -> int:
    """Serve until SIGINT or SIGTERM; the first line of the output is the port."""
    parser = argparse.ArgumentParser(
        prog="python -m hil_fakes.dynamixel", description="Fake wheels on a serial port, until Ctrl-C."
    )
    parser.add_argument("kind", choices=("dynamixel", "opencr"), help="motors by themselves, or behind a controller")
    parser.add_argument("--seed", type=int, default=1, metavar="N", help="of encoder noise and faults (default 1)")
    options = parser.parse_args(arguments)
    signals = {signal.SIGINT, signal.SIGTERM}
    signal.pthread_sigmask(signal.SIG_BLOCK, signals)  # before any thread starts, so that none of them takes one
    devices: Sequence[FakeMotor | FakeOpenCR] = [FakeOpenCR()] if options.kind == "opencr" else turtlebot3_pair()
    with FakeBus(devices, seed=options.seed) as bus, RealTimePump(bus.advance):
        sys.stdout.write(f"{bus.path}\n")
        sys.stdout.flush()
        signal.sigwait(signals)
    return 0


if __name__ == "__main__":
    sys.exit(main())
