"""Tasks that people have done again, or left out, while robots work: all come to know, whatever each has missed."""

from __future__ import annotations

from dataclasses import replace

import pytest

from hil_fakes.word_channel import Conditions
from hil_fakes.word_mission import Outage, WordMission, WordPlan
from hvcpd.coordination.actions import SaveTask
from hvcpd.coordination.states import State
from hvcpd.language import messages as m
from hvcpd.language.phrasebook import Phrasebook, Vocabulary
from tests.coordination.mission import Mission, plants

NAMES = ("Rob", "Bot", "Max")
AGAIN_S, LATER_S = 400.0, 900.0


def said_by_anna(mission: WordMission, at_s: float, number: int, skip: bool = False) -> None:
    mission.tell(at_s, "Anna", m.Utterance("Anna", m.ToAll(), None, m.Change(m.TaskByNumber(number), skip)))


def run_until(mission: WordMission, at_s: float) -> None:
    mission.air.run_until(at_s)
    for robot in mission.robots.values():
        assert robot.board.all_done


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("loss", [0.0, 0.3])
def test_what_is_wanted_again_is_done_once_more_and_all_know(seed: int, loss: float) -> None:
    mission = Mission(NAMES, plants(3), ("Anna",), seed=seed, conditions=Conditions(loss))
    for at_s in (AGAIN_S, AGAIN_S + 20.0):  # a person who is not answered says it again, and it counts once
        said_by_anna(mission, at_s, 2)
    run_until(mission, AGAIN_S + LATER_S)
    assert mission.watered == {1: 1, 2: 2, 3: 1}, "\n".join(mission.written(AGAIN_S))
    assert {robot.board[2].change for robot in mission.robots.values()} == {1}


@pytest.mark.parametrize("deaf", NAMES)
def test_who_has_missed_it_learns_it_all_the_same(deaf: str) -> None:
    mission = Mission(NAMES, plants(2), ("Anna",), seed=3)
    mission.air.misses = lambda listener, u: listener == deaf and u.speaker == "Anna"
    said_by_anna(mission, AGAIN_S, 2)
    run_until(mission, AGAIN_S + LATER_S)
    assert mission.watered == {1: 1, 2: 2}
    assert mission.robots[deaf].board[2].change == 1


@pytest.mark.parametrize("seed", range(4))
def test_who_was_off_meanwhile_learns_it_by_objecting(seed: int) -> None:
    mission = Mission(NAMES, plants(2), ("Anna",), seed=seed, outages=(Outage("Bot", AGAIN_S - 50.0, 70.0),))
    said_by_anna(mission, AGAIN_S, 1)
    run_until(mission, AGAIN_S + LATER_S)
    assert mission.watered == {1: 2, 2: 1}


def test_one_answers_with_the_number_of_the_change() -> None:
    mission = Mission(NAMES, plants(2), ("Anna",), seed=1)
    mission.air.run_until(AGAIN_S - 1.0)
    said_by_anna(mission, AGAIN_S, 2)
    mission.air.run_until(AGAIN_S + 10.0)
    first = mission.written(AGAIN_S, without=("Anna",))[0]
    assert first.startswith("Hi Anna, I am ")
    assert first.endswith(", task two again, change one")


@pytest.mark.parametrize("seed", range(4))
def test_what_is_left_out_is_done_by_nobody(seed: int) -> None:
    mission = Mission(NAMES, plants(6), ("Anna",), seed=seed, conditions=Conditions(0.2), late={"Max": 90.0})
    for at_s in (1.0, 15.0):
        said_by_anna(mission, at_s, 5, skip=True)
    run_until(mission, LATER_S)
    assert mission.watered == {1: 1, 2: 1, 3: 1, 4: 1, 6: 1}, "\n".join(mission.written())


def test_what_is_wanted_again_while_it_is_still_to_be_done_is_done_once_and_is_nobodys() -> None:
    mission = Mission(NAMES, plants(6), ("Anna",), seed=1)
    for at_s in (30.0, 45.0):  # she may be talked over
        said_by_anna(mission, at_s, 6)
    mission.air.run_until(60.0)
    assert any(text.endswith("task six again, change one") for text in mission.written(30.0, without=("Anna",)))
    assert "Anna" not in [robot.board[6].owner for robot in mission.robots.values()]
    run_until(mission, LATER_S)
    assert mission.watered[6] == 1


def test_what_is_being_carried_out_is_not_left_out_and_is_dropped_when_it_is_gone() -> None:
    mission = Mission(("Rob",), plants(2), ("Anna",), seed=1)
    mission.holds_motion = True
    rob = mission.robots["Rob"]
    mission.until("Rob", State.GOING, 1.0)
    rob.performed(mission.air.now)
    assert rob.state is State.ACTING
    assert rob.task is not None
    said_by_anna(mission, mission.air.now + 1.0, rob.task, skip=True)
    mission.air.run_until(mission.air.now + 15.0)
    assert rob.state is State.ACTING
    assert "completing task" in mission.written(without=("Anna",))[-1]
    rob.retask([task for task in plants(2) if task.number != rob.task], mission.air.now)
    assert rob.state is State.READY


def test_what_is_left_out_can_be_wanted_again_and_survives_a_restart() -> None:
    mission = Mission(("Rob",), plants(2), ("Anna",), seed=1, outages=(Outage("Rob", 300.0, 10.0),))
    said_by_anna(mission, 1.0, 2, skip=True)
    run_until(mission, 400.0)
    assert mission.watered == {1: 1}
    said_by_anna(mission, 401.0, 2)
    run_until(mission, 700.0)
    assert mission.watered == {1: 1, 2: 1}
    assert mission.changes["Rob"] == {2: (2, False)}


def test_what_is_done_cannot_be_left_out_and_what_nobody_knows_is_told() -> None:
    mission = Mission(("Rob", "Bot"), plants(1), ("Anna",), seed=1)
    mission.air.run_until(AGAIN_S)
    said_by_anna(mission, AGAIN_S + 1.0, 1, skip=True)
    mission.hear(AGAIN_S + 31.0, "Hi all, I am Anna, task nine again")
    mission.air.run_until(AGAIN_S + 60.0)
    answers = [text.split(", ")[-1] for text in mission.written(AGAIN_S, without=("Anna",))]
    assert answers[0] == "task one complete"
    assert answers[-1] == "I do not know task nine"


@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.parametrize("size", [2, 6])
def test_that_nobody_knows_a_task_is_told_by_one(size: int, seed: int) -> None:
    """All answered, and drew their slots: six robots said it four to eight times, up to seven of them in collisions."""
    mission = Mission(("Rob", "Bot", "Max", "Ann", "Mia", "Ted")[:size], plants(1), ("Anna",), seed=seed)
    run_until(mission, AGAIN_S)
    mission.hear(AGAIN_S + 1.0, "Hi all, I am Anna, task nine again")
    run_until(mission, AGAIN_S + 60.0)
    answers = [text.split(", ")[-1] for text in mission.written(AGAIN_S, without=("Anna",))]
    assert answers == ["I do not know task nine"]


def test_the_owner_of_a_robot_changes_tasks_and_is_told_why_not() -> None:
    mission = Mission(("Rob", "Bot"), plants(2), seed=1)
    mission.air.run_until(AGAIN_S)
    rob, now = mission.robots["Rob"], mission.air.now
    assert rob.change(7, False, now) == "there is no task 7; the tasks are 1, 2"
    assert rob.change(2, True, now) == "task 2 is done already"
    assert rob.change(2, False, now) is None
    assert [each.state for each in rob.actions(now) if isinstance(each, SaveTask)] == ["open"], "told once"
    assert rob.change(2, False, now) == "task 2 is still to be done"
    mission.air.refresh()
    run_until(mission, AGAIN_S + LATER_S)
    assert mission.watered == {1: 1, 2: 2}


@pytest.mark.parametrize("n", [9, 10, 14])
def test_changes_are_counted_beyond_what_is_said(n: int) -> None:
    """The spoken numbers go from 1 to 9, and then anew."""
    mission = WordMission(WordPlan(("Rob", "Bot"), plants(1), 2))
    for k in range(n):
        said_by_anna(mission, AGAIN_S * (k + 1), 1)
    run_until(mission, AGAIN_S * (n + 1))
    assert mission.watered == {1: n + 1}
    assert {robot.board[1].change for robot in mission.robots.values()} == {n}


def retask(mission: WordMission, n: int) -> None:
    for robot in mission.robots.values():
        robot.retask(plants(n), mission.air.now)
    mission.air.refresh()


def test_tasks_that_are_added_are_shared_out_and_those_that_are_gone_are_left_alone() -> None:
    mission = Mission(NAMES, plants(4), seed=1)
    mission.at(40.0, lambda: retask(mission, 2))
    mission.at(AGAIN_S, lambda: retask(mission, 6))
    mission.air.run_until(AGAIN_S - 1.0)
    before = dict(mission.watered)
    assert all(robot.board.all_done for robot in mission.robots.values())
    assert {1, 2} <= before.keys()
    mission.air.run_until(AGAIN_S + LATER_S)
    assert all(robot.board.all_done for robot in mission.robots.values())
    assert all(mission.watered[number] == before.get(number, 0) + (number > 2) for number in range(1, 7))


def test_a_task_that_is_done_stays_so_under_another_number() -> None:
    mission = Mission(("Rob", "Bot"), plants(3), seed=1)
    mission.air.run_until(AGAIN_S)
    assert mission.watered == {1: 1, 2: 1, 3: 1}
    one, two, three = plants(3)
    for robot in mission.robots.values():
        robot.retask((replace(two, number=1), replace(one, number=2), replace(three, name="x")), AGAIN_S)
    assert {robot.board.not_done() for robot in mission.robots.values()} == {(3,)}
    assert not any(robot.board.all_done for robot in mission.robots.values())


@pytest.mark.parametrize(("at_s", "state"), [(1.0, "open"), (AGAIN_S, "done")])
def test_a_task_that_is_gone_is_not_remembered_as_done_unless_it_was(at_s: float, state: str) -> None:
    """It may come back when the robot starts again, and was never done then."""
    mission = Mission(("Rob",), plants(2), seed=1)
    mission.air.run_until(at_s)
    rob = mission.robots["Rob"]
    saved = [action for action in rob.actions(at_s) if isinstance(action, SaveTask)]
    rob.retask(plants(1), at_s)
    saved += [action for action in rob.actions(at_s) if isinstance(action, SaveTask)]
    assert [action.state for action in saved if action.number == 2] in ([state], [])
    assert rob.board[2].lasting_state == state


@pytest.mark.parametrize("name", ["dust the shelves", "water the violet rose"])
def test_what_was_left_out_is_not_taken_for_a_task_that_was_added_under_its_number(name: str) -> None:
    """After a restart the new task was left out, and never done."""
    mission = Mission(("Rob",), plants(2), seed=1)
    mission.air.run_until(1.0)
    assert mission.robots["Rob"].change(2, True, 1.0) is None
    one, two = plants(2)
    for tasks in ((one,), (one, replace(two, name=name))):
        mission.robots["Rob"].retask(tasks, mission.air.now)
        mission.air.refresh()
    mission.fail(Outage("Rob", mission.air.now, 1.0))
    mission.air.run_until(AGAIN_S)
    assert mission.watered == {1: 1, 2: 1}


@pytest.mark.parametrize("unable", [frozenset(), frozenset({2})])
@pytest.mark.parametrize("seed", range(3))
def test_what_was_wanted_of_one_that_was_switched_off_before_others_heard_it_is_done(
    seed: int, unable: frozenset[int]
) -> None:
    """The others told it that nothing is left, and it believed them."""
    mission = Mission(("Rob", "Bot"), plants(2), seed=seed, unable={"Rob": unable})
    run_until(mission, AGAIN_S)
    mission.air.misses = lambda listener, _: listener == "Bot"
    assert mission.robots["Rob"].change(2, False, AGAIN_S) is None
    mission.go_on(AGAIN_S + 15.0)
    mission.fail(Outage("Rob", mission.air.now, 20.0))
    mission.air.misses = lambda *_: False
    run_until(mission, AGAIN_S + LATER_S)
    assert mission.watered == {1: 1, 2: 2}


@pytest.mark.parametrize("seed", range(3))
def test_what_takes_two_is_done_again_although_the_others_have_missed_that(seed: int) -> None:
    """Max told Bot, and took for Rob's answer to that what Rob said against its claim: that the task is complete."""
    one, two = plants(2)
    mission = Mission(NAMES, (one, replace(two, robots=2)), seed=seed)
    run_until(mission, AGAIN_S)
    mission.air.misses = lambda _, u: isinstance(u.statement, m.Change) and isinstance(u.addressee, m.ToAll)
    assert mission.robots["Max"].change(2, False, AGAIN_S) is None
    mission.air.refresh()
    run_until(mission, AGAIN_S + LATER_S)
    assert mission.watered == {1: 1, 2: 4}


def test_what_nobody_need_ask_for_any_more_is_done() -> None:
    """It was left out until the next start."""
    one, two = plants(2)
    mission = Mission(("Rob", "Bot"), (one, replace(two, on_demand=True)), seed=1)
    mission.air.run_until(AGAIN_S)
    assert mission.watered == {1: 1}
    for robot in mission.robots.values():
        robot.reconfigure(AGAIN_S, robot.role, (one, two))
    mission.air.refresh()
    run_until(mission, AGAIN_S + LATER_S)
    assert mission.watered == {1: 1, 2: 1}


def test_who_drives_to_a_task_that_is_gone_stops_there() -> None:
    mission = Mission(("Rob",), plants(3), seed=1)
    rob = mission.robots["Rob"]
    mission.air.run_until(60.0)
    mission.until("Rob", State.GOING, 1.0)
    number = rob.task
    rob.retask([task for task in plants(3) if task.number != number], mission.air.now)
    mission.air.refresh()
    assert rob.state is State.READY
    mission.air.run_until(mission.air.now + LATER_S)
    assert rob.board.all_done
    assert number not in [n for at_s, n, _ in mission.done if at_s > 60.0]


@pytest.mark.parametrize("by_voice", [True, False])
@pytest.mark.parametrize("seed", range(3))
def test_what_was_given_up_is_tried_again_by_who_gave_it_up(seed: int, by_voice: bool) -> None:
    """The tank was empty, and somebody has filled it."""
    mission = Mission(("Rob", "Bot"), plants(2), ("Anna",), seed=seed, fails=lambda _, n, now: n == 2 and now < AGAIN_S)
    mission.air.run_until(AGAIN_S)
    rob = mission.robots["Rob"]
    assert mission.watered == {1: 1}
    assert rob.board[2].failed_by == {"Rob", "Bot"}
    if by_voice:
        said_by_anna(mission, AGAIN_S, 2)
    else:
        assert rob.change(2, False, mission.air.now) is None
        mission.air.refresh()
    run_until(mission, AGAIN_S + LATER_S)
    assert mission.watered == {1: 1, 2: 1}, "\n".join(mission.written(AGAIN_S))


ON_DEMAND = tuple(replace(task, on_demand=task.number == 2) for task in plants(3))


def test_what_is_done_on_demand_waits_until_somebody_asks() -> None:
    mission = Mission(NAMES, ON_DEMAND, ("Anna",), seed=1)
    run_until(mission, AGAIN_S)
    assert mission.watered == {1: 1, 3: 1}


@pytest.mark.parametrize("loss", [0.0, 0.2])
@pytest.mark.parametrize("text", ["task two again", "please water the violet rose", "complete task two"])
def test_it_is_asked_for_by_voice_and_done_once_by_the_team(text: str, loss: float) -> None:
    mission = Mission(NAMES, ON_DEMAND, ("Anna",), seed=1, conditions=Conditions(loss))
    for at_s in (AGAIN_S, AGAIN_S + 20.0):
        mission.hear(at_s, f"Hi all, I am Anna, {text}")
    run_until(mission, AGAIN_S + LATER_S)
    assert mission.watered == {1: 1, 2: 1, 3: 1}
    assert any("task two again, change two" in line for line in mission.written(AGAIN_S))


def test_who_has_missed_that_it_was_asked_for_learns_it() -> None:
    mission = Mission(NAMES, ON_DEMAND, ("Anna",), seed=2)
    mission.air.misses = lambda listener, u: listener == "Max" and AGAIN_S - 1.0 < mission.air.now < AGAIN_S + 15.0
    said_by_anna(mission, AGAIN_S, 2)
    run_until(mission, AGAIN_S + LATER_S)
    assert mission.watered == {1: 1, 2: 1, 3: 1}
    assert mission.robots["Max"].board[2].change == 2


def test_it_is_not_forgotten_over_a_restart() -> None:
    mission = Mission(NAMES[:1], ON_DEMAND, ("Anna",), seed=2)
    mission.air.run_until(AGAIN_S)
    said_by_anna(mission, AGAIN_S + 1.0, 2)
    mission.air.run_until(AGAIN_S + 6.0)
    mission.switch_on("Rob")
    run_until(mission, AGAIN_S + LATER_S)
    assert mission.watered == {1: 1, 2: 1, 3: 1}


@pytest.mark.parametrize("names", [NAMES[:2], NAMES])
def test_who_has_not_been_told_of_a_task_has_nothing_against_a_claim_of_it(names: tuple[str, ...]) -> None:
    seven = replace(plants(4)[3], number=7, name="water the red tulip")
    mission = Mission(names, plants(2), seed=1)
    mission.book = Phrasebook(Vocabulary(names, ("plant",), tuple(t.name for t in (*plants(2), seven)), (1, 2, 7)))
    mission.air.run_until(AGAIN_S)
    mission.robots["Rob"].retask((*plants(2), seven), AGAIN_S)
    mission.air.refresh(("Rob",))
    mission.air.run_until(AGAIN_S + LATER_S)
    said = mission.written(AGAIN_S)
    assert mission.watered == {1: 1, 2: 1, 7: 1}
    assert any("I do not know task seven" in line for line in said), said
    assert sum("task seven" in line for line in said) <= 6, said
    assert mission.robots["Rob"].knowledge.report.task is None


def test_a_task_that_others_do_not_know_is_announced_by_its_number() -> None:
    """They do not have the words of its name: the robot announced it 18 times, for minutes, before it began."""
    seven = replace(plants(4)[3], number=7, name="water the red tulip")
    mission = Mission(NAMES[:2], plants(2), seed=1)
    mission.book = Phrasebook(Vocabulary(NAMES, ("plant",), tuple(t.name for t in (*plants(2), seven)), (1, 2, 7)))
    mission.air.run_until(AGAIN_S)
    rob = mission.robots["Rob"]
    rob.retask((*plants(2), seven), AGAIN_S)
    mission.air.refresh(("Rob",))
    mission.until("Rob", State.GOING, 1.0)
    rob.knowledge.missed.last_s = mission.air.now  # so it asks once more before it begins
    mission.air.run_until(mission.air.now + 100.0)
    assert mission.watered == {1: 1, 2: 1, 7: 1}
    said = mission.written(AGAIN_S)
    assert said.count("Hi all, I am Rob, completing task seven") == 1, said


def test_who_has_been_told_speaks_before_who_has_not() -> None:
    seven = replace(plants(4)[3], number=7)
    mission = Mission(NAMES, plants(2), seed=1)
    mission.air.run_until(AGAIN_S)
    for name in ("Rob", "Bot"):
        mission.robots[name].retask((*plants(2), seven), AGAIN_S)
    mission.robots["Bot"].board.complete(7, "Bot")
    mission.air.refresh(("Rob", "Bot"))
    mission.air.run_until(AGAIN_S + LATER_S)
    assert mission.watered == {1: 1, 2: 1}


@pytest.mark.parametrize("hears_robots", [True, False])
@pytest.mark.parametrize("seed", range(3))
def test_what_was_done_by_who_had_missed_the_skip_is_not_shown_as_left_out(seed: int, hears_robots: bool) -> None:
    """All robots showed it as left out, the one that had done it among them."""
    mission = Mission(NAMES, plants(6), ("Anna",), seed=seed)
    while (doer := mission.robots["Rob"].board.owner_of_claim(3)) is None:
        mission.air.run_until(mission.air.now + 1.0)

    def misses(listener: str, u: m.Utterance) -> bool:
        is_early = mission.watered[3] == 0 and isinstance(u.statement, m.Change)
        return listener == doer and (u.speaker == "Anna" or (is_early and not hears_robots))

    mission.air.misses = misses
    for after_s in (5.0, 15.0, 25.0):
        said_by_anna(mission, mission.air.now + after_s, 3, skip=True)
    mission.run()
    mission.air.run_until(mission.air.now + 300.0)
    entries = [robot.board[3] for robot in mission.robots.values()]
    if mission.watered[3]:
        assert {(entry.owner, entry.skipped) for entry in entries} == {(doer, False)}, "\n".join(mission.written())
    else:
        assert hears_robots
        assert all(entry.skipped for entry in entries)


def test_who_inferred_that_a_task_is_done_does_not_contradict_the_robot_that_leaves_it_out() -> None:
    """Bot had gone on to another task because it was told to, and not because it was done."""
    mission = Mission(("Rob", "Bot"), plants(4), ("Anna",), seed=1)
    mission.air.run_until(1.0)
    rob, book = mission.robots["Rob"], mission.book
    rob.board.complete(2, "Bot")
    rob.heard(book.parse_text("Hi all, I am Bot, skip task two, change one"), 1.0)
    assert rob.board[2].skipped
    rob.board.complete(3, "Bot")
    rob.heard(book.parse_text("Hi all, I am Anna, skip task three, change one"), 5.0)
    assert not rob.board[3].skipped
    assert rob.board[3].change == 1


@pytest.mark.parametrize("seed", [1, 2])
def test_all_together_repeat_a_change_a_few_times(seed: int) -> None:
    """Each repeated it as often as if nobody else did: four robots said it up to fifteen times."""
    mission = Mission((*NAMES, "Zoe"), plants(6), ("Anna",), seed=seed)
    for at_s in (20.0, 40.0):  # she may be talked over
        said_by_anna(mission, at_s, 6, skip=True)
    run_until(mission, LATER_S)
    said = [u for _, speaker, u in mission.said if speaker != "Anna" and isinstance(u.statement, m.Change)]
    assert 2 <= len(said) <= 8
