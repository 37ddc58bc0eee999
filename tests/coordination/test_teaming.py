"""Tasks for several robots: all begin together, nobody else joins, and who gives up frees the others."""

from __future__ import annotations

import random
from dataclasses import replace

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from hil_fakes.word_channel import Conditions
from hil_fakes.word_mission import Outage, WordMission, WordPlan
from hil_fakes.word_plans import random_plan
from hvcpd.config.recurrence import Recurrence
from hvcpd.config.tasks import Place, TaskDefinition, Wait
from hvcpd.coordination import choosing, composing, effects, teaming
from hvcpd.coordination.actions import Role, Say
from hvcpd.coordination.coordination import Coordination
from hvcpd.coordination.floor import OWN_TURN, Intent, Urgency
from hvcpd.coordination.states import State
from hvcpd.language import messages as m
from tests.coordination.mission import Mission, Watched, plants

NAMES = ("Rob", "Bot", "Max")


def shared(n: int, robots: int = 2, work_s: float = 5.0) -> tuple[TaskDefinition, ...]:
    """The first of so many tasks takes several robots."""
    first, *others = plants(n)
    return replace(first, robots=robots, actions=(*first.actions[:-1], Wait(work_s))), *others


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("names", [NAMES[:2], NAMES])
def test_two_begin_together_and_a_third_does_not_join(names: tuple[str, ...], seed: int) -> None:
    mission = Watched(WordPlan(names, shared(1), seed))
    result = mission.run()
    assert (result.lost, result.duplicates, result.agreed) == (0, 0, True)
    (first_s, one, _), (second_s, other, _) = mission.begun
    assert one != other
    assert second_s - first_s < 1.0
    mission.check_each_begins_with_others()


def test_it_is_spoken_plainly() -> None:
    mission = Mission(NAMES[:2], shared(1), seed=2)
    mission.run()
    assert [line.replace("Hi all, ", "").replace("Hi team plant, ", "") for line in mission.written()[:8]] == [
        "I am Rob, I will complete task one",
        "I am Bot, I will complete task one",
        "Hi Bot, I am Rob, confirmed one",
        "I am Rob, completing task, water the green rose",
        "Hi Rob, I am Bot, confirmed one",
        "Hi Bot, I am Rob, confirmed one",
        "I am Rob, task one complete",
        "Hi Rob, I am Bot, confirmed one complete, task one complete",
    ]


def test_a_lone_robot_does_not_begin() -> None:
    mission = Watched(WordPlan(("Rob",), shared(2), limit_s=2000.0))
    mission.run()
    assert {number for _, _, number in mission.begun} == {2}
    assert len(mission.said) < 20


def test_who_has_called_in_vain_is_joined_by_who_comes_late() -> None:
    mission = Watched(WordPlan(NAMES[:2], shared(2), 3, late={"Bot": 900.0}))
    result = mission.run()
    assert (result.lost, result.duplicates) == (0, 0)
    assert min(at_s for at_s, _, number in mission.begun if number == 1) > 900.0


@pytest.mark.parametrize("seed", range(4))
def test_who_gives_up_frees_the_other_who_finds_a_third(seed: int) -> None:
    failing = random.Random(seed).choice(NAMES)
    plan = WordPlan(NAMES, shared(1), seed, fails=lambda name, _task, _now: name == failing)
    mission = Watched(plan)
    result = mission.run()
    assert result.lost == 0
    assert {name for _, _, name in mission.done[-2:]} == set(NAMES) - {failing}


@pytest.mark.parametrize("failing", NAMES[:2])
def test_nobody_calls_for_help_those_who_have_given_the_task_up(failing: str) -> None:
    """The other one called it for ever, and it never answered."""
    plan = WordPlan(NAMES[:2], shared(2), 1, fails=lambda name, task, _now: (name, task) == (failing, 1), limit_s=3600)
    mission = Watched(plan)
    mission.run()
    failed_s = next(at_s for at_s, _, u in mission.said if any(isinstance(p.statement, m.Failed) for p in m.parts(u)))
    claims = [
        at_s
        for at_s, _, u in mission.said
        if any(p.statement == m.Claim(m.TaskByNumber(1)) for p in m.parts(u)) and at_s > failed_s + 60.0
    ]
    assert claims == []


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("back_s", [None, 30.0])
def test_a_crash_in_the_middle_frees_the_other(seed: int, back_s: float | None) -> None:
    plan = WordPlan(NAMES, shared(1, work_s=60.0), seed)
    whole = Watched(plan)
    whole.run()
    at_s, crashing, _ = whole.begun[0]
    mission = Watched(replace(plan, outages=(Outage(crashing, at_s + 20.0, back_s),)))
    result = mission.run()
    assert result.lost == 0
    last = {name for done_s, _, name in mission.done if done_s > at_s + 20.0}
    assert len(last) == 2
    mission.check_each_begins_with_others()


@pytest.mark.parametrize("how", ["leaves", "stops"])
def test_who_leaves_or_stops_frees_the_other(how: str) -> None:
    plan = WordPlan(NAMES, shared(1, work_s=60.0), 5)
    whole = Watched(plan)
    whole.run()
    at_s, one, _ = whole.begun[0]
    other = whole.begun[1][1]
    mission = Watched(replace(plan, leaving={one: at_s + 10.0}) if how == "leaves" else plan)
    if how == "stops":
        mission.tell(at_s + 10.0, "Anna", m.Utterance(None, m.ToRobot(one), None, m.Stop()), times=2)
    mission.air.run_until(at_s + 40.0)
    assert not mission.robots[other].at_place
    result = mission.run()
    assert (result.lost, result.duplicates) == (0, 0)
    assert one not in {name for _, _, name in mission.done}


def test_who_is_ordered_to_is_joined_by_another_who_is_ordered_to() -> None:
    mission = Watched(WordPlan(NAMES, shared(3), 4, coordinator="Max"))
    result = mission.run()
    assert (result.lost, result.duplicates) == (0, 0)
    assert {name for _, number, name in mission.done if number == 1} == {"Rob", "Bot"}
    mission.check_each_begins_with_others()


def test_a_stranger_to_the_pair_does_not_make_a_third() -> None:
    """Max, who has missed everything, claims what two are at."""
    mission = Watched(WordPlan(NAMES, shared(1, work_s=100.0), 1))
    mission.air.misses = lambda listener, _u: listener == "Max" and mission.air.now < 120.0
    while mission.air.now < 130.0:
        mission.air.run_until(mission.air.now + 1.0)
    assert {name for _, name, _ in mission.begun} == {"Rob", "Bot"}
    mission.run()
    assert {name for _, _, name in mission.done} == {"Rob", "Bot"}
    assert mission.robots["Max"].state is State.READY


@pytest.mark.parametrize("seed", range(3))
def test_what_recurs_is_done_by_two_each_time(seed: int) -> None:
    tasks = tuple(replace(task, every=Recurrence("1 h"), place=None) for task in shared(2))
    plan = WordPlan(NAMES, tasks, seed, Conditions(0.1), clocks={"Rob": 0.0, "Bot": 20.0}, limit_s=5 * 3600.0)
    result = WordMission(plan).run()
    assert (result.missed, result.repeated) == (0, 0)


def test_an_introduction_that_comes_late_does_not_look_like_a_restart() -> None:
    """Ada told Max her name in other words, and in the middle of the work once more: Rob took her for switched on
    again, and left her alone (seed 5124)."""
    ada = Coordination(Role("Ada", "plant", roster=("Ada", "Max", "Rob")), shared(1), random.Random(1))
    ada.knowledge.state = State.READY
    ada.heard(m.Utterance("Max", m.ToAll(), None, None), 60.0)
    ada.heard(m.Utterance("Anna", m.ToAll(), None, m.WhoHere()), 60.0)
    floor = ada.knowledge.floor
    assert floor.wants("greet Max")
    answer = composing.to_asker(ada.knowledge, "Rob", m.Confirmed(m.TaskByNumber(1)))
    floor.want(Intent(Urgency.ALARM, "test", lambda: answer), 60.0)
    while floor.wants("test"):
        ada.tick(ada.next_deadline())
    assert not floor.wants("greet Max")
    assert floor.wants("here Anna"), "a question is answered"


@settings(max_examples=25)
@example(seed=3, most=3, with_outages=True)  # two heard each other for ever, and waited for a third
@example(seed=435667, most=3, with_outages=False)  # two claimed a task for three for ever
@example(seed=78000014, most=3, with_outages=True)  # all took the others for unable, and nobody called again
@example(seed=78000273, most=2, with_outages=True)
@given(st.integers(0, 10**6), st.integers(2, 3), st.booleans())
def test_random_teams_do_each_once_and_nobody_begins_alone(seed: int, most: int, with_outages: bool) -> None:
    do_each_once(seed, most, with_outages)


def do_each_once(seed: int, most: int, with_outages: bool) -> None:
    plan = random_plan(seed, loss=(0.0, 0.2), robots=(most, 6), tasks=(2, 8), outages_max=int(with_outages))
    rng = random.Random(seed)
    tasks = tuple(replace(task, robots=rng.randint(1, most)) for task in plan.tasks)
    outages = tuple(replace(outage, back_s=outage.back_s or 60.0) for outage in plan.outages)
    mission = Watched(replace(plan, tasks=tasks, outages=outages, late={}))
    result = mission.run()
    assert result.lost == 0
    assert result.agreed
    if most == 2:
        assert not result.duplicates or result.off_in_mid_task
        mission.check_each_begins_with_others()


@pytest.mark.parametrize("claims_it_too", [True, False])
def test_one_of_three_that_nobody_names_any_more_leaves_its_place_to_another(claims_it_too: bool) -> None:
    """Two claimed a task for ever, and the rest of the team took it for that of three others (seed 435667)."""
    role, one = Role("Kim", "plant", roster=("Ada", "Kim", "Max", "Rob")), m.TaskByNumber(1)
    kim = Coordination(role, shared(1, robots=3), random.Random(1))
    for name in ("Ada", "Kim" if claims_it_too else "Rob", "Max"):
        kim.board.claim(1, name, 250.0)
    if claims_it_too:
        kim.knowledge.state, kim.knowledge.current.task = State.PROPOSED, 1
    for at_s in range(20, 400, 20):
        assert at_s > 250 or len(kim.board[1].team) == 3
        kim.heard(m.Utterance("Max", m.ToTeam("plant"), None, m.Claim(one)), at_s)
    assert kim.board[1].team == ({"Kim", "Max"} if claims_it_too else {"Max"})
    assert kim.board[1].has_room
    assert kim.knowledge.floor.wants("with Max") is claims_it_too, "it agrees with Max to do it"


def test_a_task_for_more_robots_than_are_free_keeps_nobody_from_taking_over_another() -> None:
    """Each of three took a task for that of another one, and then nobody claimed anything (seeds 1227 and 2085)."""
    kim = Coordination(Role("Kim", "plant", roster=("Kim", "Max")), shared(2, robots=3), random.Random(1))
    kim.board.claim(2, "Max", 250.0)
    assert choosing.tasks_to_claim(kim.knowledge, 240.0) == ()
    assert choosing.tasks_to_claim(kim.knowledge, 260.0) == (2,)


@pytest.mark.parametrize("seed", range(6))
def test_a_task_that_another_one_waits_for_help_with_comes_first(seed: int) -> None:
    names = ("Ada", "Kim", "Max")
    tasks = tuple(replace(task, robots=2) for task in plants(4))
    kim = Coordination(Role("Kim", "plant", roster=names), tasks, random.Random(seed))
    kim.board.claim(3, "Max", 250.0)
    assert choosing.tasks_to_claim(kim.knowledge, 10.0) == (3,)


def test_who_leaves_a_task_for_several_says_so_before_it_claims_another() -> None:
    """To the others it had done its part when it claimed another one; a minute later it said that it had not (seed
    3359 of the random teams)."""
    kim = Coordination(Role("Kim", "plant", roster=("Kim", "Max")), shared(2), random.Random(1))
    kim.knowledge.state, kim.knowledge.current.task = State.ANNOUNCING, 1
    teaming.leave(kim.knowledge, 1, 10.0)
    kim.knowledge.state = State.CLAIMING
    effects.want_claim(kim.knowledge, 10.0)
    assert kim.knowledge.floor.wants(OWN_TURN)
    assert composing.joinable(kim.knowledge) is None


@pytest.mark.parametrize("seed", range(6))
def test_who_was_left_alone_says_so_before_it_claims(seed: int) -> None:
    """It drew a later slot for that than for its claim, by which its partner understood that it had done its part."""
    kim = Coordination(Role("Kim", "plant", roster=("Kim", "Max")), shared(2), random.Random(seed))
    kim.heard(m.Utterance("Max", m.ToTeam("plant")), 5.0)
    kim.knowledge.floor.hold_back(38.0, (1, 2), own=True)
    kim.knowledge.state, kim.knowledge.current.task = State.ANNOUNCING, 1
    teaming.leave(kim.knowledge, 1, 40.0)
    said: list[m.Statement | None] = []
    while len(said) < 2:
        kim.tick(at_s := kim.next_deadline())
        said += [action.utterance.statement for action in kim.actions(at_s) if isinstance(action, Say)]
        kim.spoken(at_s)
    assert said == [m.Failed(m.TaskByNumber(1)), m.Claim(m.TaskByNumber(2))]


def test_who_lists_a_task_for_two_believes_a_robot_that_tells_it_twice_that_it_is_done() -> None:
    """It did not listen: four robots asked each other what is left for ever, without any loss."""
    kim = Coordination(Role("Kim", "plant", roster=("Kim", "Max", "Rob")), shared(1), random.Random(1))
    kim.board.complete(1, None, hearsay=True)
    told = m.Utterance("Max", m.ToRobot("Kim"), None, m.Confirmed(m.TaskByNumber(1), complete=True))
    kim.heard(told, 10.0)
    assert not kim.board.all_done, "it may have misheard"
    kim.heard(told, 30.0)
    assert kim.board.all_done


@pytest.mark.parametrize(("failing", "able"), [("Max", False), ("Rob", True)])
def test_who_was_left_alone_with_a_task_for_two_is_able_to_do_it(failing: str, able: bool) -> None:
    """It says "task one failed", too: in the end each took all others for unable, and nobody called again."""
    kim = Coordination(Role("Kim", "plant", roster=("Kim", "Max", "Rob")), shared(1), random.Random(1))
    for name in ("Max", "Rob"):
        kim.board.claim(1, name, 250.0)
    others = ("Max", "Rob") if failing == "Max" else ("Rob", "Max")
    for n, name in enumerate(others):
        kim.heard(m.Utterance(name, m.ToAll(), None, m.Failed(m.TaskByNumber(1))), 10.0 + 5.0 * n)
    assert ("Max" in kim.board[1].failed_by) is not able
    kim.heard(m.Utterance("Max", m.ToTeam("plant"), None, m.Claim(m.TaskByNumber(1))), 30.0)
    assert "Max" not in kim.board[1].failed_by, "it would not claim what it cannot do"


def test_the_place_of_the_first_is_kept_for_who_is_at_work() -> None:
    """A claim of a task for two is denied once two have it."""
    mission = Mission(NAMES, shared(1, work_s=100.0), people=("Tom",), seed=1)
    mission.air.run_until(100.0)
    mission.hear(101.0, "Hi team plant, I am Tom, I will complete task one")
    mission.air.run_until(115.0)
    assert any("Hi Tom" in line and "negative" in line for line in mission.written(100.0))
    assert all(robot.board[1].team <= set(NAMES) for robot in mission.robots.values() if robot.at_place)
    assert Place(0.0, 1.0) == mission.plan.tasks[0].place


@pytest.mark.parametrize("said", ["Hi all, I am Anna", "Who is here", "Hi all, I am Max, member of team plant"])
def test_who_says_its_name_because_it_was_asked_has_not_been_switched_on_again(said: str) -> None:
    """Rob left the task for two to Bot, who left it, too; each took the other for unable, and nobody did it."""
    mission = Mission(NAMES[:2], shared(1, work_s=60.0), ("Anna", "Max"), seed=2)
    mission.run_until(lambda: all(robot.state is State.ACTING for robot in mission.robots.values()), 1.0)
    asked_s = mission.air.now
    mission.hear(asked_s, said)
    mission.air.run_until(asked_s + 20.0)
    answers = [text for text in mission.written(asked_s, without=("Anna", "Max")) if "complet" not in text]
    assert len(answers) == 2, answers
    assert all(robot.state is State.ACTING for robot in mission.robots.values()), mission.written(asked_s)


def test_two_that_leave_each_other_alone_with_a_task_for_two_do_not_take_each_other_for_unable() -> None:
    kim = Coordination(Role("Kim", "plant", roster=("Kim", "Max")), shared(1), random.Random(1))
    kim.board[1].calls = 1  # Kim has left the task
    kim.heard(m.Utterance("Max", m.ToAll(), None, m.Working(m.TaskByNumber(1))), 5.0)
    kim.heard(m.Utterance("Max", m.ToAll(), None, m.Failed(m.TaskByNumber(1))), 10.0)
    assert not kim.board[1].failed_by
    assert not kim.board[1].team


@pytest.mark.parametrize("seed", range(3))
def test_who_has_called_in_vain_joins_at_once_who_calls(seed: int) -> None:
    """It waited for its own next call: for up to two hours both called in turn."""
    plan = WordPlan(NAMES[:2], shared(1), seed, outages=(Outage("Bot", 15.0, 400.0),))
    assert WordMission(plan).run().ended_s < 500.0


def test_who_is_at_a_task_for_two_does_its_part_whatever_a_third_believes() -> None:
    """The third may know an earlier part of the robot's, and take it with the other's for the whole."""
    rob = Coordination(Role("Rob", "plant", roster=NAMES), shared(1), random.Random(1))
    for name in NAMES[:2]:
        rob.board.claim(1, name, 250.0)
    rob.knowledge.state, rob.knowledge.current.task = State.CHECKING, 1
    rob.knowledge.current.promised = frozenset({"Bot"})
    rob.heard(m.Utterance("Max", m.ToRobot("Bot"), None, m.Confirmed(m.TaskByNumber(1), complete=True)), 10.0)
    assert rob.state is State.ACTING
