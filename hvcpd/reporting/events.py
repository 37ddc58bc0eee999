"""The events of a mission, as a stream of frozen dataclasses; one JSON object a line for machines.

Times are seconds of the mission's sample clock. `utterance` numbers the utterances of a mission from 0.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hvcpd.config.shared_places import SharedPlace
from hvcpd.ports import PlaceGoal, Pose, Samples


@dataclass(frozen=True)
class Plant:
    """A task's place on the map."""

    task: int
    name: str
    x_m: float
    y_m: float


@dataclass(frozen=True)
class Started:
    at_s: float
    robots: tuple[str, ...]
    starts: tuple[Pose, ...]
    plants: tuple[Plant, ...]
    mode: str
    seed: int
    noise_db_spl: float
    tasks: tuple[tuple[int, str], ...] = ()
    """Every task's number and name, also without a place; empty: only tasks with a place are known."""
    icons: tuple[tuple[int, str], ...] = ()
    """The number and the icon of every task that has one."""
    shared: tuple[tuple[int, int], ...] = ()
    """The number of every task for several robots, and the number of robots."""
    on_demand: tuple[int, ...] = ()
    """The tasks that are done only on request."""
    places: tuple[SharedPlace, ...] = ()
    """Where only one robot fits in at a time."""


@dataclass(frozen=True)
class Said:
    """A robot began to speak at `at_s` (the event is issued when its speech ends)."""

    at_s: float
    end_s: float
    utterance: int
    speaker: str
    text: str
    collided: bool
    seal: str = ""
    """"sealed" or "encrypted" where there is a key; otherwise empty."""


@dataclass(frozen=True)
class Heard:
    """A robot recognised a sentence; `utterance` is the number of the utterance that it overlaps in time, if any. A
    "stop" that was heard by itself has neither confidence nor SNR: not a number, in JSON null."""

    at_s: float
    utterance: int | None
    listener: str
    speaker: str
    text: str
    confidence: float
    snr_db: float
    words: tuple[tuple[str, float, float], ...] = ()
    """Each recognised word, with its beginning and end, s; empty if the listener does not know them."""
    seal: str = ""
    """The listener's verdict on its seal: "sealed", "encrypted", "code" or "not trusted"; empty if it has none."""


@dataclass(frozen=True)
class Garbled:
    """A robot noticed speech that it could not understand."""

    at_s: float
    listener: str


@dataclass(frozen=True)
class Held:
    """A robot stood still until `until_s` because other talk sounded like "stop": a false halt."""

    at_s: float
    until_s: float
    robot: str


@dataclass(frozen=True)
class Noted:
    """A robot's note about a speaker: it does not believe the sentence, the voice does not belong to the name, or how
    far away the speaker is; or about itself (speaker null): why driving failed."""

    at_s: float
    robot: str
    speaker: str | None
    text: str


@dataclass(frozen=True)
class TaskChanged:
    """A task's `state` (open, claimed or done) or `owner` changed on a robot's board."""

    at_s: float
    robot: str
    task: int
    state: str
    owner: str | None


@dataclass(frozen=True)
class Performed:
    """A robot finished a task's actions at this place: in the simulated room its true place, else by odometry."""

    at_s: float
    robot: str
    task: int
    x_m: float
    y_m: float


@dataclass(frozen=True)
class Skill:
    """A skill that a robot uses for a task changed its state, or reports its progress (`share`, 0 to 1).

    `state` is one of VDA 5050's: waiting, initializing, running, paused, finished, failed (then `text` says why).
    `call` is the number of the call, different for each call of a robot.
    """

    at_s: float
    robot: str
    call: int
    task: int
    skill: str
    state: str
    share: float | None = None
    text: str = ""
    arguments: dict[str, float | str] = field(default_factory=dict)
    results: dict[str, float | str] = field(default_factory=dict)


@dataclass(frozen=True)
class Switched:
    """In the simulated room a device that a robot uses for a task, such as a pump, was switched on or off."""

    at_s: float
    robot: str
    task: int
    skill: str
    on: bool


@dataclass(frozen=True)
class Moved:
    """The robots' poses, a few times a second, for the live view: true in the simulated room, else by odometry."""

    at_s: float
    poses: tuple[Pose, ...]


@dataclass(frozen=True)
class Level:
    """The level of a robot's microphone, RMS in dBFS: now, and the quietest of the last 3 s."""

    at_s: float
    robot: str
    level_dbfs: float
    floor_dbfs: float


@dataclass(frozen=True)
class Odom:
    """A robot's pose in the room's frame and its velocity, by odometry; sent at each reading of the wheels."""

    at_s: float
    x_m: float
    y_m: float
    heading_rad: float
    linear_m_s: float
    angular_rad_s: float


@dataclass(frozen=True)
class Drive:
    """A command for a base under ROS: speeds, or a goal."""

    at_s: float
    linear_m_s: float
    angular_rad_s: float
    stopped: bool
    """Whether somebody has said "stop", and nobody "resume" since."""
    goal: PlaceGoal | None


@dataclass(frozen=True)
class Sound:
    """What the microphone heard from `at_s` on, the robot's own voice included."""

    at_s: float
    pcm: str
    """Mono, `SAMPLE_RATE_HZ`, 16-bit little-endian, in base64."""


@dataclass(frozen=True)
class StateChanged:
    """A robot's state changed: the state's name in docs/protocol.md, the same in words, and its task."""

    at_s: float
    robot: str
    state: str
    doing: str
    task: int | None


@dataclass(frozen=True)
class Memory:
    """The condition of a robot's memory has changed; each field is a reason, or None if all is well."""

    at_s: float
    robot: str
    fault: str | None
    """Why nothing can be saved."""
    unkept: str | None
    """Why a stop, or its end, would not survive a restart."""
    loss: str | None
    """Why the knowledge from before its start is lost."""


@dataclass(frozen=True)
class Summary:
    tasks: int
    done: dict[str, str]
    duplicates: int
    lost: int
    utterances_sent: int
    utterances_understood: int
    collisions: int
    virtual_s: float
    wall_s: float
    realtime_factor: float
    seed: int
    mode: str
    undone: tuple[int, ...] = ()
    """The tasks that were not carried out, or not by enough robots; as many as `lost`."""
    repeated: tuple[int, ...] = ()
    """The tasks that were carried out more than once."""
    stopped: tuple[str, ...] = ()
    """The robots that stood stopped at the end."""


Event = Started | Said | Heard | Garbled | Held | TaskChanged | Performed | Skill | Switched | Moved | Summary

LiveEvent = (
    Said
    | Heard
    | Garbled
    | Held
    | Noted
    | TaskChanged
    | Performed
    | Skill
    | Moved
    | Odom
    | Drive
    | Level
    | Sound
    | StateChanged
    | Memory
)
"""The events of a daemon's own robot; its poses, and the places of its tasks, come from odometry."""


def as_json(event: Event | LiveEvent) -> dict[str, Any]:
    """The event as a JSON object, its kind under "event"."""
    return {"event": type(event).__name__.lower(), **asdict(event)}


@dataclass(frozen=True)
class Trail:
    """A robot's true path: `t_s`, `x_m`, `y_m` of equal shape (n,), float64."""

    robot: str
    t_s: NDArray[np.float64]
    x_m: NDArray[np.float64]
    y_m: NDArray[np.float64]


@dataclass(frozen=True)
class MissionRecord:
    """A whole mission for the report: its events in order, trails, and the room's sound at the listener."""

    events: tuple[Event, ...]
    trails: tuple[Trail, ...]
    sound: Samples
    title: str = "A mission"
