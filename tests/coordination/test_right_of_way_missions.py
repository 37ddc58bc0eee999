"""Places that only one robot fits in: never two are in one, against loss, crashes and stops."""

from __future__ import annotations

import pytest
from hypothesis import HealthCheck, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, precondition, rule

from hil_fakes.word_mission import Outage
from hil_fakes.word_traffic import TrafficMission, corridor_plan
from hvcpd.config.tasks import Place
from hvcpd.language import messages as m
from tests.coordination.corridor import CORRIDOR, EAST, NAMES, WEST, Corridor, across
from tests.coordination.mission import release_all

LOSSES_MAX = 4
"""Single sentences that single robots may miss: fewer than are needed to take a place from who has it."""


@pytest.mark.parametrize(
    "seed", [194, 205, 8065, 7707, 7983, 10190, 760207, *range(7001, 7005)]
)  # in the first seven two once met
def test_random_missions_through_a_corridor(seed: int) -> None:
    mission = TrafficMission(corridor_plan(seed))
    result = mission.run()
    assert result.lost == 0
    assert mission.traffic.collisions == 0
    assert not mission.held


@pytest.mark.parametrize("seed", [51173, 51298, 51319])
def test_a_keeper_that_was_switched_off_and_has_forgotten_is_not_waited_for_long(seed: int) -> None:
    """Six requests had to remain unanswered: robots waited for 68 to 110 s."""
    mission = TrafficMission(corridor_plan(seed))
    mission.run()
    assert mission.traffic.collisions == 0
    assert max(mission.traffic.waits_s) < 60.0


class RightOfWay(RuleBasedStateMachine):
    """An adversary chooses who misses what, who is switched off outside, and when all are stopped and released."""

    @initialize(seed=st.integers(0, 1000), n_robots=st.integers(2, 3))
    def begin(self, seed: int, n_robots: int) -> None:
        tasks = (across(1, EAST), across(2, WEST), across(3, Place(0.0, 0.0)))
        starts = (WEST, EAST, WEST)[:n_robots]
        self.mission = Corridor(NAMES[:n_robots], tasks, starts=starts, seed=seed, limit_s=3000.0)
        self.losses = 0
        self.off = False
        self.stopped = False

    @rule(for_s=st.sampled_from([2.0, 5.0, 15.0, 40.0]))
    def time_passes(self, for_s: float) -> None:
        self.mission.air.run_until(self.mission.air.now + for_s)

    @precondition(lambda self: self.losses < LOSSES_MAX)
    @rule(who=st.sampled_from(NAMES), n=st.integers(1, 3))
    def misses(self, who: str, n: int) -> None:
        n = min(n, LOSSES_MAX - self.losses)
        self.losses += n
        self.mission.deaf[who] = self.mission.deaf.get(who, 0) + n

    @precondition(lambda self: not self.off)
    @rule(who=st.sampled_from(NAMES), back_s=st.sampled_from([10.0, 60.0]))
    def runs_flat(self, who: str, back_s: float) -> None:
        place = self.mission.bodies[who].place if who in self.mission.robots else Place(0.0, 0.0)
        if CORRIDOR.distance_m(place) > 0.5:
            self.off = True
            self.mission.fail(Outage(who, self.mission.air.now, back_s))

    @rule()
    def person_stops_all(self) -> None:
        self.mission.speak("Anna", m.Utterance(None, None, None, m.Stop()))
        self.stopped = True

    @precondition(lambda self: self.stopped)
    @rule()
    def person_resumes(self) -> None:
        self.mission.speak("Anna", m.Utterance(None, None, None, m.Resume()))
        self.stopped = False

    @invariant()
    def never_two_in_one_place(self) -> None:
        if hasattr(self, "mission"):
            assert self.mission.traffic.collisions == 0

    def teardown(self) -> None:
        if not hasattr(self, "mission"):
            return
        self.mission.deaf.clear()
        release_all(self.mission)
        result = self.mission.run()
        assert result.lost == 0, "nobody waits for ever"
        assert self.mission.traffic.collisions == 0


TestRightOfWay = RightOfWay.TestCase
TestRightOfWay.settings = settings(
    max_examples=25,
    stateful_step_count=12,
    suppress_health_check=[HealthCheck.too_slow],
)
