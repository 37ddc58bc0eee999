"""A robot's memory of a shift, made up from a seed, with an account of all that is in it."""

from __future__ import annotations

import random
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from hvcpd.config.tasks import TaskDefinition, Wait
from hvcpd.language import messages as m
from hvcpd.language.phrasebook import Phrasebook, Vocabulary
from hvcpd.memory.store import Store, TranscriptRecord, TranscriptRow

BEGIN_S = 1_790_000_000.0
COLOURS = "green violet indigo orange yellow red blue white pink purple".split()
THINGS = "rose tulip lily daisy".split()
TASK_S = 240.0
"""From a robot's claim to its report."""


@dataclass
class Account:
    """What there is to find in the memory."""

    said: int = 0
    heard: Counter[str] = field(default_factory=Counter)
    """Sentences by speaker."""
    garbled: int = 0
    done: list[tuple[str, int]] = field(default_factory=list)
    failed: list[tuple[str, int]] = field(default_factory=list)
    stops: int = 0


@dataclass
class Remembered:
    """The rows of a memory, the team that talks in them, and the account."""

    names: tuple[str, ...]
    tasks: tuple[TaskDefinition, ...]
    rows: list[TranscriptRow]
    end_s: float
    account: Account

    @property
    def book(self) -> Phrasebook:
        """All that the team can say."""
        named, numbers = zip(*((task.name, task.number) for task in self.tasks), strict=True)
        return Phrasebook(Vocabulary(self.names, ("plant",), named, numbers))

    def write(self, path: Path) -> Path:
        """Keep it in a store, as a daemon does; the times of writing are not those of the rows."""
        store = Store(path)
        for row in self.rows:
            store.append_transcript(row.record)
        store.close()
        return path


def flower_tasks(count: int, start: str = "water the") -> tuple[TaskDefinition, ...]:
    """So many tasks with a colour in their names."""
    names = [f"{start} {colour} {thing}" for thing in THINGS for colour in COLOURS][:count]
    return tuple(TaskDefinition(n, name, None, (Wait(1.0),), "flower") for n, name in enumerate(names, 1))


def made_up(names: Sequence[str], tasks: Sequence[TaskDefinition], seed: int = 1, pause_s: float = 20.0) -> Remembered:
    """The first of the names remembers how they did the tasks in turn, gave some up, and talked."""
    rng = random.Random(seed)
    found = Remembered(tuple(names), tuple(tasks), [], BEGIN_S, Account())
    writer = _Writer(found, rng)
    for name in names:
        writer.say(name, f"Hi all, I am {name}, member of team plant", pause_s)
    for k, task in enumerate(tasks):
        name, number = names[k % len(names)], " ".join(spoken(task.number))
        writer.say(name, f"Hi team plant, I am {name}, I will complete task {number}", pause_s)
        if len(names) > 1:
            other = names[(k + 1) % len(names)]
            writer.say(other, f"Hi {name}, I am {other}, confirmed task {number}", TASK_S)
        if rng.random() < 0.3:
            writer.garble(pause_s)
        if rng.random() < 0.15:
            writer.say(name, f"Hi all, I am {name}, task {number} failed", pause_s)
            found.account.failed.append((name, task.number))
            continue
        if rng.random() < 0.1:
            writer.say(name, "Stop", pause_s)
            found.account.stops += 1
        for _ in range(rng.choice((1, 1, 2))):  # a report that nobody confirms is said again
            writer.say(name, f"Hi all, I am {name}, task {number} complete", pause_s)
        found.account.done.append((name, task.number))
    for name in names:
        writer.say(name, f"Hi all, I am {name}, member of team plant, report, I am free, battery twelve volts", pause_s)
    return found


def spoken(number: int) -> tuple[str, ...]:
    """A number's words."""
    book = Phrasebook(Vocabulary(("Rob",), (), ("fetch it",), (number,)))
    return book.slots["number"][m.TaskByNumber(number)]


class _Writer:
    def __init__(self, found: Remembered, rng: random.Random) -> None:
        self._found, self._rng = found, rng

    def say(self, name: str, text: str, after_s: float) -> None:
        own = name == self._found.names[0]
        if own:
            self._found.account.said += 1
        else:
            self._found.account.heard[name] += 1
        confidence = None if own else round(self._rng.uniform(0.85, 1.0), 3)
        self._row("said" if own else "heard", name, text, confidence, after_s)

    def garble(self, after_s: float) -> None:
        self._found.account.garbled += 1
        self._row("garbled", None, "", None, after_s)

    def _row(self, kind: str, name: str | None, text: str, confidence: float | None, after_s: float) -> None:
        at_s = self._found.end_s - BEGIN_S
        record = TranscriptRecord(at_s, kind, name, text, confidence)  # type: ignore[arg-type]
        self._found.rows.append(TranscriptRow(len(self._found.rows) + 1, self._found.end_s, record))
        self._found.end_s += after_s
