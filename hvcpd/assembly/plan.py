"""The differences between robots, grouped by what they describe; None stands for the default."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace

from hvcpd.config.settings import DEFAULT_TEAMS, SpeechSettings
from hvcpd.config.tasks import TaskRepository
from hvcpd.coordination.actions import Role, Speech, Timing
from hvcpd.hardware.kinematics import BURGER, Drive
from hvcpd.hardware.navigator import Navigator
from hvcpd.people.enrolled import Person
from hvcpd.people.second_pass import Found
from hvcpd.ports import Pose, WheelReading
from hvcpd.recognition.channel.search import ChannelSegment, SearchResult
from hvcpd.recognition.stages import Segment, Worker
from hvcpd.robot.own_voice import Acoustics
from hvcpd.security.keys import KeyRing
from hvcpd.security.silence import Patience


@dataclass(frozen=True)
class TeamPlan:
    """The names that it knows in advance: `names` of all robots and people, including its own."""

    names: tuple[str, ...]
    given: tuple[str, ...] | None = None
    """The names that all robots were given, if `names` has others that it has learned; None: all."""
    teams: tuple[str, ...] = DEFAULT_TEAMS
    strangers: bool = False
    """Robots that it does not know may come and spell their names."""


@dataclass(frozen=True)
class BodyPlan:
    """Its place and its drive."""

    start: Pose = field(default_factory=lambda: Pose(0.0, 0.0))
    home: Pose | None = None
    """The place to which it returns, if that is not its first place."""
    reading: WheelReading | None = None
    """Of its wheels at `start`, if that was kept."""
    drive: Drive = BURGER
    navigator: Navigator | None = None
    """Plans its ways."""


@dataclass(frozen=True)
class MemoryPlan:
    """Its memory: its tasks (number → state, owner), and whether it was `stopped` when it was switched off."""

    tasks: Mapping[int, tuple[str, str | None]] = field(default_factory=dict)
    stopped: bool = False
    counters: Mapping[str, int] = field(default_factory=dict)
    """Of seals and codes."""
    dues: Mapping[int, float] = field(default_factory=dict)
    """The occurrence for which each recurring task was last done, s since 1970."""
    changes: Mapping[int, tuple[int, bool]] = field(default_factory=dict)
    """The last change of each task, and whether it is left out since."""

    def with_names(self, names: Iterable[str]) -> MemoryPlan:
        """The same with the owners' names as they are written now; who is known no more is nobody in particular."""
        known = {name.casefold(): name for name in names}
        owned = {n: (state, known.get((owner or "").casefold())) for n, (state, owner) in self.tasks.items()}
        return replace(self, tasks=owned)


@dataclass(frozen=True)
class HearingPlan:
    """The voices that it listens for besides robots'."""

    acoustics: Acoustics = field(default_factory=Acoustics)
    people: Mapping[str, Person] = field(default_factory=dict)
    """The enrolled people, and no robots, by name in lower case. It is read again at each use, possibly in a thread."""
    channel: Worker[ChannelSegment, SearchResult] | None = None
    """A second pass for robots that speak through an unknown channel; None: there are none."""
    second: Worker[Segment, Found] | None = None
    """A second pass over sound that the voices of robots do not explain; None: no second pass."""
    any_voice: bool = True
    """It also looks for people who are not enrolled."""
    prepared: bool = True
    """Spelled names are recognised at once, and voices by their waveform, which is in the cache, or may be rendered
    when it is needed; otherwise `Robot.prepare` is to be called."""


@dataclass(frozen=True)
class SecurityPlan:
    """Where the team has `keys`, all important sentences are sealed, and nothing else is believed."""

    keys: KeyRing | None = None
    encrypts: bool = False
    """It encrypts its sentences for all listeners without a key."""
    patience: Patience | None = None
    """With wrong seals."""


@dataclass(frozen=True)
class RobotPlan:
    """One robot: its identity, and the groups above."""

    role: Role
    team: TeamPlan
    tasks: TaskRepository
    seed: int
    body: BodyPlan = BodyPlan()
    memory: MemoryPlan = MemoryPlan()
    hearing: HearingPlan = HearingPlan()
    security: SecurityPlan = SecurityPlan()
    timing: Timing | None = None

    @property
    def roster(self) -> tuple[str, ...]:
        """The robots' names that all were given, if its own is one of them."""
        given = self.team.names if self.team.given is None else self.team.given
        return self.robots(given) if self.role.listed else ()

    def robots(self, names: Iterable[str]) -> tuple[str, ...]:
        """The names without those of enrolled people."""
        return tuple(name for name in names if name.lower() not in self.hearing.people)

    def peers(self, names: Iterable[str]) -> tuple[str, ...]:
        """The names of the other robots, whose voices it recognises; its own if there is no other."""
        robots = self.robots(names)
        return tuple(name for name in robots if name.lower() != self.role.name.lower()) or robots


def speech_of(settings: SpeechSettings) -> Speech:
    """How a robot with these settings says everything."""
    return Speech(settings.rate == "slow", settings.repeat, follows_noise=settings.in_noise == "clear")
