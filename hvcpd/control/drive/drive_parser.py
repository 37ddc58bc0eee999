"""The command line of `hvcpctl drive`; light, since every command builds the whole parser."""

from __future__ import annotations

import argparse

from hvcpd.control.arguments import Commands, add_command, add_config, add_json, between

MAX_DISTANCE_M = 10.0
"""A class room's length; every motion has an end."""
MAX_TURN_DEG = 3600.0
MAX_COORDINATE_M = 50.0
"""Largest coordinate that is accepted, as in task files."""

_EPILOG = (
    "The place and heading of the robot at the start of the command are (0, 0), x ahead, y to the left. "
    "Exit status: 0 there, 1 the motion failed, 2 bad input or no wheels; 130 interrupted. The wheels stand still at "
    "the end in every case."
)
_OPTIONS = "Every action takes --port, --driver, --dry-run (needs no robot) and --json. "


def add_drive(commands: Commands) -> None:
    """Add `drive` and its actions."""
    drive = add_command(
        commands,
        "drive",
        "move one robot by hand, without the daemon",
        "drive.drive",
        "hvcpctl drive status",
        "hvcpctl drive forward 0.2 --dry-run",
        epilog=_OPTIONS + _EPILOG,
    )
    actions = drive.add_subparsers(title="actions", metavar="ACTION", required=True, dest="action")
    metres = between(-MAX_DISTANCE_M, MAX_DISTANCE_M, "m")
    degrees = between(-MAX_TURN_DEG, MAX_TURN_DEG, "degrees")
    place = between(-MAX_COORDINATE_M, MAX_COORDINATE_M, "m")
    _add(actions, "status", "voltage, temperature, errors, odometry", "status --json")
    straight = "drive straight ahead; a negative distance is backward"
    _add(actions, "forward", straight, "forward 0.2", "forward -0.2").add_argument(
        "metres", type=metres, metavar="M", help=f"metres, -{MAX_DISTANCE_M:g} to {MAX_DISTANCE_M:g}"
    )
    _add(actions, "turn", "turn on the spot; positive is to the left", "turn 90").add_argument(
        "degrees", type=degrees, metavar="DEG", help=f"degrees, -{MAX_TURN_DEG:g} to {MAX_TURN_DEG:g}"
    )
    goto = _add(actions, "goto", "go to a place, or to several in turn", "goto 1 0.5 --back")
    goto.add_argument("places", type=place, nargs="+", metavar="X Y", help="metres: x ahead, y to the left")
    goto.add_argument("--back", action="store_true", help="then go back to the start and its heading")
    _add(actions, "stop", "stop the wheels and switch them off", "stop")
    _add(actions, "calibrate", "measure the wheels' dimensions, with a tape measure", "calibrate")


def add_port(parser: argparse.ArgumentParser) -> None:
    """Options for wheels other than those of the settings."""
    parser.add_argument("--port", metavar="PORT", help="serial port (default: as in the settings)")
    parser.add_argument(
        "--driver", choices=("auto", "opencr", "dynamixel"), help="kind of wheels (default: as in the settings)"
    )


def _add(actions: Commands, name: str, text: str, *examples: str) -> argparse.ArgumentParser:
    lines = (f"hvcpctl drive {example}" for example in examples)
    parser = add_command(actions, name, text, "drive.drive", *lines, epilog=_EPILOG)
    add_config(parser)
    add_port(parser)
    parser.add_argument("--dry-run", action="store_true", help="say what would happen; needs no robot")
    add_json(parser)
    return parser
