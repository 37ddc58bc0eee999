"""What is done first: the more urgent, and never what comes after something that is not done yet."""

from __future__ import annotations

from dataclasses import replace

import pytest

from hil_fakes.word_channel import Conditions
from hil_fakes.word_mission import WordMission, WordPlan
from hvcpd.config.recurrence import Recurrence
from hvcpd.config.tasks import TaskDefinition
from tests.coordination.mission import plants

NAMES = ("Rob", "Bot", "Max")


def with_order(n: int, **orders: dict[int, object]) -> tuple[TaskDefinition, ...]:
    """Plants with further fields: field → task → value."""
    return tuple(
        replace(task, **{key: of[task.number] for key, of in orders.items() if task.number in of})  # type: ignore[arg-type]
        for task in plants(n)
    )


@pytest.mark.parametrize("loss", [0.0, 0.3])
@pytest.mark.parametrize("coordinator", [None, "Max"])
@pytest.mark.parametrize("seed", range(4))
def test_what_comes_after_others_is_begun_when_all_of_them_are_done(
    seed: int, coordinator: str | None, loss: float
) -> None:
    after: dict[int, object] = {1: frozenset({4}), 2: frozenset({1, 3})}
    plan = WordPlan(NAMES, with_order(4, after=after), seed, Conditions(loss), coordinator=coordinator)
    mission = WordMission(plan)
    assert mission.run().lost == 0
    first_s: dict[int, float] = {}
    for at_s, number, _ in mission.done:
        first_s.setdefault(number, at_s)
    assert first_s[4] < first_s[1] < first_s[2]
    assert first_s[3] < first_s[2]


@pytest.mark.parametrize("seed", range(4))
def test_the_higher_priority_is_done_first(seed: int) -> None:
    mission = WordMission(WordPlan(("Rob",), with_order(5, priority={2: 1, 5: 2}), seed))
    mission.run()
    assert [number for _, number, _ in mission.done][:2] == [5, 2]


@pytest.mark.parametrize("seed", range(4))
def test_of_equals_what_is_late_soonest_is_done_first(seed: int) -> None:
    tasks = with_order(4, deadline_s={3: 600.0, 4: 1200.0}, every=dict.fromkeys(range(1, 5), Recurrence("1 h")))
    mission = WordMission(WordPlan(("Rob",), tasks, seed, clocks={"Rob": 0.0}, limit_s=3000.0))
    mission.run()
    assert [number for _, number, _ in mission.done][:2] == [3, 4]
    assert len(mission.done) >= 4
