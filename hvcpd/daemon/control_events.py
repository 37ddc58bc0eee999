"""The events of a daemon's robot, of the same kinds as a mission's (hvcpd/reporting/events.py)."""

from __future__ import annotations

import base64
import math
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, get_args

import numpy as np

from hvcpd.coordination.actions import SaveTask
from hvcpd.coordination.coordination import Coordination
from hvcpd.coordination.states import State
from hvcpd.hardware.acoustics import SILENCE_DBFS, power_dbfs
from hvcpd.hardware.kinematics import twist_of
from hvcpd.ports import SAMPLE_RATE_HZ, Pose, Samples, WheelCommand, WheelReading
from hvcpd.reporting.events import (
    Garbled,
    Heard,
    Held,
    Level,
    LiveEvent,
    Moved,
    Noted,
    Odom,
    Performed,
    Said,
    Skill,
    Sound,
    StateChanged,
    TaskChanged,
)
from hvcpd.reporting.pcm import pcm_16
from hvcpd.robot.records import (
    DoubtRecord,
    GarbledRecord,
    HeardRecord,
    HoldRecord,
    PerformedRecord,
    RangeRecord,
    Record,
    SaidRecord,
    SkillRecord,
    StuckRecord,
    VoiceRecord,
)
from hvcpd.robot.robot import Robot
from hvcpd.robot.sealing import seal_shown

PERIOD_S = 0.25
"""Between two readings of the level, and of the pose: as fast as a person sees a meter move."""
FLOOR_PERIODS = 12
"""3 s, as the recogniser's own tracking of noise."""
KINDS: dict[str, type] = {each.__name__.lower(): each for each in get_args(LiveEvent)}
"""The kinds of events by the names that they have as JSON."""
FREQUENT = frozenset({"moved", "level", "odom", "drive", "sound"})
"""Sent only to clients that ask for them by name."""


class Meter:
    """Level of the microphone, own voice included."""

    def __init__(self) -> None:
        self.level_dbfs = SILENCE_DBFS
        self._power, self._count = 0.0, 0
        self._recent: deque[float] = deque(maxlen=FLOOR_PERIODS)

    @property
    def floor_dbfs(self) -> float:
        """The lowest level of the last 3 s."""
        return min(self._recent, default=SILENCE_DBFS)

    def take(self, heard: Samples) -> bool:
        """Take a block of shape (n,), float32; return whether a reading is complete."""
        self._power += float(np.dot(heard, heard))
        self._count += heard.size
        if self._count < PERIOD_S * SAMPLE_RATE_HZ:
            return False
        self.level_dbfs = power_dbfs(self._power / self._count)
        self._recent.append(self.level_dbfs)
        self._power, self._count = 0.0, 0
        return True


class SoundTap:
    """Collects what the microphone hears into events."""

    def __init__(self) -> None:
        self._blocks: list[Samples] = []

    def take(self, heard: Samples, now: float) -> Sound | None:
        """Take a block of shape (n,), float32, that ends at `now`; return an event for each PERIOD_S."""
        if heard.size == 0:  # the card is gone: what it heard before is not told as of when it is back
            self._blocks.clear()
            return None
        self._blocks.append(heard)
        n = sum(block.size for block in self._blocks)
        if n < PERIOD_S * SAMPLE_RATE_HZ:
            return None
        pcm = base64.b64encode(pcm_16(np.concatenate(self._blocks))).decode()
        self._blocks.clear()
        return Sound(now - n / SAMPLE_RATE_HZ, pcm)

    def rest(self) -> None:
        """Forget the collected sound: nobody listens any more."""
        self._blocks.clear()


@dataclass
class Tally:
    """Counters since the start; readers compute rates and shares from them."""

    heard: int = 0
    """Sentences of others that were understood."""
    said: int = 0
    garbled: int = 0
    """Speech that was not understood."""
    confidence_sum: float = 0.0
    """Of the sentences that were heard; each has 0 to 1."""
    air_s: float = 0.0
    """Time for which somebody spoke, this robot or one that it heard."""

    def take(self, record: Record) -> None:
        """Count a record."""
        match record:
            case SaidRecord():
                self.said += 1
                self.air_s += record.duration_s
            case HeardRecord() if math.isfinite(record.confidence):  # a word over other talk is no sentence
                self.heard += 1
                self.confidence_sum += record.confidence
                self.air_s += record.end_s - record.start_s
            case GarbledRecord():
                self.garbled += 1
                self.air_s += record.end_s - record.start_s


class EventSource:
    """Turns one robot's records into events; times are its sample clock's."""

    def __init__(self, name: str, meter: Meter) -> None:
        self._name = name
        self._meter = meter
        self._said = 0
        self._state: tuple[str, str, int | None] | None = None
        self._pose = Pose(math.inf, math.inf)

    def of_step(self, robot: Robot, records: Sequence[Record], is_reading: bool) -> Iterator[LiveEvent]:
        """The events of one block; `is_reading`: the meter has a new reading."""
        for record in records:
            event = self._of_record(record, robot)
            if event is not None:
                yield event
        yield from self._state_change(robot)
        if is_reading:
            yield Level(robot.now, self._name, self._meter.level_dbfs, self._meter.floor_dbfs)
            pose = robot.odometry.pose
            if not pose.near(self._pose):
                self._pose = pose
                yield Moved(robot.now, (pose,))

    def _of_record(self, record: Record, robot: Robot) -> LiveEvent | None:
        make = _MAKERS.get(type(record))
        if isinstance(record, SaidRecord):
            self._said += 1
            return Said(
                record.at_s,
                record.at_s + record.duration_s,
                self._said - 1,
                self._name,
                record.text,
                collided=False,
                seal=seal_shown(record.utterance),
            )
        return make(self._name, record, robot) if make is not None else None

    def _state_change(self, robot: Robot) -> Iterator[LiveEvent]:
        state = (*state_of(robot.coordination), robot.coordination.task)
        if state != self._state:
            self._state = state
            yield StateChanged(robot.now, self._name, *state)


def state_of(c: Coordination) -> tuple[str, str]:
    """The name of its state, and what it does in words. Who is stopped counts as that while it leaves, too."""
    return State.STOPPED.name.lower() if c.knowledge.latched else c.state.name.lower(), c.state.value


def odom_of(robot: Robot, reading: WheelReading) -> Odom:
    """The robot's pose and velocity at the last reading of its wheels."""
    pose = robot.odometry.pose
    twist = twist_of(WheelCommand(reading.left_rad_s, reading.right_rad_s), robot.odometry.drive)
    return Odom(robot.now, pose.x_m, pose.y_m, pose.heading_rad, twist.linear_m_s, twist.angular_rad_s)


def _heard(name: str, record: HeardRecord, _: Robot) -> LiveEvent:
    speaker = record.utterance.speaker or "somebody"
    seal = seal_shown(record.utterance, record.trust)
    sure, snr_db = record.confidence, record.snr_db
    return Heard(record.start_s, None, name, speaker, record.text, sure, snr_db, words=record.words, seal=seal)


def _performed(name: str, record: PerformedRecord, robot: Robot) -> LiveEvent:
    pose = robot.odometry.pose
    return Performed(record.at_s, name, record.task, pose.x_m, pose.y_m)


_MAKERS: dict[type, Callable[[str, Any, Robot], LiveEvent]] = {
    HeardRecord: _heard,
    GarbledRecord: lambda name, record, _: Garbled(record.start_s, name),
    HoldRecord: lambda name, record, _: Held(record.at_s, record.until_s, name),
    DoubtRecord: lambda name, record, _: Noted(record.at_s, name, record.speaker, record.note),
    RangeRecord: lambda name, record, _: Noted(record.at_s, name, record.peer, record.note),
    StuckRecord: lambda name, record, _: Noted(record.at_s, name, None, record.note),
    VoiceRecord: lambda name, record, _: Noted(record.at_s, name, record.speaker, record.note),
    SaveTask: lambda name, record, robot: TaskChanged(robot.now, name, record.number, record.state, record.owner),
    PerformedRecord: _performed,
    SkillRecord: lambda name, record, _: Skill(record.at_s, name, **record.shown()),
}
