"""The command lines of `hvcpctl key` and `audit`; light, since every command builds the whole parser."""

from __future__ import annotations

from pathlib import Path

from hvcpd.control.arguments import Commands, add_command, add_config, add_memory, add_tasks, robot_name, whole

MAX_CODES = 500
"""Codes on a sheet; more are never used up."""


def add_key_commands(commands: Commands) -> None:
    """Add `key` with its actions, and `audit`."""
    text = "make, print, change or revoke the team's key for sealed speech"
    key = add_command(commands, "key", text, "keys.key", "hvcpctl key new", "hvcpctl key sheet")
    actions = key.add_subparsers(title="actions", metavar="ACTION", required=True, dest="action")
    helps = {
        "new": "make the team's key",
        "show": "list the valid keys, without showing them",
        "sheet": "print the key in words, and one-time codes for people",
        "rotate": "make a new key; the old one stays valid for a while",
        "revoke": "stop believing one robot",
        "restore": "make the key file again from the words of the sheet",
    }
    parsers = {}
    for name, text in helps.items():
        example = f"hvcpctl key {name}{' Anna' if name == 'revoke' else ''}"
        parser = parsers[name] = add_command(actions, name, text, "keys.key", example)
        parser.add_argument("--key", type=Path, metavar="FILE", help="the key file (default: the settings')")
        add_config(parser)
    rotate, sheet = parsers["rotate"], parsers["sheet"]
    days, codes, first = whole(0, 3650, "number of days"), whole(0, MAX_CODES), whole(1, 100_000)
    rotate.add_argument(
        "--after", type=days, default=7, metavar="DAYS", help="days until robots speak with the new key (7)"
    )
    rotate.add_argument(
        "--keep", type=days, default=30, metavar="DAYS", help="days after that in which the old key is valid (30)"
    )
    sheet.add_argument("--codes", type=codes, default=60, metavar="N", help="number of one-time codes (60)")
    sheet.add_argument("--first", type=first, default=1, metavar="N", help="number of the first code (1)")
    sheet.add_argument(
        "--no-recovery", action="store_true", help="leave out the key, for people who only give commands"
    )
    sheet.add_argument(
        "-o", "--output", type=Path, metavar="FILE", help="write it to this file, which only you can read"
    )
    parsers["revoke"].add_argument("name", type=robot_name, metavar="NAME", help="the robot")
    text = "count who ordered whom, what was refused, and how the tasks were shared"
    audit = add_command(commands, "audit", text, "keys.audit", "hvcpctl audit --since 8h")
    add_memory(audit)
    add_tasks(audit)
