"""The command line of `playground`; light, since every command builds the whole parser."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path
from typing import TypeAlias

Commands: TypeAlias = "argparse._SubParsersAction[argparse.ArgumentParser]"
Run = Callable[[argparse.Namespace], int]
DEFAULT = Path("playground.html")


def add_playground(commands: Commands, run: Run, names: Callable[[str], tuple[str, ...]]) -> None:
    """Add `playground`."""
    text = "write a page in which robots say what you type, for any browser"
    c = commands.add_parser("playground", help=text, description=f"{text[0].upper()}{text[1:]}, offline.")
    c.add_argument("--config", type=Path, metavar="FILE", help="settings file (default: /etc/hvcpd/hvcpd.yaml)")
    c.add_argument("--tasks", type=Path, metavar="FILE", help="task repository (default: five plants)")
    c.add_argument("--robots", type=names, default=("Rob", "Bot", "Mia"), metavar="Rob,Bot", help="who speaks (2 to 4)")
    where = "where to write it (default: %(default)s)"
    c.add_argument("-o", "--output", type=Path, default=DEFAULT, metavar="FILE.html", help=where)
    c.set_defaults(run=run)
