"""Whole missions by the state machine alone, over a channel of words."""

import pytest

from hvcpd.coordination.table import State
from hvcpd.language import messages as m
from tests.coordination.mission import Mission, plants

NAMES = ("Rob", "Bot", "Max", "Zoe", "Ada", "Kim")


@pytest.mark.parametrize("n_robots", [1, 2, 3, 6])
@pytest.mark.parametrize("seed", range(5))
def test_volunteers_water_every_plant_exactly_once(n_robots: int, seed: int) -> None:
    mission = Mission(NAMES[:n_robots], plants(6), seed=seed)
    mission.run()
    assert mission.exactly_once, mission.said
    assert all(robot.board.all_done for robot in mission.robots.values())
    owners = [{n: o for n, (_, o) in saved.items()} for saved in mission.saved.values()]
    assert all(view == mission.by for view in owners), "every robot's own copy names who truly did it"


@pytest.mark.parametrize("n_robots", [2, 4])
@pytest.mark.parametrize("seed", range(5))
def test_a_coordinator_orders_and_is_obeyed(n_robots: int, seed: int) -> None:
    mission = Mission(NAMES[:n_robots], plants(5), seed=seed, coordinator="Bot")
    mission.run()
    assert mission.exactly_once, mission.said
    assert "Bot" not in mission.by.values()


def test_an_order_is_read_back_confirmed_carried_out_and_reported() -> None:
    mission = Mission(("Rob", "Bot"), plants(1), seed=3, coordinator="Bot")
    mission.run()
    dialogue = [text for _, text in mission.said if "member" not in text]
    assert dialogue == [
        "Hi Rob, I am Bot, water the green rose",
        "Hi Bot, I am Rob, I will water the green rose",
        "Hi Rob, I am Bot, confirmed",
        "Hi Bot, I am Rob, task one complete",
        "Hi Rob, I am Bot, confirmed",
    ]


@pytest.mark.parametrize("mode", [None, "Bot"])
def test_without_air_nothing_is_coordinated(mode: str | None) -> None:
    mission = Mission(("Rob", "Bot"), plants(3), seed=1, loss=1.0, coordinator=mode)
    mission.run(limit_s=600)
    for robot in mission.robots.values():
        assert robot.peers.all() == ()
        assert all(entry.owner in (None, robot.role.name) for entry in robot.board.entries())
    assert not mission.exactly_once


@pytest.mark.parametrize("seed", range(8))
def test_with_a_tenth_of_the_sentences_lost_no_task_is_lost(seed: int) -> None:
    for coordinator in (None, "Bot"):
        mission = Mission(NAMES[:3], plants(5), seed=seed, loss=0.1, coordinator=coordinator)
        mission.run()
        assert all(mission.watered[n] for n in range(1, 6)), mission.said


@pytest.mark.parametrize("call", [None, m.ToAll(), m.ToRobot("Rob")])
def test_stop_halts_and_latches_until_resume(call: m.Addressee | None) -> None:
    mission = Mission(("Rob", "Bot"), plants(4), seed=2)
    mission.tell(40.0, "Anna", m.Utterance(None, call, None, m.Stop()))
    mission.air.run_until(140.0, mission.next_deadline)
    halted = ["Rob"] if isinstance(call, m.ToRobot) else ["Rob", "Bot"]
    for name in halted:
        assert mission.robots[name].state is State.STOPPED
        assert mission.robots[name].task is None
    assert {t for _, t in mission.said} >= {f"Hi all, I am {name}, I have stopped" for name in halted}
    watered_before = sum(mission.watered.values())
    if len(halted) == 2:
        mission.air.run_until(240.0, mission.next_deadline)
        assert sum(mission.watered.values()) == watered_before
    mission.tell(250.0, "Anna", m.Utterance(None, call, None, m.Resume()))
    mission.run()
    assert mission.exactly_once, mission.said


def _ask(mission: Mission, statement: m.Statement, at_s: float = 20.0) -> list[str]:
    """What is said within ten seconds of Bot's saying something to Rob."""
    mission.tell(at_s, "Bot", m.Utterance("Bot", m.ToRobot("Rob"), None, statement))
    mission.air.run_until(at_s + 14.0, mission.next_deadline)
    return [text for t, text in mission.said if t > at_s]


def _waiting_rob(n_plants: int = 2) -> Mission:
    """Rob, who waits for orders; Bot's part is played by the test."""
    mission = Mission(("Rob", "Bot"), plants(n_plants), seed=5, coordinator="Bot")
    del mission.robots["Bot"]
    mission.air.talkers = {"Rob": mission.robots["Rob"], "Bot": _Silent()}
    return mission


class _Silent:
    """A person's ears: they hear and do nothing."""

    def heard(self, utterance: m.Utterance, now: float) -> None: ...
    def garbled(self, over_own_speech: bool, now: float) -> None: ...
    def channel(self, busy: bool, now: float) -> None: ...
    def spoken(self, now: float) -> None: ...
    def tick(self, now: float) -> None: ...


@pytest.mark.parametrize("ref", [m.TaskByNumber(9), m.TaskByNumber(10)])
def test_an_order_for_an_unknown_task_is_refused_aloud(ref: m.TaskRef) -> None:
    assert _ask(_waiting_rob(), m.Order(ref))[0].startswith("Hi Bot, I am Rob, I cannot complete task")


def test_a_wrong_read_back_is_denied_and_ends_in_nothing() -> None:
    mission = _waiting_rob()
    mission.tell(28.0, "Bot", m.Utterance("Bot", m.ToRobot("Rob"), None, m.Negative()))
    assert _ask(mission, m.Order(m.TaskByNumber(1))) == ["Hi Bot, I am Rob, I will complete task one"]
    assert mission.robots["Rob"].state is State.READY
    assert mission.robots["Rob"].board[1].state == "open"


def test_an_order_without_confirmation_is_never_carried_out() -> None:
    mission = _waiting_rob()
    _ask(mission, m.Order(m.TaskByNumber(1)))
    mission.air.run_until(300.0, mission.next_deadline)
    assert not mission.watered
    assert mission.robots["Rob"].state is State.READY


def test_an_order_for_somebody_else_is_not_obeyed() -> None:
    mission = Mission(("Rob", "Bot", "Max"), plants(2), seed=5, coordinator="Bot")
    del mission.robots["Bot"]
    mission.air.talkers = {**mission.robots, "Bot": _Silent()}
    mission.tell(40.0, "Bot", m.Utterance("Bot", m.ToRobot("Max"), None, m.Order(m.TaskByNumber(1))))
    mission.air.run_until(60.0, mission.next_deadline)
    assert not any(text.startswith("Hi Bot, I am Rob, I") for _, text in mission.said)


def test_a_done_task_is_said_to_be_done_when_somebody_claims_it() -> None:
    mission = Mission(("Rob", "Bot"), plants(1), seed=1)
    mission.run()
    owner = mission.by[1]
    other = "Bot" if owner == "Rob" else "Rob"
    at_s = mission.air.now + 1.0
    mission.tell(at_s, other, m.Utterance(other, m.ToAll(), None, m.Claim(m.TaskByNumber(1))))
    mission.air.run_until(at_s + 15.0, mission.next_deadline)
    assert [t for s, t in mission.said if s > at_s] == [f"Hi all, I am {owner}, task one complete"]


def test_nobody_obeys_its_own_echo() -> None:
    mission = _waiting_rob()
    mission.tell(20.0, "Bot", m.Utterance("Rob", m.ToRobot("Rob"), None, m.Order(m.TaskByNumber(1))))
    mission.air.run_until(40.0, mission.next_deadline)
    assert mission.robots["Rob"].state is State.READY
