"""Reads settings and tasks again while the robot lives: what can change at once does, the rest waits for a restart."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import structlog

from hvcpd.config.files import write_whole
from hvcpd.config.settings import Settings
from hvcpd.config.settings_file import Loaded
from hvcpd.config.sources import Sourced
from hvcpd.config.task_changes import TaskChanges, read_changes
from hvcpd.config.tasks import TaskDefinition, TaskRepository
from hvcpd.daemon.control_status import Body
from hvcpd.daemon.preflight import find_confusable
from hvcpd.daemon.wiring import Wiring, wire_up
from hvcpd.errors import ConfigError, HvcpdError, NotDoneError, writing
from hvcpd.memory.people import content
from hvcpd.people.enrolled import Person
from hvcpd.reporting.text import plural
from hvcpd.robot.robot import Robot

LIVE = ("mode", "pick", "talk", "quiet", "unable", "clips", "log_level", "log_format")
"""Settings, or groups of them, that take effect at once. All others are built into the recogniser, the voice, the
conversation, the wheels or the sound card's stream."""

PEOPLE_FROM = ("name", "state_dir", "voices")
"""Settings that tell who of those enrolled counts."""

_log = structlog.get_logger(__name__)


@dataclass(frozen=True)
class Rereading:
    """How a daemon's settings were loaded, to load them again. `load` raises HvcpdError with every fault."""

    load: Callable[[], Loaded]
    sources: tuple[Sourced, ...]
    """Of the settings that it has at first."""
    set_log: Callable[[Settings], None] = lambda _: None
    allow_confusable: bool = False

    def read(self, changes: TaskChanges | None) -> tuple[Loaded, Wiring]:
        """Settings and tasks as they are now; `changes` of the tasks take the place of those that are kept."""
        loaded = self.load()
        return loaded, wire_up(loaded.settings, self.allow_confusable, changes)


class Reloader:
    """One robot's settings in force, and where each comes from."""

    def __init__(self, body: Body, rereading: Rereading | None) -> None:
        self._body = body
        self._rereading = rereading
        self.robot: Robot
        """Known before the first reload."""
        self.sources = rereading.sources if rereading is not None else ()
        self._turn = asyncio.Lock()
        self._coming: TaskRepository | None = None
        """Tasks whose words are being learned; the last ones, if there are several."""

    async def reload(self) -> dict[str, Any]:
        """The changes, and the keys that need a restart. Raises HvcpdError; then nothing has changed."""
        return await self._renew(None)

    async def add(self, task: Mapping[str, Any]) -> dict[str, Any]:
        """Add a task, in the form of the task file; save it, and reload. Raises HvcpdError as `reload`."""

        def added(changes: TaskChanges) -> TaskChanges:
            taken = next((each for each in self._tasks.tasks if each.number == task.get("number")), None)
            if taken is not None:
                raise ConfigError(f"there already is a task {taken.number}, {taken.name!r}; choose another number")
            return changes.with_added(task)

        return await self._renew(added)

    async def remove(self, number: int) -> dict[str, Any]:
        """Remove a task; save that, and reload. Raises HvcpdError as `reload`."""

        def removed(changes: TaskChanges) -> TaskChanges:
            task = self._tasks.by_number(number)
            if task is None:
                known = ", ".join(str(each.number) for each in self._tasks.tasks)
                raise ConfigError(f"there is no task {number}; the tasks are {known}")
            return changes.without(number, task.name)

        return await self._renew(removed)

    @property
    def _tasks(self) -> TaskRepository:
        """Those that are in force, or will be once their words are learned."""
        return self._coming or self._body.wiring.tasks

    async def _renew(self, change: Callable[[TaskChanges], TaskChanges] | None) -> dict[str, Any]:
        if self._rereading is None:
            raise NotDoneError(f"{self._body.wiring.settings.name} was made by a program, and has no settings to read")
        async with self._turn:
            try:
                loaded, wiring = await asyncio.to_thread(self._read, self._rereading, change)
            except HvcpdError as error:
                _log.error("not reloaded", reason=str(error))
                raise
            for fault in wiring.unknown:
                _log.warning("person not known", reason=fault)
            result = self._take(loaded, wiring)
            self._rereading.set_log(self._body.wiring.settings)
        changed = ", ".join(change["key"] for change in result["changed"])
        _log.info("reloaded", changed=changed or "nothing", needs_restart=", ".join(result["restart"]) or "nothing")
        return result

    def _read(self, rereading: Rereading, change: Callable[[TaskChanges], TaskChanges] | None) -> tuple[Loaded, Wiring]:
        """Settings and tasks as they are now, with this change of the tasks, which is kept if all is well. In a thread:
        the comparison of new words with all others takes seconds."""
        path = self._body.wiring.settings.task_changes_path
        changes = read_changes(path)
        if change is not None:
            changes = change(changes)
        loaded, wiring = rereading.read(changes)
        if not rereading.allow_confusable and _words(wiring.tasks) != _words(self._tasks):
            finding = find_confusable(wiring, allowable=False)
            if not finding.ok:
                raise ConfigError(finding.text)
        if change is not None:
            with writing(path, NotDoneError, otherwise="see who may write there"):
                write_whole(path, changes.text())
        return loaded, wiring

    def _take(self, loaded: Loaded, read: Wiring) -> dict[str, Any]:
        changed, restart, sources = [], [], []
        for old, new in zip(self.sources, loaded.sources, strict=True):
            live = new.key.split(".")[0] in LIVE
            sources.append(new if live or old.value == new.value else old)
            if old.value == new.value:
                continue
            if live:
                changed.append({"key": new.key, "before": old.value, "now": new.value})
            else:
                restart.append(new.key)
        self.sources = tuple(sources)
        wiring = self._body.wiring
        restart += [key for key in _other_files(wiring, read) if key not in restart]
        tasks, people = wiring.tasks, wiring.people
        if not set(PEOPLE_FROM).intersection(restart):
            # Whom the settings name is one of the robots until an enrolment, in whose turns people do not take part.
            if (people.keys() ^ read.people.keys()) & {name.lower() for name in wiring.settings.names}:
                restart.append("people")
            # Who is known with the same words stays the same object, for what was made of its words is kept.
            people = {
                k: people[k] if k in people and content(people[k]) == content(p) else p for k, p in read.people.items()
            }
        news = _news_of_people(wiring.people, people)
        changed += news
        settings = replace(wiring.settings, **{key: getattr(read.settings, key) for key in LIVE})
        if "tasks" not in restart and read.tasks != self._tasks:
            if self._coming is None and _words(read.tasks) == _words(tasks):
                changed += _task_changes(tasks, read.tasks)
                tasks = read.tasks
            elif self._body.retask is None:
                restart.append("tasks")
            else:
                changed += _task_changes(self._tasks, read.tasks)
                self._coming = read.tasks
                tasks = _still(tasks, read.tasks)
        self._body.wiring = replace(wiring, settings=settings, tasks=tasks, people=people)
        if len(tasks.tasks) < len(wiring.tasks.tasks):
            self._retask()
        self._tell()
        if self._coming is read.tasks and self._body.retask is not None:
            self._body.retask(read.tasks, partial(self._take_tasks, read.tasks))
        if news:
            self._body.join([person.name for key, person in people.items() if key not in wiring.people])
        return {"changed": changed, "restart": restart}

    def _take_tasks(self, tasks: TaskRepository) -> None:
        """The robot knows their words now; those that were removed in the meantime stay so."""
        if self._coming is tasks:
            self._coming = None
        self._body.wiring = replace(self._body.wiring, tasks=_still(tasks, self._coming or tasks))
        self._retask()
        self._tell()

    def _retask(self) -> None:
        """Have the robot use the tasks in force, and no others."""
        tasks = self._body.wiring.tasks
        self._body.journal.use_tasks(tasks)
        self.robot.coordination.retask(tasks.tasks, self.robot.now, tasks.places)

    def _tell(self) -> None:
        """Have the robot use what is in force."""
        c, wiring = self.robot.coordination, self._body.wiring
        role = replace(wiring.with_live(c.role), unable=self._body.unable())
        c.reconfigure(self.robot.now, role, wiring.tasks.tasks)


def _other_files(before: Wiring, now: Wiring) -> list[str]:
    """The settings whose files say other things now, and are built into the voice and the recogniser, too."""
    lexicons = [(wiring.sound.lexicon.entries, wiring.sound.lexicon.places) for wiring in (before, now)]
    voices, others = before.sound.recorded, now.sound.recorded
    is_other = {
        "lexicon": lexicons[0] != lexicons[1],
        "voice_folder": any(not voices[name].same_as(others[name]) for name in voices.keys() & others.keys()),
        "security.key": before.keys != now.keys,
    }
    return [key for key, other in is_other.items() if other]


def _news_of_people(before: Mapping[str, Person], now: Mapping[str, Person]) -> list[dict[str, Any]]:
    """The people who are new, no longer enrolled, or have other sentences or takes."""
    changes: list[dict[str, Any]] = [
        {"key": f"{what} of {now[key].name}", "before": len(old[what]), "now": len(new[what])}
        for key in sorted(before.keys() & now.keys())
        if before[key] is not now[key]
        for old, new in [(content(before[key]), content(now[key]))]
        for what in new
        if old[what] != new[what]
    ]
    names = [sorted(person.name for person in people.values()) for people in (before, now)]
    return [{"key": "people", "before": names[0], "now": names[1]}, *changes] if names[0] != names[1] else changes


def _still(tasks: TaskRepository, coming: TaskRepository) -> TaskRepository:
    """The tasks without those that the coming ones lack: no words must be learned to leave a task alone. All of them
    if none would be left."""
    kept = [task for task in tasks.tasks if coming.by_name(task.name) is not None] or tasks.tasks
    numbers = frozenset(task.number for task in kept)
    return replace(tasks, tasks=tuple(replace(task, after=task.after & numbers) for task in kept))


def _words(tasks: TaskRepository) -> tuple[object, ...]:
    """The words of the tasks that are built into the recogniser; and the places with their areas."""
    names, said = {task.number: task.name for task in tasks.tasks}, {*tasks.remarks, *tasks.failures}
    return names, said, tasks.other_tasks, tasks.alternatives, tasks.places


def _task_changes(before: TaskRepository, now: TaskRepository) -> list[dict[str, Any]]:
    numbers = sorted({task.number for task in (*before.tasks, *now.tasks)})
    changes: list[dict[str, Any]] = []
    for number in numbers:
        old, new = before.by_number(number), now.by_number(number)
        if old != new:
            was, is_now = _described(old, new), _described(new, old)
            if was == is_now:
                is_now = f"{is_now}, others"
            changes.append({"key": f"task {number}", "before": was, "now": is_now})
    for (kind, had), has in zip(_parts(before).items(), _parts(now).values(), strict=True):
        if had != has:
            there = [f"{name}, changed" if name in had and had[name] != has[name] else name for name in has]
            changes.append({"key": kind, "before": list(had), "now": there})
    return changes


def _parts(tasks: TaskRepository) -> dict[str, dict[str, object]]:
    """What a task file has besides tasks, by kind and name."""
    return {
        "other tasks": dict.fromkeys(tasks.other_tasks),
        "alternatives": {f"{phrase} for {word}": None for word, phrase in tasks.alternatives},
        "declared skills": {skill.name: skill for skill in tasks.skills},
        "places": {place.name: place for place in tasks.places},
    }


def _described(task: TaskDefinition | None, other: TaskDefinition | None) -> str | None:
    """A task's name or, beside another one of the same name, in what it differs."""
    if task is None:
        return None
    if other is None or other.name != task.name:
        return task.name
    own, others = _traits(task), _traits(other)
    return ", ".join(text for key, text in own.items() if text != others[key]) or own["actions"]


def _traits(task: TaskDefinition) -> dict[str, str]:
    """What a task has besides its name, in words."""
    return {
        "place": f"at x {task.place.x_m:g} m, y {task.place.y_m:g} m" if task.place is not None else "without a place",
        "actions": plural(len(task.actions), "action"),
        "icon": f"icon {task.icon or 'none'}",
        "every": f"every {task.every.text}" if task.every is not None else "once",
        "priority": f"priority {task.priority}",
        "after": f"after {', '.join(map(str, sorted(task.after))) or 'none'}",
        "deadline": f"deadline {task.deadline_s / 60.0:g} min" if task.deadline_s is not None else "no deadline",
        "robots": f"for {plural(task.robots, 'robot')}",
        "on_demand": "on demand" if task.on_demand else "without being asked for",
    }
