"""The command line of `playground`; light, since every command builds the whole parser."""

from __future__ import annotations

from pathlib import Path

from hvcpd.control.arguments import Commands, Run, add_config, add_tasks, robot_names

DEFAULT = Path("playground.html")


def add_playground(commands: Commands, run: Run) -> None:
    """Add `playground`."""
    text = "write a page in which robots say what you type, for any browser"
    c = commands.add_parser("playground", help=text, description=f"{text[0].upper()}{text[1:]}, offline.")
    add_config(c)
    add_tasks(c)
    who, usual = "who speaks (2 to 4)", ("Rob", "Bot", "Mia")
    c.add_argument("--robots", type=robot_names, default=usual, metavar="Rob,Bot", help=who)
    where = "where to write it (default: %(default)s)"
    c.add_argument("-o", "--output", type=Path, default=DEFAULT, metavar="FILE.html", help=where)
    c.set_defaults(run=run)
