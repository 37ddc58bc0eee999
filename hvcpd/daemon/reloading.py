"""Reads settings and tasks again while the robot lives: what can change at once does, the rest waits for a restart."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import structlog

from hvcpd.config.settings import Loaded, Settings
from hvcpd.config.sources import Sourced
from hvcpd.config.tasks import TaskRepository
from hvcpd.daemon.control_status import Body
from hvcpd.daemon.wiring import Wiring
from hvcpd.errors import HvcpdError, NotDoneError
from hvcpd.people.enrolled import Person

LIVE = ("mode", "pick", "unable", "clips", "log_level", "log_format")
"""Settings, or groups of them, that take effect at once. All others are built into the recogniser, the voice, the
conversation, the wheels or the sound card's stream."""

PEOPLE_FROM = ("name", "state_dir", "voices")
"""Settings that tell who of those enrolled counts."""

_log = structlog.get_logger(__name__)


@dataclass(frozen=True)
class Rereading:
    """How a daemon came by its settings, to do so again. `read` raises HvcpdError with every fault."""

    sources: tuple[Sourced, ...] = ()
    read: Callable[[], tuple[Loaded, Wiring]] | None = None
    set_log: Callable[[Settings], None] = lambda _: None


class Reloader:
    """One robot's settings in force, and where each comes from."""

    def __init__(self, body: Body, rereading: Rereading) -> None:
        self._body = body
        self._rereading = rereading
        self.sources = rereading.sources
        self._turn = asyncio.Lock()

    async def reload(self) -> dict[str, Any]:
        """What has changed, and what needs a restart to change. Raises HvcpdError; then nothing has changed."""
        if self._body.robot is None:
            raise NotDoneError(f"{self._body.wiring.settings.name} is still starting; try again in a moment")
        if self._rereading.read is None:
            return {"changed": [], "restart": []}
        async with self._turn:
            try:
                loaded, wiring = await asyncio.to_thread(self._rereading.read)
            except HvcpdError as error:
                _log.error("not reloaded", reason=str(error))
                raise
            result = self._take(loaded, wiring)
        changed = ", ".join(change["key"] for change in result["changed"])
        _log.info("reloaded", changed=changed or "nothing", needs_restart=", ".join(result["restart"]) or "nothing")
        return result

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
        if not set(PEOPLE_FROM).intersection(restart):
            known, found = wiring.sound.people, read.sound.people
            # Whom the settings name is one of the robots until an enrolment, in whose turns people do not take part.
            if (known.keys() ^ found.keys()) & {name.lower() for name in wiring.settings.names}:
                restart.append("people")
            changed += self._take_people(known, found)
        settings = replace(wiring.settings, **{key: getattr(read.settings, key) for key in LIVE})
        tasks = wiring.tasks
        if "tasks" not in restart and read.tasks != tasks:
            if _words(read.tasks) != _words(tasks):
                restart.append("tasks")
            else:
                changed += _task_changes(tasks, read.tasks)
                tasks = read.tasks
        self._body.wiring = replace(wiring, settings=settings, tasks=tasks)
        self._rereading.set_log(settings)
        self._tell_robot(self._body.wiring)
        return {"changed": changed, "restart": restart}

    def _take_people(self, known: dict[str, Person], read: dict[str, Person]) -> list[dict[str, Any]]:
        """Everybody counts with the words that are on file now; who is new comes to be known by name, too."""
        before, new = _names(known), [person.name for key, person in read.items() if key not in known]
        more = {key: read[key] for key in known.keys() & read.keys() if not known[key].same_as(read[key])}
        changes = [
            {"key": f"takes of {more[key].name}", "before": known[key].n_takes, "now": more[key].n_takes}
            for key in sorted(more)
        ]
        gone = known.keys() - read.keys()
        for key in gone:
            del known[key]
        known.update({key: person for key, person in read.items() if key not in known or key in more})
        if new or gone:
            changes.insert(0, {"key": "people", "before": before, "now": _names(known)})
        if changes:
            self._body.join(new)
        return changes


    def _tell_robot(self, wiring: Wiring) -> None:
        robot = self._body.robot
        if robot is not None:
            c = robot.coordination
            role = replace(wiring.with_live(c.role), unable=self._body.unable())
            c.reconfigure(robot.now, role, wiring.tasks.tasks)


def _names(people: dict[str, Person]) -> list[str]:
    return sorted(person.name for person in people.values())


def _words(tasks: TaskRepository) -> tuple[object, ...]:
    """What of the tasks can be spoken of, and is built into the recogniser."""
    names, said = {task.number: task.name for task in tasks.tasks}, {*tasks.remarks, *tasks.failures}
    return names, said, tasks.other_tasks, tasks.alternatives


def _task_changes(before: TaskRepository, now: TaskRepository) -> list[dict[str, Any]]:
    pairs = ((task, before.by_number(task.number)) for task in now.tasks)
    return [
        {"key": f"task {new.number}", "before": _described(old), "now": _described(new)}
        for new, old in pairs
        if old is not None and old != new
    ]


def _described(task: Any) -> str:
    place = f"at x {task.place.x_m:g} m, y {task.place.y_m:g} m" if task.place is not None else "without a place"
    return f"{place}, {len(task.actions)} action{'s' * (len(task.actions) != 1)}"
