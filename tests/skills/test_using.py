"""A robot that uses a skill: what it asks for, what it makes of the answers, and what it says aloud of a failure."""

from __future__ import annotations

import pytest

from hvcpd.config.skills import Parameter, Skill, SkillEntry
from hvcpd.config.tasks import Tend, Use, Wait
from hvcpd.coordination.states import State
from hvcpd.ports import STANDSTILL
from hvcpd.recognition.events import Held, Released, Urgent
from hvcpd.robot.records import PerformedRecord, SaidRecord, SkillRecord
from hvcpd.skills.life import TOO_LONG, Begin, Cancel, Order, Pause, Report, Resume, SkillState
from tests.robot.test_hold import BLOCK_S, Bench

POUR = Skill("pour", SkillEntry({"litres": Parameter()}, 20.0, ("the tank is empty",)))
USE = Use("pour", (("litres", 0.5),), 20.0)


class SkilledBench(Bench):
    """The same with a skill, whose orders are kept."""

    def __init__(self, *actions: Use | Wait, offered: frozenset[str] = frozenset({"pour"})) -> None:
        super().__init__(*actions, skills=(POUR,))
        self.orders: list[Order] = []
        self.robot.performer.offer(offered)

    def live(self, *events: object) -> None:
        super().live(*events)  # type: ignore[arg-type]
        self.orders += self.output.skills

    def until_asked(self) -> int:
        """The number of the call that it makes."""
        while not self.orders:
            assert self.robot.now < 300.0
            self.live()
        (order,) = self.orders
        assert isinstance(order, Begin)
        return order.call.number

    def tell(self, number: int, state: SkillState, text: str = "") -> None:
        self.robot.performer.tell(Report(number, state, text=text))
        self.live()

    def said(self) -> list[str]:
        self.run(20.0)
        return [record.text for record in self.records if isinstance(record, SaidRecord)]

    def states(self) -> list[SkillState]:
        return [record.report.state for record in self.records if isinstance(record, SkillRecord)]


def test_a_skill_is_asked_for_and_the_task_done_when_it_is() -> None:
    bench = SkilledBench(USE)
    number = bench.until_asked()
    bench.tell(number, SkillState.RUNNING)
    bench.run(5.0)
    assert not any(isinstance(record, PerformedRecord) for record in bench.records)
    bench.tell(number, SkillState.FINISHED)
    assert any(isinstance(record, PerformedRecord) for record in bench.records)
    assert bench.states() == [SkillState.WAITING, SkillState.RUNNING, SkillState.FINISHED]
    assert bench.said()[-1].endswith("task one complete")


@pytest.mark.parametrize("source", ["voice", "button", "socket"])
def test_a_stop_in_the_block_in_which_a_skill_would_begin_begins_nothing(source: str) -> None:
    """It began, and was cancelled at once: a pump gave a jet."""
    free, bench = SkilledBench(Wait(1.0), USE), SkilledBench(Wait(1.0), USE)
    free.until_asked()
    while bench.robot.now + 1.5 * BLOCK_S < free.robot.now:
        bench.live()
    if source == "socket":
        bench.robot.coordination.stop(bench.robot.now)
    bench.robot.is_held_down = source == "button"
    bench.live(*([Urgent(0, 1)] if source == "voice" else []))
    assert bench.stopped
    bench.run(1.0)
    assert bench.orders == []


@pytest.mark.parametrize(
    ("reason", "said"),
    [("The tank is empty.", "task one failed, the tank is empty"), ("pump: EIO", "task one failed")],
)
def test_a_failure_is_told_with_its_reason_if_the_task_file_has_words_for_it(reason: str, said: str) -> None:
    bench = SkilledBench(USE)
    bench.tell(bench.until_asked(), SkillState.FAILED, reason)
    assert bench.said()[-1].endswith(said)


def test_a_skill_that_hangs_fails_at_its_time_limit_and_the_robot_talks_on() -> None:
    bench = SkilledBench(USE)
    number = bench.until_asked()
    bench.tell(number, SkillState.RUNNING)
    bench.run(19.0)
    assert bench.orders[1:] == []
    bench.run(1.1)
    assert bench.orders[1:] == [Cancel(number)]
    last = [record for record in bench.records if isinstance(record, SkillRecord)][-1]
    assert (last.report.state, last.report.text) == (SkillState.FAILED, TOO_LONG)
    assert bench.said()[-1].endswith("task one failed")


def test_stop_cancels_in_the_same_step() -> None:
    bench = SkilledBench(USE)
    number = bench.until_asked()
    bench.tell(number, SkillState.RUNNING)
    bench.robot.coordination.stop(bench.robot.now)
    bench.live()
    assert bench.orders[1:] == [Cancel(number)]
    assert bench.robot.coordination.state is State.STOPPED
    bench.tell(number, SkillState.FINISHED)  # too late to count
    assert not any(isinstance(record, PerformedRecord) for record in bench.records)


def test_it_is_held_for_what_may_be_stop_and_its_time_stands_still() -> None:
    bench = SkilledBench(USE)
    number = bench.until_asked()
    bench.tell(number, SkillState.RUNNING)
    bench.live(Held(0, 0))
    bench.run(60.0)
    assert bench.orders[1:] == [Pause(number)]
    bench.live(Released(0, 0))
    bench.run(1.0)
    assert bench.orders[1:] == [Pause(number), Resume(number)]
    assert bench.states()[1:] == [SkillState.RUNNING, SkillState.PAUSED, SkillState.RUNNING]


def test_a_client_that_reports_while_it_is_held_is_told_to_go_on() -> None:
    """Its report counted as going on; it was not told to, and held until its time limit."""
    bench = SkilledBench(USE)
    number = bench.until_asked()
    bench.tell(number, SkillState.RUNNING)
    bench.live(Held(0, 0))
    bench.tell(number, SkillState.RUNNING)
    bench.robot.performer.tell(Report(number, SkillState.RUNNING))
    bench.live(Released(0, 0))
    assert bench.orders[1:] == [Pause(number), Resume(number)]
    bench.live(Held(0, 0))
    bench.tell(number, SkillState.FINISHED)
    bench.live(Released(0, 0))
    assert bench.states()[-2:] == [SkillState.PAUSED, SkillState.FINISHED]


def test_who_offers_it_breaks_off() -> None:
    bench = SkilledBench(USE)
    bench.tell(bench.until_asked(), SkillState.RUNNING)
    bench.robot.performer.offer(frozenset())
    bench.live()
    assert bench.states()[-1] is SkillState.FAILED
    assert bench.said()[-1].endswith("task one failed")


def test_watering_is_the_skill_of_that_name_if_there_is_one_and_else_it_waits() -> None:
    skilled = SkilledBench(Tend(3.0), offered=frozenset({"water"}))
    skilled.until_asked()
    (order,) = skilled.orders
    assert isinstance(order, Begin)
    assert (order.call.skill, order.call.arguments) == ("water", (("seconds", 3.0),))
    plain = SkilledBench(Tend(3.0), offered=frozenset())
    while not any(isinstance(record, PerformedRecord) for record in plain.records):
        assert plain.robot.now < 300.0
        plain.live()
    assert plain.orders == []
    assert plain.wheels == STANDSTILL
