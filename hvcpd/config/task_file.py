"""Reads a task file in YAML; `etc/tasks.yaml` shows and explains the form."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

from cattrs import Converter
from cattrs.errors import AttributeValidationNote, BaseValidationError

from hvcpd.config.document import Document, KeyPath, parse, read_bytes
from hvcpd.config.icons import valid_icon
from hvcpd.config.loading import (
    Check,
    FaultError,
    Parts,
    at_most,
    between,
    checked,
    describe,
    number_between,
    of_each,
    structure,
)
from hvcpd.config.names import valid_task_name
from hvcpd.config.recurrence import Recurrence, interval_s, valid_recurrence
from hvcpd.config.shared_places import MAX_DISTANCE_M, MAX_PLACES, PlaceEntry, PointEntry, check_places
from hvcpd.config.skills import MAX_SKILLS, Skill, SkillEntry, valid_keys
from hvcpd.config.task_changes import TaskChanges
from hvcpd.config.task_checks import SoundsAlike, check_after, check_alternatives, check_names
from hvcpd.config.tasks import (
    TENDING,
    Action,
    Dock,
    Forward,
    GoTo,
    SayAction,
    TaskDefinition,
    TaskRepository,
    Tend,
    Turn,
    Use,
    Wait,
)
from hvcpd.config.written import unsayable
from hvcpd.errors import ConfigError, did_you_mean

MAX_TASKS = 99
"""Tasks of a repository, and the highest number: numbers are spoken, and the phrasebook counts to ninety-nine."""

MAX_ACTIONS = 100
"""Actions of a task; bounds a mission."""

MAX_ROBOTS = 20
"""Robots that do one task together."""

MAX_PRIORITY = 9
"""Ten levels are more than anybody keeps apart."""

MAX_ANGLE_DEG = 360
"""A turn; once around is enough."""

MAX_WAIT_S = 600
"""A wait; ten minutes, after which the others must think that the robot has failed."""

MAX_SENTENCE_LENGTH = 200
"""Characters of a sentence to say; the phrasebook's longest are half of this."""

_NAME_AND_NUMBER = re.compile(r"([a-z_ ]*[a-z_])(?:(?: *[:=] *| +)(-?[0-9.]+)(?: *[a-z]+)?)?$")

TO_PLACE = "go to place"
DOCK = "dock"


@dataclass(frozen=True)
class _ActionEntry:
    """An action; None stands for the way to the task's own place, which only the whole task can tell."""

    action: Action | None


def _valid_actions(actions: tuple[_ActionEntry, ...]) -> str | None:
    if 1 <= len(actions) <= MAX_ACTIONS:
        return None
    return f"a task has 1 to {MAX_ACTIONS} actions, found {len(actions)}; write for example [{TO_PLACE}, {{wait: 5}}]"


def _valid_deadline(text: str) -> str | None:
    if not text or interval_s(text) is not None:
        return None
    return f"{text[:40]!r} is not a length of time; write for example `30 min` or `2 h`"


@dataclass(frozen=True)
class _TaskEntry:
    number: int = field(metadata=between(1, MAX_TASKS))
    name: str = field(metadata=checked(valid_task_name))
    actions: tuple[_ActionEntry, ...] = field(metadata=checked(_valid_actions))
    place: PointEntry | None = None
    icon: str = field(default="", metadata=checked(valid_icon))
    every: str = field(default="", metadata=checked(valid_recurrence))
    priority: int = field(default=0, metadata=between(0, MAX_PRIORITY))
    after: tuple[int, ...] = ()
    deadline: str = field(default="", metadata=checked(_valid_deadline))
    robots: int = field(default=1, metadata=between(1, MAX_ROBOTS))
    on_demand: bool = False

    def definition(self) -> TaskDefinition:
        place = self.place.place() if self.place else None
        there = (GoTo(place),) if place else ()
        every = Recurrence(self.every) if self.every else None
        due = (self.priority, frozenset(self.after), interval_s(self.deadline), self.robots, self.on_demand)
        actions: list[Action] = []
        for entry in self.actions:
            actions += (entry.action,) if entry.action is not None else there
        return TaskDefinition(self.number, self.name, place, tuple(actions), self.icon, every, *due)


def _valid_count(tasks: tuple[Any, ...]) -> str | None:
    if 1 <= len(tasks) <= MAX_TASKS:
        return None
    return f"a task file has 1 to {MAX_TASKS} tasks, found {len(tasks)}; {'remove some' if tasks else 'add one'}"


@dataclass(frozen=True)
class _Alternatives:
    """Pairs of a word and a phrase that counts as it."""

    pairs: tuple[tuple[str, str], ...] = ()


def _read_alternatives(value: Any, _: Converter) -> _Alternatives:
    """What is well-formed; `check_alternatives` tells what is not."""
    if not isinstance(value, dict):
        raise FaultError(f"expected words and their alternatives, found {describe(value)}; write `word: [a phrase]`")
    lists = {word: phrases for word, phrases in value.items() if isinstance(phrases, list)}
    return _Alternatives(tuple((word, p) for word, phrases in lists.items() for p in phrases if isinstance(p, str)))


def _not_built_in(name: str, _: object) -> str | None:
    return "every robot can do this; choose another name" if name in _BUILT_IN else None


@dataclass(frozen=True)
class _TaskFile:
    tasks: tuple[_TaskEntry, ...] = field(metadata=checked(_valid_count))
    skills: Mapping[str, SkillEntry] = field(
        default_factory=dict,
        metadata=checked(at_most(MAX_SKILLS, "skills may be declared"), of_each(_not_built_in), valid_keys),
    )
    places: tuple[PlaceEntry, ...] = field(default=(), metadata=checked(at_most(MAX_PLACES, "places may be listed")))
    other_tasks: tuple[str, ...] = field(default=(), metadata=checked(at_most(MAX_TASKS, "other tasks may be named")))
    alternatives: _Alternatives = field(default_factory=_Alternatives)


def _valid_sentence(text: str) -> str | None:
    if not text.strip() or len(text) > MAX_SENTENCE_LENGTH:
        return f"a sentence has 1 to {MAX_SENTENCE_LENGTH} characters, found {len(text)}; reword it"
    strange = unsayable(text)
    return f"{strange!r} cannot be said; write {text[:40]!r} in words" if strange else None


_ACTIONS: dict[str, tuple[type[Any], Check | None, Callable[[Any], Action]]] = {
    "go to": (PointEntry, None, lambda entry: GoTo(entry.place())),
    "forward": (float, number_between(-MAX_DISTANCE_M, MAX_DISTANCE_M), Forward),
    "turn": (float, number_between(-MAX_ANGLE_DEG, MAX_ANGLE_DEG), Turn),
    "wait": (float, number_between(0, MAX_WAIT_S), Wait),
    **{key: (float, number_between(0, MAX_WAIT_S), partial(Tend, skill=key)) for key in TENDING},
    "say": (str, _valid_sentence, SayAction),
}
"""The key of each action, the type of what follows it, a check of that, and what becomes of it."""

_BUILT_IN = (TO_PLACE, DOCK, *(key for key in _ACTIONS if key not in TENDING))
"""Names that a team may not give to its own skills; those of TENDING it may declare, with parameters."""

Declared = Mapping[str, SkillEntry | None]
"""The skills of a file; None: one that is itself at fault, so that nothing can be said of its uses."""


def _declared(document: Document) -> Declared:
    """What the file declares, as far as it is right; `structure` tells of the rest."""
    found = document.value.get("skills") if isinstance(document.value, dict) else None
    skills: dict[str, SkillEntry | None] = {}
    for name, value in found.items() if isinstance(found, dict) else ():
        part = Document(document.place(("skills", name)))
        part.value = value
        try:
            skills[name] = structure(part, SkillEntry)
        except ConfigError:
            skills[name] = None
    return skills


def _reader(declared: Declared) -> Callable[[Any, Converter], _ActionEntry]:
    """Reads an action of a file that declares these skills."""

    def read(value: Any, converter: Converter) -> _ActionEntry:
        pair = (value, None) if isinstance(value, str) else _only_pair(value)
        if pair is not None and pair[0] in declared:
            name, argument = pair
            return _read_use(name, argument, declared[name])
        return _read_action(value, converter, tuple(declared))

    return read


def _only_pair(value: Any) -> tuple[str, Any] | None:
    return next(iter(value.items())) if isinstance(value, dict) and len(value) == 1 else None


def _read_use(name: str, argument: Any, entry: SkillEntry | None) -> _ActionEntry:
    if entry is None:
        return _ActionEntry(Use(name))
    try:
        return _ActionEntry(Use(name, entry.read(argument), entry.limit_s))
    except FaultError as error:
        raise FaultError(str(error), *((name, *error.path) if argument is not None else ())) from None


def _read_action(value: Any, converter: Converter, skills: tuple[str, ...]) -> _ActionEntry:
    if value == TO_PLACE:
        return _ActionEntry(None)
    if value == DOCK:
        return _ActionEntry(Dock())
    forms = [TO_PLACE, DOCK, *_ACTIONS, *skills]
    if isinstance(value, str):
        hint = _with_value(value, (*_ACTIONS, *skills)) or did_you_mean(value[:40], forms)
        raise FaultError(f"{value[:40]!r} is not an action by itself; {hint}")
    if not isinstance(value, dict) or len(value) != 1:
        if isinstance(value, dict) and None in value.values():  # {say: hello, friends}
            raise FaultError(f"expected one action, found {len(value)}; put text with a comma in quotes")
        others = ", ".join((*_ACTIONS, *skills))
        raise FaultError(
            f"expected one action, found {describe(value)}; write {TO_PLACE!r}, {DOCK!r} or one of {others}"
        )
    ((key, argument),) = value.items()
    if key in (TO_PLACE, DOCK):
        raise FaultError(f"{key!r} takes no value; write it without the colon", key)
    if key not in _ACTIONS:
        hint = _with_value(key, (*_ACTIONS, *skills)) or did_you_mean(key[:40], forms)
        raise FaultError(f"unknown action {key[:40]!r}; {hint} (a skill of your own is declared under `skills:`)", key)
    type_, check, make = _ACTIONS[key]
    try:
        found = converter.structure(argument, type_)
        if check is not None and (wrong := check(found)) is not None:
            raise FaultError(wrong)
        return _ActionEntry(make(found))
    except FaultError as error:
        raise FaultError(str(error), key, *error.path) from error
    except BaseValidationError as error:
        error.add_note(AttributeValidationNote(f"in action {key}", key, type_))
        raise


def _with_value(text: str, actions: tuple[str, ...]) -> str | None:
    """What to write in place of an action's name alone, of `water 5`, or of `water:5` without the space after it."""
    found = _NAME_AND_NUMBER.match(text)
    return f"write {{{found[1]}: {found[2] or '…'}}}" if found is not None and found[1] in actions else None


def load_tasks(
    path: Path, sounds_alike: SoundsAlike | None = None, changes: TaskChanges | None = None, robots: int = MAX_ROBOTS
) -> TaskRepository:
    """Read the task file `path`, with the tasks that `changes` add and remove.

    Checked are: numbers from 1 to 99 and names, each given once; distances, angles and waits within bounds; that a
    task with "go to place" has a place; that no task takes more robots than the team has, which are `robots`; and, if
    `sounds_alike` is given, that no two names are mistaken by ear.
    Raises ConfigError with every fault of the file.
    """
    document = (changes or TaskChanges()).applied_to(parse(read_bytes(path), str(path)))
    file = structure(
        document,
        _TaskFile,
        lambda parts: _check(parts, sounds_alike, robots),
        {_ActionEntry: _reader(_declared(document)), _Alternatives: _read_alternatives},
    )
    return TaskRepository(
        tuple(entry.definition() for entry in file.tasks),
        file.other_tasks,
        file.alternatives.pairs,
        tuple(Skill(name, entry) for name, entry in file.skills.items()),
        tuple(entry.place() for entry in file.places),
    )


def _check(parts: Parts, sounds_alike: SoundsAlike | None, robots: int) -> None:
    numbers: dict[int, KeyPath] = {}
    names: list[tuple[str, KeyPath]] = []
    for at in parts.elements(("tasks",)):
        number = parts.get((*at, "number"), int)
        if number is not None and number in numbers:
            line = parts.where(numbers[number], (*at, "number"))
            parts.fault((*at, "number"), f"task number {number} is taken in {line} already; choose another")
        elif number is not None:
            numbers[number] = (*at, "number")
        names.append((parts.get((*at, "name"), str) or "", (*at, "name")))
        if robots < (wanted := parts.get((*at, "robots"), int) or 1) <= MAX_ROBOTS:
            problem = f"the task takes {wanted} robots, and the team has {robots}; write fewer, or name more robots"
            parts.fault((*at, "robots"), problem)
        if parts.get((*at, "on_demand"), bool) and parts.has((*at, "every")):
            parts.fault((*at, "on_demand"), "what recurs is due without being asked for; leave one of the two out")
        _check_place(parts, at)
    for path in parts.elements(("other_tasks",)):
        name = parts.get(path, str)
        if name is not None and (text := valid_task_name(name)) is not None:
            parts.fault(path, text)
        names.append((name or "", path))
    check_after(parts, numbers)
    check_names(parts, [(name, path) for name, path in names if name], sounds_alike)
    check_alternatives(parts)
    check_places(parts, sounds_alike)


def _check_place(parts: Parts, at: KeyPath) -> None:
    if parts.has((*at, "place")):
        return
    for action in parts.elements((*at, "actions")):
        if parts.get(action, str) == TO_PLACE:
            parts.fault(action, "this task has no place; add `place: {x_m: …, y_m: …}` to it")
