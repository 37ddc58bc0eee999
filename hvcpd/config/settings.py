"""The settings of one robot, with their defaults and bounds; `etc/hvcpd.yaml` documents every key in place."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

from hvcpd.config.loading import at_most, between, checked, of_each
from hvcpd.config.names import Accent, VoiceName, every_fault, valid_robot_name, valid_robot_names, valid_team_name
from hvcpd.config.quiet_hours import QuietSettings
from hvcpd.config.shared_places import WITHIN_ROOM
from hvcpd.config.skill_settings import SkillSettings, StopButtonSettings, way_fault
from hvcpd.config.skills import valid_keys
from hvcpd.config.tasks import TaskRepository, default_tasks_path
from hvcpd.config.unknown_keys import synonyms
from hvcpd.config.whereabouts import STATE_DIR, memory_path
from hvcpd.ports import Pose

MAX_KNOWN_NAMES = 12
"""Robots known beforehand; each name makes the recognizer's network larger, and a class room has no more."""

MAX_TEAMS = 12
"""Teams whose names are known; each one makes the recognizer's network larger."""

DEFAULT_NAMES = ("Rob", "Bot")
"""The robots that are known without being told: the paper's."""

DEFAULT_TEAMS = ("plant", "a", "b")
"""The teams that are known without being told: the paper's."""

VOICE_FACTORS = (0.8, 1.25)
"""Bounds of a robot's pitch and rate as multiples of its voice's: four semitones, and as slow as slow speech is."""

RATE_SYNONYMS = synonyms("pace", "speed", "tempo")
"""`pace` was the key's name once."""


@dataclass(frozen=True)
class StartSettings:
    """Where the robot stands when the daemon starts, in the room's frame (REP-103)."""

    x_m: float = field(default=-5.0, metadata=WITHIN_ROOM)
    y_m: float = field(default=-5.0, metadata=WITHIN_ROOM)
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
    """How the robot speaks: for long distances slowly, each sentence twice; `in_noise` more clearly, or not."""

    rate: Literal["normal", "slow"] = "normal"
    repeat: Literal[1, 2] = 1
    in_noise: Literal["clear", "plain"] = "clear"


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


def _valid_socket(path: Path | None) -> str | None:
    """What is wrong with the socket's name, or None: files beside it are named after it."""
    return None if path is None or path.name else f"{path} is a folder; name a file in it"


@dataclass(frozen=True)
class ControlSettings:
    """The socket by which `hvcpctl` and other programs of this computer ask the daemon; None is the usual place."""

    enabled: bool = True
    socket: Path | None = field(default=None, metadata=checked(_valid_socket))
    sound: bool = False
    """Whether they may also have what the microphone hears."""


@dataclass(frozen=True)
class ClipSettings:
    """The folder of recordings of speech that was not understood, if any, and its limits."""

    folder: Path | None = None
    keep: int = field(default=200, metadata=between(1, 10_000))
    keep_mb: float = field(default=20.0, metadata=between(1, 10_000))


@dataclass(frozen=True)
class PeerSettings:
    """How another robot speaks, if not with the voice that follows from its name."""

    voice: VoiceName | None = None
    voice_folder: Path | None = None
    pitch: float = field(default=1.0, metadata=between(*VOICE_FACTORS))
    rate: float = field(default=1.0, metadata=between(*VOICE_FACTORS) | RATE_SYNONYMS)


@dataclass(frozen=True)
class SecuritySettings:
    """The file of the team's key, None for what systemd hands over or else none; what people may do without one;
    whether what robots tell each other is hidden from all who have none."""

    key: Path | None = None
    people: Literal["everything", "questions", "nothing"] = "questions"
    encrypted: bool = False


def _valid_teams(teams: tuple[str, ...]) -> str | None:
    wrong = every_fault(teams, valid_team_name)
    twice = next((team for index, team in enumerate(teams) if team in teams[:index]), None)
    return wrong or (f"the team {twice!r} is given twice; keep one" if twice is not None else None)


@dataclass(frozen=True)
class Settings:
    """All settings of one robot's daemon, or of a command.

    Of a robot that is loaded by `load_settings`, `teams` has its own `team` in it.
    """

    name: str = field(metadata=checked(valid_robot_name))
    team: str = field(default="plant", metadata=checked(valid_team_name))
    teams: tuple[str, ...] = field(
        default=DEFAULT_TEAMS, metadata=checked(at_most(MAX_TEAMS, "teams can be given"), _valid_teams)
    )
    voice: VoiceName | None = None
    voice_folder: Path | None = None
    pitch: float = field(default=1.0, metadata=between(*VOICE_FACTORS))
    rate: float = field(default=1.0, metadata=between(*VOICE_FACTORS) | RATE_SYNONYMS)
    synthesizer: Literal["formant", "natural"] = "formant"
    accent: Accent = "us"
    speech: SpeechSettings = SpeechSettings()
    waits: WaitSettings = WaitSettings()
    peers: Mapping[str, PeerSettings] = field(default_factory=dict)
    lexicon: Path | None = None
    tasks: Path = field(default_factory=default_tasks_path)
    names: tuple[str, ...] = field(
        default=DEFAULT_NAMES, metadata=checked(at_most(MAX_KNOWN_NAMES, "names can be given"), valid_robot_names)
    )
    state_dir: Path = STATE_DIR
    mode: Literal["volunteer", "coordinate", "follow"] = "volunteer"
    pick: Literal["nearest", "random"] = "nearest"
    talk: Literal["full", "normal", "terse"] = "normal"
    quiet: QuietSettings = field(default_factory=QuietSettings)
    unable: tuple[int, ...] = ()
    clock: bool = True
    start: StartSettings = StartSettings()
    audio: AudioSettings = AudioSettings()
    wheels: WheelSettings = WheelSettings()
    stop_button: StopButtonSettings = field(default_factory=StopButtonSettings)
    control: ControlSettings = ControlSettings()
    clips: ClipSettings = ClipSettings()
    voices: Literal["robots", "enrolled", "any"] = "any"
    learn_voices: bool = True
    security: SecuritySettings = SecuritySettings()
    skills: Mapping[str, SkillSettings] = field(default_factory=dict, metadata=checked(valid_keys, of_each(way_fault)))
    seed: int | None = field(default=None, metadata=between(0, 2**32 - 1))
    log_level: Literal["debug", "info", "warning", "error"] = "info"
    log_format: Literal["auto", "console", "keyvalue", "json"] = "auto"

    @property
    def memory_path(self) -> Path:
        """The robot's memory."""
        return memory_path(self.state_dir, self.name)

    @property
    def task_changes_path(self) -> Path:
        """The file of tasks that commands have added to this robot's task file or removed from it."""
        return self.state_dir / f"{self.name.lower()}.tasks.yaml"

    def unable_for(self, tasks: TaskRepository) -> frozenset[int]:
        """The numbers of the tasks that the robot cannot do: its `unable` and, without wheels, those that drive."""
        return frozenset(self.unable) | (tasks.driving if self.wheels.driver == "none" else frozenset())
