"""`hvcpctl task`: have a task done again, or left out this time, while the robots work."""

from __future__ import annotations

import argparse
import json
import sys
from contextlib import closing

from hvcpd.control.live.daemon_client import find_daemon
from hvcpd.errors import EX_OK

BECOMES = {"again": "is done once more", "skip": "is left out this time"}
"""What a task does then, as it is told."""


def run(options: argparse.Namespace) -> int:
    """Tell the robot, which tells the others."""
    with closing(find_daemon(options)) as daemon:
        result = daemon.ask("task", do=options.do, number=options.number)
        told = f"task {options.number}, {result['name']}, {BECOMES[options.do]}: {daemon.name} tells the others"
        sys.stdout.write((json.dumps({"robot": daemon.name, **result}) if options.json else told) + "\n")
    return EX_OK
