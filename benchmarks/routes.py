"""The distance that teams drive, compared with the best assignments, found by dynamic programming over subsets (Held
and Karp 1962)."""

from __future__ import annotations

import math
import random
from collections.abc import Callable, Iterable, Sequence
from itertools import pairwise

from hil_fakes.word_body import SPEED_M_S
from hil_fakes.word_mission import WordMission, WordPlan
from hil_fakes.word_plans import NAMES, ROOM_M, random_tasks
from hvcpd.config.tasks import Place
from hvcpd.coordination.routes import work_s

TASKS_MAX = 8
"""Of 8 tasks there are 6,561 ways to split a subset in two; 9 would take three times as long."""


def way_m(places: Sequence[Place]) -> float:
    """Length of the way along these places, m."""
    return sum(a.distance_m(b) for a, b in pairwise(places))


def shortest_m(start: Place, tasks: Sequence[Place]) -> list[float]:
    """Length of the shortest way from a start through each subset of the tasks, m; index: the subset's bits."""
    n = len(tasks)
    ends = [[math.inf] * n for _ in range(1 << n)]
    for i, place in enumerate(tasks):
        ends[1 << i][i] = way_m((start, place))
    for subset in range(1, 1 << n):
        for i in range(n):
            for j in range(n):
                if not subset >> j & 1 and ends[subset][i] < math.inf:
                    longer_m = ends[subset][i] + way_m((tasks[i], tasks[j]))
                    ends[subset | 1 << j][j] = min(ends[subset | 1 << j][j], longer_m)
    return [0.0, *(min(row) for row in ends[1:])]


def best_split(costs: Sequence[Sequence[float]], join: Callable[[float, float], float]) -> float:
    """The least joint cost of any split of all tasks among robots. `costs[robot][subset]`; `join`: sum or maximum."""
    best = list(costs[0])
    for cost in costs[1:]:
        for whole in range(len(best) - 1, -1, -1):  # downwards: a smaller subset is still that of the robots before
            best[whole] = min(join(best[whole ^ part], cost[part]) for part in _subsets(whole))
    return best[-1]


def _subsets(whole: int) -> list[int]:
    parts, part = [whole], whole
    while part:
        part = (part - 1) & whole
        parts.append(part)
    return parts


def best_routes_m(
    starts: Sequence[Place], tasks: Sequence[Place], work_s: Sequence[float], speed_m_s: float
) -> tuple[float, float]:
    """The sum of all robots' ways, m, in the assignment that is done first, and in the one of the shortest sum."""
    ways = [shortest_m(start, tasks) for start in starts]
    works = [sum(s for i, s in enumerate(work_s) if subset >> i & 1) for subset in range(1 << len(tasks))]
    times = [[way / speed_m_s + work for way, work in zip(row, works, strict=True)] for row in ways]
    done_s = best_split(times, max) + 1e-6
    in_time = [
        [way if time <= done_s else math.inf for way, time in zip(*rows, strict=True)]
        for rows in zip(ways, times, strict=True)
    ]
    return best_split(in_time, float.__add__), best_split(ways, float.__add__)


def random_routes_plan(seed: int, pick: str) -> WordPlan:
    """Two to four robots, and at least as many tasks, at random places of one room, in which nothing is lost."""
    rng = random.Random(seed)
    names = NAMES[: rng.randint(2, 4)]
    tasks = random_tasks(rng.randint(len(names), TASKS_MAX), rng)
    starts = {name: Place(rng.uniform(-ROOM_M, ROOM_M), rng.uniform(-ROOM_M, ROOM_M)) for name in names}
    return WordPlan(names, tasks, seed, nearest_first=pick == "nearest", starts=starts)


def compare(seeds: Iterable[int], pick: str) -> None:
    """Print each team's way, and its time, as shares of the best assignments'."""
    rows = []
    for seed in seeds:
        plan = random_routes_plan(seed, pick)
        mission = WordMission(plan)
        result = mission.run()
        if result.lost or result.duplicates or math.isinf(result.ended_s):
            print(f"  seed {seed}: {result}")
        places = [task.place for task in plan.tasks if task.place is not None]
        works_s = [work_s(task) for task in plan.tasks]
        first_m, shortest = best_routes_m(list(plan.starts.values()), places, works_s, SPEED_M_S)
        driven_m = sum(body.driven_m for body in mission.bodies.values())
        rows.append((driven_m / first_m, driven_m / shortest, max(at_s for at_s, _, _ in mission.done), result.sent))
    for title, column in zip(_TITLES, zip(*rows, strict=True), strict=True):
        ordered = sorted(column)
        print(f"{title:54} mean {sum(column) / len(column):6.2f}, 95 % {ordered[int(0.95 * len(ordered))]:6.2f}")


_TITLES = (
    "way, of the assignment's that is done first",
    "way, of the shortest assignment's",
    "last task done, s",
    "sentences",
)
