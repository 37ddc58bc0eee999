"""`hvcpctl prerender`: renders in advance what a robot's service renders at its first start."""

from __future__ import annotations

import argparse
import math
import os
import pwd
import shlex
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

from rich.console import Console
from rich.progress import Progress

from hvcpd.assembly.make import make_robot
from hvcpd.assembly.sound import user_cache_folder
from hvcpd.config.files import make_writable
from hvcpd.config.settings import Settings
from hvcpd.config.settings_file import load_with_sources
from hvcpd.control.output import print_note, show
from hvcpd.control.simulate.team import load_team
from hvcpd.daemon.cache_warm_up import CacheWarmUp, Preparation
from hvcpd.daemon.preflight import find_confusable
from hvcpd.daemon.wiring import wire_up
from hvcpd.errors import ConfigError, StoreError, unwritable, writing
from hvcpd.recognition.stages import SynchronousWorker
from hvcpd.synthesis.unit_cache import UnitCache

SERVICE_USER = "hvcpd"
"""The service's user, as in systemd/hvcpd.sysusers."""
ELSEWHERE = "set XDG_CACHE_HOME to a folder that you may write"


def run(options: argparse.Namespace) -> None:
    """Fill the service's cache, or else this user's; what is already there is not rendered again."""
    team = load_team(options, options.names or ())
    settings = team.settings if options.names is None else replace(team.settings, names=options.names)
    own = load_with_sources(options.config, name_needed=False).name if options.names is None else None
    names = settings.names if own is None else (own,)
    _become_owner(settings.state_dir)
    for_service = os.access(settings.state_dir, os.W_OK | os.X_OK, effective_ids=True) and settings.state_dir.is_dir()
    folder = settings.state_dir / "units" if for_service else user_cache_folder()
    if folder is None:
        raise ConfigError(f"state_dir: {settings.state_dir} cannot be written; {_remedy(options, settings.state_dir)}")
    with writing(folder, StoreError, otherwise=ELSEWHERE):
        make_writable(folder)  # before minutes of work where nothing can be kept
    for name in names:
        _prepare(replace(settings, name=name), folder, for_service)
    n_words = len(team.phrasebook.graph.words)
    result = {"words": n_words, "names": names, "folder": str(folder), "for_service": for_service}
    show(options.json, result, f"{n_words} words in the voices of {', '.join(names)} are ready in {folder}")
    if not for_service:
        why = "which is not there yet"
        if os.access(settings.state_dir, os.F_OK):
            why = f"which you cannot write; {_remedy(options, settings.state_dir)}"
        read = settings.state_dir / "units"
        print_note(f"note: this is your own cache; a service reads {read}, {why}")


def _prepare(settings: Settings, folder: Path, for_service: bool) -> None:
    """Render all that the daemon renders for this robot, in a robot that is discarded afterwards.

    Raises StoreError if the disk has become full meanwhile.
    """
    wiring = wire_up(settings, allow_confusable=True)
    cache = UnitCache(folder)
    sound = replace(wiring.sound, cache=cache)
    if for_service:
        find_confusable(replace(wiring, sound=sound))
    plan = wiring.plan(channel=SynchronousWorker(), second=SynchronousWorker())

    with Progress(console=Console(stderr=True)) as bar:
        task = bar.add_task(settings.name, total=None)

        def show(text: str) -> None:
            if cache.fault is not None:
                made.stop()
            bar.update(task, description=f"{settings.name}: {text}", completed=made.done, total=made.total)

        made = Preparation(show, logged_every_s=math.inf)
        warm_up = CacheWarmUp(plan, sound, made)
        warm_up.before_listening()
        warm_up.before_speaking()
        warm_up.the_rest(make_robot(plan, sound))
        bar.update(task, description=settings.name, completed=made.total, total=made.total)
    if cache.fault is not None:
        raise StoreError(unwritable(folder, cache.fault, ELSEWHERE))


def _become_owner(folder: Path) -> None:
    """Have root write as the owner of the folder, because the service could not maintain root's files."""
    with suppress(OSError):
        owner = folder.stat()
        if os.geteuid() == 0 != owner.st_uid:
            os.setegid(owner.st_gid)
            os.seteuid(owner.st_uid)


def _remedy(options: argparse.Namespace, folder: Path) -> str:
    user = SERVICE_USER
    with suppress(OSError, KeyError):
        user = pwd.getpwuid(folder.stat().st_uid).pw_name
    config = f" --config {shlex.quote(str(options.config))}" if options.config is not None else ""
    return f"for that one: sudo -u {user} hvcpctl prerender{config}"
