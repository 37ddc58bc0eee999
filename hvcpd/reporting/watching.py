"""A mission as it is going on: what has been said, what each robot believes of the tasks, where they are."""

from __future__ import annotations

import math
from bisect import insort
from collections import Counter
from dataclasses import dataclass
from operator import itemgetter

from hvcpd.reporting.events import Event, Garbled, Heard, Moved, Performed, Said, Skill, Started, Summary, TaskChanged
from hvcpd.reporting.story import Line, line_of, meant_by, task_names

PATIENCE_S = 2.0
"""After this nobody will report an utterance any more: recognition ends 0.25 s after the last word, plus a margin."""
LONG_AGO_S = 30.0
"""Speech that nobody here can have uttered by now: longer than any sentence of the phrasebook."""


@dataclass(frozen=True)
class GaveUp:
    """A robot let a task go that it had claimed."""

    at_s: float
    robot: str
    task: int


Note = Line | Heard | Garbled | Performed | Skill | GaveUp
"""What is worth a line: a settled utterance, speech from no robot, a task carried out or given up."""
Belief = tuple[str, str | None]
"""A task's state and owner, as one robot sees it."""


@dataclass(frozen=True)
class BoardRow:
    """One task: what is true or most believed, and the robots that believe otherwise."""

    task: int
    name: str
    state: str
    owner: str | None
    differing: tuple[tuple[str, Belief], ...]


class Watch:
    """Takes events in the order of their coming and says, one by one, what is worth telling."""

    def __init__(self, started: Started) -> None:
        self.started = started
        self.names, self.icons = task_names(started), dict(started.icons)
        self.now_s = started.at_s
        self.poses = started.starts
        self.performed: dict[int, str] = {}
        """Of each task that was done the robot that did it, or the last part of it, in their order."""
        self._robots = dict(started.shared)
        self.doers: dict[int, list[str]] = {}
        """Of each task the robots that did it, once for each time."""
        self.failures: dict[int, str] = {}
        """Of each task the reason for which a skill failed last."""
        self.summary: Summary | None = None
        self._queue: list[tuple[float, Said | Note]] = []
        """What is not told yet, with its time, oldest first. The time of an utterance is its end. It waits until
        everybody has said what was heard, and what comes after it waits too."""
        self._heard: dict[int, dict[str, Heard]] = {}
        self._garbled: list[Garbled] = []
        self._beliefs: dict[int, dict[str, Belief]] = {number: {} for number in self.names}

    def handle(self, event: Event) -> list[Note]:
        """Take an event in; returns what is now worth telling, in order."""
        match event:
            case Said():
                self._pass(event.end_s)
                self._add(event.end_s, event)
            case Heard():
                if event.utterance is None:
                    self._add(self.now_s, event)
                else:
                    self._heard.setdefault(event.utterance, {})[event.listener] = event
            case Garbled():
                self._garbled.append(event)
            case TaskChanged():
                self._pass(event.at_s)
                self._changed(event)
            case Performed():
                self._pass(event.at_s)
                doers = self.doers.setdefault(event.task, [])
                doers.append(event.robot)
                if len(doers) >= self._robots.get(event.task, 1):
                    self.performed.setdefault(event.task, event.robot)
                self.names.setdefault(event.task, f"task {event.task}")
                self._add(event.at_s, event)
            case Skill():
                self._pass(event.at_s)
                if event.state in ("finished", "failed"):
                    self._add(event.at_s, event)
                if event.state == "failed":
                    self.failures[event.task] = event.text
            case Moved():
                self._pass(event.at_s)
                self.poses = event.poses
            case Summary():
                self.summary = event
                self._pass(event.virtual_s)
        return self.settle()

    @property
    def wanted(self) -> int:
        """The number of tasks that are to be done: all but those on demand that nobody has done."""
        return len(self.names.keys() - (set(self.started.on_demand) - self.performed.keys()))

    def is_part(self, act: Performed) -> bool:
        """Whether it was only a part of the task: others were still to do theirs."""
        return act.task in self._robots and self.performed.get(act.task) != act.robot

    @property
    def pending(self) -> list[Said]:
        """Utterances of which not everybody has said yet what was heard; oldest first."""
        return [each for _, each in self._queue if isinstance(each, Said)]

    def _add(self, at_s: float, what: Said | Note) -> None:
        insort(self._queue, (at_s, what), key=itemgetter(0))

    def _pass(self, at_s: float) -> None:
        if math.isfinite(at_s):
            self.now_s = max(self.now_s, at_s)

    def _changed(self, event: TaskChanged) -> None:
        self.names.setdefault(event.task, f"task {event.task}")
        beliefs = self._beliefs.setdefault(event.task, {})
        before = beliefs.get(event.robot)
        beliefs[event.robot] = (event.state, event.owner)
        let_go = event.state == "open" and before == ("claimed", event.robot)
        if let_go:
            self._add(event.at_s, GaveUp(event.at_s, event.robot, event.task))

    def settle(self, everything: bool = False) -> list[Note]:
        """What comes before the first utterance that not all have accounted for yet; with `everything`, all of it."""
        notes: list[Note] = []
        while self._queue:
            _, first = self._queue[0]
            if isinstance(first, Said):
                line = self.line(first)
                is_open = line.missed or line.garbled  # a later search may understand what was garbled at first
                if is_open and not everything and self.now_s < first.end_s + PATIENCE_S:
                    break
                self._heard.pop(first.utterance, None)
                self._garbled = [g for g in self._garbled if meant_by(g, [first]) is None]
                first = line
            del self._queue[0]
            notes.append(first)
        late = [g for g in self._garbled if everything or g.at_s < self.now_s - LONG_AGO_S]
        self._garbled = [g for g in self._garbled if g not in late]
        return notes + list(late)

    def line(self, said: Said) -> Line:
        """An utterance with what is known of its listeners by now."""
        garbled = [g.listener for g in self._garbled if meant_by(g, self.pending) == said]
        return line_of(said, self._heard.get(said.utterance, {}), garbled, self.started.robots)

    def board(self) -> list[BoardRow]:
        """All tasks by number."""
        return [self._row(number) for number in sorted(self.names)]

    def _row(self, number: int) -> BoardRow:
        beliefs = dict.fromkeys(self.started.robots, ("open", None)) | self._beliefs.get(number, {})
        main = self._main(number, beliefs)
        differing = tuple((name, belief) for name, belief in beliefs.items() if belief != main)
        return BoardRow(number, self.names[number], *main, differing)

    def _main(self, number: int, beliefs: dict[str, Belief]) -> Belief:
        if number in self.performed:
            return "done", self.performed[number]
        working = [belief for name, belief in beliefs.items() if belief[1] == name and belief[0] == "claimed"]
        common = Counter(beliefs.values()).most_common(1)
        return working[0] if working else common[0][0] if common else ("open", None)
