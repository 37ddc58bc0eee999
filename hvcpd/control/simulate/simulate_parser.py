"""The command lines of `hvcpctl simulate`, `new-team` and `evaluate`; light, since every command builds the whole
parser."""

from __future__ import annotations

import argparse
from pathlib import Path

from hvcpd.control.arguments import (
    Commands,
    add_command,
    add_config,
    add_json,
    add_key_file,
    add_tasks,
    between,
    lack,
    robot_names,
    seed,
    tank,
    whole,
)

FOR_SOUND: dict[str, object] = {
    "play": False,
    "speed": "max",
    "noise_db": 40.0,
    "room": "furnished",
    "mute": False,
    "key": None,
    "encrypted": False,
    "strangers": False,
    "tank": None,
}
"""Options that need sound, and what they are if they are not given."""


def add_simulate_commands(commands: Commands) -> None:
    """Add `simulate`, `new-team` and `evaluate`."""
    _add_simulate(commands)
    _add_new_team(commands)
    _add_evaluate(commands)


def _add_simulate(commands: Commands) -> None:
    c = add_command(
        commands,
        "simulate",
        "run a mission of whole robots in a simulated room, out loud",
        "simulate.simulate",
        "hvcpctl simulate --seed 2 --robots Rob,Bot,Ada",
        "hvcpctl simulate --noise-db 60 --report out/noisy",
    )
    add_config(c)
    add_tasks(c)
    who = "the robots' names, up to 12 (default: the settings' `names`)"
    c.add_argument("--robots", type=robot_names, metavar="Rob,Bot", help=who)
    c.add_argument("--seed", type=seed, default=1, metavar="N", help="same seed, same mission (default 1)")
    c.add_argument(
        "--mode",
        choices=("volunteer", "coordinate"),
        help="every robot picks tasks, or one gives orders (default: the settings')",
    )
    orders = "who gives the orders in coordinate mode (default: as the settings say, or else the last)"
    c.add_argument("--coordinator", metavar="NAME", help=orders)
    pick = "how a volunteer picks a task (default: the settings')"
    c.add_argument("--pick", choices=("nearest", "random"), help=pick)
    talk = "how much the robots say (default: the settings')"
    c.add_argument("--talk", choices=("full", "normal", "terse"), help=talk)
    hours = "simulate N hours of tasks that recur, in words without sound, and report on the shift"
    c.add_argument("--hours", type=between(0.1, 24.0 * 31), metavar="N", help=hours)
    lost = "with --hours: the share of sentences that each listener does not understand (default 0)"
    c.add_argument("--loss", type=between(0.0, 0.9), default=0.0, metavar="SHARE", help=lost)
    speed = "as fast as the processor can, or real time"
    c.add_argument("--speed", choices=("max", "real"), default=FOR_SOUND["speed"], help=speed)
    c.add_argument("--play", action="store_true", help="play the mission as heard in the room (implies --speed real)")
    c.add_argument(
        "--noise-db",
        type=between(-200.0, 200.0, "dB"),
        default=FOR_SOUND["noise_db"],
        metavar="DB",
        help="ambient noise in dB SPL (default 40, a quiet room)",
    )
    c.add_argument(
        "--room",
        choices=("open", "furnished"),
        default=FOR_SOUND["room"],
        help="furnished: small loudspeakers and echoes (default); open: free air, ideal loudspeakers",
    )
    _add_robots_options(c)
    c.add_argument("--mute", action="store_true", help="let no sound pass: then nothing is coordinated")
    c.add_argument("--allow-confusable", action="store_true", help="also use words that robots may confuse")
    c.add_argument("--report", type=Path, metavar="DIR", help="write report.html, mission.wav, transcript.jsonl")
    add_json(c, "print one JSON object a line, the summary last")


def _add_robots_options(c: argparse.ArgumentParser) -> None:
    """What the robots know and have, and how they speak."""
    c.add_argument("--strangers", action="store_true", help="robots do not know each other's names, and spell them")
    c.add_argument("--slow", action="store_true", help="speak slowly, as for long distances")
    c.add_argument(
        "--repeat", type=int, choices=(1, 2), help="how many times in a row to say each sentence (default 1)"
    )
    add_key_file(c, "seal what the robots say; without FILE, with a new key")
    c.add_argument("--encrypted", action="store_true", help="with --key: encrypt, in code words")
    water = "give each robot a pump and this much water; with ROBOT= only that robot, and others no limit"
    c.add_argument("--tank", type=tank, metavar="[ROBOT=]LITRES", help=water)
    c.add_argument(
        "--without",
        type=lack,
        action="append",
        default=[],
        metavar="ROBOT=SKILL",
        help="take a skill of the task file from a robot; may be repeated",
    )


def _add_new_team(commands: Commands) -> None:
    command = add_command(
        commands,
        "new-team",
        "write the settings and tasks of your own team, and try it",
        "simulate.new_team",
        "hvcpctl new-team garden",
        "hvcpctl new-team garden --robots Rob,Bot --skill 'pour litres' \\\n"
        "    --task 'water the green rose; -3, -4; pour 0.2' --task 'count the empty chairs' --demo",
        epilog="Without options it asks, on a terminal. All words are checked before anything is written.",
    )
    command.add_argument("folder", type=Path, metavar="FOLDER", help="where hvcpd.yaml and tasks.yaml are written")
    command.add_argument("--robots", type=robot_names, metavar="Rob,Bot", help="the robots' names")
    skill = "a skill besides driving, and what its number is called, if it takes one; may be repeated"
    command.add_argument("--skill", action="append", metavar="'NAME [UNIT]'", help=skill)
    task = "a task's name, its place in metres, and what to do there (default: wait 5); may be repeated"
    command.add_argument("--task", action="append", metavar="'NAME; X, Y; DO'", help=task)
    demo = command.add_mutually_exclusive_group()
    demo.add_argument("--demo", dest="demo", action="store_true", default=None, help="simulate the team at once")
    demo.add_argument("--no-demo", dest="demo", action="store_false", help="do not ask whether to")


def _add_evaluate(commands: Commands) -> None:
    from hvcpd.evaluation.experiments import NAMES

    count = whole(1, 100_000)
    c = add_command(
        commands,
        "evaluate",
        "run the paper's experiments in a simulated room",
        "simulate.evaluate",
        "hvcpctl evaluate wake",
        epilog="Results are kept in --out: the same command continues where it was interrupted.",
    )
    one_of = f"one of {', '.join(NAMES)}, or all"
    c.add_argument("experiment", choices=(*NAMES, "all"), metavar="EXPERIMENT", help=one_of)
    c.add_argument("--jobs", type=count, metavar="N", help="processes (default: one for each core)")
    c.add_argument("--scheduler", metavar="ADDRESS", help="dask cluster to run on, such as tcp://10.0.0.1:8786")
    c.add_argument("--seed", type=seed, default=1, metavar="N", help="same seed, same results (default 1)")
    each = "trials at each step (default 20, as in the paper)"
    c.add_argument("--trials", type=count, default=20, metavar="N", help=each)
    whole_robots = "missions of whole robots at each step (default: as trials, 1 with --quick)"
    c.add_argument("--missions", type=count, metavar="N", help=whole_robots)
    c.add_argument("--out", type=Path, default=Path("out/evaluation"), metavar="DIR", help="(default out/evaluation)")
    recordings = "with wake: recordings of real robots (docs/experiment.md) instead of a simulation"
    c.add_argument("--from-recordings", type=Path, metavar="DIR", help=recordings)
    c.add_argument("--quick", action="store_true", help="fewer steps: rough results within minutes")
