"""Missions for the tests, with the sentences written out."""

from __future__ import annotations

from collections import defaultdict

from hil_fakes.word_mission import WordMission, WordPlan
from hvcpd.config.tasks import Action, Forward, Place, TaskDefinition, Tend
from hvcpd.coordination.actions import Say
from hvcpd.coordination.coordination import Coordination
from hvcpd.coordination.states import State
from hvcpd.language import messages as m
from hvcpd.language.phrasebook import Phrasebook, Vocabulary

COLOURS = "green violet indigo orange yellow white purple silver".split()


def plants(n: int) -> tuple[TaskDefinition, ...]:
    return tuple(
        TaskDefinition(i + 1, f"water the {COLOURS[i]} rose", Place(float(i), 1.0), (Forward(2.0 + 3.0 * i), Tend(5.0)))
        for i in range(n)
    )


class Mission(WordMission):
    """A mission whose conversation and motions can be read."""

    def __init__(
        self, names: tuple[str, ...], tasks: tuple[TaskDefinition, ...], people: tuple[str, ...] = (), **plan: object
    ) -> None:
        self.slowly: defaultdict[str, list[bool]] = defaultdict(list)
        """Of each speaker, sentence by sentence: whether it was said slowly."""
        self.performed: list[tuple[int, tuple[Action, ...]]] = []
        """Each task, or 0, and the actions that any robot began to carry out."""
        self.holds_motion = False
        """Whether nothing is carried out: a robot goes on when the test calls its `performed`."""
        super().__init__(WordPlan(names, tasks, **plan), keep=True)  # type: ignore[arg-type]
        self.book = Phrasebook(
            Vocabulary((*names, *people), ("plant",), tuple(t.name for t in tasks), tuple(t.number for t in tasks))
        )

    def speak(self, speaker: str, utterance: m.Utterance, slowly: bool = False, times: int = 1) -> None:
        self.slowly[speaker].append(slowly)
        super().speak(speaker, utterance, slowly, times)

    def perform(self, name: str, task: int, actions: tuple[Action, ...]) -> None:
        self.performed.append((task, actions))
        if not self.holds_motion:
            super().perform(name, task, actions)

    def written(self, since_s: float = -1.0, without: tuple[str, ...] = ()) -> list[str]:
        """What was said, as people write it."""
        return [self.book.write(u) for at_s, who, u in self.said if at_s > since_s and who not in without]

    def hear(self, at_s: float, text: str, speaker: str = "") -> None:
        """Have somebody say a written sentence."""
        u = self.book.parse_text(text)
        self.tell(at_s, speaker or u.speaker or "somebody", u)

    @property
    def exactly_once(self) -> bool:
        return all(self.watered[t.number] == 1 for t in self.plan.tasks)


class Watched(WordMission):
    """A mission that notes when each robot begins at a task."""

    def __init__(self, plan: WordPlan) -> None:
        self.begun: list[tuple[float, str, int]] = []
        super().__init__(plan, keep=True)

    def perform(self, name: str, task: int, actions: tuple[Action, ...]) -> None:
        if task and self.robots[name].at_place:
            self.begun.append((self.air.now, name, task))
        super().perform(name, task, actions)

    def was_told(self, speaker: str, to: str, number: int, before_s: float) -> bool:
        """Whether somebody has told another one so far that it begins."""
        told = m.Utterance(speaker, m.ToRobot(to), None, m.Confirmed(m.TaskByNumber(number)))
        return any(at_s < before_s and m.parts(u)[0] == told for at_s, _, u in self.said)

    def check_each_begins_with_others(self) -> None:
        """Nobody has begun alone, or without having told the others so."""
        for task in (task for task in self.plan.tasks if task.robots > 1):
            acts = [(at_s, name) for at_s, name, number in self.begun if number == task.number]
            for at_s, name in acts:
                others = {other for _, other in acts if other != name}
                told = {other for other in others if self.was_told(name, other, task.number, at_s)}
                assert len(told) >= task.robots - 1, (task.number, name, at_s, acts)


def next_sentence(robot: Coordination, now: float = 0.0) -> tuple[m.Utterance, float]:
    """What a robot says next, without any answer until then, and when it has said so."""
    while True:
        now = max(now, robot.next_deadline())
        robot.tick(now)
        for action in robot.actions(now):
            if isinstance(action, Say):
                robot.spoken(now + 3.0)
                return action.utterance, now + 3.0


def utterance(speaker: str, to: str, statement: m.Statement) -> m.Utterance:
    return m.Utterance(speaker, m.ToRobot(to), None, statement)


def release_all(mission: WordMission) -> None:
    """Have a person say "resume" until all have heard it, also robots that are off when it is said first."""
    resume = m.Utterance(None, None, None, m.Resume())
    for pause_s in (1.0, 10.0, 30.0, 60.0):
        mission.tell(mission.air.now + pause_s, "Anna", resume)

    def say_again() -> None:  # other sentences may have been in the way every time
        if any(robot.state is State.STOPPED for robot in mission.robots.values()):
            mission.speak("Anna", resume)
            mission.at(mission.air.now + 25.0, say_again)

    mission.at(mission.air.now + 90.0, say_again)
