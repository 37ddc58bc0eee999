"""Writes a robot's reports into its own store; with this and the store's `tasks` a robot survives a restart."""

from __future__ import annotations

import secrets
from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import cast

from hvcpd.config.tasks import TaskRepository
from hvcpd.coordination.actions import SaveChange, SaveDue, SavePeer, SaveTask
from hvcpd.memory.recent import OfTask, Recent
from hvcpd.memory.store import YEAR_9999_S, PeerRecord, Store, TaskRecord, TaskState, TranscriptRecord
from hvcpd.robot.records import (
    DoubtRecord,
    GarbledRecord,
    HeardRecord,
    HoldRecord,
    Record,
    SaidRecord,
    SaveCounter,
    SkillRecord,
    StuckRecord,
    VoiceRecord,
)
from hvcpd.robot.sealing import seal_shown
from hvcpd.security.codes import LOST
from hvcpd.security.guard import DOUBTED, LOST_BITS, SKIPPED

DUE = "due "
"""Before a task's number: the counter of the due time of its last completed occurrence, s since 1970."""
CHANGE = "change "
"""Before a task's number: the counter of its last change, doubled, plus one if it is left out since."""


class Journal:
    """One robot's store, fed with its records.

    `seals` keeps the counters of seals and codes: apart, because deleting the tasks for a fresh start must not make old
    recordings valid again. `recent` holds what is new about tasks until it is written.
    """

    def __init__(
        self,
        store: Store,
        tasks: TaskRepository,
        own_name: str,
        seals: Store | None = None,
        recent: Recent | None = None,
    ) -> None:
        self._store = store
        self._recent = recent
        self._seals = seals
        self._names = {task.number: task.name for task in tasks.tasks}
        self._own_name = own_name

    def use_tasks(self, tasks: TaskRepository) -> None:
        """Use these tasks from now on; records of others that are still to be written are kept, too."""
        self._names = {**self._names, **{task.number: task.name for task in tasks.tasks}}

    def recall(self) -> None:
        """Save the records that a killed daemon had not written yet, and have all that is known of a task under the
        number that it has in the task file by now. Raises StoreError."""
        left = self._recent.left(self._names) if self._recent is not None else []
        self._renumber()
        self.write(left, 0.0)

    def _renumber(self) -> None:
        """Tasks are told apart by their names, as when a robot that runs reads its task file again."""
        tasks, counters = self._store.tasks(), self._store.counters()
        now = self._numbers_now(tasks)
        wrong = [task for task in tasks if now.get(task.number) != task.number and self._is_listed(task)]
        if not wrong:
            return
        with self._store.together():
            for task in wrong:
                self._store.forget_task(task.number, [f"{kind}{task.number}" for kind in (DUE, CHANGE)])
            for task in (task for task in wrong if task.number in now):
                number = now[task.number]
                self._store.save_task(replace(task, number=number))
                for kind in (DUE, CHANGE):
                    if (value := counters.get(f"{kind}{task.number}")) is not None:
                        self._store.set_counter(f"{kind}{number}", value)

    def _is_listed(self, task: TaskRecord) -> bool:
        """Whether the task file has its name or its number; of another task it may have it again one day."""
        return task.number in self._names or task.name in self._names.values()

    def _numbers_now(self, tasks: Iterable[TaskRecord]) -> dict[int, int]:
        """The number that each of these tasks has in the task file by now; without those that are not in it."""
        number_of = {name: number for number, name in self._names.items()}
        return {task.number: number_of[task.name] for task in tasks if task.name in number_of}

    def hold(self, records: Sequence[OfTask], now: float) -> None:
        """Keep these records so that they survive a killed daemon, but not a power cut. Raises StoreError."""
        try:
            if self._recent is not None:
                self._recent.keep(records, self._names)
        except OSError:
            self.write(records, now)

    def remembered(self) -> dict[int, tuple[str, str | None]]:
        """The tasks' states as the robot last knew them: number → (state, owner)."""
        tasks = self._store.tasks()
        now = self._numbers_now(tasks)
        return {now[task.number]: (task.state, task.owner) for task in tasks if task.number in now}

    @property
    def dues(self) -> dict[int, float]:
        """The due time of the last completed occurrence of each recurring task, s since 1970, by number."""
        return {number: float(due_s) for number, due_s in self._counted(DUE).items() if 0 <= due_s < YEAR_9999_S}

    @property
    def changes(self) -> dict[int, tuple[int, bool]]:
        """The last change of each task that was changed, and whether it is left out since, by number."""
        return {number: (value // 2, value % 2 == 1) for number, value in self._counted(CHANGE).items()}

    def _counted(self, what: str) -> dict[int, int]:
        tasks = self._store.tasks()
        others = self._names.keys() - {task.number for task in tasks}
        now = self._numbers_now(tasks) | {number: number for number in others}
        counters = self._store.counters()
        return {now[number]: counters[f"{what}{number}"] for number in now if f"{what}{number}" in counters}

    @property
    def counters(self) -> dict[str, int]:
        """The last known counters of seals and codes."""
        return self._seals.counters() if self._seals is not None else {}

    @property
    def names(self) -> tuple[str, ...]:
        """All names that the robot has heard, the last heard at the end."""
        return tuple(peer.name for peer in self._store.peers())

    @property
    def robots(self) -> tuple[str, ...]:
        """Those of the names that have named a team, as people do not."""
        return tuple(peer.name for peer in self._store.peers() if peer.team is not None)

    def doubt_counters(self, fingerprints: Iterable[str], are_lost: bool) -> None:
        """Keep that the counters under these keys may lag behind, or are lost. Raises StoreError."""
        if self._seals is None:
            return
        known = self._seals.counters()
        for key in fingerprints:
            self._seals.raise_counter(f"{DOUBTED}{key}", known.get(f"{DOUBTED}{key}", 0) + 1)
            own = f"{key}/{self._own_name.casefold()}"
            if are_lost:
                self._seals.raise_counter(f"{LOST}{key}", 1)
                self._seals.raise_counter(own, secrets.randbits(LOST_BITS))
            elif own in known:
                self._seals.raise_counter(own, known[own] + SKIPPED)

    def check(self) -> None:
        """Raises StoreError if the file was replaced, cut short or deleted since it was opened."""
        self._store.check()

    def write_together(self, timed: Iterable[tuple[Record, float]], now: float) -> None:
        """Save the records with their times in one transaction, except the counters of seals. Raises StoreError."""
        timed = tuple(timed)
        self.write([record for record, _ in timed if isinstance(record, SaveCounter)], now)
        others = [(record, at_s) for record, at_s in timed if not isinstance(record, SaveCounter)]
        if not others:
            return
        with self._store.together():
            for record, at_s in others:
                self.write((record,), at_s, now - at_s)

    def write(self, records: Iterable[Record], now: float, ago_s: float = 0.0) -> None:
        """Keep the records of one step, `ago_s` after it. Raises StoreError."""
        for record in records:
            match record:
                case SaveTask(number, state, owner):
                    self._store.save_task(TaskRecord(number, self._names[number], cast(TaskState, state), owner, now))
                case SaveDue(number, due_s):
                    self._store.set_counter(f"{DUE}{number}", int(due_s))  # a clock that was ahead is set back
                case SaveChange(number, count, skipped):
                    self._store.set_counter(f"{CHANGE}{number}", 2 * count + skipped)
                case SavePeer(name, team, heard_at_s):
                    self._store.save_peer(PeerRecord(name, team, heard_at_s))
                case SaveCounter(name, value):
                    if self._seals is not None:
                        self._seals.raise_counter(name, value)
                case _ if (note := self._note(record)) is not None:
                    self._store.append_transcript(note, ago_s)

    def _note(self, record: Record) -> TranscriptRecord | None:
        """The record's line in the transcript, if it has one."""
        match record:
            case SaidRecord():
                seal = seal_shown(record.utterance) or None
                return TranscriptRecord(record.at_s, "said", self._own_name, record.text, None, seal)
            case HeardRecord():
                seal, speaker = seal_shown(record.utterance, record.trust) or None, record.utterance.speaker
                return TranscriptRecord(record.start_s, "heard", speaker, record.text, record.confidence, seal)
            case GarbledRecord():
                return TranscriptRecord(record.start_s, "garbled", None, "")
            case DoubtRecord() | VoiceRecord():
                return TranscriptRecord(record.at_s, "garbled", record.speaker, record.note)
            case SkillRecord() | StuckRecord() if record.note is not None:
                return TranscriptRecord(record.at_s, "garbled", None, record.note)
            case HoldRecord(at_s, until_s):
                stood = f"stop? no: stood still for {until_s - at_s:.1f} s"
                return TranscriptRecord(at_s, "garbled", None, stood)
        return None
