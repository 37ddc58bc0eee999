"""What a robot says is chosen when it has the floor, by what it knows then."""

from collections import Counter

import pytest

from hil_fakes.word_mission import Outage
from hvcpd.coordination.actions import Talk
from hvcpd.coordination.floor import Intent, Urgency
from hvcpd.language import messages as m
from tests.coordination.mission import Mission, plants


@pytest.mark.parametrize("seed", range(1, 6))
def test_a_task_that_a_listener_does_not_know_is_done_after_one_claim(seed: int) -> None:
    """The claim is joined to a report of a task that it does know."""
    tasks = plants(4)
    mission = Mission(("Rob", "Bot"), tasks, seed=seed, nearest_first=True)
    mission.robots["Bot"].retask(tasks[:3], 0.0)
    mission.air.run_until(400.0)
    claims = [text for text in mission.written() if "I will complete task four" in text]
    assert any("I do not know task four" in text for text in mission.written())
    assert len(claims) == 1
    assert mission.watered[4] == 1


@pytest.mark.parametrize("seed", range(1, 6))
@pytest.mark.parametrize(("lacking", "most"), [({1}, 3), ({2}, 3), ({3}, 2), ({5}, 2), ({6}, 3), ({5, 6}, 3)])
def test_tasks_of_which_a_listener_does_not_know_some_are_claimed_and_reported_soon(
    seed: int, lacking: set[int], most: int
) -> None:
    """Rob claims two at once. What was claimed in vain six times and more is said at most so often now."""
    tasks, terse = plants(6), dict.fromkeys(("Rob", "Bot"), Talk.TERSE)
    unable = {"Bot": frozenset(range(1, 7))}
    mission = Mission(("Rob", "Bot"), tasks, seed=seed, nearest_first=True, talks=terse, unable=unable)
    mission.robots["Bot"].retask([task for task in tasks if task.number not in lacking], 0.0)
    mission.run()
    assert mission.exactly_once
    assert max(Counter(mission.written()).values()) <= most


@pytest.mark.parametrize("seed", range(1, 4))
def test_a_task_that_was_added_to_one_robot_is_done_although_it_was_restarted(seed: int) -> None:
    """The others, which do not know the task, tell it that nothing is left."""
    tasks, names = plants(4), ("Rob", "Bot", "Max")
    mission = Mission(names, tasks, seed=seed)
    for name in names:
        mission.robots[name].retask(tasks[:3], 0.0)

    def add_and_restart() -> None:
        mission.robots["Rob"].retask(tasks, mission.air.now)
        mission.fail(Outage("Rob", 0.0, 30.0))

    mission.at(300.0, add_and_restart)
    mission.air.run_until(500.0)
    assert mission.exactly_once


@pytest.mark.parametrize("claim", [None, m.TaskByNumber(4)])
def test_a_doubtful_report_is_asked_for_again_whatever_is_claimed_with_it(claim: m.TaskByNumber | None) -> None:
    tasks = plants(4)
    mission = Mission(("Bot",), tasks, ("Rob", "Max"), seed=1, coordinator="Nobody")
    bot = mission.robots["Bot"]
    bot.retask(tasks[:3], 0.0)
    mission.hear(90.0, "Hi all, I am Rob")
    mission.air.run_until(110.0)
    bot.heard(m.Utterance("Rob", m.ToAll(), None, m.Completed(m.TaskByNumber(1), claim)), 110.0)
    mission.go_on(125.0)
    assert mission.written(110.0)[0] == "Hi Rob, I am Bot, say again"


def test_a_choice_is_made_at_the_time_of_speaking() -> None:
    mission = Mission(("Rob",), plants(1), coordinator="Nobody")
    mission.air.run_until(60.0)
    rob, times = mission.robots["Rob"], list[float]()
    rob.channel(True, 60.0)
    rob.knowledge.floor.want(Intent(Urgency.TURN, "test", lambda: None, decide=times.append), 60.0)
    rob.channel(False, 70.0)
    while not times:
        rob.tick(rob.next_deadline())
    assert 70.0 < times[0] < 80.0
