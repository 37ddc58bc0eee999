"""A whole robot whose own voice comes back later or sooner than it was told."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np
import pytest

from hvcpd.assembly.make import make_robot
from hvcpd.assembly.plan import HearingPlan, RobotPlan, TeamPlan
from hvcpd.assembly.sound import Sound, make_sound, user_cache_folder
from hvcpd.config.tasks import Place, TaskDefinition, TaskRepository, Wait
from hvcpd.coordination.actions import Role
from hvcpd.language.messages import NameTaken
from hvcpd.ports import SAMPLE_RATE_HZ
from hvcpd.recognition.events import Recognised
from hvcpd.robot.own_voice import Acoustics
from hvcpd.robot.records import EchoRecord, GarbledRecord, HeardRecord, Record, SaidRecord
from hvcpd.robot.robot import Robot
from tests.robot.test_hold import Bench

BLOCK = 400
BLOCK_S = BLOCK / SAMPLE_RATE_HZ
TASKS = TaskRepository(
    tuple(TaskDefinition(number, f"water the {color} rose", Place(0.0, 0.0), (Wait(1.0),))
          for number, color in ((1, "green"), (2, "violet")))
)  # fmt: skip


@cache
def sound() -> Sound:
    return make_sound(None, user_cache_folder())


class Alone:
    """A robot in a room of its own, and its voice on its way through a sound system of that delay."""

    def __init__(self, told_s: float, gain: float = 0.5) -> None:
        role = Role("Rob", "plant", volunteer=True)
        plan = RobotPlan(role, TeamPlan(("Rob", "Bot")), TASKS, 1, hearing=HearingPlan(Acoustics(told_s)))
        self.robot: Robot = make_robot(plan, sound())
        self.records: list[Record] = []
        self._gain = gain
        self._air = np.zeros(SAMPLE_RATE_HZ * 200, np.float32)
        self._rng = np.random.default_rng(3)
        self._n = 0

    def live(self, delay_s: Callable[[float], float], sentences: int) -> None:
        """Until so many have been said, and two seconds more."""
        rest = round(2.0 / BLOCK_S)
        while rest:
            heard = self._air[self._n : self._n + BLOCK] + 1e-4 * self._rng.standard_normal(BLOCK)
            output = self.robot.step(np.asarray(heard, np.float32), None)
            self._n += BLOCK
            assert self.robot.now < 150.0
            at = self._n + round(delay_s(self.robot.now) * SAMPLE_RATE_HZ)
            self._air[at : at + BLOCK] += self._gain * output.sound
            self.records += output.records
            rest -= len(self.noted(SaidRecord)) >= sentences and not self.robot.speaking

    def noted(self, *kinds: type[Record]) -> list[Record]:
        return [record for record in self.records if isinstance(record, kinds)]


@pytest.mark.parametrize("true_s", [0.0, 0.075, 0.225, 0.6])
@pytest.mark.parametrize("told_s", [0.0, 0.15])
def test_it_never_hears_itself_whatever_it_was_told(told_s: float, true_s: float) -> None:
    alone = Alone(told_s)
    alone.live(lambda _: true_s, 3)
    assert alone.robot.latency_s == pytest.approx(true_s, abs=0.012)
    assert not alone.noted(HeardRecord, GarbledRecord, EchoRecord)


def test_it_never_hears_itself_when_the_delay_changes_in_mid_mission() -> None:
    alone = Alone(0.15)
    alone.live(lambda _: 0.075, 2)
    alone.live(lambda _: 0.6, 4)
    assert alone.robot.latency_s == pytest.approx(0.6, abs=0.012)
    assert not alone.noted(HeardRecord, GarbledRecord, EchoRecord)


def test_with_headphones_on_it_believes_what_it_was_told() -> None:
    alone = Alone(0.15, gain=0.0)
    alone.live(lambda _: 0.4, 2)
    assert alone.robot.latency_s == 0.15


WORDS = ("hi", "all", "i", "am", "rob", "member", "of", "team", "plant")


def greeted() -> Bench:
    """A robot that has just said its name."""
    bench = Bench()
    bench.until(lambda: bench.robot.speaking, 60.0)
    bench.until(lambda: not bench.robot.speaking)
    return bench


def recognised(start_s: float, end_s: float) -> Recognised:
    return Recognised(WORDS, "Bot", round(start_s * SAMPLE_RATE_HZ), round(end_s * SAMPLE_RATE_HZ), 1.0, 20.0, ())


def names_taken(bench: Bench) -> bool:
    bench.run(20.0)
    return any(isinstance(r, SaidRecord) and isinstance(r.utterance.statement, NameTaken) for r in bench.records)


def test_its_own_words_that_come_back_unmasked_are_nobodys() -> None:
    bench = greeted()
    for late_s in (0.3, 0.5, 0.7):
        bench.live(recognised(bench.robot.now - 0.2, bench.robot.now))
        bench.run(late_s - 0.3)
    assert len(bench.noted(EchoRecord)) == 3
    assert not bench.noted(HeardRecord)
    assert not names_taken(bench)


def test_another_robot_of_its_name_is_noticed() -> None:
    bench = greeted()
    for _ in range(2):
        bench.run(1.7)
        bench.live(recognised(bench.robot.now - 1.7, bench.robot.now))
    assert not bench.noted(EchoRecord)
    assert len(bench.noted(HeardRecord)) == 2
    assert names_taken(bench)
