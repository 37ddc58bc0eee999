"""Keeps the score of a mission from outside: each sentence's speaker and listeners, and the tasks truly done."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace

from hil_fakes.word_occurrences import times
from hvcpd.config.tasks import Place, TaskRepository
from hvcpd.coordination.actions import SaveTask
from hvcpd.language.messages import ToRobot
from hvcpd.ports import Pose
from hvcpd.reporting.events import Event, Garbled, Heard, Held, Performed, Said, Skill, Summary, TaskChanged
from hvcpd.robot.records import GarbledRecord, HeardRecord, HoldRecord, PerformedRecord, SaidRecord, SkillRecord
from hvcpd.robot.sealing import seal_shown

REACH_M = 0.3
"""A robot truly stands at a place only if it is this near: a burger's half length and a short arm."""
STILL_M = 0.01
"""Largest movement within `STANDS_S` of a robot that stands."""
STANDS_S = 0.2
"""Time over which `STILL_M` is measured: the limit is 5 cm/s, a quarter of a burger's speed."""


@dataclass
class _Sentence:
    said: Said
    to: str | None
    heard: dict[str, str]


class Scorekeeper:
    """Turns the robots' records into the mission's events. All times are the bench's."""

    def __init__(self, names: tuple[str, ...], tasks: TaskRepository, sink: Callable[[Event], None]) -> None:
        self.events: list[Event] = []
        self._names = names
        self._tasks = tasks
        self._sink = sink
        self._sentences: list[_Sentence] = []
        self._pending: list[int] = []
        self._done: dict[int, list[str]] = {}
        self._stood: dict[str, list[Pose]] = {name: [] for name in names}
        """Where each robot truly stood since it last finished a task."""
        self._rests: dict[str, tuple[Pose, float]] = {}
        """Where each robot was when it last moved, and when."""

    def emit(self, event: Event) -> None:
        self.events.append(event)
        self._sink(event)

    def note(self, robot: str, on_s: float, records: Iterable[object], pose: Pose, now: float) -> None:
        """Take one robot's reports of one block; it was switched on at `on_s` and truly is at `pose`."""
        self._watch(robot, pose, now)
        for record in records:
            match record:
                case SaidRecord():
                    self._said(robot, on_s, record)
                case HeardRecord():
                    self._heard(robot, on_s, record)
                case GarbledRecord():
                    self.emit(Garbled(on_s + record.start_s, robot))
                case HoldRecord(at_s, until_s):
                    self.emit(Held(on_s + at_s, on_s + until_s, robot))
                case SaveTask(number, state, owner):
                    self.emit(TaskChanged(now, robot, number, state, owner))
                case SkillRecord():
                    self.emit(Skill(on_s + record.at_s, robot, **record.shown()))
                case PerformedRecord():
                    self._performed(robot, record.task, pose, now)
        while self._pending and now >= self._sentences[self._pending[0]].said.end_s:
            self.emit(self._sentences[self._pending.pop(0)].said)

    def _said(self, robot: str, on_s: float, record: SaidRecord) -> None:
        start_s = on_s + record.at_s
        seal, number = seal_shown(record.utterance), len(self._sentences)
        said = Said(start_s, start_s + record.duration_s, number, robot, record.text, False, seal)
        for other in self._sentences[-len(self._names) :]:
            if other.said.end_s > start_s:
                other.said = replace(other.said, collided=True)
                said = replace(said, collided=True)
        to = record.utterance.addressee
        self._sentences.append(_Sentence(said, to.name if isinstance(to, ToRobot) else None, {}))
        self._pending.append(said.utterance)

    def _heard(self, robot: str, on_s: float, record: HeardRecord) -> None:
        start_s, end_s = on_s + record.start_s, on_s + record.end_s
        best, overlap_s = None, 0.0
        for sentence in reversed(self._sentences[-2 * len(self._names) :]):
            shared_s = min(end_s, sentence.said.end_s) - max(start_s, sentence.said.at_s)
            if sentence.said.speaker != robot and shared_s > overlap_s:
                best, overlap_s = sentence, shared_s
        if best is not None:
            best.heard[robot] = record.text
        utterance = best.said.utterance if best else None
        speaker = record.utterance.speaker or "somebody"
        words = tuple((word, on_s + from_s, on_s + to_s) for word, from_s, to_s in record.words)
        seal = seal_shown(record.utterance, record.trust)
        sure, snr_db = record.confidence, record.snr_db
        self.emit(Heard(start_s, utterance, robot, speaker, record.text, sure, snr_db, words, seal))

    def _performed(self, robot: str, number: int, pose: Pose, now: float) -> None:
        task = self._tasks.by_number(number)
        stood, self._stood[robot] = [*self._stood[robot], pose], []
        if task is None or all(min(_away_m(p, place) for p in stood) <= REACH_M for place in task.places):
            own = task.place if task is not None and task.place in task.places else None
            there = min(stood, key=lambda p: _away_m(p, own)) if own is not None else pose
            self._done.setdefault(number, []).append(robot)
            self.emit(Performed(now, robot, number, there.x_m, there.y_m))

    def _watch(self, robot: str, pose: Pose, now: float) -> None:
        """Note where the robot stands."""
        where, since_s = self._rests.get(robot, (pose, now))
        if robot not in self._rests or math.hypot(pose.x_m - where.x_m, pose.y_m - where.y_m) > STILL_M:
            self._rests[robot] = (pose, now)
        elif now - since_s >= STANDS_S and self._stood[robot][-1:] != [where]:
            self._stood[robot].append(where)

    def _understood(self, sentence: _Sentence) -> bool:
        """By whom it was meant for: one robot, or everybody else."""
        names = [n for n in self._names if n != sentence.said.speaker]
        meant = [n for n in names if n == sentence.to] or names
        return bool(meant) and all(sentence.heard.get(name) == sentence.said.text for name in meant)

    def summary(self, virtual_s: float, wall_s: float, seed: int, mode: str) -> Summary:
        """The mission's result; to be asked for once, at its end."""
        for index in self._pending:
            self.emit(self._sentences[index].said)
        self._pending.clear()
        counts = {task.number: self._done.get(task.number, []) for task in self._tasks.tasks}
        wanted = [task for task in self._tasks.tasks if not task.on_demand]
        done = {task.number: times(task, len(counts[task.number])) for task in wanted}
        undone = tuple(number for number, n in done.items() if n == 0)
        said = [s.said for s in self._sentences]
        return Summary(
            tasks=len(wanted),
            done={t.name: " and ".join(counts[t.number][: t.robots]) for t in self._tasks.tasks if counts[t.number]},
            duplicates=sum(max(n - 1, 0) for n in done.values()),
            lost=len(undone),
            utterances_sent=len(said),
            utterances_understood=sum(self._understood(s) for s in self._sentences),
            collisions=_collisions(said),
            virtual_s=virtual_s,
            wall_s=wall_s,
            realtime_factor=virtual_s / max(wall_s, 1e-9),
            seed=seed,
            mode=mode,
            undone=undone,
            repeated=tuple(number for number, n in done.items() if n > 1),
        )


def _away_m(pose: Pose, place: Place) -> float:
    return math.hypot(pose.x_m - place.x_m, pose.y_m - place.y_m)


def _collisions(said: list[Said]) -> int:
    """The number of times that a robot began to speak while another one spoke."""
    count, loud_until_s = 0, -math.inf
    for sentence in sorted(said, key=lambda s: s.at_s):
        count += sentence.at_s < loud_until_s
        loud_until_s = max(loud_until_s, sentence.end_s)
    return count
