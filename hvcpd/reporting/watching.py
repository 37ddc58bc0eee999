"""A mission as it is going on: what has been said, what each robot believes of the tasks, where they are."""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass

from hvcpd.reporting.events import Event, Garbled, Heard, Moved, Performed, Said, Skill, Started, Summary, TaskChanged
from hvcpd.reporting.story import Line, meant_by, task_names

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
        self.doers: dict[int, list[str]] = {}
        """Of each task the robots that did it, once for each time."""
        self.failures: dict[int, str] = {}
        """Of each task the reason for which a skill failed last."""
        self.summary: Summary | None = None
        self.pending: list[Said] = []
        """Uttered, but not everybody has said yet what was heard; oldest first."""
        self._heard: dict[int, dict[str, Heard]] = {}
        self._garbled: list[Garbled] = []
        self._beliefs: dict[int, dict[str, Belief]] = {number: {} for number in self.names}

    def handle(self, event: Event) -> list[Note]:
        """Take an event in; returns what is now worth telling, in order."""
        told: list[Note] = []
        match event:
            case Said():
                self._pass(event.end_s)
                self.pending.append(event)
                self.pending.sort(key=lambda said: said.at_s)
            case Heard():
                if event.utterance is None:
                    told.append(event)
                else:
                    self._heard.setdefault(event.utterance, {})[event.listener] = event
            case Garbled():
                self._garbled.append(event)
            case TaskChanged():
                self._pass(event.at_s)
                told += self._changed(event)
            case Performed():
                self._pass(event.at_s)
                self.performed.setdefault(event.task, event.robot)
                self.doers.setdefault(event.task, []).append(event.robot)
                self.names.setdefault(event.task, f"task {event.task}")
                told.append(event)
            case Skill():
                self._pass(event.at_s)
                told += [event] if event.state in ("finished", "failed") else []
                if event.state == "failed":
                    self.failures[event.task] = event.text
            case Moved():
                self._pass(event.at_s)
                self.poses = event.poses
            case Summary():
                self.summary = event
                self._pass(event.virtual_s)
        return [*self.settle(), *told]

    def _pass(self, at_s: float) -> None:
        if math.isfinite(at_s):
            self.now_s = max(self.now_s, at_s)

    def _changed(self, event: TaskChanged) -> list[Note]:
        self.names.setdefault(event.task, f"task {event.task}")
        beliefs = self._beliefs.setdefault(event.task, {})
        before = beliefs.get(event.robot)
        beliefs[event.robot] = (event.state, event.owner)
        let_go = event.state in ("open", "failed") and before == ("claimed", event.robot)
        return [GaveUp(event.at_s, event.robot, event.task)] if let_go else []

    def settle(self, everything: bool = False) -> list[Note]:
        """The utterances that all have accounted for, or (`everything`) all that are pending."""
        told: list[Note] = []
        while self.pending:
            line = self.line(self.pending[0])
            if line.missed and not everything and self.now_s < line.said.end_s + PATIENCE_S:
                break
            self.pending.pop(0)
            self._heard.pop(line.said.utterance, None)
            self._garbled = [g for g in self._garbled if meant_by(g, [line.said]) is None]
            told.append(line)
        late = [g for g in self._garbled if everything or g.at_s < self.now_s - LONG_AGO_S]
        self._garbled = [g for g in self._garbled if g not in late]
        return told + list(late)

    def line(self, said: Said) -> Line:
        """An utterance with what is known of its listeners by now."""
        heard = self._heard.get(said.utterance, {})
        mine = [g.listener for g in self._garbled if meant_by(g, self.pending) == said]
        garbled = tuple(dict.fromkeys(name for name in mine if name not in heard))
        known = {said.speaker, *heard, *garbled}
        missed = tuple(name for name in self.started.robots if name not in known)
        return Line(said, tuple(heard.values()), garbled, missed)

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
