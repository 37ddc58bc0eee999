"""What a robot cannot do it refuses, and an able one takes over."""

from dataclasses import replace

import pytest

from hvcpd.coordination.states import State, Trigger
from hvcpd.coordination.table import fire
from hvcpd.language import messages as m
from tests.coordination.mission import Mission, plants

CANNOT = {"Rob": frozenset({1, 2})}


@pytest.mark.parametrize("seed", range(4))
def test_a_volunteer_leaves_what_it_cannot_do_to_others(seed: int) -> None:
    mission = Mission(("Rob", "Bot"), plants(4), seed=seed, unable=CANNOT)
    mission.run()
    assert mission.exactly_once
    assert (mission.by[1], mission.by[2]) == ("Bot", "Bot")


@pytest.mark.parametrize("seed", range(4))
def test_who_comes_late_learns_that_others_have_done_what_it_cannot_do_itself(seed: int) -> None:
    """Only it can do the last task, which comes after one that it cannot do: it would wait for that for ever."""
    after = replace(plants(2)[1], after=frozenset({1}))
    unable = {"Rob": frozenset({2}), "Bot": frozenset({2}), "Max": frozenset({1})}
    names = ("Rob", "Bot", "Max")
    mission = Mission(names, (plants(2)[0], after), seed=seed, unable=unable, late={"Max": 150.0})
    result = mission.run()
    assert mission.by == {1: mission.by[1], 2: "Max"}
    assert (result.lost, result.agreed) == (0, True)


def test_who_can_do_nothing_of_what_is_left_stops_asking() -> None:
    nobody = {name: frozenset({1}) for name in ("Rob", "Bot")}
    mission = Mission(("Rob", "Bot"), plants(2), seed=1, unable=nobody, limit_s=20_000.0)
    mission.run()
    asked = [at_s for at_s, _, u in mission.said if isinstance(u.statement, m.WhatLeft)]
    assert 2 <= len(asked) <= 8
    assert max(asked) < 6_000.0
    assert not [at_s for at_s in asked if at_s < 240.0], "others may be about to do it"


@pytest.mark.parametrize("seed", range(4))
def test_an_order_is_refused_and_given_to_an_able_one(seed: int) -> None:
    mission = Mission(("Rob", "Bot", "Max"), plants(2), seed=seed, coordinator="Max", unable=CANNOT)
    mission.run()
    assert mission.exactly_once
    assert mission.by == {1: "Bot", 2: "Bot"}


def test_a_person_is_told() -> None:
    mission = Mission(("Rob",), plants(3), ("Anna",), seed=1, coordinator="Nobody", unable=CANNOT)
    mission.hear(40.0, "Hi Rob, I am Anna, complete task two")
    mission.air.run_until(50.0)
    assert mission.written(40.0, without=("Anna",)) == ["Hi Anna, I am Rob, I cannot complete task two"]


def test_nobody_who_is_silent_for_long_is_waited_for() -> None:
    mission = Mission(("Rob", "Bot"), plants(1), seed=2, coordinator="Nobody")
    mission.air.run_until(40.0)
    rob = mission.robots["Rob"]
    assert rob.peers.is_present("Bot", mission.air.now)
    absent_s = mission.plan.timing.absent_s
    assert not rob.peers.is_present("Bot", mission.air.now + absent_s)


@pytest.mark.parametrize(
    ("said", "state"),
    [
        ("Hi Rob, I am Max, I cannot water the green rose", State.READY),
        ("Hi Rob, I am Max, I am busy", State.READY),
        ("Hi Rob, I am Max, I will water the green rose", State.CONFIRMING),
        ("Hi Rob, I am Max, I will water the violet rose", State.DENYING),
    ],
)
def test_what_is_understood_after_the_time_for_it_still_answers_the_order(said: str, state: State) -> None:
    """In noise a voice seems to end earlier than it does: the order was said again and again, and never answered."""
    mission = Mission(("Rob", "Max"), plants(2), seed=3, coordinator="Rob")
    rob = mission.robots["Rob"]
    mission.until("Rob", State.ORDERED)
    current = rob.knowledge.current
    current.task, current.task_ref, current.repeats = 1, m.TaskByName("water the green rose"), 1
    fire(rob.knowledge, Trigger.TIMEOUT, mission.air.now)
    rob.heard(mission.book.parse_text(said), mission.air.now)
    assert rob.state is state
    peer = rob.peers.get("Max")
    assert peer is not None
    assert (1 in peer.unable) is ("cannot" in said)
    assert (peer.silent_until_s > mission.air.now) is ("busy" in said)
