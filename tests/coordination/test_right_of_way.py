"""Places that only one robot fits in: what is said, and who goes first."""

from __future__ import annotations

import random

import pytest

from hil_fakes.word_mission import Outage
from hil_fakes.word_traffic import TrafficMission, corridor_plan
from hvcpd.config.shared_places import SharedPlace
from hvcpd.config.tasks import GoTo, Place
from hvcpd.coordination import right_of_way
from hvcpd.coordination.actions import Perform, Say
from hvcpd.coordination.coordination import Coordination
from hvcpd.coordination.place_state import TELL_MAX_S, PlaceState
from hvcpd.coordination.states import State
from hvcpd.language import messages as m
from hvcpd.language.phrasebook import Phrasebook, Vocabulary
from tests.coordination.corridor import CORRIDOR, CROSSING, EAST, NAMES, WEST, Corridor, across, heard


def test_who_comes_after_waits_and_is_let_in_by_who_leaves() -> None:
    mission = Corridor(("Bot", "Rob"), (across(1), across(2, WEST)), starts=(WEST, EAST), unable=CROSSING, seed=3)
    result = mission.run()
    assert result.agreed
    assert result.lost == 0
    assert mission.traffic.collisions == 0
    assert mission.traffic.passages >= 2
    said = mission.of_the_corridor()
    assert any(text.endswith("I will use the corridor") for text in said)
    assert any(text.endswith("confirmed the corridor") for text in said)


def test_a_place_that_was_given_is_given_again_to_who_missed_it() -> None:
    mission = Corridor(("Bot", "Rob"), (across(1),), starts=(WEST, WEST), unable={"Bot": frozenset({1})})
    mission.until("Rob", State.GOING, 0.25)
    mission.run_until(lambda: any(isinstance(u.statement, m.PlaceWanted) for _, _, u in mission.said), 0.25)
    mission.deaf["Rob"] = 2
    assert mission.run().lost == 0
    given = [text for text in mission.of_the_corridor() if "confirmed" in text]
    assert given == ["Hi Rob, I am Bot, confirmed the corridor"] * 3


def test_who_is_switched_on_inside_drives_out_when_somebody_waits() -> None:
    """It does not know where it came from: it goes to the nearest task outside."""
    mission = TrafficMission(corridor_plan(1174))
    mission.run()
    assert mission.traffic.collisions == 0
    assert max(mission.traffic.waits_s) < 200.0, "it was 401 s"


def test_who_is_switched_on_inside_where_all_tasks_are_drives_to_where_it_starts() -> None:
    """It stood there for ever, and so did who waited for it."""
    bot = Corridor(("Bot", "Rob"), (across(1, Place(0.2, 0.0)),), starts=(Place(0.0, 0.0), WEST)).robots["Bot"]
    bot.knowledge.body.home = WEST
    bot.may_drive((), 1.0)
    bot.heard(m.Utterance("Rob", m.ToAll(), None, m.PlaceWanted("corridor")), 2.0)
    bot.may_drive((), 2.0)
    assert Perform(0, (GoTo(WEST),)) in bot.actions(2.0)


def test_who_stays_in_its_dock_for_weeks_says_so_every_five_minutes() -> None:
    """The pauses double no further; after three and a half days they were too long for a number."""
    dock = PlaceState(CORRIDOR, 0.0)
    for _ in range(2000):
        dock.tell(0.0)
    assert dock.tell_s == TELL_MAX_S


@pytest.mark.parametrize("seed", [4, 5, 15, 16, 32])
def test_a_robot_that_is_not_heard_stays_out(seed: int) -> None:
    """Nobody hears Rob's requests while another one works in the corridor: it hears from that one that it must wait."""
    tasks = (across(1), across(2, Place(0.0, 0.0), 30.0), across(3), across(4, WEST))
    mission = Corridor(NAMES, tasks, starts=(WEST, WEST, WEST), seed=seed)
    of_places = m.PlaceWanted | m.PlaceGiven | m.PlaceTaken | m.PlaceFree
    mission.air.misses = lambda _listener, u: u.speaker == "Rob" and isinstance(u.statement, of_places)
    while mission.air.now < 180.0:
        mission.air.run_until(mission.air.now + 0.25)
        assert mission.traffic.collisions == 0


def test_who_is_stopped_inside_says_so_and_keeps_the_place_until_it_has_left() -> None:
    mission = Corridor(("Bot", "Rob"), (across(1), across(2, WEST)), starts=(WEST, EAST), unable=CROSSING, seed=3)
    first = None
    while first is None:
        assert mission.air.now < 300.0
        mission.air.run_until(mission.air.now + 0.25)
        first = next((n for n, r in mission.robots.items() if r.knowledge.places[0].inside), None)
    mission.speak("Anna", m.Utterance(None, m.ToRobot(first), None, m.Stop()))
    began_s = mission.air.now
    mission.air.run_until(began_s + 200.0)
    assert f"Hi all, I am {first}, I have stopped in the corridor" in mission.of_the_corridor()
    assert mission.traffic.passages == 1
    assert len(mission.held) == 1
    mission.speak("Anna", m.Utterance(None, None, None, m.Resume()))
    assert mission.run().lost == 0
    assert mission.traffic.collisions == 0


def test_who_is_stopped_inside_says_so_when_another_robot_gives_the_place_away() -> None:
    """It said that it was inside, as if it would soon leave: the others waited for it for a shorter time."""
    bot = Corridor(NAMES, (), starts=(Place(0.0, 0.0), WEST, WEST)).robots["Bot"]
    bot.may_drive((), 1.0)
    bot.stop(2.0)
    said_until(bot, 95.0)
    bot.heard(m.Utterance("Rob", m.ToRobot("Max"), None, m.PlaceGiven("corridor")), 100.0)
    assert said_until(bot, 105.0) == [m.PlaceTaken("corridor", stands=True)]


def said_until(robot: Coordination, end_s: float) -> list[m.Statement | None]:
    said: list[m.Statement | None] = []
    while (due_s := robot.next_deadline()) < end_s:
        robot.tick(due_s)
        for action in robot.actions(due_s):
            if isinstance(action, Say):
                said.append(action.utterance.statement)
                robot.spoken(due_s)
    return said


def test_who_rests_in_a_place_makes_room_for_who_waits() -> None:
    tasks = (across(1, Place(0.0, 0.0)), across(2, Place(0.1, 0.0)))
    mission = Corridor(("Bot", "Rob"), tasks, starts=(WEST, WEST), seed=1)
    result = mission.run()
    assert result.agreed
    assert (result.lost, result.duplicates) == (0, 0)
    assert mission.traffic.collisions == 0
    assert mission.traffic.passages >= 2


@pytest.mark.parametrize(
    "state",
    [
        *(State.READY, State.CLAIMING, State.PROPOSED, State.REPORTING, State.REPORTED, State.ASKING, State.ASKED),
        *(State.WAKING, State.GREETING, State.MEETING),
    ],
)
def test_who_rests_in_a_place_drives_out_whatever_it_is_about_to_say(state: State) -> None:
    """Others waited for three minutes while a robot in there asked what is left (seed 8035), and for fourteen while one
    that was switched on in there had no turn to greet (seed 7338)."""
    bot = Corridor(("Bot", "Rob"), (across(1),), starts=(Place(0.0, 0.0), WEST)).robots["Bot"]
    bot.may_drive((), 1.0)
    bot.knowledge.state = state
    bot.heard(m.Utterance("Rob", m.ToAll(), None, m.PlaceWanted("corridor")), 2.0)
    bot.may_drive((), 2.0)
    assert bot.state is State.RETURNING
    assert bot.knowledge.missed.heard_work is (state in (State.ASKING, State.ASKED)), "it asks again outside"


@pytest.mark.parametrize(("name", "other", "pause_s"), [("Bot", "Max", 1.5), ("Max", "Bot", 5.0)])
def test_of_two_that_wait_the_first_name_asks_next(name: str, other: str, pause_s: float) -> None:
    """Bot left the turn to Max after each request of Max, and so never asked often enough (seed 2045)."""
    p = (robot := Corridor(NAMES, (), starts=(WEST,) * 3).robots[name]).knowledge.places[0]
    p.keep("Rob", 90.0)
    p.wanted_s = 40.0
    robot.heard(m.Utterance(other, m.ToAll(), None, m.PlaceWanted("corridor")), 50.0)
    assert p.ask_s == 50.0 + pause_s


def test_the_place_of_who_was_switched_off_outside_is_taken_after_silence() -> None:
    mission = Corridor(NAMES, (across(1),), starts=(WEST,) * 3, unable={n: frozenset({1}) for n in ("Bot", "Max")})
    mission.until("Rob", State.GOING, 0.25)
    mission.fail(Outage("Bot", mission.air.now, None))
    assert mission.run().lost == 0
    asked = [text for text in mission.of_the_corridor() if "use" in text]
    assert len(asked) >= 4
    assert max(mission.traffic.waits_s) <= 60.0


def test_how_long_a_keeper_stays_silent_does_not_depend_on_its_stays_before() -> None:
    """It had been in there two minutes before, and left without a word; once it was switched off, another robot waited
    for it for 260 s (seed 41161)."""
    p = Corridor(NAMES, (), starts=(WEST,) * 3).robots["Max"].knowledge.places[0]
    p.is_taken_by("Bot", 178.0)
    first_s = p.lease_end_s - 178.0
    p.is_taken_by("Bot", 308.0)
    assert p.lease_end_s == 308.0 + first_s


def test_the_requests_of_all_that_wait_show_that_the_keeper_is_missing() -> None:
    """Each counted its own requests only, and began again whenever a robot that comes first asked; three robots waited
    for 104 to 140 s (seed 10326)."""
    mission = TrafficMission(corridor_plan(10326))
    mission.run()
    assert mission.traffic.collisions == 0
    assert max(mission.traffic.waits_s) < 70.0


@pytest.mark.parametrize(("name", "other", "enters"), [("Bot", "Max", True), ("Max", "Bot", False)])
def test_of_two_that_wait_for_a_missing_keeper_the_first_name_goes_in(name: str, other: str, enters: bool) -> None:
    """Bot goes in after its own first request, if Max has asked three times and nobody has answered."""
    assert goes_in_after(name, other, (62.0, 68.0, 74.0)) is enters


def test_a_voice_that_was_not_understood_shows_that_the_keeper_is_there() -> None:
    """Rob answered the requests after the third one, and Zoe, which did not understand it, took the place after one
    more: both were in there."""
    assert not goes_in_after("Bot", "Max", (44.0, 50.0, 56.0, 62.0, 68.0, 74.0), voice_after_s=74.0)


def goes_in_after(name: str, other: str, requests_s: tuple[float, ...], voice_after_s: float | None = None) -> bool:
    """Whether a robot takes the place after its own request, the first one after those of another robot."""
    robot = (mission := Corridor(NAMES, (), starts=(WEST,) * 3)).robots[name]
    p, knowledge = robot.knowledge.places[0], robot.knowledge
    p.keep("Rob", 0.0)
    p.wanted_s = 40.0
    for asked_s in requests_s:
        robot.channel(True, asked_s - 2.5)
        robot.channel(False, asked_s)
        heard(mission, name, other, m.PlaceWanted("corridor"), asked_s)
        if asked_s == voice_after_s:
            robot.channel(True, asked_s + 0.5)
            robot.channel(False, asked_s + 3.0)
        right_of_way.ask(knowledge, asked_s + 1.5)
        right_of_way.ask(knowledge, asked_s + 4.0)
    knowledge.floor.began_s = 79.5
    right_of_way.said(knowledge, p.topic, 82.0)
    right_of_way.ask(knowledge, 83.5)
    return p.using


def test_who_has_waited_longest_is_first() -> None:
    mission = Corridor(NAMES, (across(1), across(2), across(3)), starts=(WEST,) * 3, seed=5)
    rob = mission.robots["Rob"]
    p = rob.knowledge.places[0]
    p.keep("Rob", 0.0)
    p.waiting = {"Bot": (20.0, 50.0), "Max": (10.0, 49.0)}
    p.using = True
    rob.sensed(here=WEST)
    rob.may_drive((), 52.0)
    assert p.keeper == "Max"


@pytest.mark.parametrize("seed", range(3))
def test_a_robot_that_stays_inside_says_so_less_and_less_and_nobody_enters(seed: int) -> None:
    """Nobody hears Rob's requests; Bot works inside for half an hour, and Rob misses every third sentence."""
    inside = across(1, Place(0.0, 0.0), wait_s=1800.0)
    unable = {"Bot": frozenset({2}), "Rob": frozenset({1})}
    mission = Corridor(("Bot", "Rob"), (inside, across(2, WEST)), starts=(WEST, EAST), unable=unable, seed=seed)
    mission.until_inside("Bot")
    rng = random.Random(seed)
    mission.air.misses = lambda listener, _: listener == "Bot" or rng.random() < 1 / 3
    began_s = mission.air.now
    mission.run_until(lambda: not mission.robots["Bot"].knowledge.places[0].inside, 5.0, began_s + 2200.0)
    taken = [at_s for at_s, who, u in mission.said if who == "Bot" and isinstance(u.statement, m.PlaceTaken)]
    assert len(taken) <= 10
    assert mission.traffic.collisions == 0
    mission.air.misses = lambda _listener, _utterance: False
    result = mission.run()
    assert (result.lost, mission.traffic.collisions) == (0, 0)
    assert any(isinstance(u.statement, m.PlaceFree | m.PlaceGiven) and who == "Bot" for _, who, u in mission.said)


def test_places_that_are_listed_anew_keep_what_is_known_of_the_others() -> None:
    mission = Corridor(("Bot", "Rob"), (across(1),), starts=(WEST, WEST))
    rob, now = mission.robots["Rob"], mission.air.now
    rob.knowledge.places[0].keep("Bot", 50.0)
    tap = SharedPlace("tap", 9.0, 9.0, 9.0, 9.0, 0.5)
    rob.retask((across(1),), now, (tap, CORRIDOR))
    assert [(p.place, p.keeper) for p in rob.knowledge.places] == [(tap, None), (CORRIDOR, "Bot")]
    rob.retask((across(1),), now)
    rob.sensed(here=Place(0.0, 0.0))
    assert rob.knowledge.places == ()
    assert rob.may_drive((EAST,), now)


def test_a_place_that_is_not_listed_costs_nothing_and_changes_nothing() -> None:
    bare, listed = (Phrasebook(Vocabulary(NAMES, places=places)) for places in ((), ("corridor",)))
    assert not any(word in bare.graph.words for word in ("use", "in", "corridor"))
    assert 0 < len(listed.graph.arcs) - len(bare.graph.arcs) <= 12
