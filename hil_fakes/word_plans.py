"""Random missions at the level of words, by seed: teams, tasks, air and faults; and the least cost of the tasks'
talk."""

from __future__ import annotations

import random
from collections.abc import Iterable
from dataclasses import replace

from hil_fakes.word_channel import WORD_S, Conditions
from hil_fakes.word_lengths import n_words
from hil_fakes.word_mission import Outage, WordPlan
from hvcpd.config.recurrence import Recurrence
from hvcpd.config.tasks import GoTo, Place, TaskDefinition, Tend
from hvcpd.coordination.actions import Talk
from hvcpd.language import messages as m

NAMES = tuple("Rob Bot Max Zoe Ada Kim Leo Mia Tom Eva Sam Ida Ben Joy Pip Gus Ned Una Vic Wil".split())
PERIODS = ("1 h", "90 min", "3 h", "8 h", "1 d", "FREQ=DAILY;BYHOUR=8,16", "FREQ=HOURLY;INTERVAL=4")
CLOCKS_S = 50.0
"""So wrong is a clock that was set by hand; two of them differ by less than `schedule.SKEW_S`."""
FAILING, CRASHING = 0.1, 0.3
"""Fractions of all robots' tasks that always fail for them, and of robots that are switched off once."""
ROOM_M = 6.0
"""Half the side of the room that the tasks are strewn over."""
MISHEARING_MAX = 0.01
"""Largest share of a robot's reported sentences that is wrong; the recogniser's own rate is measured elsewhere."""
DELAY_S = 0.05
"""Largest difference between the times at which robots' recognisers report one sentence."""
EARSHOT_M = (5.0, 9.0)
"""Distance that a voice carries where it fades: less than the way to most plants; in noise as loud as speech it is
8 m."""
CLEAR = 0.6
"""Up to this share of that way nothing is lost."""
FADING_LIMIT_S = 4000.0
"""By then all is done six times over."""
NEAREST = 0.75
"""Share of teams that take the nearest tasks, as by default."""
AFTER, LACKING, ORDERING = 0.2, 0.2, 0.15
"""In missions drawn from everything: shares of tasks that come after another one, of tasks that a robot lacks the means
for, and of teams with a coordinator."""
LATE = 0.3
"""Share of missions of three and more robots in which one comes late."""


def random_tasks(n: int, rng: random.Random) -> tuple[TaskDefinition, ...]:
    """Places to drive to and to water at, for 2 to 8 s."""

    def task(number: int) -> TaskDefinition:
        place = Place(rng.uniform(-ROOM_M, ROOM_M), rng.uniform(-ROOM_M, ROOM_M))
        return TaskDefinition(number, f"job {number}", place, (GoTo(place), Tend(rng.uniform(2.0, 8.0))))

    return tuple(task(number) for number in range(1, n + 1))


def random_plan(
    seed: int,
    *,
    loss: tuple[float, float] = (0.0, 0.3),
    robots: tuple[int, int] = (2, 12),
    tasks: tuple[int, int] = (5, 40),
    outages_max: int = 2,
) -> WordPlan:
    """A mission drawn from these ranges, with up to `outages_max` robots switched off, half of them for good."""
    rng = random.Random(seed)
    names = NAMES[: rng.randint(*robots)]
    conditions = Conditions(rng.uniform(*loss), rng.uniform(0.0, MISHEARING_MAX), DELAY_S)
    n_off = min(rng.randint(0, outages_max), len(names) - 1)
    outages = tuple(
        Outage(name, rng.uniform(5.0, 400.0), rng.choice((None, rng.uniform(5.0, 200.0))))
        for name in rng.sample(names, n_off)
    )
    late = {names[-1]: rng.uniform(20.0, 200.0)} if len(names) > 2 and rng.random() < LATE else {}
    drawn = random_tasks(rng.randint(*tasks), rng)
    nearest = rng.random() < NEAREST
    return WordPlan(names, drawn, seed, conditions, outages=outages, late=late, nearest_first=nearest)


def with_talk(plan: WordPlan, talk: str) -> WordPlan:
    """The same mission of robots with this setting `talk`: `full`, `normal`, `terse`, or `mixed`, in turn."""
    kinds = tuple(Talk) if talk == "mixed" else (Talk(talk),)
    return replace(plan, talks={name: kinds[n % len(kinds)] for n, name in enumerate(plan.names)})


def _all_back(outages: Iterable[Outage], rng: random.Random) -> tuple[Outage, ...]:
    """The same, with nobody switched off for good."""
    return tuple(replace(each, back_s=each.back_s or rng.uniform(5.0, 200.0)) for each in outages)


def ordered_pairs_plan(seed: int, loss: tuple[float, float] = (0.0, 0.3), outages_max: int = 2) -> WordPlan:
    """A mission of three to eight robots, one of which gives the orders; half of the tasks are for two robots."""
    rng = random.Random(f"pairs {seed}")
    plan = random_plan(seed, robots=(3, 8), loss=loss, tasks=(2, 16), outages_max=outages_max)
    outages = _all_back(plan.outages, rng)
    tasks = tuple(replace(task, robots=rng.choice((1, 2))) for task in plan.tasks)
    return replace(plan, tasks=tasks, coordinator=plan.names[-1], outages=outages, late={})


def any_plan(seed: int) -> WordPlan:
    """A mission in which everything is drawn at once: tasks in order or for two robots, robots that cannot do some of
    them, how much each says, where it begins, orders or volunteers, losses and outages. No robot stays off, and some
    two robots can do each task."""
    rng = random.Random(f"any {seed}")
    plan = random_plan(seed, robots=(2, 8), tasks=(2, 16))
    two = rng.random() < 0.5

    def vary(task: TaskDefinition) -> TaskDefinition:
        before = {rng.randint(1, task.number - 1)} if task.number > 1 and rng.random() < AFTER else set()
        place = task.place if rng.random() < 0.8 else None
        actions = task.actions if place is not None else task.actions[1:]
        robots = rng.choice((1, 1, 2)) if two else 1
        priority = rng.choice((0, 0, 0, 1))
        return replace(task, place=place, actions=actions, robots=robots, priority=priority, after=frozenset(before))

    tasks = tuple(map(vary, plan.tasks))
    lacking = {name: frozenset(t.number for t in tasks if rng.random() < LACKING) for name in plan.names[2:]}
    starts = {name: Place(rng.uniform(-ROOM_M, ROOM_M), rng.uniform(-ROOM_M, ROOM_M)) for name in plan.names}
    outages = _all_back(plan.outages, rng)
    plan = replace(plan, tasks=tasks, unable=lacking, starts=starts if rng.random() < 0.5 else {}, outages=outages)
    orders = rng.random() < ORDERING and not plan.outages and not plan.late
    plan = replace(plan, coordinator=plan.names[-1] if orders and len(plan.names) > 2 else None)
    return with_talk(plan, rng.choice(("full", "normal", "terse", "mixed")))


def fading_plan(seed: int, coordinate: bool) -> WordPlan:
    """Two to five robots among plants, some out of earshot of each other; voices fade with the way, or end at once."""
    rng = random.Random(seed)
    n = rng.randint(2, 5)
    plan = random_plan(seed, robots=(n, n), tasks=(4, 10), outages_max=0, loss=(0.0, 0.1))
    earshot_m = rng.uniform(*EARSHOT_M)
    clear_m = rng.choice((CLEAR, 1.0)) * earshot_m - 1e-3
    coordinator = rng.choice(plan.names) if coordinate else None
    return replace(plan, earshot_m=earshot_m, clear_m=clear_m, coordinator=coordinator, late={}, limit_s=FADING_LIMIT_S)


def recurring_plan(seed: int, robots: tuple[int, int] = (2, 12), hours: float = 72.0) -> WordPlan:
    """A team for some days: tasks that recur, clocks that are wrong by up to a minute or missing, some robots that
    fail, and some that are switched off and on again."""
    rng = random.Random(seed)
    plan = random_plan(seed, robots=robots, tasks=(1, 5), outages_max=0)
    tasks = tuple(replace(t, every=Recurrence(rng.choice(PERIODS))) for t in plan.tasks)
    with_clock = rng.sample(plan.names, rng.randint(1, len(plan.names)))
    failing = {(name, task.number) for name in plan.names[1:] for task in tasks if rng.random() < FAILING}
    outages = tuple(
        Outage(name, rng.uniform(0.0, hours * 3600.0), rng.uniform(30.0, 20_000.0))
        for name in plan.names[1:]
        if rng.random() < CRASHING
    )
    return replace(
        plan,
        tasks=tasks,
        clocks={name: rng.uniform(-CLOCKS_S, CLOCKS_S) for name in dict.fromkeys((plan.names[0], *with_clock))},
        fails=lambda name, task, _now: (name, task) in failing,
        outages=outages,
        late={},
        limit_s=hours * 3600.0,
    )


def omniscient_airtime_s(plan: WordPlan) -> float:
    """The talk of a scheduler that knows all: one claim and one report a task, and no collision."""
    words = 0
    for task in plan.tasks:
        ref = m.TaskByNumber(task.number)
        words += n_words(m.Utterance(plan.names[0], m.ToTeam("plant"), None, m.Claim(ref)))
        words += n_words(m.Utterance(plan.names[0], m.ToAll(), None, m.Completed(ref)))
    return words * WORD_S
