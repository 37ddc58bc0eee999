"""A skill's name, its parameters, and the reasons for which it may fail: what the task file says for a whole team.

How one robot does it (a program, a pin) stands in that robot's own settings, `hvcpd.config.settings`.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

from hvcpd.config.loading import FaultError, as_number, at_most, between, checked, describe, of_each
from hvcpd.config.names import valid_task_name
from hvcpd.errors import did_you_mean

Value = float | str
"""The value of one parameter in a call."""

MAX_SKILLS = 30
"""Of one task file; more than a team of small robots has."""
MAX_PARAMETERS = 12
MAX_FAILURES = 12
"""Reasons that a skill may give aloud: each one makes every listener's network larger."""
MAX_TEXT_LENGTH = 200
"""Characters of a parameter: a file name or a sentence."""
MAX_LIMIT_S = 3600.0
"""A skill that needs more than an hour is several tasks."""
USUAL_LIMIT_S = 60.0
"""Longer than a small robot's gripper, pump or camera takes for one thing."""

_NAME = re.compile(r"[a-z][a-z0-9_]{0,23}")


def valid_key(name: str) -> str | None:
    """What is wrong with the name of a skill or of a parameter, or None: it is typed, never spoken."""
    if _NAME.fullmatch(name):
        return None
    tidy = re.sub(r"[^a-z0-9_]+", "_", name.lower()).strip("_0123456789")[:24]
    hint = f"write for example {tidy!r}" if _NAME.fullmatch(tidy) else "choose another"
    return f"{name[:40]!r} is not a lower-case letter followed by up to 23 of a-z, 0-9 and _; {hint}"


valid_keys = of_each(lambda name, _: valid_key(name))
"""The check of a group by such names."""


@dataclass(frozen=True)
class Parameter:
    """The bounds of one parameter of a skill. `unit` is shown to people. Without a `default` it must be given."""

    type: Literal["number", "text"] = "number"
    least: float | None = None
    most: float | None = None
    choices: tuple[str, ...] = ()
    default: Any = None
    unit: str = ""

    def read(self, value: Any) -> Value:
        """The value as it is passed on. Raises FaultError."""
        if self.type == "text":
            if not isinstance(value, str) or not 0 < len(value) <= MAX_TEXT_LENGTH or not value.isprintable():
                raise FaultError(f"expected a text of 1 to {MAX_TEXT_LENGTH} characters, found {describe(value)}")
            if self.choices and value not in self.choices:
                raise FaultError(
                    f"{describe(value)} is not one of the choices; {did_you_mean(value[:40], self.choices)}"
                )
            return value
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise FaultError(f"expected a number, found {describe(value)}; {as_number(value)}")
        least = self.least if self.least is not None else -1e9
        most = self.most if self.most is not None else 1e9
        if not least <= value <= most:
            raise FaultError(f"{describe(value)} is out of range; give a number from {least:g} to {most:g}")
        return float(value)


def _parameter_fault(_name: str, parameter: Parameter) -> str | None:
    if parameter.choices and parameter.type != "text":
        return "choices are of texts; add `type: text`, or give `least` and `most`"
    if parameter.type == "text" and (parameter.least, parameter.most) != (None, None):
        return "`least` and `most` are of numbers; leave out `type: text`, or give `choices`"
    if parameter.least is not None and parameter.most is not None and parameter.least > parameter.most:
        return f"`least` {parameter.least:g} is more than `most` {parameter.most:g}; exchange them"
    if parameter.default is not None:
        try:
            parameter.read(parameter.default)
        except FaultError as error:
            return f"default: {error}"
    return None


def _valid_failures(failures: tuple[str, ...]) -> str | None:
    wrong = next((text for reason in failures if (text := valid_task_name(reason)) is not None), None)
    return wrong.replace("task name", "reason", 1) if wrong is not None else None


@dataclass(frozen=True)
class SkillEntry:
    """A skill as the task file declares it. It fails at `limit_s`; `failures` are the reasons that can be spoken."""

    parameters: Mapping[str, Parameter] = field(
        default_factory=dict,
        metadata=checked(at_most(MAX_PARAMETERS, "parameters"), valid_keys, of_each(_parameter_fault)),
    )
    limit_s: float = field(default=USUAL_LIMIT_S, metadata=between(0.1, MAX_LIMIT_S))
    failures: tuple[str, ...] = field(default=(), metadata=checked(at_most(MAX_FAILURES, "reasons"), _valid_failures))

    def read(self, argument: Any) -> tuple[tuple[str, Value], ...]:
        """The arguments of a use, in the order of the parameters. Raises FaultError.

        `argument` is a group of keys; or a single value, for a skill with one parameter; or None, for its defaults.
        """
        if argument is not None and not isinstance(argument, dict):
            if len(self.parameters) != 1:
                example = ", ".join(f"{name}: …" for name in self.parameters)
                found = f"expected a group of keys, found {describe(argument)}"
                raise FaultError(f"{found}; write {{{example}}}" if example else f"{found}; it takes nothing")
            argument = {next(iter(self.parameters)): argument}
        given = argument or {}
        for name in given:
            if name not in self.parameters:
                raise FaultError(f"unknown parameter {name[:40]!r}; {did_you_mean(name[:40], self.parameters)}", name)
        values: list[tuple[str, Value]] = []
        for name, parameter in self.parameters.items():
            value = given.get(name, parameter.default)
            if value is None:
                raise FaultError(f"the parameter {name!r} is missing; add it")
            try:
                values.append((name, parameter.read(value)))
            except FaultError as error:
                raise FaultError(str(error), name) from None
        return tuple(values)


@dataclass(frozen=True)
class Skill:
    """A declared skill, by its name."""

    name: str
    entry: SkillEntry
