"""The status of a daemon: its robot, its board and its body, as JSON has them."""

from __future__ import annotations

import math
import os
import time
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field, replace
from typing import Any

from hvcpd import __version__
from hvcpd.config.tasks import TaskRepository
from hvcpd.coordination.chatter import is_noisy
from hvcpd.coordination.choosing import in_name_conflict
from hvcpd.coordination.entry import DONE, Entry
from hvcpd.coordination.peers import Peer
from hvcpd.coordination.place_state import PlaceState
from hvcpd.daemon.base_request_handler import BaseRequestHandler
from hvcpd.daemon.cache_warm_up import Preparation
from hvcpd.daemon.control_events import Meter, Tally, state_of
from hvcpd.daemon.journal_service import JournalService
from hvcpd.daemon.skill_service import SkillService
from hvcpd.daemon.sound_service import SoundService
from hvcpd.daemon.wheel_service import WheelService
from hvcpd.daemon.wiring import Wiring
from hvcpd.hardware.stop_button import StopButton
from hvcpd.language.phrasebook import WORDS
from hvcpd.people.enrolled import Person
from hvcpd.ports import STANDSTILL
from hvcpd.robot.records import RangeRecord
from hvcpd.robot.robot import Robot


@dataclass
class Body:
    """The parts of a daemon that have been started; None: not yet."""

    wiring: Wiring
    journal: JournalService
    meter: Meter = field(default_factory=Meter)
    tally: Tally = field(default_factory=Tally)
    preparation: Preparation = field(default_factory=Preparation)
    robot: Robot | None = None
    sound: SoundService | None = None
    wheels: WheelService | None = None
    skills: SkillService = field(init=False)
    join: Callable[[Sequence[str]], None] = lambda _names: None
    """Has the robot know the names of those who were enrolled meanwhile, and what else there is new of who is."""
    retask: Callable[[TaskRepository, Callable[[], None]], None] | None = None
    """Has the robot learn the words of other tasks, and tells when it has; None: it cannot before its next start."""
    base: BaseRequestHandler | None = None
    """Of a robot whose base ROS has."""
    heard: bool = False
    """Sound has come."""
    button: StopButton | None = None
    voltage_v: float | None = None
    """The battery's voltage as the wheels measured it last."""
    began_s: float = field(default_factory=time.monotonic)
    """When the daemon was started, by the monotonic clock."""

    def __post_init__(self) -> None:
        self.skills = SkillService(lambda: self.wiring.tasks, self.tell_unable)

    @property
    def is_held_down(self) -> bool:
        """Whether the stop button is pressed, so that nothing releases the robot."""
        return self.button is not None and self.button.pressed

    @property
    def lacking(self) -> frozenset[int]:
        """The tasks whose skills nobody offers."""
        return self.wiring.tasks.lacking(self.skills.offered)

    def unable(self) -> frozenset[int]:
        """The tasks that the robot lacks the means for at present."""
        return self.lacking | (self.wiring.unable if self.base is None else self.base.unable(self.wiring))

    def tell_unable(self) -> None:
        """Update the tasks that the robot cannot do now. It may retry one that it gave up if it can do it again."""
        if self.robot is None:
            return
        c = self.robot.coordination
        before, now = c.role.unable, self.unable()
        if now != before:
            c.reconfigure(self.robot.now, replace(c.role, unable=now), forgiven=before - now)

    def update_person(self, person: Person) -> None:
        """Use more takes of an enrolled person."""
        people = {**self.wiring.people, person.name.lower(): person}
        self.wiring = replace(self.wiring, people=people)


def status_of(body: Body) -> dict[str, Any]:
    """All that `hvcpctl status` shows; docs/control.md lists the fields."""
    settings = body.wiring.settings
    return {
        "name": settings.name,
        "team": settings.team,
        "mode": settings.mode,
        "talk": _talk(body),
        "version": __version__,
        "pid": os.getpid(),
        "uptime_s": round(time.monotonic() - body.began_s, 1),
        "wall_s": round(time.time(), 3),
        "preparing": body.preparation.text,
        **_conversation(body),
        "button_pressed": body.is_held_down,
        "battery_v": body.voltage_v,
        "counts": {key: round(value, 3) for key, value in asdict(body.tally).items()},
        "sound": _sound(body),
        "wheels": _wheels(body),
        "skills": _skills(body),
        "memory": {
            "file": str(settings.memory_path),
            "lost": body.journal.lost,
            "fault": body.journal.fault,
            "loss": body.journal.loss,
            "unkept": body.journal.latch.unkept,
        },
    }


def tasks_of(robot: Robot) -> list[dict[str, Any]]:
    """The board, as this robot knows it, by number."""
    entries = sorted(robot.coordination.board.entries(), key=lambda entry: entry.number)
    return [_task(entry, robot) for entry in entries]


def words_of(robot: Robot) -> dict[str, list[str]]:
    """What the task file adds to the sentences besides its tasks."""
    vocabulary = robot.phrasebook.vocabulary
    return {kind: list(getattr(vocabulary, kind)) for kind in WORDS}


def _conversation(body: Body) -> dict[str, Any]:
    robot = body.robot
    if robot is None:
        nothing: dict[str, Any] = {"now_s": 0.0, "pose": None, "stopped": body.journal.stopped, "speaking": False}
        nothing |= {"task": None, "tasks": {}, "places": [], "peers": []}
        return {"state": "starting", "doing": "is starting", **nothing}
    c, now = robot.coordination, robot.now
    state, doing = state_of(c)
    task = body.wiring.tasks.by_number(c.task) if c.task is not None else None
    pose = robot.odometry.pose
    conflict = "; another robot uses its name, so it takes on nothing" if in_name_conflict(c.knowledge, now) else ""
    return {
        "state": state,
        "doing": doing + conflict,
        "now_s": round(now, 3),
        "pose": {
            "x_m": round(pose.x_m, 3),
            "y_m": round(pose.y_m, 3),
            "heading_deg": round(math.degrees(pose.heading_rad), 1),
        },
        "stopped": c.knowledge.latched,
        "speaking": robot.speaking,
        "task": {"number": task.number, "name": task.name} if task is not None else None,
        "tasks": dict(Counter("left_out" if _is_left_out(entry) else entry.state for entry in c.board.entries())),
        "places": [_place(each, now) for each in c.knowledge.places],
        "peers": [_peer(peer, robot) for peer in c.peers.all()],
    }


def _talk(body: Body) -> dict[str, Any]:
    """How much the robot says now, at which level, and whether for noise; `quiet`: the quiet hours."""
    settings, robot = body.wiring.settings, body.robot
    role = robot.coordination.role if robot is not None else None
    return {
        "now": role.talk.value if role is not None else settings.talk,
        "level_db": role.softly_db if role is not None else 0.0,
        "for_noise": robot is not None
        and not robot.coordination.role.softly_db
        and is_noisy(robot.coordination.knowledge, robot.now),
        "quiet": settings.quiet.hours,
    }


def _place(p: PlaceState, now: float) -> dict[str, Any]:
    """A place that only one robot fits in: its area, its keeper, and the waiting robots, the longest waiting first."""
    area = asdict(p.place)
    lasts = math.isfinite(p.lease_end_s) and not p.using
    return {
        "name": area.pop("name"),
        "area": area,
        "keeper": p.keeper,
        "inside": p.inside,
        "wanted_s": round(now - p.wanted_s, 1) if p.wanted_s is not None else None,
        "lease_s": round(max(p.lease_end_s - now, 0.0), 1) if lasts else None,
        "waiting": list(p.queue(now)),
    }


def _peer(peer: Peer, robot: Robot) -> dict[str, Any]:
    now, away = robot.now, robot.measures.distances.get(peer.name.lower())
    return {
        "name": peer.name,
        "team": peer.team,
        "present": robot.coordination.peers.is_present(peer.name, now),
        "heard_ago_s": round(now - peer.last_heard_s, 1),
        "confidence": round(peer.confidence, 3),
        "snr_db": round(peer.snr_db, 1) if peer.snr_db is not None else None,
        "away": _away(away, now) if away is not None else None,
    }


def _away(away: RangeRecord, now: float) -> dict[str, Any]:
    return {
        "distance_m": round(away.distance_m, 3),
        "deviation_m": round(away.deviation_m, 3),
        "sure": away.sure,
        "ago_s": round(now - away.at_s, 1),
    }


def _sound(body: Body) -> dict[str, Any]:
    return {
        "listening": body.heard and (body.sound is None or (body.sound.flowing and not body.sound.deaf)),
        "level_dbfs": round(body.meter.level_dbfs, 1),
        "floor_dbfs": round(body.meter.floor_dbfs, 1),
        "mute": body.sound is not None and body.sound.mute,
        "too_busy": body.sound is not None and body.sound.overload.standing,
        "lost": asdict(body.sound.counters) if body.sound else {},
    }


def _wheels(body: Body) -> dict[str, Any] | None:
    settings = body.wiring.settings.wheels
    if body.wheels is None and settings.driver == "none":
        return None
    wanted = body.wheels.wanted if body.wheels is not None else STANDSTILL
    return {
        "driver": settings.driver,
        "ros_mode": settings.ros_mode if settings.driver == "ros" else None,
        "open": body.wheels is not None,
        "fault": body.wheels.fault if body.wheels is not None else None,
        "turning": wanted != STANDSTILL,
        "left_rad_s": round(wanted.left_rad_s, 3),
        "right_rad_s": round(wanted.right_rad_s, 3),
    }


def _skills(body: Body) -> dict[str, Any]:
    """The skills offered, those that tasks need and nobody offers, and the call under way."""
    needed = frozenset(skill for task in body.wiring.tasks.tasks for skill in task.skills)
    return {
        "offered": sorted(body.skills.offered),
        "missing": sorted(needed - body.skills.offered),
        "call": body.skills.under_way.shown() if body.skills.under_way is not None else None,
    }


def _is_left_out(entry: Entry) -> bool:
    """Whether it counts as done although nobody did it: skipped, or not asked for yet."""
    return entry.state == DONE and entry.skipped


def _task(entry: Entry, robot: Robot) -> dict[str, Any]:
    definition = entry.definition
    place = definition.place
    claimed = entry.state == "claimed"
    return {
        "number": definition.number,
        "name": definition.name,
        "icon": definition.icon,
        "robots": definition.robots,
        "state": entry.state,
        "owner": entry.owner,
        "hearsay": entry.hearsay,
        "left_out": _is_left_out(entry),
        "lease_s": round(max(entry.lease_end_s - robot.now, 0.0), 1) if claimed else None,
        "failed_by": sorted(entry.failed_by),
        "every": definition.every.text if definition.every is not None else None,
        "unable": definition.number in robot.coordination.role.unable,
        "place": {"x_m": place.x_m, "y_m": place.y_m} if place is not None else None,
    }
