"""What the command lines have in common: how a command is added, options of several commands, and options' types.

A type turns a text into a value, or into an error that says what is wrong.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import TypeAlias

from hvcpd.config.command_line import with_examples
from hvcpd.errors import EX_OK

Commands: TypeAlias = "argparse._SubParsersAction[argparse.ArgumentParser]"


def add_command(
    commands: Commands, name: str, text: str, run: str, *examples: str, description: str = "", epilog: str = ""
) -> argparse.ArgumentParser:
    """Add a command, or an action of one, and return its parser.

    `text` lists it, and is its description if there is no other; the help ends with the epilog and the examples. `run`
    is the module of `hvcpd.control` with the command's function `run`, imported when it is needed, so that every
    command starts quickly; it returns nothing, or the exit status.
    """
    description = description or f"{text[0].upper()}{text[1:]}."
    epilog = with_examples(epilog, *examples) if examples else epilog
    command = commands.add_parser(name, help=text, description=description, epilog=epilog or None)

    def run_module(options: argparse.Namespace) -> int:
        status: int | None = import_module(f"hvcpd.control.{run}").run(options)
        return status or EX_OK

    command.set_defaults(run=run_module)
    return command


def add_config(command: argparse.ArgumentParser) -> None:
    """Add --config."""
    command.add_argument("--config", type=Path, metavar="FILE", help="settings file (default: /etc/hvcpd/hvcpd.yaml)")


def add_tasks(command: argparse.ArgumentParser) -> None:
    """Add --tasks."""
    command.add_argument("--tasks", type=Path, metavar="FILE", help="task file (default: five plants)")


def add_team(command: argparse.ArgumentParser) -> None:
    """Add --config, --tasks and --names."""
    add_config(command)
    add_tasks(command)
    command.add_argument("--names", type=robot_names, metavar="Rob,Bot", help="the names that the robots know")


def add_json(command: argparse.ArgumentParser, text: str = "print one JSON object a line") -> None:
    """Add --json."""
    command.add_argument("--json", action="store_true", help=text)


def add_memory(command: argparse.ArgumentParser, since: str | None = None) -> None:
    """Add --config, --name, --memory, --socket, --since and --json, for what reads a robot's memory."""
    add_config(command)
    whose = "the robot whose memory to read (default: from the settings)"
    command.add_argument("--name", type=robot_name, metavar="NAME", help=whose)
    command.add_argument("--memory", type=Path, metavar="FILE", help="this memory file, in any folder")
    command.add_argument("--socket", type=Path, metavar="FILE", help="the memory of the robot with this control socket")
    text = "start this long ago (30m, 8h, 2d) or at this time (2026-11-21T08:00; default: {})"
    command.add_argument("--since", metavar="WHEN", default=since, help=text.format(since or "at the first sentence"))
    add_json(command)


def add_key_file(command: argparse.ArgumentParser, text: str) -> None:
    """Add --key, with or without a file."""
    command.add_argument("--key", type=Path, nargs="?", const=Path(), metavar="FILE", help=text)


def add_sound_out(command: argparse.ArgumentParser, text: str) -> None:
    """Add -o for a WAV file."""
    command.add_argument("-o", "--output", type=sound_out, metavar="FILE.wav", help=text)


def robot_names(text: str) -> tuple[str, ...]:
    """Robots' names, separated by commas."""
    from hvcpd.config.names import valid_robot_names

    names = tuple(part.strip() for part in text.split(",") if part.strip())
    wrong = valid_robot_names(names)
    if not names or wrong:
        raise argparse.ArgumentTypeError(wrong or "give at least one name, as in: Rob,Bot")
    return names


def robot_name(text: str) -> str:
    """One robot's name."""
    found = robot_names(text)
    if len(found) != 1:
        raise argparse.ArgumentTypeError("give one name, as in: Rob")
    return found[0]


def task_number(text: str) -> int:
    """A task's number, in digits or as it is spoken; -3 is not three."""
    from hvcpd.language.words import NUMBER_MAX, number_words, strict_words

    words = strict_words(text)
    found = next((number for number in range(1, NUMBER_MAX + 1) if number_words(number) == words), None)
    if found is None:
        raise argparse.ArgumentTypeError(f"{text[:40]!r} is not a task number from 1 to {NUMBER_MAX}")
    return found


def task_numbers(text: str) -> list[int]:
    """Tasks' numbers, separated by commas."""
    return [task_number(part.strip()) for part in text.split(",")]


def place(text: str) -> tuple[float, ...]:
    """X,Y: a place in the room, m."""
    from hvcpd.config.shared_places import MAX_DISTANCE_M

    if text.count(",") != 1:
        raise argparse.ArgumentTypeError(f"{text[:40]!r} is not x and y in metres; write for example 1.2,0.5")
    return tuple(map(between(-MAX_DISTANCE_M, MAX_DISTANCE_M, "m"), text.split(",")))


def lack(text: str) -> tuple[str, str]:
    """ROBOT=SKILL: a robot and the skill that it lacks."""
    robot, _, skill = text.partition("=")
    if not robot or not skill:
        raise argparse.ArgumentTypeError(f"{text!r} is not ROBOT=SKILL, for example Bot=look")
    return robot, skill


def tank(text: str) -> tuple[str, float]:
    """[ROBOT=]LITRES: whose tank, "" for everybody's, and what is in it."""
    robot, _, litres = text.rpartition("=")
    return robot, between(0.0, 1000.0, "l")(litres)


def between(least: float, most: float, unit: str = "") -> Callable[[str], float]:
    """Return a parser for numbers within bounds."""

    def number(text: str) -> float:
        bounds = f"from {least:g} to {most:g}{unit and ' '}{unit}"
        try:
            value = float(text)
        except ValueError:
            raise argparse.ArgumentTypeError(f"{text!r} is not a number {bounds}") from None
        if not least <= value <= most:
            raise argparse.ArgumentTypeError(f"{text} is not {bounds}")
        return value

    return number


def whole(least: int, most: int, what: str = "whole number") -> Callable[[str], int]:
    """Return a parser for whole numbers within bounds."""

    def number(text: str) -> int:
        if not text.isdecimal() or not text.isascii() or len(text) > MAX_DIGITS or not least <= int(text) <= most:
            raise argparse.ArgumentTypeError(f"{text!r} is not a {what} from {least} to {most}")
        return int(text)

    return number


MAX_DIGITS = 10
"""Of a whole number; Python itself refuses to read very long ones."""
seed = whole(0, 2**32 - 1)
"""A whole number of 32 bits."""
port = whole(0, 65535, "port")


def file_in(text: str) -> Path:
    """A file to read, or standard input."""
    return Path("/dev/stdin" if text == "-" else text)


def table_out(text: str) -> Path:
    """Where a table is written, or standard output."""
    return Path("/dev/stdout" if text == "-" else text)


_NOT_WRITTEN = frozenset({".aac", ".aif", ".aiff", ".flac", ".m4a", ".mp3", ".oga", ".ogg", ".opus"})
"""File name extensions of other sound formats, which would mislead a player."""


def sound_out(text: str) -> Path:
    """Where sound is written: no terminal, which must not get its bytes, and no file of another format's extension."""
    if text != "-":
        path = Path(text)
        if path.suffix.lower() in _NOT_WRITTEN:
            raise argparse.ArgumentTypeError(f"only WAV is written; name it {path.with_suffix('.wav')}")
        return path
    if sys.stdout.isatty():
        raise argparse.ArgumentTypeError("no sound is written to a terminal; name a file, or pipe it: … -o - | aplay")
    return table_out(text)
