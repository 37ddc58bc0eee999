"""How one robot does what its team's task file calls by a name, by a program or by a pin; and the pin of its button."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from hvcpd.config.loading import between
from hvcpd.config.skills import valid_key

HIGHEST_PIN = 27
"""Of a Raspberry Pi's header, in Broadcom's numbers, as gpiozero counts them."""


@dataclass(frozen=True)
class PinSettings:
    """A pin that is switched on for a while: the argument `amount` of the call, divided by `per_s`, in seconds."""

    pin: int = field(metadata=between(0, HIGHEST_PIN))
    amount: str = "seconds"
    per_s: float = field(default=1.0, metadata=between(1e-6, 1e6))
    active_high: bool = True


@dataclass(frozen=True)
class SkillSettings:
    """How this robot does what its team calls by a name: by a program, or by a pin.

    `run` is the program and its arguments, where "{litres}" stands for what the call has for `litres`. `safe` is a
    program that leaves all safe, run after `run` was cancelled or has failed.
    """

    run: tuple[str, ...] = ()
    safe: tuple[str, ...] = ()
    gpio: PinSettings | None = None


@dataclass(frozen=True)
class StopButtonSettings:
    """A button that stops the robot, between a pin and ground; None: there is none.

    One that is normally closed opens when it is pressed, and so does a wire that breaks.
    """

    pin: int | None = field(default=None, metadata=between(0, HIGHEST_PIN))
    normally_closed: bool = True


def valid_skills(skills: Mapping[str, SkillSettings]) -> str | None:
    """What is wrong with the names, or with how a skill is done, or None."""
    for name, skill in skills.items():
        if (wrong := valid_key(name)) is not None:
            return wrong
        if bool(skill.run) == (skill.gpio is not None):
            return f"{name}: give one of `run: [program, argument, …]` and `gpio: {{pin: 17}}`"
        if skill.safe and not skill.run:
            return f"{name}: `safe` goes with `run`; a pin is switched off by itself"
    return None


def runnable(skill: SkillSettings, path: Path | None) -> SkillSettings:
    """A program that begins with a point lies beside the file; others are looked for where the system has programs."""

    def whole(words: tuple[str, ...]) -> tuple[str, ...]:
        beside = path is not None and words[:1] and words[0].startswith(("./", "../"))
        return (str(path.resolve().parent / words[0]), *words[1:]) if beside and path is not None else words

    return dataclasses.replace(skill, run=whole(skill.run), safe=whole(skill.safe))
