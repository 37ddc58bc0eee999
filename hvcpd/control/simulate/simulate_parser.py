"""The command line of `hvcpctl simulate`."""

from __future__ import annotations

import argparse
from pathlib import Path

from hvcpd.control.arguments import Commands, Run, add_config, add_tasks, between, lack, robot_names, seed


def add_simulate(commands: Commands, run: Run) -> None:
    """Add `simulate`."""
    c = commands.add_parser("simulate", help="run a mission of whole robots in a simulated room, out loud")
    add_config(c)
    add_tasks(c)
    who = "who takes part, up to 12 (default: the settings' `names`)"
    c.add_argument("--robots", type=robot_names, metavar="Rob,Bot", help=who)
    c.add_argument("--seed", type=seed, default=1, metavar="N", help="same seed, same mission (default 1)")
    c.add_argument(
        "--mode",
        choices=("volunteer", "coordinate"),
        default="volunteer",
        help="every robot picks tasks, or one gives orders",
    )
    c.add_argument("--coordinator", metavar="NAME", help="who gives the orders in coordinate mode (default: the last)")
    pick = "how a volunteer picks a task (default: the settings')"
    c.add_argument("--pick", choices=("nearest", "random"), help=pick)
    talk = "how much the robots say (default: the settings')"
    c.add_argument("--talk", choices=("full", "normal", "terse"), help=talk)
    hours = "simulate N hours of tasks that recur, in words without sound, and report on the shift"
    c.add_argument("--hours", type=between(0.1, 24.0 * 31), metavar="N", help=hours)
    lost = "with --hours: the share of sentences that each listener does not understand (default 0)"
    c.add_argument("--loss", type=between(0.0, 0.9), default=0.0, metavar="SHARE", help=lost)
    c.add_argument("--speed", choices=("max", "real"), default="max", help="as fast as the processor can, or real time")
    c.add_argument("--play", action="store_true", help="play the mission as heard in the room (implies --speed real)")
    c.add_argument(
        "--noise-db",
        type=between(-200.0, 200.0, "dB"),
        default=40.0,
        metavar="DB",
        help="ambient noise in dB SPL (default 40, a quiet room)",
    )
    c.add_argument(
        "--room",
        choices=("open", "furnished"),
        default="furnished",
        help="furnished: small loudspeakers and echoes (default); open: free air, ideal loudspeakers",
    )
    _add_robots_options(c)
    c.add_argument("--mute", action="store_true", help="let no sound pass: then nothing is coordinated")
    c.add_argument("--allow-confusable", action="store_true", help="also use words that robots may confuse")
    c.add_argument("--report", type=Path, metavar="DIR", help="write report.html, mission.wav, transcript.jsonl")
    c.add_argument("--json", action="store_true", help="print one JSON object a line, the summary last")
    c.set_defaults(run=run)


def _add_robots_options(c: argparse.ArgumentParser) -> None:
    """What the robots know and have, and how they speak."""
    c.add_argument("--strangers", action="store_true", help="robots do not know each other's names, and spell them")
    c.add_argument("--slow", action="store_true", help="speak slowly, as for long distances")
    c.add_argument(
        "--repeat", type=int, choices=(1, 2), help="how many times in a row to say each sentence (default 1)"
    )
    key = "seal what the robots say; without FILE, with a new key"
    c.add_argument("--key", type=Path, nargs="?", const=Path(), metavar="FILE", help=key)
    c.add_argument("--encrypted", action="store_true", help="with --key: encrypt, in code words")
    tank = "give each robot a pump and this much water"
    c.add_argument("--tank", type=between(0.0, 1000.0), metavar="LITRES", help=tank)
    c.add_argument(
        "--without",
        type=lack,
        action="append",
        default=[],
        metavar="ROBOT=SKILL",
        help="take a skill of the task file from a robot; may be repeated",
    )
