"""A pump and its tank on fake pins, as a process beside `hvcpctl skills`.

    python -m hil_fakes.pump --pins /tmp/pins --pump 17 --float 27 --litres 0.5

It turns while its pin is high, and closes the float's switch to ground once the tank is empty.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

from hil_fakes.pin_files import drive, is_on
from hil_fakes.skills import Pump, Tank

STEP_S = 0.01


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the pump by the wall clock until Ctrl-C; it reports each time that it turned."""
    parser = argparse.ArgumentParser(
        prog="python -m hil_fakes.pump", description="A fake pump and its tank, on fake pins, until Ctrl-C."
    )
    parser.add_argument("--pins", type=Path, required=True, metavar="FOLDER")
    parser.add_argument("--pump", type=int, default=17, metavar="PIN")
    parser.add_argument("--float", type=int, default=None, metavar="PIN", dest="float_pin")
    parser.add_argument("--litres", type=float, default=1.0, help="in the tank")
    options = parser.parse_args(arguments)
    with suppress(KeyboardInterrupt):
        _run(Pump(Tank(options.litres)), options)
    return 0


def _run(pump: Pump, options: argparse.Namespace) -> None:
    if options.float_pin is not None:
        drive(options.pins, options.float_pin, True)
    last_s, was_on = time.monotonic(), False
    while True:
        time.sleep(STEP_S)
        now_s, on = time.monotonic(), is_on(options.pins, options.pump)
        if was_on:
            pump.run(now_s - last_s)
        if on != was_on:
            sys.stdout.write(
                f"pump {'on' if on else 'off'}, {pump.poured:.3f} l poured, {pump.tank.litres:.3f} l left\n"
            )
            sys.stdout.flush()
        if options.float_pin is not None and pump.tank.is_empty:
            drive(options.pins, options.float_pin, False)
        last_s, was_on = now_s, on


if __name__ == "__main__":
    sys.exit(main())
