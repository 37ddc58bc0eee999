"""The claim engine against an adversary that loses sentences, switches robots off and on, stops and resumes them.

The rules are hypothesis's stateful testing; what it found, shrunk, stands below as tests of their own.
"""

from __future__ import annotations

from dataclasses import replace

from hypothesis import HealthCheck, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, precondition, rule

from hil_fakes.word_mission import Outage, WordMission, WordPlan
from hvcpd.config.tasks import Place
from hvcpd.coordination.actions import Talk
from hvcpd.coordination.states import AT_WORK, State
from hvcpd.language import messages as m
from tests.coordination.mission import plants, release_all

NAMES = ("Rob", "Bot", "Max")
GIVER = "Zoe"
"""The robot that gives the orders."""
ROBOTS = (*NAMES, GIVER)
LIMIT_S = 6000.0
"""Time enough for a robot that was left alone to be sent again, many times."""
LOSSES_MAX = 5
"""Single sentences that single robots may miss: one fewer than a claim is repeated."""
RESOLUTION_S = 40.0
"""Two robots may hold one task for so long: both repeat what they said, and hear each other."""
AGAIN_MAX = 2
"""Changes that a person may make."""
AIRTIME_MAX = 0.95
"""Of all time, over five minutes: sentences have gaps."""


class Sieve(WordMission):
    """A mission in which chosen robots miss their next sentences."""

    def __init__(self, plan: WordPlan) -> None:
        super().__init__(plan, keep=True)
        self.deaf: dict[str, int] = {}
        self.air.misses = self.misses

    def misses(self, listener: str, utterance: m.Utterance) -> bool:
        missed = self.deaf.get(listener, 0) > 0 and not isinstance(utterance.statement, m.Stop)
        self.deaf[listener] = self.deaf.get(listener, 0) - missed
        return missed


class ClaimEngine(RuleBasedStateMachine):
    """Time passes between the adversary's moves; the invariants are checked after each of them."""

    @initialize(
        seed=st.integers(0, 1000),
        n_robots=st.integers(2, 3),
        n_tasks=st.integers(1, 6),
        near=st.booleans(),
        nearest=st.booleans(),
        talks=st.tuples(*[st.sampled_from(Talk)] * len(NAMES)),
        n_pairs=st.integers(0, 6),
        orders=st.booleans(),
        on_demand=st.booleans(),
    )
    def begin(
        self,
        seed: int,
        n_robots: int,
        n_tasks: int,
        near: bool,
        nearest: bool,
        talks: tuple[Talk, ...],
        n_pairs: int,
        orders: bool,
        on_demand: bool,
    ) -> None:
        """Tasks that are `near` take less time than a round of turns: then robots claim two at once. Robots that take
        the `nearest` plan for all, and Max, who stands nearer than the others, bids for what they claim. The last
        `n_pairs` tasks are for two robots. With `orders`, one more robot tells the others what to do. The last task may
        wait until somebody asks for it (`on_demand`), if nobody else gives orders."""
        names = (*NAMES[:n_robots], *(GIVER,) * orders)
        first, *others = (replace(task, place=None) if near else task for task in plants(n_tasks))
        later = tuple(replace(task, after=frozenset({1})) for task in others)
        self.on_demand = on_demand and not orders and n_tasks > 1
        pairs = (replace(t, robots=1 + (t.number > n_tasks - n_pairs)) for t in (first, *later))
        *before, last = pairs
        tasks = (*before, replace(last, on_demand=True, after=frozenset()) if self.on_demand else last)
        plan = WordPlan(
            names,
            tasks,
            seed=seed,
            limit_s=LIMIT_S,
            coordinator=GIVER if orders else None,
            nearest_first=nearest,
            starts={"Max": Place(0.0, 0.0)},
            talks=dict(zip(NAMES, talks, strict=True)),
        )
        self.mission = Sieve(plan)
        self.wanted_again = 0
        self.losses = 0
        self.stopped = False
        self.off: dict[str, float] = {}
        self.both_since: dict[int, float] = {}

    @rule(for_s=st.sampled_from([0.5, 2.0, 5.0, 15.0, 60.0]))
    def time_passes(self, for_s: float) -> None:
        end_s = self.mission.air.now + for_s
        while self.mission.air.now < end_s:
            self.mission.air.run_until(min(self.mission.air.now + 1.0, end_s))
            self.check()

    @precondition(lambda self: self.losses < LOSSES_MAX)
    @rule(who=st.sampled_from(ROBOTS), n=st.integers(1, 3))
    def misses(self, who: str, n: int) -> None:
        n = min(n, LOSSES_MAX - self.losses)
        self.losses += n
        self.mission.deaf[who] = self.mission.deaf.get(who, 0) + n

    @precondition(lambda self: len(self.off) == 0)
    @rule(who=st.sampled_from(ROBOTS), back_s=st.sampled_from([5.0, 40.0]))
    def runs_flat(self, who: str, back_s: float) -> None:
        if who in self.mission.robots:
            self.off[who] = self.mission.air.now
            self.mission.fail(Outage(who, self.mission.air.now, back_s))

    @rule(who=st.sampled_from(NAMES), talk=st.sampled_from(Talk), softly_db=st.sampled_from((0.0, -10.0)))
    def hours_or_settings_change(self, who: str, talk: Talk, softly_db: float) -> None:
        robot = self.mission.robots.get(who)
        if robot is not None:
            robot.reconfigure(self.mission.air.now, replace(robot.role, talk=talk, softly_db=softly_db))
            self.mission.air.refresh()

    @rule()
    def person_stops_all(self) -> None:
        listening = tuple(self.mission.robots.values())
        self.mission.speak("Anna", m.Utterance(None, None, None, m.Stop()))
        said_s = self.mission.air.now
        self.mission.air.run_until(said_s + 0.37 + 0.5)
        self.stopped = True
        for robot in listening:
            assert robot.state is State.STOPPED, "stop always wins"

    @precondition(lambda self: self.wanted_again < AGAIN_MAX and any(self.mission.watered.values()))
    @rule(number=st.integers(1, 6))
    def person_wants_it_again(self, number: int) -> None:
        self.wanted_again += 1
        again = m.Change(m.TaskByNumber(min(number, len(self.mission.plan.tasks))))
        self.mission.speak("Anna", m.Utterance("Anna", m.ToAll(), None, again))

    @precondition(lambda self: self.wanted_again < AGAIN_MAX and self.on_demand)
    @rule(who=st.sampled_from(NAMES))
    def person_orders_one_robot(self, who: str) -> None:
        """To do the last task; she confirms what it reads back in time."""
        self.wanted_again += 1
        number = m.TaskByNumber(len(self.mission.plan.tasks))
        self.mission.speak("Anna", m.Utterance("Anna", m.ToRobot(who), None, m.Order(number)))
        self.mission.air.run_until(self.mission.air.now + 8.0)
        self.check()
        self.mission.speak("Anna", m.Utterance("Anna", m.ToRobot(who), None, m.Confirmed()))

    @precondition(lambda self: self.stopped)
    @rule()
    def person_resumes(self) -> None:
        self.mission.speak("Anna", m.Utterance(None, None, None, m.Resume()))
        self.mission.air.run_until(self.mission.air.now + 1.0)
        self.stopped = False

    @invariant()
    def check(self) -> None:
        if not hasattr(self, "mission"):
            return
        mission, now = self.mission, self.mission.air.now
        if not mission.off_in_mid_task:
            most = 1 + self.wanted_again
            for task in mission.plan.tasks:
                assert mission.watered[task.number] <= most * task.robots, "exactly once, but for what was wanted again"
        later = {task.number for task in mission.plan.tasks if task.after}
        first = next((n for n, robot in self.acting() if n in later), None)
        assert first is None or mission.watered[1], "nothing before what it comes after"
        for robot in mission.robots.values():
            for entry in robot.board.entries():
                if entry.known_done and not entry.skipped:
                    assert mission.watered[entry.number], "what nobody did is not held for done"
        for task in mission.plan.tasks:
            robots = mission.robots.values()
            owners = [r for r in robots if task.number in r.knowledge.my_tasks() and r.state in AT_WORK]
            if len(owners) <= task.robots:
                self.both_since.pop(task.number, None)
            else:
                since_s = self.both_since.setdefault(task.number, now)
                assert now - since_s <= RESOLUTION_S, "no more owners than it takes"

    def acting(self) -> list[tuple[int, str]]:
        robots = self.mission.robots.items()
        return [(robot.task, name) for name, robot in robots if robot.state is State.ACTING and robot.task is not None]

    def teardown(self) -> None:
        if not hasattr(self, "mission"):
            return
        mission = self.mission
        mission.deaf.clear()
        release_all(mission)
        began_s, spoken_s = mission.air.now, mission.air.airtime_s
        result = mission.run()
        assert result.lost == 0, "none lost"
        assert result.agreed
        assert mission.off_in_mid_task or result.duplicates <= self.wanted_again, "exactly once"
        lasted_s = mission.air.now - began_s
        if lasted_s > 300.0:
            assert mission.air.airtime_s - spoken_s <= AIRTIME_MAX * lasted_s, "bounded airtime"


TestClaimEngine = ClaimEngine.TestCase
TestClaimEngine.settings = settings(
    max_examples=40,
    stateful_step_count=15,
    suppress_health_check=[HealthCheck.too_slow],
)
