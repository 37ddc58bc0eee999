"""The settings of one robot: from defaults, a YAML file, the environment and options, the later over the earlier.

`etc/hvcpd.yaml` documents every key in place.
"""

from __future__ import annotations

import dataclasses
import math
import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal, ParamSpec, cast

from hvcpd.config.document import Document, KeyPath, Place, parse, read_bytes
from hvcpd.config.loading import Parts, between, checked, structure
from hvcpd.config.names import NameCheck, VoiceName, repeated_names, valid_robot_name, valid_team_name
from hvcpd.config.skill_settings import SkillSettings, StopButtonSettings, runnable, valid_skills
from hvcpd.config.sources import FILE_VARIABLE, Sourced, overlay_environment, sources_of
from hvcpd.config.tasks import default_tasks_path
from hvcpd.errors import did_you_mean
from hvcpd.ports import Pose

_P = ParamSpec("_P")

SYSTEM_SETTINGS_PATH = Path("/etc/hvcpd/hvcpd.yaml")
"""Read if no other file is named; it need not be there."""

STATE_DIR = Path("/var/lib/hvcpd")
"""Folder where a service keeps its state, by the Filesystem Hierarchy Standard."""

MAX_KNOWN_NAMES = 12
"""Robots known beforehand; each name makes the recognizer's network larger, and a class room has no more."""

MAX_TEAMS = 12
"""Teams whose names are known; each one makes the recognizer's network larger."""

DEFAULT_NAMES = ("Rob", "Bot")
"""The robots that are known without being told: the paper's."""

DEFAULT_TEAMS = ("plant", "a", "b")
"""The teams that are known without being told: the paper's."""

STAND_IN_NAME = "Rob"
"""The name in the settings of a command that is no robot; the first of the paper's two."""

VOICE_FACTORS = (0.8, 1.25)
"""Bounds of a robot's pitch and pace as multiples of its voice's: four semitones, and as slow as slow speech is."""

MAX_COORDINATE_M = 50
"""Bound of a start pose; the same as for the places of tasks."""


@dataclass(frozen=True)
class StartSettings:
    """Where the robot stands when the daemon starts, in the room's frame (REP-103)."""

    x_m: float = field(default=-5.0, metadata=between(-MAX_COORDINATE_M, MAX_COORDINATE_M))
    y_m: float = field(default=-5.0, metadata=between(-MAX_COORDINATE_M, MAX_COORDINATE_M))
    heading_deg: float = field(default=0.0, metadata=between(-360, 360))

    @property
    def pose(self) -> Pose:
        """The start with the heading in radians."""
        return Pose(self.x_m, self.y_m, math.radians(self.heading_deg))


@dataclass(frozen=True)
class AudioSettings:
    """Microphone and loudspeaker; a device is chosen by a part of its name, None is the system's default."""

    input_device: str | None = None
    output_device: str | None = None
    input_channel: int = field(default=1, metadata=between(1, 32))
    block_ms: int = field(default=25, metadata=between(5, 100))
    queue_s: float = field(default=2.0, metadata=between(0.1, 30))
    watchdog_s: float = field(default=1.0, metadata=between(0.1, 10))


@dataclass(frozen=True)
class SpeechSettings:
    """How the robot speaks, for long distances: slowly, and each sentence twice in a row."""

    rate: Literal["normal", "slow"] = "normal"
    repeat: Literal[1, 2] = 1


@dataclass(frozen=True)
class WaitSettings:
    """How long the robot waits for others; the defaults, with their reasons, are those of coordination's `Timing`."""

    absent_s: float = field(default=600.0, metadata=between(120, 86_400))
    lease_s: float = field(default=240.0, metadata=between(120, 86_400))
    answer_s: float = field(default=4.0, metadata=between(2, 60))


@dataclass(frozen=True)
class WheelSettings:
    """The wheels' motors; identifiers and dimensions are those of a TurtleBot3 Burger (ROBOTIS e-Manual)."""

    driver: Literal["auto", "opencr", "dynamixel", "xl430", "ros", "none"] = "auto"
    ros_mode: Literal["cmd_vel", "goal"] = "cmd_vel"
    port: str = "auto"
    baud_rate: Literal[9600, 57600, 115200, 1000000, 2000000, 3000000, 4000000, 4500000] = 1_000_000
    left_id: int = field(default=1, metadata=between(0, 252))
    right_id: int = field(default=2, metadata=between(0, 252))
    wheel_radius_m: float = field(default=0.033, metadata=between(0.01, 0.2))
    radius_ratio: float = field(default=1.0, metadata=between(0.8, 1.25))
    separation_m: float = field(default=0.160, metadata=between(0.05, 1.0))

    def __post_init__(self) -> None:
        if self.driver == "xl430":  # its name in version 0.2
            object.__setattr__(self, "driver", "dynamixel")

    @property
    def on_serial_port(self) -> bool:
        """Whether a handshake on a serial port finds them; other drivers raise what is wrong at `open`."""
        return self.driver in ("auto", "opencr", "dynamixel")

    @property
    def ids(self) -> tuple[int, int]:
        """The left and the right motor's identifier on the bus."""
        return self.left_id, self.right_id


@dataclass(frozen=True)
class ControlSettings:
    """The socket by which `hvcpctl` and other programs of this computer ask the daemon; None is the usual place."""

    enabled: bool = True
    socket: Path | None = None


@dataclass(frozen=True)
class ClipSettings:
    """Where recordings of what was not understood are kept, if at all, and how much of them at most."""

    folder: Path | None = None
    keep: int = field(default=200, metadata=between(1, 10_000))
    keep_mb: float = field(default=20.0, metadata=between(1, 10_000))


@dataclass(frozen=True)
class PeerSettings:
    """How another robot speaks, if not with the voice that follows from its name."""

    voice: VoiceName | None = None
    voice_folder: Path | None = None
    pitch: float = field(default=1.0, metadata=between(*VOICE_FACTORS))
    pace: float = field(default=1.0, metadata=between(*VOICE_FACTORS))


@dataclass(frozen=True)
class SecuritySettings:
    """The file of the team's key, None for what systemd hands over or else none; what people may do without one;
    whether what robots tell each other is hidden from all who have none."""

    key: Path | None = None
    people: Literal["everything", "questions", "nothing"] = "questions"
    encrypted: bool = False


def _valid_name(name: str) -> str | None:
    return valid_robot_name(name)


def _valid_names(names: tuple[str, ...]) -> str | None:
    if len(names) > MAX_KNOWN_NAMES:
        return f"at most {MAX_KNOWN_NAMES} names can be given, found {len(names)}; remove some"
    return next((text for name in names if (text := valid_robot_name(name))), None) or repeated_names(names)


def _valid_teams(teams: tuple[str, ...]) -> str | None:
    if len(teams) > MAX_TEAMS:
        return f"at most {MAX_TEAMS} teams can be given, found {len(teams)}; remove some"
    wrong = next((text for team in teams if (text := valid_team_name(team))), None)
    twice = next((team for index, team in enumerate(teams) if team in teams[:index]), None)
    return wrong or (f"the team {twice!r} is given twice; keep one" if twice is not None else None)


@dataclass(frozen=True)
class Settings:
    """All that one robot's daemon, or a command, needs to know beforehand.

    Of a robot that is loaded by `load_settings`, `teams` has its own `team` in it.
    """

    name: str = field(metadata=checked(_valid_name))
    team: str = field(default="plant", metadata=checked(valid_team_name))
    teams: tuple[str, ...] = field(default=DEFAULT_TEAMS, metadata=checked(_valid_teams))
    voice: VoiceName | None = None
    voice_folder: Path | None = None
    pitch: float = field(default=1.0, metadata=between(*VOICE_FACTORS))
    pace: float = field(default=1.0, metadata=between(*VOICE_FACTORS))
    synthesizer: Literal["formant", "natural"] = "formant"
    speech: SpeechSettings = SpeechSettings()
    waits: WaitSettings = WaitSettings()
    peers: Mapping[str, PeerSettings] = field(default_factory=dict)
    lexicon: Path | None = None
    tasks: Path = field(default_factory=default_tasks_path)
    names: tuple[str, ...] = field(default=DEFAULT_NAMES, metadata=checked(_valid_names))
    state_dir: Path = STATE_DIR
    mode: Literal["volunteer", "coordinate", "follow"] = "volunteer"
    pick: Literal["nearest", "random"] = "nearest"
    unable: tuple[int, ...] = ()
    clock: bool = True
    start: StartSettings = StartSettings()
    audio: AudioSettings = AudioSettings()
    wheels: WheelSettings = WheelSettings()
    stop_button: StopButtonSettings = field(default_factory=StopButtonSettings)
    control: ControlSettings = ControlSettings()
    clips: ClipSettings = ClipSettings()
    voices: Literal["robots", "enrolled", "any"] = "any"
    security: SecuritySettings = SecuritySettings()
    skills: Mapping[str, SkillSettings] = field(default_factory=dict, metadata=checked(valid_skills))
    seed: int | None = field(default=None, metadata=between(0, 2**32 - 1))
    log_level: Literal["debug", "info", "warning", "error"] = "info"
    log_format: Literal["auto", "console", "keyvalue", "json"] = "auto"

    @property
    def memory_path(self) -> Path:
        """The robot's memory: one file a robot, so that two on one computer share nothing."""
        return self.state_dir / f"{self.name.lower()}.sqlite3"

    @property
    def task_changes_path(self) -> Path:
        """What commands added to this robot's task file, and took out of it."""
        return self.state_dir / f"{self.name.lower()}.tasks.yaml"


@dataclass(frozen=True)
class Loaded:
    """Settings, and every key of them with its source, in the order of etc/hvcpd.yaml."""

    settings: Settings
    sources: tuple[Sourced, ...]
    file: Path | None = None
    skill_places: Mapping[str, str] = field(default_factory=dict)
    """Where each skill is written, as "FILE:LINE"."""


def load_with_sources(
    path: Path | None = None,
    overrides: Mapping[str, object] | None = None,
    *,
    name_needed: bool = True,
    reserved: NameCheck | None = None,
    system_path: Path = SYSTEM_SETTINGS_PATH,
    environment: Mapping[str, str] = os.environ,
) -> Loaded:
    """The settings in the file `path`, with the environment's variables and then a command's options over them.

    Without `path` the file that FILE_VARIABLE names is read, or else `system_path` if there is one. `overrides` maps
    a key such as `name` or `audio.input_device` to an option's value; None means that the option was not given. With
    `name_needed` false (commands that are no robot) STAND_IN_NAME takes the place of a missing name. `reserved` is the
    phrasebook's check of names. File names in the file are relative to its directory. Raises ConfigError with every
    fault.
    """
    if path is None and environment.get(FILE_VARIABLE):
        path = Path(environment[FILE_VARIABLE])
    if path is None and system_path.exists():
        path = system_path
    document = parse(read_bytes(path), str(path)) if path is not None else Document(Place("settings"))
    overlay_environment(document, Settings, environment)
    for key, value in (overrides or {}).items():
        if value is not None:
            plain = list(value) if isinstance(value, tuple) else value
            document.overlay(tuple(key.split(".")), plain, f"--{key.replace('.', '-').replace('_', '-')}")
    if not document.has(("name",)):
        if name_needed:
            document.fault(("name",), "the robot has no name; give --name NAME, or write `name: NAME` in the file")
        else:
            document.overlay(("name",), STAND_IN_NAME, "default")

    def check(parts: Parts) -> None:
        check_reserved(parts, reserved)
        check_peers(parts, DEFAULT_NAMES)
        _check_wheels(parts)

    settings = _with_whole_paths(structure(document, Settings, check), document, path)
    skill_places = {name: str(document.place(("skills", name))) for name in settings.skills}
    return Loaded(settings, tuple(sources_of(settings, document)), path, skill_places)


def _settings_of(load: Callable[_P, Loaded]) -> Callable[_P, Settings]:
    def settings(*given: _P.args, **options: _P.kwargs) -> Settings:
        return load(*given, **options).settings

    return settings


load_settings = _settings_of(load_with_sources)
"""The settings of `load_with_sources` alone."""


def _check_wheels(parts: Parts) -> None:
    """Two motors on one bus have two identifiers."""
    sides: tuple[tuple[KeyPath, int], ...] = (("wheels", "left_id"), 1), (("wheels", "right_id"), 2)
    given = [(path, parts.get(path, int) if parts.has(path) else usual) for path, usual in sides]
    (left, left_id), (right, right_id) = given
    if left_id is not None and left_id == right_id:
        text = f"{right[-1]}: both wheels have the identifier {left_id}; give each motor its own"
        parts.fault(right if parts.has(right) else left, text)


def _with_whole_paths(settings: Settings, document: Document, path: Path | None) -> Settings:
    """Return the settings with absolute file names, and with their own team among the teams."""

    def whole(name: Path, *key: str) -> Path:
        return _absolute(name, document, key, path)

    control, clips, security = settings.control, settings.clips, settings.security
    return dataclasses.replace(
        settings,
        teams=settings.teams if settings.team in settings.teams else (*settings.teams, settings.team),
        tasks=whole(settings.tasks, "tasks"),
        voice_folder=settings.voice_folder and whole(settings.voice_folder, "voice_folder"),
        peers={name: _found(peer, document, name, path) for name, peer in settings.peers.items()},
        lexicon=settings.lexicon and whole(settings.lexicon, "lexicon"),
        state_dir=whole(settings.state_dir, "state_dir"),
        control=dataclasses.replace(control, socket=control.socket and whole(control.socket, "control", "socket")),
        skills={name: runnable(skill, path) for name, skill in settings.skills.items()},
        clips=dataclasses.replace(clips, folder=clips.folder and whole(clips.folder, "clips", "folder")),
        security=dataclasses.replace(security, key=security.key and whole(security.key, "security", "key")),
    )


def _found(peer: PeerSettings, document: Document, name: str, path: Path | None) -> PeerSettings:
    folder = peer.voice_folder
    key = ("peers", name, "voice_folder")
    return dataclasses.replace(peer, voice_folder=folder and _absolute(folder, document, key, path))


def _absolute(name: Path, document: Document, key: KeyPath, path: Path | None) -> Path:
    """A file name from the configuration file is relative to that file's directory; ~ is the home directory."""
    if name.parts[:1] == ("~",):
        name = Path.home().joinpath(*name.parts[1:])
    from_file = path is not None and document.has(key) and document.place(key).source == str(path)
    return path.parent / name if path is not None and from_file else name


def check_reserved(parts: Parts, reserved: NameCheck | None) -> None:
    """No name is, or sounds like, a word of the phrasebook."""
    if reserved is None:
        return
    paths: list[KeyPath] = [("name",), *(("names", index) for index in range(parts.length(("names",))))]
    for path in paths:
        name = parts.get(path, str)
        text = reserved(name) if name is not None else None
        if text is not None:
            parts.fault(path, text)


def check_peers(parts: Parts, default_names: tuple[str, ...]) -> None:
    """Each peer is another robot among those that are known."""
    names = parts.get(("names",), tuple[str, ...]) if parts.has(("names",)) else default_names
    own = parts.get(("name",), str) or ""
    peers = parts.get(("peers",), cast(type[Any], Any))
    if names is None or not isinstance(peers, dict):
        return
    known = {name.casefold() for name in names}
    told: list[str] = []
    for peer in (peer for peer in peers if isinstance(peer, str)):
        told.append(peer)
        text = repeated_names(tuple(told))
        if peer.casefold() == own.casefold():
            text = f"{peer!r} is this robot itself; set its own `voice`, `pitch` and so on instead"
        elif text is None and peer.casefold() not in known:
            text = f"{peer[:40]!r} is not one of `names`; {did_you_mean(peer[:40], names)}"
        if text is not None:
            parts.fault(("peers", peer), text)
