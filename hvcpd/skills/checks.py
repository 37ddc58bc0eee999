"""Checks, before any device is opened, that a robot can carry out its skills as its settings say."""

from __future__ import annotations

import math
import os
import shutil
from collections.abc import Iterator, Mapping
from pathlib import Path

from hvcpd.config.settings import Settings, WheelSettings
from hvcpd.config.skill_settings import JointSettings, PinSettings, SkillSettings
from hvcpd.config.skills import Parameter
from hvcpd.config.tasks import TENDING, TaskRepository, Use
from hvcpd.errors import did_you_mean
from hvcpd.skills.runners import places

_LONGEST_FIRST_LINE = 256
"""Of a script, as the kernel reads it (execve(2))."""
_SECONDS = {"seconds": Parameter()}
"""Argument of tending, if the task file declares no other."""


def faults(
    settings: Settings,
    tasks: TaskRepository,
    programs_too: bool = True,
    skill_places: Mapping[str, str] | None = None,
) -> Iterator[str]:
    """One message with its remedy for each fault; `programs_too`: report missing programs too, for a caller that runs
    them and may see other folders than the robot does. `skill_places` has the line of each skill."""
    for name, text in _faults(settings.skills, tasks, settings, programs_too):
        place = (skill_places or {}).get(name)
        yield f"{place}: {text}" if place else text


def _faults(
    skills: Mapping[str, SkillSettings], tasks: TaskRepository, settings: Settings, programs_too: bool
) -> Iterator[tuple[str, str]]:
    wheels, control = settings.wheels, settings.control
    button = settings.stop_button.pin
    taken = {button: "the stop button"} if button is not None else {}
    motors = dict(zip(wheels.ids, ("the left wheel", "the right wheel"), strict=True))
    for name, skill in skills.items():
        if skill.joint is not None and not control.enabled:
            yield name, f"skills.{name}.joint: it is offered by the control socket; set control.enabled to true"
        for part, text in _faults_of(name, skill, tasks, wheels, programs_too):
            yield name, f"skills.{name}{part}: {text}"
        if skill.joint is not None:
            if skill.joint.id in motors:
                text = f"{motors[skill.joint.id]} has ID {skill.joint.id} already; give each motor its own"
                yield name, f"skills.{name}.joint: {text}"
            motors[skill.joint.id] = f"skill {name!r}"
        for number in (skill.gpio.pin, skill.gpio.empty_pin) if skill.gpio is not None else ():
            if number in taken:
                text = f"{taken[number]} has pin {number} already; give each its own"
                yield name, f"skills.{name}.gpio: {text}"
            if number is not None:
                taken[number] = f"skill {name!r}"


def _faults_of(
    name: str, skill: SkillSettings, tasks: TaskRepository, wheels: WheelSettings, programs_too: bool
) -> Iterator[tuple[str, str]]:
    """The faults of one skill by itself, each with its part of the skill."""
    declared = dict.fromkeys(TENDING, _SECONDS) | {each.name: dict(each.entry.parameters) for each in tasks.skills}
    if name not in declared:
        yield "", f"the task file declares no such skill; {did_you_mean(name, declared)}"
        return
    parameters = declared[name]
    for place in sorted(_named(skill) - parameters.keys()):
        yield "", f"it has no parameter {place!r}; {did_you_mean(place, parameters)}"
    for program in (skill.run[:1], skill.safe[:1]):
        if programs_too and program and (wrong := _unrunnable(program[0])) is not None:
            yield "", wrong
    if skill.joint is not None:
        yield from ((".joint", text) for text in _joint_faults(skill.joint, parameters, wheels))
    if skill.gpio is not None and skill.gpio.empty_pin is not None:
        spoken = {each.name: each.entry.failures for each in tasks.skills}.get(name, ())
        if skill.gpio.empty_reason not in spoken:
            text = f"empty_reason: {skill.gpio.empty_reason!r} is none of the skill's `failures` in the task file"
            yield ".gpio", f"{text}; {did_you_mean(skill.gpio.empty_reason, spoken) if spoken else 'add it there'}"
    if skill.gpio is not None and (wrong := _no_number(skill.gpio.amount, parameters)) is not None:
        yield ".gpio", f"amount: {wrong}"
    elif skill.gpio is not None and (wrong := _too_long(name, skill.gpio, tasks)) is not None:
        yield ".gpio", wrong


def _named(skill: SkillSettings) -> frozenset[str]:
    """The parameters that a program's words, or the fields of a goal, name."""
    return places((*skill.run, *skill.safe, *(_texts(skill.ros.goal) if skill.ros is not None else ())))


def _texts(value: object) -> Iterator[str]:
    if isinstance(value, str):
        yield value
    elif isinstance(value, Mapping | list):
        for each in value.values() if isinstance(value, Mapping) else value:
            yield from _texts(each)


def _no_number(name: str, parameters: Mapping[str, Parameter]) -> str | None:
    if name in parameters and parameters[name].type == "number":
        return None
    return f"{name!r} is not one of its numbers; name one of its parameters"


def _too_long(name: str, gpio: PinSettings, tasks: TaskRepository) -> str | None:
    """A call that would fail at its time limit, with most of its work done; and then again, by another robot."""
    for task in tasks.tasks:
        for use in (each for each in task.actions if isinstance(each, Use) and each.skill == name):
            needed_s = float(dict(use.arguments)[gpio.amount]) / gpio.per_s
            if needed_s > use.limit_s:
                why = f"task {task.number} needs {needed_s:g} s at `per_s: {gpio.per_s:g}`"
                return f"{why}, and the skill's limit_s is {use.limit_s:g}; raise one of the two, or ask for less"
    return None


def _joint_faults(joint: JointSettings, parameters: Mapping[str, Parameter], wheels: WheelSettings) -> Iterator[str]:
    if wheels.driver not in ("auto", "dynamixel"):
        yield f"it is on the wheels' bus, and wheels.driver is {wheels.driver}; set that to dynamixel or auto"
    if (text := _no_number(joint.angle, parameters)) is not None:
        yield f"angle: {text}"
        return
    parameter = parameters[joint.angle]
    least = parameter.least if parameter.least is not None else -math.inf
    most = parameter.most if parameter.most is not None else math.inf
    if least < joint.least_deg or most > joint.most_deg:
        asked = f"{least:g} to {most:g}"
        bounds = f"{joint.least_deg:g} to {joint.most_deg:g}"
        yield f"the task file allows {asked} for {joint.angle!r}, and this joint turns from {bounds}; bound it there"


def _unrunnable(program: str) -> str | None:
    path = Path(program)
    if not path.is_absolute():
        return None if shutil.which(program) else f"there is no program {program!r}; install it, or give its whole path"
    if not os.access(path, os.F_OK):
        return f"there is no {program}, or not for this user; check the name"
    if path.is_dir():
        return f"{program} is a folder; name the program in it"
    if not os.access(path, os.X_OK):
        return f"{program} is not executable; run `chmod +x` on it"
    wrong = _first_line_fault(path) if os.access(path, os.R_OK) else None
    return f"{program} {wrong}" if wrong is not None else None


def _first_line_fault(program: Path) -> str | None:
    """Why the kernel cannot run the file, which is neither machine code nor a script that names its interpreter."""
    with program.open("rb") as file:
        first = file.readline(_LONGEST_FIRST_LINE)
    if first.startswith(b"\x7fELF"):
        return None
    named = first[2:].split() if first.startswith(b"#!") else []
    if not named:
        return "does not say what runs it; begin its first line with `#!`, for example `#!/bin/sh`"
    if first.endswith(b"\r\n"):
        return "has the line ends of Windows; run `sed -i 's/\\r$//'` on it"
    interpreter = Path(os.fsdecode(named[0]))
    return (
        None
        if os.access(interpreter, os.F_OK)
        else f"is to be run by {interpreter}, which does not exist; correct its first line"
    )
