"""Places that only one robot fits in: those that wait leave the robot inside the air that it needs to finish."""

from __future__ import annotations

import math

import pytest

from hil_fakes.word_traffic import TrafficMission, corridor_plan
from hvcpd.config.shared_places import LINE_M
from hvcpd.config.tasks import GoTo, Place
from hvcpd.coordination import right_of_way
from hvcpd.coordination.actions import Perform, Say
from hvcpd.coordination.floor import EARLY_SLOTS
from hvcpd.coordination.place_state import WAITS_S
from hvcpd.coordination.right_of_way import ASKS_MAX, LEASE_S
from hvcpd.coordination.states import State, Trigger
from hvcpd.coordination.table import fire
from hvcpd.language import messages as m
from tests.coordination.corridor import CORRIDOR, EAST, NAMES, WEST, Corridor, across

INSIDE = Place(0.0, 0.0)


@pytest.mark.parametrize(("seed", "outages_max"), [(5, 0), (25, 0), (56, 0), (76, 0), (17, 2), (34, 2)])
def test_missions_with_tasks_inside_end_where_a_third_of_all_sentences_is_lost(seed: int, outages_max: int) -> None:
    """Three robots waited, and asked again every seven seconds and before all turns: the robot inside had no turn to
    announce its task, and nobody one to confirm it. 2 to 9 tasks were never done."""
    mission = TrafficMission(corridor_plan(seed, loss=(0.3, 0.3), outages_max=outages_max, inside=0.3))
    result = mission.run()
    assert result.lost == 0
    assert result.ended_s < math.inf
    assert not mission.held
    assert mission.traffic.collisions == 0


@pytest.mark.parametrize("to", [None, "Max"])
def test_who_waits_asks_the_more_rarely_the_longer_the_keeper_stays(to: str | None) -> None:
    robot = Corridor(NAMES, (), starts=(WEST,) * 3).robots["Max"]
    p = robot.knowledge.places[0]
    p.wanted_s = 100.0
    pauses_s = []
    addressee = m.ToRobot(to) if to else m.ToAll()
    for now in (100.0, 110.0, 120.0, 150.0):
        robot.heard(m.Utterance("Bot", addressee, None, m.PlaceTaken("corridor")), now)
        pauses_s.append(p.ask_s - now)
    assert pauses_s == sorted(pauses_s)
    assert pauses_s[0] <= 7.0, "a robot that passes through has left soon"
    assert 20.0 < pauses_s[-1] < WAITS_S, "rarely, and often enough to be known to wait"


def test_a_robot_that_waits_still_counts_as_waiting_while_the_keeper_has_stopped_inside() -> None:
    """It asked once a minute, and counted as gone after 35 s: another one that came later was let in before it."""
    robot = Corridor(NAMES, (), starts=(WEST,) * 3).robots["Max"]
    p = robot.knowledge.places[0]
    p.wanted_s = 100.0
    robot.heard(m.Utterance("Bot", m.ToAll(), None, m.PlaceTaken("corridor", stands=True)), 100.0)
    assert p.ask_s - 100.0 < WAITS_S


def test_who_asks_again_after_a_long_time_has_not_waited_since_then() -> None:
    p = Corridor(NAMES, (), starts=(WEST,) * 3).robots["Max"].knowledge.places[0]
    p.note_waiting("Rob", 100.0)
    p.note_waiting("Bot", 300.0)
    p.note_waiting("Rob", 305.0)
    assert p.queue(310.0) == ("Bot", "Rob")
    assert p.queue(300.0 + WAITS_S) == ("Rob",)


@pytest.mark.parametrize("asked", [True, False])
def test_a_robot_inside_that_others_wait_for_speaks_before_all_turns(asked: bool) -> None:
    bot = Corridor(("Bot", "Rob"), (across(1),), starts=(INSIDE, WEST)).robots["Bot"]
    me = bot.knowledge
    bot.may_drive((), 100.0)
    if asked:
        me.places[0].note_waiting("Rob", 100.0)
    me.board.claim(1, "Bot", 300.0)
    me.current.task, me.state = 1, State.GOING
    bot.heard(m.Utterance("Bob", m.ToAll(), None, m.Free()), 101.0)
    me.floor.understood(101.0, (4, 5))
    fire(me, Trigger.ARRIVED, 101.0)
    early_s = me.timing.turn_gap_s + EARLY_SLOTS * me.timing.slot_s
    assert (me.floor.next_deadline() < 101.0 + early_s) is asked


def test_a_robot_inside_that_is_asked_while_it_waits_for_its_turn_hurries() -> None:
    """It had wanted to announce its task before anybody asked, and had no turn for 38 s while others waited."""
    bot = Corridor(("Bot", "Rob"), (across(1),), starts=(INSIDE, WEST)).robots["Bot"]
    me = bot.knowledge
    bot.may_drive((), 100.0)
    me.board.claim(1, "Bot", 300.0)
    me.current.task, me.state = 1, State.GOING
    fire(me, Trigger.ARRIVED, 101.0)
    bot.heard(m.Utterance("Rob", m.ToAll(), None, m.PlaceWanted("corridor")), 102.0)
    me.floor.withdraw("taken corridor")
    me.floor.understood(102.0, (4, 5))
    early_s = me.timing.turn_gap_s + EARLY_SLOTS * me.timing.slot_s
    assert me.floor.next_deadline() < 102.0 + early_s


def test_who_is_told_to_wait_is_not_forgotten_while_it_waits() -> None:
    """Each "I am in the corridor" made all that waited pause anew. They counted as gone after 35 s; the robot inside
    let others in before them, or went in again itself: one waited for 424 s though no sentence was lost."""
    mission = Corridor(NAMES, (), starts=(INSIDE, WEST, WEST))
    keeper, other = mission.robots["Bot"], mission.robots["Max"]
    keeper.may_drive((), 1.0)
    for robot in (keeper, other):
        robot.heard(m.Utterance("Rob", m.ToAll(), None, m.PlaceWanted("corridor")), 100.0)
    for now in (125.0, 150.0, 175.0):
        right_of_way.said(keeper.knowledge, "taken corridor", now)
        other.heard(m.Utterance("Bot", m.ToAll(), None, m.PlaceTaken("corridor")), now)
    for robot in (keeper, other):
        assert robot.knowledge.places[0].queue(180.0) == ("Rob",)
        assert robot.knowledge.places[0].queue(175.0 + WAITS_S) == ()


def test_two_that_wait_do_not_ask_at_the_same_moment() -> None:
    """Both had heard the same sentence, and paused for the same time: nobody understood either, time and again."""
    mission = Corridor(NAMES, (), starts=(WEST,) * 3)
    due_s = []
    for name in ("Max", "Rob"):
        robot = mission.robots[name]
        robot.knowledge.places[0].wanted_s = 50.0
        for now in (50.0, 100.0):
            robot.heard(m.Utterance("Bot", m.ToAll(), None, m.PlaceTaken("corridor")), now)
        due_s.append(robot.knowledge.places[0].ask_s)
    assert abs(due_s[0] - due_s[1]) > 0.5


def test_who_has_done_its_task_inside_makes_room_for_who_asked_before() -> None:
    """It stood there until somebody asked again."""
    bot = Corridor(("Bot", "Rob"), (across(1),), starts=(INSIDE, WEST)).robots["Bot"]
    me = bot.knowledge
    me.body.home = WEST
    bot.may_drive((), 90.0)
    me.board.claim(1, "Bot", 300.0)
    me.current.task, me.state = 1, State.ACTING
    bot.heard(m.Utterance("Rob", m.ToAll(), None, m.PlaceWanted("corridor")), 100.0)
    bot.may_drive((), 101.0)
    assert me.state is State.ACTING
    bot.performed(110.0)
    bot.may_drive((), 110.0)
    assert me.state is State.RETURNING
    assert Perform(0, (GoTo(WEST),)) in bot.actions(110.0)


def test_who_cannot_make_room_tries_again_after_a_pause() -> None:
    bot = Corridor(("Bot", "Rob"), (across(1),), starts=(INSIDE, WEST)).robots["Bot"]
    bot.knowledge.body.home = WEST
    bot.knowledge.state = State.READY
    bot.may_drive((), 90.0)
    bot.heard(m.Utterance("Rob", m.ToAll(), None, m.PlaceWanted("corridor")), 100.0)
    tries = 0
    for step in range(40):
        now = 100.0 + 0.25 * step
        bot.may_drive((), now)
        tries += any(isinstance(action, Perform) for action in bot.actions(now))
        if bot.state is State.RETURNING:
            bot.perform_failed(now)
    assert tries == 2


@pytest.mark.parametrize("inside_m", [0.16, 0.2, 0.39])
def test_who_makes_room_drives_out_beyond_the_line(inside_m: float) -> None:
    """It drove to where it had last stood outside, a hand's breadth from the area, where it still counted as inside."""
    bot = Corridor(("Bot", "Rob"), (across(1),), starts=(WEST, EAST)).robots["Bot"]
    p = bot.knowledge.places[0]
    p.keep("Bot", 0.0)
    for x_m in (-4.0, CORRIDOR.low_x_m - LINE_M - 0.05, CORRIDOR.low_x_m - inside_m, 0.0):
        bot.sensed(here=Place(x_m, 0.0))
        bot.may_drive((EAST,), 100.0)
    assert p.inside
    assert p.came_from is not None
    assert CORRIDOR.distance_m(p.came_from) >= LINE_M


def test_a_request_by_name_tells_who_has_the_place() -> None:
    """Ada had heard nothing of the corridor, took herself for its first keeper, and let Zoe in, who had asked Rob by
    name: Rob was inside (seed 250, with tasks inside at a loss of 30 %)."""
    mission = Corridor(NAMES, (), starts=(WEST,) * 3)
    bot = mission.robots["Bot"]
    bot.heard(m.Utterance("Max", m.ToAll(), None, m.Free()), 50.0)
    bot.heard(m.Utterance("Rob", m.ToAll(), None, m.Free()), 55.0)
    bot.heard(m.Utterance("Rob", m.ToRobot("Max"), None, m.PlaceWanted("corridor")), 60.0)
    assert bot.knowledge.places[0].keeper == "Max"
    bot.tick(62.0)
    assert not [action for action in bot.actions(62.0) if "PlaceGiven" in repr(action)]


def test_no_two_met_where_one_presumed_itself_the_first_keeper() -> None:
    mission = TrafficMission(corridor_plan(250, loss=(0.3, 0.3), outages_max=0, inside=0.3))
    mission.run()
    assert mission.traffic.collisions == 0


def test_who_hears_another_one_ask_does_not_ask_sooner_than_it_meant_to() -> None:
    """Each request of one that waited made the first of the alphabet ask as well, long before its pause was over."""
    robot = Corridor(NAMES, (), starts=(WEST,) * 3).robots["Bot"]
    p = robot.knowledge.places[0]
    p.wanted_s = 50.0
    for now in (50.0, 100.0):
        robot.heard(m.Utterance("Rob", m.ToAll(), None, m.PlaceTaken("corridor")), now)
    due_s = p.ask_s
    robot.heard(m.Utterance("Max", m.ToAll(), None, m.PlaceWanted("corridor")), 105.0)
    assert p.ask_s == due_s


@pytest.mark.parametrize("wanted_s", [None, 110.0])
@pytest.mark.parametrize("silences", [ASKS_MAX - 1, ASKS_MAX])
def test_who_gave_a_place_to_one_that_never_heard_it_gives_it_anew(silences: int, wanted_s: float | None) -> None:
    """Nobody had heard that Max gave the place on when it left, after a long stay: the others took it for inside, and
    asked in vain for 16 minutes, while Max heard them (seed 199, with tasks inside at a loss of 30 %). Where Max wanted
    it again, it waited for the robot that it had given it, for twelve minutes."""
    mission = Corridor(NAMES, (), starts=(WEST,) * 3)
    p = mission.robots["Max"].knowledge.places[0]
    p.keep("Rob", 100.0 + LEASE_S)
    p.given_s, p.gave, p.silences, p.wanted_s = 100.0, True, silences, wanted_s
    mission.robots["Max"].heard(m.Utterance("Bot", m.ToAll(), None, m.PlaceWanted("corridor")), 101.0 + LEASE_S)
    assert (p.keeper == "Bot") is (silences == ASKS_MAX)
    assert not p.using


def test_who_gave_a_place_gives_it_anew_to_the_robot_that_never_heard_so() -> None:
    """Max missed that it was given the corridor, took Bot for inside, and asked forty times, for 791 s; Bot heard it,
    and counted only the requests of others."""
    robot = Corridor(NAMES, (), starts=(WEST,) * 3).robots["Bot"]
    p = robot.knowledge.places[0]
    p.keep("Max", 100.0 + LEASE_S)
    p.given_s, p.gave = 100.0, True
    given = []
    for now in (146.0 + 6.0 * n for n in range(ASKS_MAX + 1)):
        robot.heard(m.Utterance("Max", m.ToAll(), None, m.PlaceWanted("corridor")), now)
        robot.tick(now + 2.0)
        given.append(any(isinstance(a, Say) for a in robot.actions(now + 2.0)))
    assert given == [False] * ASKS_MAX + [True]
