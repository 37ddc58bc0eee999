"""Missions of robots on both sides of a corridor that only one of them fits in."""

from __future__ import annotations

from hil_fakes.word_mission import WordPlan
from hil_fakes.word_traffic import TrafficMission
from hvcpd.config.shared_places import SharedPlace
from hvcpd.config.tasks import GoTo, Place, TaskDefinition, Wait
from hvcpd.language import messages as m
from hvcpd.language.phrasebook import Phrasebook, Vocabulary

CORRIDOR = SharedPlace("corridor", -0.75, -0.5, 0.75, 0.5)
WEST, EAST = Place(-4.0, 0.0), Place(4.0, 0.0)
NAMES = ("Bot", "Max", "Rob")
CROSSING = {"Bot": frozenset({2}), "Rob": frozenset({1})}
"""So that the one in the west has to go east, and the other way round."""


def across(number: int, goal: Place = EAST, wait_s: float = 2.0) -> TaskDefinition:
    return TaskDefinition(number, f"job {number}", goal, (GoTo(goal), Wait(wait_s)))


class Corridor(TrafficMission):
    """A mission whose conversation about the corridor can be read, and in which chosen robots miss sentences."""

    def __init__(
        self, names: tuple[str, ...], tasks: tuple[TaskDefinition, ...], starts: tuple[Place, ...], **plan: object
    ) -> None:
        self.deaf: dict[str, int] = {}
        from_where = dict(zip(names, starts, strict=True))
        mission = WordPlan(names, tasks, starts=from_where, places=(CORRIDOR,), **plan)  # type: ignore[arg-type]
        super().__init__(mission, keep=True)
        self.air.misses = self.misses
        self.book = Phrasebook(Vocabulary(names, ("plant",), numbers=(1, 2, 3), places=("corridor",)))

    def misses(self, listener: str, utterance: m.Utterance) -> bool:
        missed = self.deaf.get(listener, 0) > 0 and not isinstance(utterance.statement, m.Stop | m.Resume)
        self.deaf[listener] = self.deaf.get(listener, 0) - missed
        return missed

    def of_the_corridor(self) -> list[str]:
        kinds = m.PlaceWanted | m.PlaceGiven | m.PlaceTaken | m.PlaceFree
        return [self.book.write(u) for _, _, u in self.said if isinstance(u.statement, kinds)]

    def until_inside(self, name: str) -> None:
        self.run_until(lambda: self.robots[name].knowledge.places[0].inside, 0.25)


def heard(
    mission: Corridor, name: str, speaker: str, statement: m.Statement, now: float, to: str | None = None
) -> None:
    """A robot hears another one, and does what follows until now."""
    mission.robots[name].heard(m.Utterance(speaker, m.ToRobot(to) if to else m.ToAll(), None, statement), now)
