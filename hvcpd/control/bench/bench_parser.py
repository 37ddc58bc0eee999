"""The command line of `hvcpctl bench`."""

from __future__ import annotations

from hvcpd.control.arguments import Commands, Run


def add_bench(commands: Commands, run: Run) -> None:
    """Add `bench`."""
    bench = commands.add_parser(
        "bench",
        help="time a robot's work on this computer, and say whether it keeps up with real time",
        epilog="It takes a minute or two on a Raspberry Pi and uses one core; no device is opened. Exit status: 0 if "
        "speech is decoded as fast as it comes, else 1.",
    )
    bench.add_argument("--json", action="store_true", help="print one JSON object a line")
    bench.set_defaults(run=run)
