"""Whole missions at the level of words: robots as pure state machines, driving as a delay."""

from __future__ import annotations

import math
import random
from collections import Counter
from dataclasses import dataclass, field

from hil_fakes.word_channel import WordChannel
from hvcpd.config.tasks import Forward, Place, TaskDefinition, Water
from hvcpd.coordination.actions import Halt, Perform, Role, SaveTask, Say
from hvcpd.coordination.coordination import Coordination
from hvcpd.language.messages import Utterance
from hvcpd.language.phrasebook import Phrasebook, Vocabulary

COLOURS = "green violet indigo orange yellow white purple silver".split()


def plants(n: int) -> tuple[TaskDefinition, ...]:
    return tuple(
        TaskDefinition(
            i + 1, f"water the {COLOURS[i]} rose", Place(float(i), 1.0), (Forward(2.0 + 3.0 * i), Water(5.0))
        )
        for i in range(n)
    )


@dataclass
class Mission:
    names: tuple[str, ...]
    tasks: tuple[TaskDefinition, ...]
    seed: int = 0
    loss: float = 0.0
    coordinator: str | None = None
    robots: dict[str, Coordination] = field(default_factory=dict)
    watered: Counter[int] = field(default_factory=Counter)
    by: dict[int, str] = field(default_factory=dict)
    said: list[tuple[float, str]] = field(default_factory=list)
    saved: dict[str, dict[int, tuple[str, str | None]]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.book = Phrasebook(
            Vocabulary(self.names, ("plant",), tuple(t.name for t in self.tasks), tuple(t.number for t in self.tasks))
        )
        chance = random.Random(self.seed)
        for name in self.names:
            role = Role(name, "plant", coordinator=name == self.coordinator, volunteer=self.coordinator is None)
            self.robots[name] = Coordination(role, self.tasks, random.Random(chance.random()))
            self.saved[name] = {}
        self.air = WordChannel(
            self.robots, lambda u: len(self.book.render(u)), self.loss, self.seed, after_each=lambda now: self.collect()
        )
        self._jobs: dict[str, int] = dict.fromkeys(self.names, 0)

    def collect(self) -> None:
        for name, robot in self.robots.items():
            for action in robot.actions():
                match action:
                    case Say(utterance):
                        self.said.append((self.air.now, self.book.write(utterance)))
                        self.air.say(name, utterance)
                    case Perform():
                        self._perform(name, action)
                    case Halt():
                        self._jobs[name] += 1
                    case SaveTask(number, state, owner):
                        self.saved[name][number] = (state, owner)

    def _perform(self, name: str, action: Perform) -> None:
        self._jobs[name] += 1
        job = self._jobs[name]
        waters = any(isinstance(a, Water) for a in action.actions)
        length_s = sum(a.duration_s if isinstance(a, Water) else abs(a.distance_m) / 0.2 for a in action.actions)

        def finish() -> None:
            if self._jobs[name] == job:
                if waters:
                    self.watered[action.task] += 1
                    self.by[action.task] = name
                self.robots[name].performed(self.air.now)

        self.air.at(self.air.now + length_s, finish)

    def tell(self, at_s: float, speaker: str, utterance: Utterance) -> None:
        """Have a person say something."""
        self.air.at(at_s, lambda: self.air.say(speaker, utterance))

    def run(self, limit_s: float = 3000.0, settle_s: float = 20.0) -> None:
        step = 5.0
        while self.air.now < limit_s:
            self.air.run_until(self.air.now + step, self.next_deadline)
            if all(r.board.all_done for r in self.robots.values()):
                self.air.run_until(self.air.now + settle_s, self.next_deadline)
                return

    def next_deadline(self) -> float:
        return min((r.next_deadline() for r in self.robots.values()), default=math.inf)

    @property
    def exactly_once(self) -> bool:
        return all(self.watered[t.number] == 1 for t in self.tasks)
