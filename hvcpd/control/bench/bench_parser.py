"""The command line of `hvcpctl bench`."""

from __future__ import annotations

from hvcpd.control.arguments import Commands, add_command, add_json


def add_bench(commands: Commands) -> None:
    """Add `bench`."""
    bench = add_command(
        commands,
        "bench",
        "time a robot's work on this computer, and say whether it keeps up with real time",
        "bench.bench",
        "hvcpctl bench",
        epilog="It takes a minute or two on a Raspberry Pi and uses one core; no device is opened. Exit status: 0 if "
        "speech is decoded as fast as it comes, else 1.",
    )
    add_json(bench)
