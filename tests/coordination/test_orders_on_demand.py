"""A person orders one robot to do a task that waits until somebody asks for it."""

from __future__ import annotations

import random
from collections import Counter
from dataclasses import replace

import pytest

from hil_fakes.word_channel import Conditions
from hil_fakes.word_lengths import n_words
from hil_fakes.word_mission import Outage
from hvcpd.config.tasks import Action
from hvcpd.coordination.entry import DONE
from hvcpd.coordination.states import State
from hvcpd.language import messages as m
from tests.coordination.mission import Mission, plants, release_all

NAMES = ("Rob", "Bot", "Max")
ON_DEMAND = tuple(replace(task, on_demand=task.number == 2) for task in plants(3))
ASKED_S, LATER_S = 300.0, 300.0
ORDER = "Hi Rob, I am Anna, water the violet rose"
READ_BACK = "Hi Anna, I am Rob, I will water the violet rose"


class Attended(Mission):
    """Anna is there, and answers `answer` to each read-back and report that she hears; None: she does not answer."""

    answer: m.Statement | None = m.Confirmed()

    def __init__(self, names: tuple[str, ...] = NAMES, **plan: object) -> None:
        self.followed: Counter[int] = Counter()
        """How often a robot has set out to each task after a read-back."""
        self._deafness = random.Random(str(plan.get("seed")))
        super().__init__(names, plan.pop("tasks", ON_DEMAND), ("Anna", "Ben"), **plan)  # type: ignore[arg-type]

    def speak(self, speaker: str, utterance: m.Utterance, slowly: bool = False, times: int = 1) -> None:
        super().speak(speaker, utterance, slowly, times)
        is_asked = isinstance(utterance.addressee, m.ToRobot) and utterance.addressee.name in ("Anna", "Ben")
        hears = self._deafness.random() >= self.plan.conditions.loss
        if isinstance(utterance.statement, m.Claim | m.Completed) and is_asked and hears and self.answer is not None:
            said = m.Utterance(utterance.addressee.name, m.ToRobot(speaker), None, self.answer)  # type: ignore[union-attr]
            self.tell(self.air.now + 0.36 * n_words(utterance) + 0.8, said.speaker or "", said)

    def perform(self, name: str, task: int, actions: tuple[Action, ...]) -> None:
        robot = self.robots[name]
        self.followed[task] += robot.knowledge.current.partner in ("Anna", "Ben") and not robot.at_place
        super().perform(name, task, actions)

    @property
    def changes_known(self) -> set[int]:
        return {robot.board[2].change for robot in self.robots.values()}


def ordered(*texts: str, every_s: float = LATER_S, **plan: object) -> Attended:
    """A mission in which these orders are given one after the other, and followed."""
    mission = Attended(**{"seed": 1, **plan})  # type: ignore[arg-type]
    for n, text in enumerate(texts):
        mission.hear(ASKED_S + n * every_s, text)
    mission.air.run_until(ASKED_S + len(texts) * LATER_S)
    return mission


@pytest.mark.parametrize("text", [ORDER, "Hi Rob, I am Anna, please complete task two"])
def test_the_robot_that_is_ordered_reads_it_back_does_it_and_reports_it(text: str) -> None:
    mission = ordered(text)
    read_back = READ_BACK if "violet" in text else "Hi Anna, I am Rob, I will complete task two"
    said = mission.written(ASKED_S, without=("Anna",))
    assert said[0] == read_back
    assert said[1:] == [
        "Hi all, I am Rob, task two again",
        "Hi Rob, I am Bot, task two again, change two",
        "Hi Anna, I am Rob, task two complete, change two",
    ]
    assert (mission.watered[2], mission.by[2]) == (1, "Rob")
    assert all(robot.board.all_done for robot in mission.robots.values())


@pytest.mark.parametrize("number", [None, 2])
@pytest.mark.parametrize("seed", [0, 9, 13, 18])
def test_all_know_who_has_it_before_anybody_can_claim_it(seed: int, number: int | None) -> None:
    """The others wait to speak of their own tasks. Anna may say the number with her confirmation."""
    tasks = tuple(replace(task, on_demand=task.number == 2) for task in plants(8))
    rest = frozenset(task.number for task in tasks if not task.on_demand)
    mission = Attended(seed=seed, tasks=tasks, unable={"Rob": rest})
    mission.answer = m.Confirmed(m.TaskByNumber(number) if number else None)
    mission.air.run_until(40.0)
    while mission.robots["Rob"].state is State.READY and mission.air.now < 300.0:  # she may be talked over
        mission.hear(mission.air.now, ORDER)
        mission.air.run_until(mission.air.now + 10.0)
    mission.until("Rob", State.GOING)
    began_s = mission.air.now
    mission.air.run_until(began_s + 5.0)
    assert mission.written(began_s)[0] == "Hi all, I am Rob, task two again"
    assert [mission.robots[name].board[2].owner for name in NAMES] == ["Rob"] * 3
    assert all(mission.robots[name].board[2].firm for name in ("Bot", "Max"))


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("loss", [0.0, 0.2])
def test_it_can_be_ordered_of_anybody_as_often_as_it_is_needed(seed: int, loss: float) -> None:
    to_bot = "Hi Bot, I am Anna, complete task two"
    mission = ordered(ORDER, ORDER, to_bot, "Hi all, I am Anna, task two again", seed=seed, conditions=Conditions(loss))
    mission.air.run_until(2000.0)
    asked = mission.followed[2] + 1
    assert mission.watered == {1: 1, 2: asked, 3: 1}, "\n".join(mission.written(ASKED_S))
    assert mission.changes_known == {asked + 1}
    assert loss or asked == 4


@pytest.mark.parametrize("answer", [m.Negative(), None])
def test_nothing_is_changed_before_the_read_back_is_confirmed(answer: m.Statement | None) -> None:
    mission = Attended(seed=1)
    mission.answer = answer
    mission.hear(ASKED_S, ORDER)
    mission.air.run_until(ASKED_S + LATER_S)
    said = mission.written(ASKED_S, without=("Anna",))
    assert set(said) == {READ_BACK}, "nobody objects to it, and nobody goes"
    assert len(said) == (1 if answer else 3)
    assert mission.watered == {1: 1, 3: 1}
    assert mission.changes_known == {1}


def test_the_read_back_of_what_was_done_before_can_be_denied_too() -> None:
    """The denial was answered with the task's last change."""
    mission = ordered(ORDER)
    mission.answer = m.Negative()
    asked_s = mission.air.now
    mission.hear(asked_s + 1.0, ORDER)
    mission.air.run_until(asked_s + LATER_S)
    assert mission.written(asked_s, without=("Anna",)) == [READ_BACK]
    assert mission.watered[2] == 1


HEARD_ALONE = {
    "nothing": (),
    "the order": (m.Order,),
    "the read-back": (m.Claim,),
    "the confirmation": (m.Confirmed,),
    "that it was asked for": (m.Change,),
    "the report": (m.Completed,),
}


@pytest.mark.parametrize("heard", HEARD_ALONE)
@pytest.mark.parametrize("times", [1, 2])
def test_who_hears_only_a_part_of_it_does_not_do_it_too(heard: str, times: int) -> None:
    """Max is in earshot of one kind of sentence only while Rob follows the last of these orders."""
    mission = Attended(seed=4)
    hears, last_s = HEARD_ALONE[heard], ASKED_S + (times - 1) * LATER_S
    mission.air.misses = lambda listener, u: (
        listener == "Max" and 0.0 < mission.air.now - last_s < 60.0 and not isinstance(u.statement, hears)
    )
    for n in range(times):
        mission.hear(ASKED_S + n * LATER_S, ORDER)
    mission.air.run_until(last_s + LATER_S)
    assert mission.watered == {1: 1, 2: times, 3: 1}, "\n".join(mission.written(ASKED_S))
    mission.hear(mission.air.now + 1.0, "Hi Max, I am Anna, complete task two")
    mission.air.run_until(mission.air.now + LATER_S)
    assert mission.watered[2] == times + 1, "\n".join(mission.written(last_s))
    assert mission.by[2] == "Max"
    assert mission.changes_known == {times + 2}


def test_an_earlier_report_that_is_repeated_does_not_cancel_the_order() -> None:
    mission = ordered("Hi Max, I am Anna, complete task two")
    asked_s = mission.air.now
    mission.answer = None
    mission.hear(asked_s, ORDER)
    mission.air.run_until(asked_s)
    mission.until("Rob", State.READ_BACK)
    mission.hear(mission.air.now, "Hi all, I am Max, task two complete, change two")
    mission.air.run_until(mission.air.now + 6.0)
    assert mission.robots["Rob"].state in (State.READING_BACK, State.READ_BACK)


def test_a_bid_for_what_was_done_is_no_read_back() -> None:
    mission = ordered(ORDER)
    asked_s = mission.air.now
    mission.hear(asked_s, "Hi Bot, I am Max, I will complete task two, one metre")
    mission.air.run_until(asked_s + 10.0)
    assert "Hi all, I am Rob, task two complete, change two" in mission.written(asked_s)


def test_who_hears_only_its_report_knows_that_it_was_done_for_that_change() -> None:
    """It still held the task for left out, and did it once more when somebody repeated the change."""
    mission = Attended(NAMES[:1], seed=1)
    rob, now = mission.robots["Rob"], 60.0
    mission.air.run_until(now)
    two = m.TaskByNumber(2)
    rob.heard(m.Utterance("Bot", m.ToRobot("Anna"), None, m.Completed(two, count=2)), now)
    rob.heard(m.Utterance("Max", m.ToAll(), None, m.Change(two, count=2)), now + 30.0)
    assert rob.board[2].state == "done"
    mission.air.refresh()
    assert mission.changes["Rob"] == {2: (2, False)}


def test_a_robot_at_another_task_is_busy() -> None:
    mission = Attended(seed=1)
    mission.until("Rob", State.GOING)
    began_s = mission.air.now
    mission.hear(began_s + 0.1, ORDER)
    mission.air.run_until(began_s + 20.0)
    assert "Hi Anna, I am Rob, I am busy" in mission.written(began_s)
    assert mission.changes_known == {1}


def test_what_another_robot_has_by_now_stays_with_it() -> None:
    mission = ordered("Hi Max, I am Anna, complete task two", ORDER, every_s=20.0)
    assert mission.watered[2] == 1
    assert mission.by[2] == "Max"
    assert "Hi Rob, I am Max, completing task two" in mission.written(ASKED_S)


def test_two_that_are_ordered_at_once_do_it_once() -> None:
    mission = ordered(ORDER, "Hi Max, I am Ben, complete task two", every_s=5.0)
    assert mission.watered[2] == 1, "\n".join(mission.written(ASKED_S))
    assert mission.changes_known == {2}


@pytest.mark.parametrize("after_s", [4.5, 20.0, 27.0])
def test_an_order_that_is_repeated_meanwhile_is_the_same_order(after_s: float) -> None:
    """Before the read-back is confirmed, on the way, and at work."""
    mission = Attended(seed=1)
    mission.answer = m.Confirmed() if after_s > 10.0 else None
    for at_s in (ASKED_S, ASKED_S + after_s):
        mission.hear(at_s, ORDER)
    mission.air.run_until(ASKED_S + after_s)
    mission.answer = m.Confirmed()
    mission.air.run_until(ASKED_S + LATER_S)
    assert mission.watered[2] == 1
    assert mission.written(ASKED_S).count(READ_BACK) == 2


def test_who_repeats_the_order_instead_of_confirming_the_report_is_told_again() -> None:
    mission = Attended(seed=1)
    mission.hear(ASKED_S, ORDER)
    mission.air.run_until(ASKED_S)
    mission.until("Rob", State.ACTING)
    mission.answer = None
    mission.until("Rob", State.REPORTED)
    reported_s = mission.air.now
    mission.hear(reported_s + 0.1, ORDER)
    mission.air.run_until(reported_s + 8.0)
    assert mission.written(reported_s, without=("Anna",)) == ["Hi Anna, I am Rob, task two complete, change two"]


@pytest.mark.parametrize("halts", [True, False])
@pytest.mark.parametrize(("state", "times"), [(State.READ_BACK, 0), (State.GOING, 1)])
def test_a_stop_or_a_restart_forgets_only_what_was_not_confirmed(state: State, times: int, halts: bool) -> None:
    mission = Attended(seed=1)
    mission.hear(ASKED_S, ORDER)
    mission.air.run_until(ASKED_S)
    mission.until("Rob", state)
    mission.answer = None
    mission.air.run_until(mission.air.now + (6.0 if times else 0.2))  # it has told the others
    if halts:
        mission.hear(mission.air.now, "all stop", speaker="Anna")
        mission.air.run_until(mission.air.now + 20.0)
        release_all(mission)
    else:
        mission.fail(Outage("Rob", mission.air.now, 20.0))
    mission.air.run_until(mission.air.now + 900.0)
    assert mission.watered[2] == times, "\n".join(mission.written(ASKED_S))


def test_who_has_failed_may_be_asked_to_try_again() -> None:
    mission = ordered(
        ORDER, "Hi Rob, I am Anna, complete task two", fails=lambda name, n, now: n == 2 and name == "Rob"
    )
    failed = [text for text in mission.written(ASKED_S + LATER_S) if text.startswith("Hi Anna, I am Rob, ")]
    assert failed[:2] == ["Hi Anna, I am Rob, I will complete task two", "Hi Anna, I am Rob, task two failed"]
    assert mission.by[2] != "Rob"
    assert mission.watered[2] == 2, "the others do it instead, each time"


def test_who_was_off_while_it_was_done_and_is_ordered_later_learns_its_number() -> None:
    """It gave the change the number of an earlier one, and the others said that this was done."""
    off = (Outage("Max", ASKED_S - 20.0, 1.5 * LATER_S),)
    mission = ordered(ORDER, ORDER, "Hi Max, I am Anna, complete task two", outages=off)
    assert mission.watered[2] == 3, "\n".join(mission.written(ASKED_S))
    assert mission.by[2] == "Max"
    assert mission.changes_known == {4}


def test_what_a_person_has_left_out_can_be_ordered_and_what_was_done_cannot() -> None:
    mission = Attended(seed=1, tasks=(plants(3)[0], plants(3)[2]))
    mission.hear(1.0, "Hi all, I am Anna, skip task three")
    for n, number in enumerate(("one", "three")):
        mission.hear(ASKED_S + 60.0 * n, f"Hi Rob, I am Anna, complete task {number}")
    mission.air.run_until(ASKED_S + LATER_S)
    assert "Hi Anna, I am Rob, task one complete" in mission.written(ASKED_S)
    assert mission.watered == {1: 1, 3: 1}, "\n".join(mission.written())


def test_an_order_of_a_coordinator_that_has_missed_the_report_is_no_request() -> None:
    names = ("Rob", "Bot", "Zoe")
    mission = Attended(names, seed=1, coordinator="Zoe")
    mission.hear(ASKED_S, ORDER)
    mission.air.misses = lambda listener, u: (
        listener == "Zoe" and mission.air.now > ASKED_S and isinstance(u.statement, m.Completed | m.Claim)
    )
    mission.air.run_until(ASKED_S + 90.0)
    mission.air.misses = lambda _listener, _u: False
    mission.air.run_until(ASKED_S + 2.0 * LATER_S)
    said = mission.written(ASKED_S)
    assert any(text.startswith("Hi ") and "I am Zoe, water the violet rose" in text for text in said), said
    assert mission.watered[2] == 1, "\n".join(said)
    mission.hear(mission.air.now + 1.0, ORDER)
    mission.air.run_until(mission.air.now + LATER_S)
    assert mission.watered[2] == 2, "a person who is none of the robots may ask again"


def test_a_coordinator_may_order_what_the_other_did_not_hear_anybody_ask_for() -> None:
    mission = Attended(("Rob", "Zoe"), seed=1, coordinator="Zoe")
    mission.air.misses = lambda listener, u: listener == "Rob" and isinstance(u.statement, m.Change)
    mission.hear(ASKED_S, "Hi all, I am Anna, task two again")
    mission.air.run_until(ASKED_S + LATER_S)
    assert mission.watered[2] == 1, "\n".join(mission.written(ASKED_S))
    assert mission.changes_known == {2}


@pytest.mark.parametrize("seed", range(25))
def test_whole_teams_do_all_that_was_ordered_once(seed: int) -> None:
    """Robots lose up to three of ten sentences and are ordered at random, twice in a row too."""
    rng = random.Random(seed)
    names = ("Rob", "Bot", "Max", "Zoe", "Ada")[: rng.randint(2, 5)]
    tasks = tuple(replace(task, on_demand=task.number in (2, 4)) for task in plants(5))
    mission = Attended(names, seed=seed, tasks=tasks, conditions=Conditions(rng.uniform(0.0, 0.3), delay_s=0.05))
    for n in range(4):
        order = m.Order(m.TaskByNumber(rng.choice((2, 4))))
        said = m.Utterance("Anna", m.ToRobot(rng.choice(names)), None, order)
        for again_s in (0.0, 20.0)[: rng.randint(1, 2)]:
            mission.tell(30.0 + 400.0 * n + again_s, "Anna", said)
    mission.air.run_until(2500.0)
    assert mission.watered == {1: 1, 3: 1, 5: 1} | +mission.followed, "\n".join(mission.written())
    assert all(robot.board.all_done for robot in mission.robots.values())


def about_to_repeat(text: str) -> Attended:
    """Rob has read this order of Anna's back, unsure, was not answered, and is about to do it again."""
    mission = Attended(seed=1)
    mission.answer = None
    mission.air.run_until(ASKED_S)
    mission.robots["Rob"].heard(mission.book.parse_text(text), ASKED_S, 0.8)
    mission.air.refresh()
    mission.until("Rob", State.READ_BACK)
    mission.until("Rob", State.READING_BACK)
    return mission


@pytest.mark.parametrize(
    ("order", "answer", "then"),
    [
        (ORDER, m.Confirmed(), State.GOING),
        (ORDER, m.Negative(), State.READY),
        ("Hi Rob, I am Anna, turn left", m.Confirmed(), State.MOVING),
    ],
)
def test_an_answer_counts_while_the_robot_is_about_to_repeat_itself(
    order: str, answer: m.Statement, then: State
) -> None:
    mission = about_to_repeat(order)
    rob = mission.robots["Rob"]
    rob.heard(m.Utterance("Anna", m.ToRobot("Rob"), None, answer), mission.air.now)
    assert rob.state is then


def test_a_confirmation_before_the_read_back_means_something_else() -> None:
    mission = Attended(seed=1)
    mission.air.run_until(ASKED_S)
    rob = mission.robots["Rob"]
    for statement in (m.Order(m.TaskByNumber(2)), m.Confirmed()):
        rob.heard(m.Utterance("Anna", m.ToRobot("Rob"), None, statement), ASKED_S)
    assert rob.state is State.READING_BACK


@pytest.mark.parametrize("state", [State.READ_BACK, State.READING_BACK])
@pytest.mark.parametrize("answer", [m.Confirmed(m.TaskByNumber(1)), m.Confirmed(m.TaskByNumber(2), complete=True)])
def test_who_confirms_something_else_does_not_confirm_the_read_back(state: State, answer: m.Confirmed) -> None:
    mission = about_to_repeat(ORDER)
    mission.until("Rob", state)
    rob = mission.robots["Rob"]
    rob.heard(m.Utterance("Anna", m.ToRobot("Rob"), None, answer), mission.air.now)
    assert rob.state is state


def test_another_robot_tells_that_the_ordered_task_is_done_while_it_is_read_back() -> None:
    tasks = tuple(replace(task, robots=2 if task.number == 2 else 1) for task in plants(3))
    mission = Attended(("Rob", "Bot"), tasks=tasks, seed=1, coordinator="Nobody")
    mission.answer = None
    mission.air.run_until(60.0)
    rob = mission.robots["Rob"]
    rob.heard(mission.book.parse_text("Hi Rob, I am Anna, complete task two"), 60.0, 0.8)
    mission.air.refresh()
    mission.until("Rob", State.READ_BACK)
    mission.until("Rob", State.READING_BACK)
    done = m.Confirmed(m.TaskByNumber(2), complete=True)
    rob.heard(m.Utterance("Bot", m.ToRobot("Rob"), None, done), mission.air.now)
    assert (rob.state, rob.board[2].state) == (State.READY, DONE)
