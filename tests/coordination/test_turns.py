"""Who speaks next: turns go round by whose turn it was, and nobody waits for ever."""

from __future__ import annotations

import random

from hil_fakes.word_channel import Conditions
from hil_fakes.word_mission import WordMission, WordPlan
from hil_fakes.word_plans import NAMES, random_tasks
from hvcpd.coordination.actions import Role, Timing
from hvcpd.coordination.addressing import whose_turn
from hvcpd.coordination.coordination import Coordination
from hvcpd.coordination.floor import CROWD, OVERDUE_S, OVERDUE_SLOTS, Floor, Intent, Urgency
from hvcpd.coordination.states import State
from hvcpd.language import messages as m
from tests.coordination.mission import plants, utterance

TASK = m.TaskByNumber(1)
TIMING = Timing()


def test_an_answer_belongs_to_the_turn_of_whom_it_is_for() -> None:
    assert whose_turn(m.Utterance("Rob", m.ToTeam("plant"), None, m.Claim(TASK))) == "Rob"
    assert whose_turn(utterance("Zoe", "Rob", m.Confirmed(TASK))) == "Rob"
    assert whose_turn(utterance("Zoe", "Rob", m.Negative())) == "Rob"
    assert whose_turn(utterance("Zoe", "Rob", m.Order(TASK))) == "Zoe"
    assert whose_turn(m.Utterance(None, None, None, m.Stop())) is None


def test_after_a_confirmation_the_next_turn_is_of_who_follows_the_one_confirmed() -> None:
    """Else turns begin anew after a confirmer that chance has chosen, and some robots' never come."""
    role = Role("Bot", "plant", roster=("Ada", "Bot", "Max", "Zoe"))
    bot = Coordination(role, plants(1), random.Random(1))
    bot.knowledge.state = State.READY
    bot.heard(utterance("Zoe", "Ada", m.Confirmed(TASK)), 10.0)
    wait_s = _wait(bot.knowledge.floor, 10.0) - TIMING.turn_gap_s
    assert -1e-9 < wait_s < TIMING.slot_s, "Bot follows Ada, whose claim it was, not Zoe, who confirmed it"


def _wait(floor: Floor, now: float) -> float:
    floor.want(Intent(Urgency.TURN, "turn", lambda: None), now)
    due_s = floor.next_deadline()
    assert due_s is not None
    return due_s - now


def test_who_did_not_understand_waits_until_the_others_have_had_their_turns() -> None:
    for seed in range(20):
        floor = Floor(TIMING, random.Random(seed))
        floor.understood(1.0, (3, 4))
        floor.hold_back(2.0)
        assert _wait(floor, 2.0) >= TIMING.turn_gap_s + 4 * TIMING.slot_s


def test_in_a_crowd_who_has_waited_too_long_comes_before_all_turns() -> None:
    size = CROWD + 4
    floor = Floor(TIMING, random.Random(1))
    floor.understood(0.0, (size - 1, size))
    first = _wait(floor, 0.0)
    assert first >= TIMING.turn_gap_s + OVERDUE_SLOTS * TIMING.slot_s
    late_s = OVERDUE_S * size + 1.0
    floor.understood(late_s, (size - 1, size))
    due_s = floor.next_deadline()
    assert due_s is not None
    assert due_s < late_s + TIMING.turn_gap_s + OVERDUE_SLOTS * TIMING.slot_s


def test_a_dozen_robots_do_not_collide_if_they_hear_each_other() -> None:
    tasks = random_tasks(24, random.Random(3))
    mission = WordMission(WordPlan(NAMES[:12], tasks, 3))
    result = mission.run()
    assert result.lost == result.duplicates == 0
    assert result.collisions <= 2, "two may greet at once; turns do not collide"


def test_of_a_dozen_that_lose_three_of_ten_sentences_nobody_waits_longer_than_its_lease() -> None:
    """Tasks were done twice because their owners got no turn to report them before their leases had lapsed."""
    tasks = random_tasks(30, random.Random(1))
    mission = WordMission(WordPlan(NAMES[:12], tasks, 1, Conditions(loss=0.3)))
    since: dict[str, float] = {}
    longest_s = 0.0
    while mission.air.now < 900.0:
        mission.air.run_until(mission.air.now + 1.0)
        for name, robot in mission.robots.items():
            if robot.state is State.REPORTING and robot.knowledge.current.repeats == 0:
                longest_s = max(longest_s, mission.air.now - since.setdefault(name, mission.air.now))
            else:
                since.pop(name, None)
    assert 60.0 < longest_s < TIMING.lease_per_robot_s * 11 * 0.7
