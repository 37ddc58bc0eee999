"""Types of options of several commands: texts become values, or an error that says what is wrong."""

from __future__ import annotations

import argparse
from collections.abc import Callable


def robot_names(text: str) -> tuple[str, ...]:
    """Robots' names, separated by commas."""
    from hvcpd.config.names import repeated_names, valid_robot_name

    names = tuple(part.strip() for part in text.split(",") if part.strip())
    wrong = next((w for name in names if (w := valid_robot_name(name))), None) or repeated_names(names)
    if not names or wrong:
        raise argparse.ArgumentTypeError(wrong or "give at least one name, as in: Rob,Bot")
    return names


def task_number(text: str) -> int:
    """A task's number, in digits or as it is spoken."""
    from hvcpd.language.words import NUMBER_MAX, number_words, spoken_words

    words = spoken_words(text)
    found = next((number for number in range(1, NUMBER_MAX + 1) if number_words(number) == words), None)
    if found is None:
        raise argparse.ArgumentTypeError(f"{text[:40]!r} is not a task number; write for example 3")
    return found


def level_db(text: str) -> float:
    """A level of -200 to 200 dB."""
    try:
        value = float(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is not a number") from None
    if not -200.0 <= value <= 200.0:
        raise argparse.ArgumentTypeError(f"{text} dB is out of the range -200 to 200")
    return value


def lack(text: str) -> tuple[str, str]:
    """ROBOT=SKILL: a robot and the skill that it lacks."""
    robot, _, skill = text.partition("=")
    if not robot or not skill:
        raise argparse.ArgumentTypeError(f"{text!r} is not ROBOT=SKILL, for example Bot=look")
    return robot, skill


def between(least: float, most: float) -> Callable[[str], float]:
    """Return a parser for numbers within bounds."""

    def number(text: str) -> float:
        try:
            value = float(text)
        except ValueError:
            raise argparse.ArgumentTypeError(f"{text!r} is not a number") from None
        if not least <= value <= most:
            raise argparse.ArgumentTypeError(f"{text} is not from {least:g} to {most:g}")
        return value

    return number


def seed(text: str) -> int:
    """A whole number of 32 bits."""
    if not text.isdecimal() or not text.isascii() or int(text[:12]) >= 2**32:
        raise argparse.ArgumentTypeError(f"{text!r} is not a whole number from 0 to {2**32 - 1}")
    return int(text)
