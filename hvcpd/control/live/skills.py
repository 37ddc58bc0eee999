"""`hvcpctl skills`: carry out a running robot's skills, until interrupted."""

from __future__ import annotations

import argparse
import asyncio
import signal
import sys
from collections.abc import Coroutine, Iterator, Mapping
from contextlib import AsyncExitStack, ExitStack, closing, suppress
from pathlib import Path

from hvcpd.config.settings import Settings
from hvcpd.config.settings_file import load_with_sources
from hvcpd.config.task_file import load_tasks
from hvcpd.config.tasks import TaskRepository
from hvcpd.control.live.daemon_client import find_daemon
from hvcpd.daemon.skill_hosting import offer
from hvcpd.errors import ConfigError, HvcpdError
from hvcpd.hardware.gpio import missing
from hvcpd.skills.checks import faults
from hvcpd.skills.guard import GuardLine
from hvcpd.skills.objects import PythonRunner, installed, unusable
from hvcpd.skills.pins import PinRunner
from hvcpd.skills.runners import ProgramRunner, Runner


def run(options: argparse.Namespace) -> None:
    """Find the robot, prepare its skills, and serve them; repeat if the daemon restarts."""
    loaded = load_with_sources(options.config, {"name": options.name}, name_needed=False)
    settings = loaded.settings
    tasks = load_tasks(settings.tasks)
    if wrong := list(faults(settings, tasks, skill_places=loaded.skill_places)):
        raise ConfigError("\n".join(wrong))
    names = offered(settings, tasks)
    if options.check and (known := sorted({*names, *settings.skills})):
        if broken := list(_broken(names, settings, loaded.skill_places)):
            raise ConfigError("\n".join(broken))
        sys.stdout.writelines(f"ok  {name}: by {_carrier(name, settings)}\n" for name in known)
        return
    if not names:
        raise ConfigError(f"there is no skill to offer here: {_elsewhere(settings, tasks)}")
    with closing(find_daemon(options)) as daemon:
        path = daemon.path
        sys.stdout.write(f"Carrying out {', '.join(names)} for {daemon.name}; Ctrl-C ends it.\n")
    with suppress(KeyboardInterrupt):
        asyncio.run(until_ended(serve(path, settings, tasks, loaded.skill_places)))


def _broken(names: tuple[str, ...], settings: Settings, places: Mapping[str, str]) -> Iterator[str]:
    """What packages and pins lack, with the line and the remedy."""
    for name in names:
        skill = settings.skills.get(name)
        if skill is None and (why := unusable(name)):
            yield f"skill {name!r}: {why}; fix the package that provides it"
        if skill is not None and skill.gpio is not None and (why := missing()):
            yield f"{places[name]}: skills.{name}.gpio: pin {skill.gpio.pin} cannot be used: {why}"


def _elsewhere(settings: Settings, tasks: TaskRepository) -> str:
    """Who has the skills that this command does not carry out, or how to have one."""
    if settings.skills:
        return "; ".join(f"{name} is done by {_carrier(name, settings)}" for name in settings.skills)
    declared = ", ".join(skill.name for skill in tasks.skills) or "some"
    return f"name {declared} under `skills:` in the settings, or install a package"


def _carrier(name: str, settings: Settings) -> str:
    """What carries a skill out, in words."""
    skill = settings.skills.get(name)
    if skill is None:
        return "an installed Python package"
    if skill.joint is not None:
        return f"joint {skill.joint.id}, which hvcpd itself moves"
    if skill.ros is not None:
        return f"the action {skill.ros.action}, through `hvcpctl ros`"
    return f"pin {skill.gpio.pin}" if skill.gpio is not None else f"the program {skill.run[0]}"


async def until_ended(serving: Coroutine[None, None, None]) -> None:
    """Serve until SIGTERM or Ctrl-C; a skill under way is then cancelled and made safe."""
    task = asyncio.ensure_future(serving)
    asyncio.get_running_loop().add_signal_handler(signal.SIGTERM, task.cancel)
    with suppress(asyncio.CancelledError):
        await task


def offered(settings: Settings, tasks: TaskRepository) -> tuple[str, ...]:
    """The skills of the settings, without joints (the daemon's) and actions of ROS (`hvcpctl ros`), and the declared
    skills of Python packages."""
    declared = {skill.name for skill in tasks.skills}
    own = {name for name, skill in settings.skills.items() if skill.run or skill.gpio is not None}
    return tuple(sorted(own | declared.intersection(installed()) - settings.skills.keys()))


async def serve(
    path: Path, settings: Settings, tasks: TaskRepository, skill_places: Mapping[str, str] | None = None
) -> None:
    """Offer the skills to the daemon at `path` for ever. Raises HvcpdError for an error that a retry does not fix.
    `skill_places` has the line of each skill."""
    places = skill_places or {}
    async with AsyncExitStack() as stack:
        with ExitStack() as opened:
            pins = {skill.gpio.pin: skill.gpio.active_high for skill in settings.skills.values() if skill.gpio}
            guard = GuardLine(pins)
            opened.callback(guard.close)
            runners = {name: _runner(name, settings, guard, places.get(name)) for name in offered(settings, tasks)}
            stack.push(opened.pop_all())
        beat = asyncio.create_task(guard.beat())
        stack.callback(beat.cancel)
        for runner in runners.values():
            stack.push_async_callback(runner.close)
            if isinstance(runner, PythonRunner):
                await runner.open()
        await offer(path, runners)


def _runner(name: str, settings: Settings, guard: GuardLine, place: str | None) -> Runner:
    skill = settings.skills.get(name)
    if skill is None:
        return PythonRunner(name, guard)
    try:
        return PinRunner(skill.gpio) if skill.gpio is not None else ProgramRunner(skill.run, skill.safe, guard)
    except HvcpdError as error:
        where = f"{place}: " if place is not None else ""
        raise type(error)(f"{where}skills.{name}: {error}") from None
