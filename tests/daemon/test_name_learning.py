"""Who comes to be known, and who is forgotten, while a robot lives."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import cast

import numpy as np
import pytest
from structlog.testing import capture_logs

from hvcpd.assembly.name_registry import NameRegistry
from hvcpd.assembly.plan import HearingPlan, RobotPlan, TeamPlan
from hvcpd.assembly.sound import make_sound
from hvcpd.config.tasks import Place, TaskDefinition, TaskRepository, Tend
from hvcpd.coordination.actions import Role
from hvcpd.daemon.adaptation import CurrentPeople
from hvcpd.daemon.cache_warm_up import CacheWarmUp
from hvcpd.daemon.name_learning import NameLearning
from hvcpd.language.phrasebook import Phrasebook, Vocabulary
from hvcpd.people.enrolled import Person
from hvcpd.robot.records import LearnName
from hvcpd.robot.robot import Robot
from tests.daemon.control_bench import run

TASKS = TaskRepository((TaskDefinition(1, "water the red rose", Place(0.0, 0.0), (Tend(1.0),)),))


class Adaptation:
    """What name_learning need of a robot; it never has the time to adopt what it is given."""

    now = 0.0
    voices: Mapping[str, str] = {}
    prepared = 0

    def __init__(self, *names: str) -> None:
        self.phrasebook = Phrasebook(Vocabulary(names, ("plant",), ("water the red rose",), (1,)))

    def expect(self, voices: Mapping[str, str]) -> None:
        self.voices = voices

    def prepare(self, go_on: Callable[[], bool]) -> None:
        self.prepared += go_on()


class School:
    """A robot's names, some of them of people, and its name_learning."""

    def __init__(self, units: Path | None, *names: str, settled: tuple[str, ...] = ()) -> None:
        self.sound = make_sound(None, units)
        self.people: dict[str, Person] = {}
        self.enrol(*names)
        role = Role("Bot", "plant", volunteer=False)
        hearing = HearingPlan(people=CurrentPeople(lambda: self.people), prepared=False)
        self.plan = RobotPlan(role, TeamPlan(("Bot", *names)), TASKS, 1, hearing=hearing)
        self.roster = NameRegistry(self.plan, self.sound, settled)
        self.adaptation = Adaptation("Bot", *names)

    def enrol(self, *names: str) -> None:
        """Nobody but these from now on."""
        self.people = {name.lower(): Person(name, {"stop": [np.ones((20, 24), np.float32)]}) for name in names}

    def name_learning(self) -> NameLearning:
        return NameLearning(cast(Robot, self.adaptation), self.roster, CacheWarmUp(self.plan, self.sound))

    async def join(self, *names: str) -> None:
        name_learning = self.name_learning()
        name_learning.join(names)
        await name_learning.settled()


async def test_the_words_of_new_tasks_are_learned_and_the_names_stay() -> None:
    school = School(None)
    taken: list[str] = []

    def adopt(book: Phrasebook, _ears: object, then: Callable[[], None]) -> None:
        taken.extend(book.vocabulary.tasks)
        assert book.vocabulary.names == ("Bot",)
        then()

    school.adaptation.adopt = adopt  # type: ignore[attr-defined]
    name_learning = school.name_learning()
    more = TaskRepository((TaskDefinition(2, "sweep the floor", None, (Tend(1.0),)),))
    name_learning.retask(more, lambda: taken.append("told"))
    await name_learning.settled()
    assert taken == ["sweep the floor", "water the red rose", "told"], "it may still have to speak of the other"


@pytest.mark.parametrize("name", ["Water the red rose", "water the red-rose"])
def test_a_task_that_is_only_written_otherwise_is_learned(name: str) -> None:
    """It clashed with itself, and no task of the file was taken any more until the next start."""
    book, _ = School(None).roster.retask(TaskRepository((replace(TASKS.tasks[0], name=name),)))
    assert book.vocabulary.tasks == (name,)


def test_who_is_removed_leaves_the_name_to_others(units: Path) -> None:
    school = School(units, "Clara")
    school.enrol()
    run(school.join())
    assert school.adaptation.voices.keys() == {"bot"}, "nobody expects Clara's voice any more"
    assert school.roster.names == ("Bot",), "and nobody's name sounds like hers"


def test_who_is_removed_before_it_was_learned_is_not(units: Path) -> None:
    school = School(units)
    run(school.join("Clara"))
    assert school.roster.names == ("Bot",)


def test_whom_the_settings_name_stays_known_when_an_enrolment_is_removed(units: Path) -> None:
    school = School(units, "Clara", "Rob", settled=("Bot", "Rob"))
    school.enrol()
    run(school.join())
    assert school.roster.names == ("Bot", "Rob")


def test_more_words_of_whom_it_knows_are_made_ready(units: Path) -> None:
    school = School(units, "Clara")
    run(school.join())
    assert school.adaptation.prepared == 1


def test_a_name_that_is_spelled_twice_and_then_enrolled_is_kept(units: Path) -> None:
    school = School(units)
    school.roster.names = ("Bot", "Zorg")  # as it was learned

    async def spell() -> None:
        name_learning = school.name_learning()
        name_learning.take([LearnName("Zorg")])  # before the robot has adopted it
        await name_learning.settled()

    with capture_logs() as logs:
        run(spell())
    assert logs == []
    school.enrol("Zorg")
    run(school.join("Zorg"))
    assert school.adaptation.voices["zorg"] == "zorg, enrolled"
    school.enrol()
    run(school.join())
    assert school.roster.names == ("Bot",), "as of anybody else who was removed"


def test_who_reads_while_people_change_finds_those_of_one_moment() -> None:
    people = {"ada": Person("Ada", {}), "ben": Person("Ben", {})}
    current = CurrentPeople(lambda: people)
    reading = iter(current.values())  # as the second pass's thread does
    assert next(reading).name == "Ada"
    people = {"cleo": Person("Cleo", {})}
    assert [person.name for person in reading] == ["Ben"]
    assert list(current) == ["cleo"]
