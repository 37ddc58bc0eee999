"""Robots tell by its number, by their clocks and by what they have heard which occurrence of a task is meant."""

from __future__ import annotations

from dataclasses import replace

import pytest

from hil_fakes.word_channel import Conditions
from hil_fakes.word_mission import WordMission
from hil_fakes.word_occurrences import BEGIN_S, counted
from hvcpd.coordination import schedule
from hvcpd.coordination.states import State
from hvcpd.language import messages as m
from tests.coordination.hourly import EVERY_HOUR, HOUR_S, PLAN, again, done_for_this_hour

PAIRED = tuple(replace(task, robots=2) for task in EVERY_HOUR[:2])


def test_a_robot_that_is_said_to_have_done_what_is_due_knows_by_its_clock_that_it_has_not() -> None:
    """Bot has misheard the number of the task that Rob has reported (seed 700480 of the missions over days)."""
    mission = done_for_this_hour(doer="Rob")
    rob = mission.robots["Rob"].board[1]
    mission.air.run_until(2 * HOUR_S + 10.0)
    mission.robots["Rob"].board.reopen(1)
    rob.change += 1
    count = (rob.change + 2) % 9 + 1
    quoted = m.Relayed("Rob", m.Completed(m.TaskByNumber(1), count=count))
    mission.robots["Rob"].heard(m.Utterance("Bot", m.ToRobot("Max"), None, quoted), mission.air.now)
    assert not rob.known_done


def test_a_robot_that_knows_by_its_clock_what_is_done_objects_to_whoever_did_it() -> None:
    """Bot has misheard another task's number, and takes this one for due (seed 702229 of the missions over days)."""
    mission = done_for_this_hour()
    bot, now = mission.robots["Bot"], mission.air.now
    claim = m.Utterance("Rob", m.ToTeam("plant"), None, m.Claim(m.TaskByNumber(1)))
    bot.board[1].opened_s -= HOUR_S  # it is to take the task for due
    bot.heard(claim, now)
    assert not bot.board[1].known_done
    bot.board.release(1)
    bot.knowledge.reconsider(now)
    mission.go_on(now + 400.0)
    assert len(mission.done) == 2
    assert bot.board[1].known_done


def test_who_claims_again_what_it_has_done_is_told_so_by_a_robot_that_knows_by_its_clock() -> None:
    mission = done_for_this_hour(doer="Bot")
    rob = mission.robots["Rob"]
    rob.heard(m.Utterance("Bot", m.ToTeam("plant"), None, m.Claim(m.TaskByNumber(1))), mission.air.now)
    assert rob.board[1].known_done
    assert rob.knowledge.floor.wants("done 1")


@pytest.mark.parametrize(("listener", "speaker", "ahead"), [("Bot", "Rob", 3), ("Rob", "Bot", 1), ("Bot", "Rob", 1)])
def test_a_new_number_must_be_heard_twice(listener: str, speaker: str, ahead: int) -> None:
    """It was told of task two, and has heard task one (seeds 701103 and 710888). Bot, which has no clock, does not
    believe the next number either so soon after the last (seeds 11001292, 11002127 and 11002287)."""
    mission = done_for_this_hour(doer=speaker)
    robot, now = mission.robots[listener], mission.air.now
    told = m.Utterance(speaker, m.ToRobot(listener), None, again(robot.board[1].change + ahead))
    robot.heard(told, now)
    assert robot.board[1].known_done
    robot.heard(replace(told, speaker="Max"), now + 60.0)
    assert not robot.board[1].known_done


def test_a_rumour_is_forgotten() -> None:
    """Hours later a misheard number confirmed it (seed 703207 of the missions over days)."""
    mission = done_for_this_hour(doer="Rob")
    bot, now = mission.robots["Bot"], mission.air.now
    told = m.Utterance("Rob", m.ToRobot("Bot"), None, again(bot.board[1].change + 3))
    bot.heard(told, now)
    bot.heard(replace(told, speaker="Max"), now + 1000.0)
    assert bot.board[1].known_done


def test_a_robot_without_a_clock_believes_the_next_number_once_it_may_be_due() -> None:
    mission = done_for_this_hour(doer="Rob")
    bot = mission.robots["Bot"]
    bot.board[1].opened_s -= HOUR_S
    bot.heard(m.Utterance("Rob", m.ToRobot("Bot"), None, again(bot.board[1].change + 1)), mission.air.now)
    assert not bot.board[1].known_done


def test_a_robot_without_a_clock_believes_the_number_that_answers_its_objection() -> None:
    """It does not know how late it heard last time that the task was due."""
    mission = done_for_this_hour()
    bot, now = mission.robots["Bot"], mission.air.now
    bot.heard(m.Utterance("Rob", m.ToTeam("plant"), None, m.Claim(m.TaskByNumber(1))), now)
    mission.go_on(now + 3.0)
    assert isinstance(mission.said[-1][2].statement, m.Completed)
    bot.heard(m.Utterance("Rob", m.ToRobot("Bot"), None, again(bot.board[1].change + 1)), now + 8.0)
    assert not bot.board[1].known_done


def test_a_robot_that_took_its_task_for_due_too_early_still_hears_when_it_is() -> None:
    """Kim had misheard a task's number, and was told that it had done this one; when that was due it said so itself,
    and all robots believed it (seeds 11002622 and 11003012)."""
    mission = done_for_this_hour()
    bot, rob = mission.robots["Bot"], mission.robots["Rob"]
    due_s = rob.next_deadline()
    bot.board[1].acted_s = bot.board[1].done_s = due_s - 1300.0  # late
    mission.air.misses = lambda _listener, _utterance: True
    claim = m.Utterance("Rob", m.ToTeam("plant"), None, m.Claim(m.TaskByNumber(1)))
    bot.heard(claim, due_s - 680.0)
    assert not bot.board[1].known_done
    bot.knowledge.state, bot.knowledge.current.task = State.GOING, 1
    quoted = m.Relayed("Bot", m.Completed(m.TaskByNumber(1), count=(rob.board[1].change - 1) % 9 + 1))
    bot.heard(m.Utterance("Max", m.ToRobot("Rob"), None, quoted), due_s - 670.0)
    bot.actions(due_s - 670.0)
    assert bot.board[1].known_done
    assert bot.task is None
    bot.heard(claim, due_s + 10.0)
    assert bot.board[1].owner == "Rob"


@pytest.mark.parametrize("owner", ["Bot", "Max"])
def test_a_list_tells_what_is_done_of_a_claim_that_is_only_remembered(owner: str) -> None:
    """Bot was switched off while Leo did it, was told that nothing is left, and did it once more when Leo's claim had
    lapsed, in time to count for the next occurrence, which it then did as well (seed 11001819)."""
    mission = done_for_this_hour(("Rob", "Bot", "Max", "Zoe"), doer="Max")
    mission.saved["Bot"][1] = ("claimed", owner)
    mission.switch_on("Bot")
    bot, now = mission.robots["Bot"], mission.air.now
    for speaker in ("Rob", "Zoe"):
        bot.heard(m.Utterance(speaker, m.ToAll(), None, m.Left()), now + 30.0)
        assert bot.board[1].known_done is (speaker == "Zoe")


@pytest.mark.parametrize("known", [False, True])
def test_a_quote_without_a_number_may_be_of_an_earlier_occurrence(known: bool) -> None:
    """A robot without a clock objects to a new claim (seeds 710426 and 710704 of the missions over days)."""
    mission = done_for_this_hour()
    mission.air.run_until(2 * HOUR_S - 850.0)
    rob, now = mission.robots["Rob"], mission.air.now
    rob.board.reopen(1)
    rob.board.claim(1, "Bot", now + 100.0)
    count = (rob.board[1].change - 1) % 9 + 1 if known else None
    quoted = m.Relayed("Bot", m.Completed(m.TaskByNumber(1), count=count))
    rob.heard(m.Utterance("Max", m.ToRobot("Zoe"), None, quoted), now)
    assert rob.board[1].known_done is known


def test_a_report_of_an_earlier_number_does_not_end_what_is_open_however_long_it_was() -> None:
    """Rob's clock was behind when Bot claimed what came next (seed 730425 of the missions over days)."""
    mission = done_for_this_hour()
    rob, now = mission.robots["Rob"], mission.air.now
    rob.board.reopen(1)
    rob.board[1].opened_s = now - HOUR_S
    for count, is_done in ((rob.board[1].change - 1, False), (rob.board[1].change, True)):
        quoted = m.Relayed("Bot", m.Completed(m.TaskByNumber(1), count=(count - 1) % 9 + 1))
        rob.heard(m.Utterance("Max", m.ToRobot("Rob"), None, quoted), now)
        assert (rob.board[1].state == "done") is is_done


def test_a_report_just_before_it_is_due_again_is_of_the_occurrence_that_was_not_known_to_be_done() -> None:
    """Rob missed Bot's report, and hears it again when another robot has claimed what comes (seed 752609)."""
    mission = done_for_this_hour()
    rob = mission.robots["Rob"]
    mission.air.run_until(2 * HOUR_S - 880.0)
    rob.board.reopen(1)
    due_s = rob.board[1].due_s
    wall_s = mission.plan.begin_s + mission.air.now
    coming_s = EVERY_HOUR[0].every.next(wall_s)  # type: ignore[union-attr]
    assert coming_s is not None
    now = mission.air.now + coming_s - wall_s - 60.0
    rob.heard(m.Utterance("Bot", m.ToAll(), None, m.Completed(m.TaskByNumber(1))), now)
    assert rob.board[1].due_s == due_s


def test_work_on_an_earlier_occurrence_does_not_count_for_the_one_that_is_due_soon_after() -> None:
    """Bot was late, and hears two minutes later that it is due again (seed 710925 of the missions over days)."""
    mission = done_for_this_hour()
    bot, now = mission.robots["Bot"].board[1], mission.air.now
    bot.change, bot.acted_s, bot.opened_s = 0, now - 160.0, now - 0.9 * HOUR_S
    assert not schedule.has_just_done(bot, now)
    bot.opened_s = now - 400.0
    assert schedule.has_just_done(bot, now)


def test_what_is_done_late_counts_for_its_own_occurrence() -> None:
    """It was done a minute before the next one was due, which was then done as well."""
    hour_s = EVERY_HOUR[0].every.next(BEGIN_S)  # type: ignore[union-attr]
    assert hour_s is not None
    due_s = hour_s - BEGIN_S
    done = [(10.0, 1, "Rob"), (due_s + HOUR_S - 60.0, 1, "Rob"), (due_s + HOUR_S + 60.0, 1, "Bot")]
    assert set(counted(EVERY_HOUR[:1], done, due_s + 2.5 * HOUR_S).values()) == {1}
    early = [(10.0, 1, "Rob"), (due_s - 60.0, 1, "Rob")]
    assert list(counted(EVERY_HOUR[:1], early, due_s + 1.5 * HOUR_S).values()) == [1, 1]


@pytest.mark.parametrize("knows", [False, True])
def test_a_list_tells_what_is_done_of_a_task_that_the_speaker_has_known_to_be_due(knows: bool) -> None:
    """Bot asked twelve times, until nobody answered, and did what was done (seed 780647 of the missions over days)."""
    mission = done_for_this_hour(("Rob", "Bot", "Max"), doer="Max")
    mission.air.run_until(2 * HOUR_S - 850.0)
    bot, now = mission.robots["Bot"], mission.air.now
    left = m.Left(m.TaskByNumber(1))
    bot.heard(m.Utterance("Rob" if knows else "Max", m.ToAll(), None, left), now)
    bot.heard(m.Utterance("Max", m.ToAll(), None, m.Completed(m.TaskByNumber(1))), now + 20.0)
    assert bot.board[1].hearsay
    bot.heard(m.Utterance("Rob", m.ToAll(), None, m.Left()), now + 40.0)
    assert bot.board[1].known_done is knows


@pytest.mark.parametrize("is_done", [True, False])
def test_the_next_number_means_what_comes_also_where_clocks_differ(is_done: bool) -> None:
    """Tom's clock was ahead, and Ida did the same once more, as the number after that (seeds 802714 and 805349)."""
    mission = done_for_this_hour(doer="Rob")
    rob = mission.robots["Rob"]
    due_s = rob.next_deadline()
    mission.air.run_until(due_s - 200.0)
    coming = rob.board[1].change + 1
    if not is_done:
        rob.board.reopen(1)
        rob.board.claim(1, "Bot", due_s)
    for speaker in ("Max", "Zoe"):
        rob.heard(m.Utterance(speaker, m.ToAll(), None, again(coming)), mission.air.now)
        assert rob.board[1].state != "done"
    mission.go_on(due_s + 600.0)
    assert rob.board[1].change == coming
    assert len(mission.done) == 3


def test_a_report_without_a_number_does_not_end_what_comes_for_who_has_just_been_told_of_it() -> None:
    """Max, without a clock, meant the last time; Rob gave it this time's number, and nobody did it (seed 1105698)."""
    mission = done_for_this_hour(doer="Bot")
    rob = mission.robots["Rob"]
    now = rob.next_deadline() - 200.0
    mission.air.run_until(now)
    for speaker in ("Max", "Zoe"):
        rob.heard(m.Utterance(speaker, m.ToAll(), None, again(rob.board[1].change + 1)), now)
    rob.heard(m.Utterance("Bot", m.ToAll(), None, m.Completed(m.TaskByNumber(1))), now + 5.0)
    assert rob.board[1].state == "open"
    assert rob.knowledge.floor.wants("change 1")


@pytest.mark.parametrize("claimed_before_s", [5.0, 60.0])
def test_a_quote_of_whoever_has_only_just_claimed_it_is_of_the_last_time(claimed_before_s: float) -> None:
    """Max had not heard that it was due again, and robots with clocks believed it (seed 821681)."""
    mission = done_for_this_hour(doer="Bot")
    rob = mission.robots["Rob"]
    mission.air.misses = lambda _listener, _utterance: True
    now = rob.next_deadline() + 30.0
    rob.tick(now)
    rob.heard(m.Utterance("Bot", m.ToAll(), None, m.Claim(m.TaskByNumber(1))), now)
    rob.actions(now)
    now += claimed_before_s
    quoted = m.Relayed("Bot", m.Completed(m.TaskByNumber(1)))
    rob.heard(m.Utterance("Max", m.ToRobot("Bot"), None, quoted), now)
    assert rob.board[1].state == ("claimed" if claimed_before_s < 15.0 else "done")


def test_a_robot_without_a_clock_does_not_know_after_a_restart_when_it_did_what_it_remembers() -> None:
    """Max objected to the claim of what was due, as if it had just done it (seed 844017)."""
    mission = done_for_this_hour(doer="Bot")
    mission.changes["Bot"] = {1: (3, False)}  # a person wanted it once more, some time ago
    mission.switch_on("Bot")
    bot = mission.robots["Bot"]
    bot.heard(m.Utterance("Rob", m.ToAll(), None, m.Claim(m.TaskByNumber(1))), mission.air.now + 20.0)
    assert bot.board[1].owner == "Rob"


def test_what_another_robot_reports_is_no_number_for_ones_own_work() -> None:
    """Bot, without a clock, had misheard the task of Rob's report; an hour after its own work it objected with that
    number to the claim of what was due, and all robots believed it (seed 11000598 of the missions over days)."""
    mission = done_for_this_hour(doer="Bot")
    bot, now = mission.robots["Bot"], mission.air.now
    coming = mission.robots["Rob"].board[1].change + 1
    bot.board[1].change = 0  # it has not heard the number since
    bot.board[1].opened_s -= HOUR_S
    bot.board[1].done_s -= HOUR_S
    count = (coming - 1) % 9 + 1
    bot.heard(m.Utterance("Rob", m.ToAll(), None, m.Completed(m.TaskByNumber(1), count=count)), now)
    assert bot.board[1].change == 0


def test_who_has_just_done_what_it_heard_become_due_does_not_do_it_again_once_it_hears_the_number() -> None:
    """It knew no number, and took the one that Rob told it for another occurrence."""
    mission = done_for_this_hour()
    bot, now = mission.robots["Bot"], mission.air.now
    entry = bot.board[1]
    entry.change, entry.acted_s, entry.opened_s = 0, now - 60.0, now - 100.0
    for at_s in (now, now + 30.0):
        bot.heard(m.Utterance("Rob", m.ToAll(), None, again(7)), at_s)
    assert entry.known_done
    assert entry.change == 7


@pytest.mark.parametrize(("n_robots", "n_tasks", "seed"), [(2, 1, 4), (3, 1, 4), (4, 2, 3)])
def test_what_two_have_just_done_together_is_not_taken_for_the_last_time(
    n_robots: int, n_tasks: int, seed: int
) -> None:
    """They report it in one breath with a confirmation, without its number, and another one denies it to a third: of
    both they said "task one again", and went on so for a minute and a half each hour."""
    clocks = dict.fromkeys(("Rob", "Bot", "Max", "Zoe")[:n_robots], 0.0)
    plan = replace(PLAN, names=tuple(clocks), seed=seed, tasks=PAIRED[:n_tasks], conditions=Conditions(), clocks=clocks)
    mission = WordMission(plan, keep=True)
    assert mission.run().missed == 0
    assert not [u for _, _, u in mission.said if isinstance(m.own_words(u.statement), m.Change)]


def test_who_hears_a_part_reported_and_confirmed_knows_that_two_have_done_the_task() -> None:
    """It took the confirmation for hearsay, and then the other part's report for the first of two."""
    plan = replace(PLAN, tasks=PAIRED, conditions=Conditions(), clocks={"Rob": 0.0, "Bot": 0.0, "Max": 0.0})
    mission, one = WordMission(plan), m.TaskByNumber(1)
    bystander, now = mission.robots["Max"], 100.0
    for speaker in ("Rob", "Bot"):
        bystander.heard(m.Utterance(speaker, m.ToTeam("plant"), None, m.Claim(one)), now)
    bystander.heard(m.Utterance("Bot", m.ToAll(), None, m.Completed(one)), now + 30.0)
    assert not bystander.board[1].known_done
    bystander.heard(m.Utterance("Rob", m.ToRobot("Bot"), None, m.Confirmed(one, complete=True)), now + 40.0)
    assert bystander.board[1].known_done


@pytest.mark.parametrize("coordinator", [None, "Rob"])
@pytest.mark.parametrize("before_s", [1.0, 3.0])
def test_what_is_due_again_while_a_robot_reports_it_is_done_for_this_time_too(
    coordinator: str | None, before_s: float
) -> None:
    """The report has the number of the last time, and counted for both; its doer waited for an order until the next."""

    def begun(at_s: float) -> WordMission:
        plan = replace(PLAN, names=("Rob", "Bot"), tasks=EVERY_HOUR[:1], seed=2, conditions=Conditions())
        return WordMission(replace(plan, coordinator=coordinator, clocks={"Rob": 0.0, "Bot": 0.0}, begin_s=at_s))

    mission = begun(HOUR_S / 2.0)
    mission.run_until(lambda: mission.done)
    done_s, _, _ = mission.done[0]
    mission = begun(10.0 * HOUR_S - done_s - before_s)
    mission.air.run_until(done_s + 180.0)
    assert mission.done[0][0] == done_s
    assert len(mission.done) == 2
    assert all(robot.board.all_done for robot in mission.robots.values())
