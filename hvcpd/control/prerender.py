"""`hvcpctl prerender`: make every word of the phrasebook in robots' voices beforehand, with a progress bar."""

from __future__ import annotations

import argparse
import json
import sys

from rich.console import Console
from rich.progress import track

from hvcpd.control.team import load_team
from hvcpd.daemon.rehearsal import rehearse


def run(options: argparse.Namespace) -> int:
    """Fill the cache of this user; what is there already is not made again."""
    team = load_team(options, options.names or ())
    words = sorted(team.phrasebook.graph.words)
    console = Console(stderr=True)
    for name in team.names:
        rehearse(name, track(words, description=f"{name}'s voice", console=console), team.sound)
    if options.json:
        sys.stdout.write(json.dumps({"words": len(words), "names": team.names}) + "\n")
    else:
        sys.stdout.write(f"{len(words)} words in the voices of {', '.join(team.names)} are ready\n")
    return 0
