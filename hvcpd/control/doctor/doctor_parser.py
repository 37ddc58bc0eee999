"""The command lines of `hvcpctl doctor`, `calibrate` and `stop-test`; light, since every command builds all parsers."""

from __future__ import annotations

import argparse

from hvcpd.control.arguments import Commands, add_command, add_config, add_json, add_tasks, between, whole
from hvcpd.control.drive.drive_parser import add_port

OWN_DISTANCE_M = 0.1
"""From the loudspeaker to the microphone of a small robot."""
MOST_TIMES = 50
"""Five loudnesses of fifty calls take half an hour."""


def add_doctor_commands(commands: Commands) -> None:
    """Add `doctor`, `calibrate` and `stop-test`."""
    doctor = add_command(
        commands,
        "doctor",
        "say what is wrong with this robot, and how to fix it",
        "doctor.doctor",
        "hvcpctl doctor",
        epilog="The robot says 'I am free' aloud, listens to itself, times the recogniser and asks the motors; nothing "
        "moves. Stop hvcpd first: only one program can use the card and the port. Exit status: 0 if nothing is wrong, "
        "otherwise 1.",
    )
    _add_shared(doctor)
    add_port(doctor)
    doctor.add_argument("--only", choices=("machine", "sound", "wheels"), help="check only this part")
    doctor.add_argument("--silent", action="store_true", help="say nothing aloud: no loopback test")
    calibrate = add_command(
        commands,
        "calibrate",
        "set the microphone's gain, and predict how far away a peer will be heard",
        "doctor.calibrate",
        "hvcpctl calibrate",
        epilog="The robot says 'I am free' up to five times and listens to itself. The room should be as loud as in "
        "use. Exit status: 0 if the robot understood itself, 1 if not, 2 without sound.",
    )
    _add_shared(calibrate)
    calibrate.add_argument("--keep-gain", action="store_true", help="only measure; leave the mixer alone")
    calibrate.add_argument("--dry-run", action="store_true", help="do not save the result")
    far, metres = f"from loudspeaker to microphone, metres (default {OWN_DISTANCE_M:g})", between(0.01, 2.0, "m")
    calibrate.add_argument("--distance", type=metres, default=OWN_DISTANCE_M, metavar="M", help=far)
    test = add_command(
        commands,
        "stop-test",
        "test in your own room which calls of stop are heard, and how soon",
        "doctor.stop_test",
        "hvcpctl stop-test",
        epilog="Plays calls at several loudnesses through a second loudspeaker that stands where people will "
        "(--output), or asks you to call (--ask), and listens with this robot's microphone. Nothing moves. Stop hvcpd "
        "first: only one program can use the card. The test shows what was heard here and now; a voice is not a safety "
        "device. Exit status: 0 if every call was heard within half a second, 1 if not, 2 without sound.",
    )
    _add_shared(test)
    how = test.add_mutually_exclusive_group()
    how.add_argument("--ask", action="store_true", help="ask somebody to call, instead of playing")
    second = "a part of the second loudspeaker's name (default: the settings')"
    how.add_argument("--output", metavar="NAME", help=second)
    times = "calls at each loudness (default 3)"
    test.add_argument("--times", type=whole(1, MOST_TIMES), default=3, metavar="N", help=times)


def _add_shared(parser: argparse.ArgumentParser) -> None:
    add_config(parser)
    add_tasks(parser)
    add_json(parser)
