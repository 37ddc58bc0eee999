"""The command line of `hvcpctl new-team`."""

from __future__ import annotations

from pathlib import Path

from hvcpd.config.command_line import with_examples
from hvcpd.control.arguments import Commands, Run, robot_names


def add_new_team(commands: Commands, run: Run) -> None:
    """Add `new-team`."""
    command = commands.add_parser(
        "new-team",
        help="write the settings and tasks of your own team, and try it",
        epilog=with_examples(
            "Without options it asks, on a terminal. All words are checked before anything is written.",
            "hvcpctl new-team garden",
            "hvcpctl new-team garden --robots Rob,Bot --skill 'pour litres' \\\n"
            "    --task 'water the green rose; -3, -4; pour 0.2' --task 'count the empty chairs' --demo",
        ),
    )
    command.add_argument("folder", type=Path, metavar="FOLDER", help="where hvcpd.yaml and tasks.yaml are written")
    command.add_argument("--robots", type=robot_names, metavar="Rob,Bot", help="the robots' names")
    skill = "a skill besides driving, and its number, if any; may be repeated"
    command.add_argument("--skill", action="append", metavar="'NAME [NUMBER]'", help=skill)
    task = "a task's name, its place in metres, and what to do there (default: wait 5); may be repeated"
    command.add_argument("--task", action="append", metavar="'NAME; X, Y; DO'", help=task)
    demo = command.add_mutually_exclusive_group()
    demo.add_argument("--demo", dest="demo", action="store_true", default=None, help="simulate the team at once")
    demo.add_argument("--no-demo", dest="demo", action="store_false", help="do not ask whether to")
    command.set_defaults(run=run)
