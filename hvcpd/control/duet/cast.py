"""Who takes part in a duet, and how each robot's settings are loaded.

As in `hvcpctl simulate`, what a settings file says of one robot, its voice or its mode, counts for the robot that it
names; another robot has the voice that the file's `peers` give it, and its defaults.
"""

from __future__ import annotations

import argparse
import os
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from hvcpd.assembly.sound import user_cache_folder
from hvcpd.config.settings import PeerSettings, Settings
from hvcpd.config.settings_file import DEFAULT, load_with_sources
from hvcpd.control.simulate.team import as_written, named_robots, refuse_same_sound
from hvcpd.daemon.reloading import Rereading
from hvcpd.errors import ConfigError
from hvcpd.language.rewording import known_names
from hvcpd.synthesis.lexicon import Lexicon
from hvcpd.synthesis.likeness import name_fault, sounds_alike

START_X_M = -5.0
"""Start of the first robot; the others start beside it, 1 m apart."""
VISITOR = "Anna"
"""The visitor's name, which the robots know from the start, unless a robot's sounds like it."""
NO_FILE = Path(os.devnull) / "none.yaml"
"""Where there is no file: a duet does not read the system's settings."""
ROBOTS = 2
"""Robots without --names: what two daemons need of a computer most have."""
OF_ONE_ROBOT = ("voice", "voice_folder", "pitch", "rate", "unable", "clock", "stop_button")
"""Settings of the file that are those of the robot it names, and of no other; so are `peers`, `mode` and `wheels`."""


@dataclass(frozen=True)
class Cast:
    """The names of all `robots`, here or on another computer, and of the visitor; the settings file's `own` settings,
    of the robot that it names."""

    robots: tuple[str, ...]
    visitor: str
    own: Settings


def cast_of(options: argparse.Namespace) -> Cast:
    """Without names it is the one that the options or the settings name, and the next of the settings. Raises
    ConfigError, also for names that robots confuse."""
    loaded = load_with_sources(options.config, name_needed=False, system_path=NO_FILE)
    lexicon = Lexicon.load(loaded.settings.lexicon, loaded.settings.accent)
    usual = (options.as_name, loaded.name, *named_robots(loaded))
    named = options.names or _different(usual)[:ROBOTS]
    robots = _different((*named, options.as_name))
    if faults := [fault for name in robots if (fault := name_fault(name, lexicon))]:
        raise ConfigError("\n".join(faults))
    refuse_same_sound(robots, lexicon)
    visitors = (name for name in (VISITOR, *known_names()) if name_fault(name, lexicon) is None)
    free = (name for name in visitors if not any(sounds_alike(name, robot, lexicon) for robot in robots))
    return Cast(robots, next(free), loaded.settings)


def _different(names: Iterable[str | None]) -> tuple[str, ...]:
    """The names that there are, each once, as it is first written."""
    found: dict[str, str] = {}
    for name in names:
        if name is not None:
            found.setdefault(name.lower(), name)
    return tuple(found.values())


def rereading_of(options: argparse.Namespace, cast: Cast, folder: Path, robot: str, place: int) -> Rereading:
    """How to read one robot's settings, now and again; its memory lasts as long as the duet. Raises ConfigError."""
    state = folder / robot.lower()
    state.mkdir()
    with suppress(OSError):  # else what is rendered lasts as long as the duet, too
        if (units := user_cache_folder()) is not None:
            units.mkdir(parents=True, exist_ok=True)
            (state / "units").symlink_to(units)
    given: dict[str, object] = {
        "name": robot,
        "names": [*cast.robots, cast.visitor],
        "state_dir": str(state),
        "start.x_m": START_X_M + place,
        "control.enabled": True,  # the terminal asks there
        "control.socket": str(folder / f"{robot.lower()}.sock"),
        "voices": "any",
        **_of_one_robot(robot, cast),
    }
    more = {
        "tasks": options.tasks,
        "audio.input_device": options.input_device,
        "audio.output_device": options.output_device,
    }
    given |= {key: str(value) for key, value in more.items() if value is not None}

    load = partial(load_with_sources, options.config, given, system_path=NO_FILE)
    return Rereading(load, load().sources)


def _of_one_robot(robot: str, cast: Cast) -> dict[str, object]:
    """What takes the place of the file's settings of one robot. The simulated wheels have the default dimensions."""
    own, own_name = cast.own, as_written(cast.own.name, cast.robots)
    peers = ((as_written(name, cast.robots), peer) for name, peer in own.peers.items())
    voices = {name: _plain(peer) for name, peer in peers if name is not None}
    if robot == own_name:
        return {"peers": voices, "wheels": {"driver": "none"} if own.wheels.driver == "none" else DEFAULT}
    given: dict[str, object] = dict.fromkeys((*OF_ONE_ROBOT, "wheels"), DEFAULT)
    given |= voices.pop(robot, {})
    if own_name is not None:
        voices[own_name] = _plain(PeerSettings(own.voice, own.voice_folder, own.pitch, own.rate))
    return given | {"peers": voices, "mode": _mode(robot, cast, own_name)}


def _plain(voice: PeerSettings) -> dict[str, object]:
    """In the form of the settings file."""
    return {key: str(value) if isinstance(value, Path) else value for key, value in vars(voice).items() if value}


def _mode(robot: str, cast: Cast, own_name: str | None) -> str:
    """Where the file's robot gives orders the others follow; where it follows, the last of them gives orders."""
    if own_name is None or cast.own.mode == "volunteer":
        return "volunteer"
    others = [name for name in cast.robots if name != own_name]
    return "coordinate" if cast.own.mode == "follow" and robot == others[-1] else "follow"
