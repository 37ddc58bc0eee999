"""Route planning: each robot plans the routes of all robots for itself, from what all have heard.

Claims and reports tell where each robot is going, and when it will be there. A robot that claims a task first plans for
every robot whose place it knows: cheapest insertion (Rosenkrantz, Stearns & Lewis 1977) puts each free task into the
route where it finishes the last task soonest, by short ways. The robot claims the first task of its own route, and
leaves the tasks that others are nearer to. The robots do not negotiate a plan: claims resolve any difference between
two plans.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from operator import attrgetter

from hvcpd.config.tasks import Place, TaskDefinition, Use, Wait
from hvcpd.coordination.actions import Talk
from hvcpd.coordination.entry import CLAIMED, DONE
from hvcpd.coordination.knowledge import Knowledge
from hvcpd.coordination.peers import Peer
from hvcpd.language.phrasebook import CLAIM_DISTANCES_M

DRIVE_M_S = 0.2
"""A burger's mean speed on short ways: at most 0.22 m/s, and it turns first."""
PLANNED_MAX = 16
"""Number of tasks, the nearest ones, in a plan: a plan for twelve robots takes about 5 ms on a desktop computer."""
WAY_WEIGHT = 0.3
"""Weight of a second of travel against a second until the last task is done: with 0.3, 0.7 and 1.2 the ways in
`benchmarks.missions routes` were 1.04, 1.01 and 0.99 of the best, and four robots done after 210, 223 and 232 s."""
UNKNOWN_WAY_S = 20.0
"""Distance to the first task of a robot whose place is not known: 4 m."""


@dataclass
class Route:
    """The tasks that a robot would do, in order, from `place` on; `end_s`: when it would be done, s from now."""

    name: str
    place: Place
    end_s: float
    works: bool = False
    """It carries out a task before those."""
    unable: frozenset[int] = frozenset()
    tasks: list[TaskDefinition] = field(default_factory=list)

    def detour(self, task: TaskDefinition) -> tuple[float, int]:
        """The least time by which the task lengthens the route, s, and the position in the route where it does so."""
        if task.number in self.unable:
            return math.inf, 0
        stops = [self.place]
        for each in self.tasks:
            stops.append(each.place or stops[-1])
        place = task.place or stops[-1]
        between = [travel_s(a, place) + travel_s(place, b) - travel_s(a, b) for a, b in pairwise(stops)]
        detours = [*between, travel_s(stops[-1], place)]
        return min(((longer_s, n) for n, longer_s in enumerate(detours)), key=lambda each: (each[0], -each[1]))

    def insert(self, task: TaskDefinition, travel_s: float, position: int) -> None:
        self.tasks.insert(position, task)
        self.end_s += travel_s + work_s(task)


def travel_s(start: Place, end: Place) -> float:
    """Travel time from one place to another, s."""
    return start.distance_m(end) / DRIVE_M_S


def work_s(task: TaskDefinition) -> float:
    """Duration of a task's work, s, as far as it is known in advance."""
    waits_s = sum(a.duration_s for a in task.actions if isinstance(a, Wait))
    return waits_s + sum(a.limit_s for a in task.actions if isinstance(a, Use))


def cost_s(task: TaskDefinition, start: Place | None) -> float:
    """Travel time to a task, from a place that may be unknown, plus the duration of its work, s."""
    if start is None:
        return UNKNOWN_WAY_S + work_s(task)
    return travel_s(start, task.place or start) + work_s(task)


def own(
    me: Knowledge,
    tasks: Sequence[TaskDefinition],
    now: float,
    without: str | None = None,
    after: TaskDefinition | None = None,
) -> list[TaskDefinition]:
    """The tasks that this robot does in its plan for all robots but one, in order; empty if others do them sooner. It
    begins `after` its present task, if it has one."""
    here = me.body.here or Place(0.0, 0.0)
    begin_s = cost_s(after, here) if after is not None else 0.0
    here = (after.place if after is not None else None) or here
    near = sorted(tasks, key=lambda task: travel_s(here, task.place or here))[:PLANNED_MAX]
    mine = Route(me.role.name, here, begin_s, after is not None)
    _plan([mine, *(route for route in _of_others(me, now) if route.name != without)], near)
    return mine.tasks


def _plan(routes: Sequence[Route], tasks: Sequence[TaskDefinition]) -> None:
    """Give each task, the cheapest first, to the route that it lengthens least."""
    left = {task.number: task for task in tasks}
    detours = {(number, n): route.detour(task) for number, task in left.items() for n, route in enumerate(routes)}
    while left:
        last_s = max((route.end_s for route in routes if route.works or route.tasks), default=0.0)
        costs = {
            (number, n): max(last_s, routes[n].end_s + detour_s + work_s(left[number])) + WAY_WEIGHT * detour_s
            for (number, n), (detour_s, _) in detours.items()
        }
        number, n = min(costs, key=costs.__getitem__)
        routes[n].insert(left.pop(number), *detours[number, n])
        detours = {key: value for key, value in detours.items() if key[0] != number}
        detours |= {(other, n): routes[n].detour(task) for other, task in left.items()}


def _of_others(me: Knowledge, now: float) -> Iterator[Route]:
    """The robots that are present and whose place is known, and when each becomes free. A robot that is late, or has
    not claimed anything, is expected that much later: it may never come."""
    for name in me.peers.present(now):
        peer = me.peers.get(name)
        if peer is not None and (stand := next_stop(me, peer)) is not None:
            place, free_s = stand
            failed = frozenset(e.number for e in me.board.entries() if peer.name in e.failed_by)
            yield Route(peer.name, place, abs(free_s - now), free_s > now, failed | peer.unable)


def next_stop(me: Knowledge, peer: Peer) -> tuple[Place, float] | None:
    """The place where a robot ends its claimed tasks, and the time then, s; None if it has claimed none yet."""
    entries = [entry for entry in me.board.entries() if entry.owner == peer.name]
    done = max((e for e in entries if e.state == DONE), key=attrgetter("since_s"), default=None)
    place, free_s = (done.definition.place, done.since_s) if done is not None else (None, -math.inf)
    for entry in sorted((e for e in entries if e.state == CLAIMED), key=attrgetter("since_s")):
        stated_s = entry.distance_m / DRIVE_M_S + work_s(entry.definition) if entry.distance_m is not None else None
        free_s = max(free_s, entry.since_s) + (stated_s or cost_s(entry.definition, place))
        place = entry.definition.place or place
    return (place, free_s) if place is not None else None


def has_unknown_place(me: Knowledge) -> bool:
    """Whether the others cannot know this robot's place, because it has claimed nothing before its present claim."""
    claiming = me.my_tasks()
    return all(e.owner != me.role.name or e.number in claiming for e in me.board.entries())


def distance_to_state_m(me: Knowledge, task: TaskDefinition, now: float) -> int | None:
    """The distance to a task, in metres, if the claim should state it: because robots that do not know where this one
    is may be nearer, or because it says as much as it can (`Talk.FULL`)."""
    if not me.role.nearest_first or me.role.speech.encrypted or task.place is None:
        return None
    if me.role.talk is Talk.FULL:
        return spoken_distance_m(me, task)
    peers = [me.peers.get(name) for name in me.expected(now)]
    unknown = has_unknown_place(me) and any(peer is None or next_stop(me, peer) is None for peer in peers)
    return spoken_distance_m(me, task) if unknown else None


def spoken_distance_m(me: Knowledge, task: TaskDefinition) -> int | None:
    """The distance to a task, in whole metres from 1 to the most that can be said; None if this robot's place is
    unknown."""
    here = me.body.here
    if here is None:
        return None
    return min(max(round(here.distance_m(task.place or here)), 1), max(CLAIM_DISTANCES_M))
