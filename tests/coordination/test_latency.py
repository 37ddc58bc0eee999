"""Sound cards hold a voice back; turns and slots must leave room for that, or neighbours speak at once."""

from __future__ import annotations

from dataclasses import replace

import pytest

from hil_fakes.word_mission import WordMission
from hil_fakes.word_plans import random_plan
from hvcpd.coordination.actions import Timing


@pytest.mark.parametrize(("robots", "latency_s"), [(2, 0.16), (4, 0.16), (8, 0.16), (4, 0.25)])
def test_cards_that_hold_a_voice_back_cost_few_collisions(robots: int, latency_s: float) -> None:
    sent = collisions = 0
    for seed in range(1, 5):
        plan = random_plan(seed, loss=(0.0, 0.05), robots=(robots, robots), tasks=(8, 8), outages_max=0)
        slow = replace(plan.conditions, latency_s=latency_s)
        mission = WordMission(replace(plan, late={}, conditions=slow, timing=Timing().for_latency(latency_s)))
        result = mission.run()
        assert (result.lost, result.duplicates) == (0, 0)
        sent += result.sent
        collisions += result.collisions
    # Without `for_latency` it is every second sentence of four and more robots.
    assert collisions <= 0.15 * sent
