"""`hvcpctl new-team`: writes the settings and tasks of a new team from a few answers, and checks them."""

from __future__ import annotations

import argparse
import json
import math
import shlex
import sys
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from textwrap import indent
from typing import TypeVar

import yaml

from hvcpd.assembly.sound import make_phrasebook, make_sound, user_cache_folder
from hvcpd.config.files import write_whole
from hvcpd.config.loading import at_most
from hvcpd.config.names import repeated_names, valid_robot_name, valid_task_name
from hvcpd.config.settings import DEFAULT_TEAMS, MAX_KNOWN_NAMES, Settings
from hvcpd.config.shared_places import MAX_DISTANCE_M
from hvcpd.config.skills import MAX_SKILLS, valid_key
from hvcpd.config.task_file import MAX_TASKS
from hvcpd.config.tasks import TENDING, TaskRepository
from hvcpd.control.simulate.team import Team, load_team, refuse_confusable, refuse_same_sound
from hvcpd.errors import EX_OK, ConfigError, writing
from hvcpd.reporting.text import number
from hvcpd.synthesis.likeness import name_fault

BUILT_IN = {"wait": "seconds", **dict.fromkeys(TENDING, "seconds"), "dock": "", "turn": "degrees", "forward": "metres"}
"""Actions of every robot at a place, and the number that each takes."""
USUAL_DEED = "wait 5"
MISSING = "this is not a terminal: give --robots and --task, as `hvcpctl new-team --help` shows"
ENDED = "the input has ended; answer again, or give --robots and --task"

Given = TypeVar("Given")


@dataclass(frozen=True)
class SkillAnswer:
    """A skill, and the number that it takes; "": none."""

    name: str
    parameter: str


@dataclass(frozen=True)
class TaskAnswer:
    """A task, its place (m) if it has one, what is done there, and the number for that."""

    name: str
    place: tuple[float, float] | None
    deed: str
    amount: float | None


class Console:
    """Asks a person, on a terminal."""

    def __init__(self, ask: Callable[[str], str] = input, tell: Callable[[str], object] = sys.stdout.write) -> None:
        self._ask = ask
        self.tell = tell

    def answer(self, question: str, read: Callable[[str], Given], usual: str = "") -> Given:
        """The answer; asks again until it is valid. Raises ConfigError at the end of the input."""
        while True:
            try:
                text = self._ask(f"{question}{f' [{usual}]' if usual else ''}: ").strip() or usual
                return read(text)
            except ConfigError as error:
                self.tell(indent(f"{error}\n", "  "))
            except EOFError:
                self.tell("\n")
                raise ConfigError(ENDED) from None


def run(options: argparse.Namespace, console: Console | None = None) -> int:
    """Ask for what is missing, check everything, write the two files, and simulate the team if requested."""
    folder: Path = options.folder
    for name in ("hvcpd.yaml", "tasks.yaml"):
        if (folder / name).exists():
            raise ConfigError(f"{folder / name} is there already; name another folder, or move it away")
    is_asked = console is not None or sys.stdin.isatty()
    console = console or Console()
    if not is_asked and not (options.robots and options.task):
        raise ConfigError(MISSING)
    robots = read_robots(",".join(options.robots)) if options.robots else None
    robots = robots or console.answer("The robots' names", read_robots, "Rob, Bot")
    skills = read_skills(options.skill or ())
    tasks: list[TaskAnswer] = []
    for text in options.task or ():
        tasks.append(read_task(text, skills, tasks))
    if tasks:
        _check(robots, skills, tasks)
    else:
        skills = skills or _ask_skills(console)
        tasks = _ask_tasks(console, robots, skills)
    with writing(folder, ConfigError, otherwise="name another folder"):
        folder.mkdir(parents=True, exist_ok=True)
        write_whole(folder / "tasks.yaml", tasks_of(folder, skills, tasks).encode())
        write_whole(folder / "hvcpd.yaml", settings_of(robots, skills).encode())
    words = _to_simulate(folder)
    sys.stdout.write(f"{folder}: hvcpd.yaml and tasks.yaml; to simulate this team:\n  {shlex.join(words)}\n")
    wanted = options.demo
    if wanted is None and is_asked:
        wanted = console.answer("Simulate it now? (y, n)", _read_yes, "y")
    if not wanted:
        return EX_OK
    from hvcpd.control.cli import main

    return main(words[1:])


def _to_simulate(folder: Path) -> list[str]:
    return ["hvcpctl", "simulate", "--config", str(folder / "hvcpd.yaml")]


def _ask_skills(console: Console) -> list[SkillAnswer]:
    question = "Their skills besides driving and waiting, each with its number, as in: pour litres, wave (Enter: none)"
    return console.answer(question, lambda text: read_skills([each for each in text.split(",") if each.strip()]))


def _ask_tasks(console: Console, robots: tuple[str, ...], skills: list[SkillAnswer]) -> list[TaskAnswer]:
    """Each is checked beside those before it, so that no answer is lost for a later one."""
    deeds = ", ".join([*(f"{each.name} {each.parameter}".strip() for each in skills), *BUILT_IN])
    console.tell(f'Write a task as "water the green rose; -3, -4; {USUAL_DEED}": name; place in metres; what to do.\n')
    console.tell(f"What robots can do: {deeds}.\n")
    tasks: list[TaskAnswer] = []

    def read(text: str) -> TaskAnswer | None:
        if not text:
            if tasks:
                return None
            raise ConfigError("give at least one task")
        task = read_task(text, skills, tasks)
        _check(robots, skills, [*tasks, task])
        return task

    while len(tasks) < MAX_TASKS:
        found = console.answer(f"Task {len(tasks) + 1}{' (Enter: no more)' if tasks else ''}", read)
        if found is None:
            break
        tasks.append(found)
    return tasks


def _read_yes(text: str) -> bool:
    if text.lower() not in ("y", "yes", "n", "no"):
        raise ConfigError("answer y or n")
    return text.lower().startswith("y")


def read_robots(text: str) -> tuple[str, ...]:
    """Names with commas between them. Raises ConfigError with the remedy."""
    names = tuple(part.strip() for part in text.split(",") if part.strip())
    wrong = [fault for name in names if (fault := valid_robot_name(name) or name_fault(name))]
    few_enough = at_most(MAX_KNOWN_NAMES, "names can be given")
    if fault := "\n".join(wrong) or repeated_names(names) or few_enough(names):
        raise ConfigError(fault)
    if not names:
        raise ConfigError("give at least one name, as in: Rob, Bot")
    sound, tasks = make_sound(cache_folder=user_cache_folder()), TaskRepository(())
    refuse_same_sound(names, sound.lexicon)
    team = Team(Settings(names[0]), tasks, names, make_phrasebook(names, DEFAULT_TEAMS, tasks), sound, {})
    refuse_confusable(team, allowable=False)
    return names


def read_skills(texts: Sequence[str]) -> list[SkillAnswer]:
    """All skills of a team. Raises ConfigError with the remedy."""
    skills = [read_skill(text) for text in texts]
    names = [skill.name for skill in skills]
    for k, name in enumerate(names):
        if name in names[:k]:
            raise ConfigError(f"there is a skill {name!r} already; choose another name")
    if fault := at_most(MAX_SKILLS, "skills may be declared")(names):
        raise ConfigError(fault)
    return skills


def read_skill(text: str) -> SkillAnswer:
    """A skill's name, and the name of the number that it takes. Raises ConfigError with the remedy."""
    name, _, parameter = text.strip().partition(" ")
    parameter = parameter.strip()
    if fault := valid_key(name) or (valid_key(parameter) if parameter else None):
        raise ConfigError(fault)
    for word in filter(None, (name, parameter)):
        if not isinstance(yaml.safe_load(word), str):
            raise ConfigError(f"{word!r} is no name in a YAML file; choose another")
    if name in BUILT_IN or name == "say":
        raise ConfigError(f"every robot can {name!r}; leave it out, or choose another name")
    return SkillAnswer(name, parameter)


def read_task(text: str, skills: list[SkillAnswer], before: list[TaskAnswer]) -> TaskAnswer:
    """A task after those `before`. Raises ConfigError with the remedy."""
    name, *rest = (part.strip() for part in text.rstrip("; ").split(";"))
    if fault := valid_task_name(name):
        raise ConfigError(fault)
    if any(name == task.name for task in before):
        raise ConfigError(f"there is a task {name!r} already; choose another name")
    is_placed = rest and (rest[0][:1] in "-+.0123456789" or (len(rest) > 1 and "," in rest[0]))
    place = _read_place(rest.pop(0)) if is_placed else None
    deed, _, amount = (rest.pop(0) if rest and rest[0] else USUAL_DEED).partition(" ")
    if rest:
        raise ConfigError(f"{rest[0][:40]!r} is too much; write for example: {name}; -3, -4; {USUAL_DEED}")
    known = BUILT_IN | {skill.name: skill.parameter for skill in skills}
    if deed not in known:
        remedy = f"write one of {', '.join(known)}, or declare it by --skill"
        raise ConfigError(f"no robot has the skill {deed[:40]!r}; {remedy}")
    if bool(known[deed]) != bool(amount.strip()):
        wanted = f"{deed} 5 ({known[deed]})" if known[deed] else deed
        raise ConfigError(f"{deed!r} takes {'a number' if known[deed] else 'no number'}; write {wanted}")
    return TaskAnswer(name, place, deed, _number(amount) if known[deed] else None)


def _read_place(text: str) -> tuple[float, float]:
    parts = text.split(",")
    if len(parts) != 2:
        raise ConfigError(f"{text[:40]!r} is not a place; write x and y in metres, as in: -3, -4")
    x_m, y_m = map(_number, parts)
    if max(abs(x_m), abs(y_m)) > MAX_DISTANCE_M:
        raise ConfigError(f"{text[:40]!r} is too far; give metres from -{MAX_DISTANCE_M} to {MAX_DISTANCE_M}")
    return x_m, y_m


def _number(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise ConfigError(f"{text.strip()[:40]!r} is not a number; write for example 0.5")
    return value


def settings_of(robots: tuple[str, ...], skills: list[SkillAnswer]) -> str:
    """The settings of the first robot, as a file."""
    lines = [
        "# The first robot's settings. The others have the same with their own name.",
        f"name: {json.dumps(robots[0])}",
        f"names: {json.dumps(list(robots))}",
        "tasks: tasks.yaml",
    ]
    if skills:
        lines += ["# How this robot does what the task file calls by a name; docs/skills.md has all ways.", "# skills:"]
    for each in skills:
        words = f', "{{{each.parameter}}}"' if each.parameter else ""
        lines.append(f"#   {each.name}: {{run: [./{each.name}.sh{words}]}}")
    return "\n".join(lines) + "\n"


def tasks_of(folder: Path, skills: list[SkillAnswer], tasks: list[TaskAnswer]) -> str:
    """The task file, the same for all robots."""
    lines = ["# The team's tasks. All robots have this file.", "#", f"#     {shlex.join(_to_simulate(folder))}"]
    lines += ["skills:"] if skills else []
    for each in skills:
        lines.append(f"  {each.name}: {{parameters: {{{f'{each.parameter}: {{}}' if each.parameter else ''}}}}}")
    lines.append("tasks:")
    for k, task in enumerate(tasks, 1):
        lines += [f"  - number: {k}", f"    name: {task.name}"]
        way = []
        if task.place is not None:
            x_m, y_m = (number(each, 6) for each in task.place)  # no exponent, which YAML would take for text
            lines.append(f"    place: {{x_m: {x_m}, y_m: {y_m}}}")
            way = ["go to place"]
        deed = task.deed if task.amount is None else f"{{{task.deed}: {number(task.amount, 6)}}}"
        lines.append(f"    actions: [{', '.join([*way, deed])}]")
    return "\n".join(lines) + "\n"


def _check(robots: tuple[str, ...], skills: list[SkillAnswer], tasks: list[TaskAnswer]) -> None:
    """Check that a robot would accept both files, and could tell all their words apart. Raises ConfigError."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "hvcpd.yaml").write_text(settings_of(robots, skills))
        (folder / "tasks.yaml").write_text(tasks_of(folder, skills, tasks))
        try:
            team = load_team(argparse.Namespace(config=folder / "hvcpd.yaml", tasks=None), robots)
            refuse_confusable(team, allowable=False)
        except ConfigError as error:
            raise ConfigError(str(error).replace(f"{folder}/", "")) from None
