"""What to choose: which task to claim, and whom to order what."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

from hvcpd.config.tasks import Place, TaskDefinition
from hvcpd.coordination import routes
from hvcpd.coordination.board import CLAIMED, OPEN
from hvcpd.coordination.knowledge import Knowledge
from hvcpd.coordination.peers import Peer

CALLS_MAX = 3
"""How often robots are called for before the one that gives orders does the tasks itself."""
TURN_S = 7.0
"""A confirmation and a claim in one breath, with the pause before them."""
MARGIN_S = 10.0
"""Between the end of a task's actions and the end of its lease: for a stall, and for the report."""


def claims_max(me: Knowledge, now: float) -> int:
    """How often a sentence that somebody should confirm is said: most often if others are heard all the while."""
    if not me.peers.present(now):
        greetings_spared = me.timing.greetings_max - me.acquaintance.greetings if not me.peers.all() else 0
        return me.timing.claims_alone + max(greetings_spared, 0)
    talkers = me.peers.last_heard_s > me.current.asked_since_s
    return me.timing.claims_max * (me.timing.claims_among_talkers if talkers else 1)


def may_volunteer(me: Knowledge, now: float) -> bool:
    willing = me.role.volunteer if not me.role.coordinator else _orders_in_vain(me, now)
    return willing and not in_name_conflict(me, now)


def _orders_in_vain(me: Knowledge, now: float) -> bool:
    """Whether who gives orders has called for all whom it knew, and none of them can take one. Who has never heard
    anybody waits on: it may be deaf."""
    return me.acquaintance.calls >= CALLS_MAX and bool(me.peers.all()) and not can_order(me, now)


def in_name_conflict(me: Knowledge, now: float) -> bool:
    """Another voice has used this robot's name, twice and not long ago: once can be a word misheard."""
    recent = [t for t in me.acquaintance.own_name_heard_s if now < t + me.timing.name_conflict_s]
    return len(recent) >= 2


def task_is_free(me: Knowledge, now: float) -> bool:
    return bool(me.board.free_for(me.role.name, now, me.role.unable))


def claims_at_once(me: Knowledge, now: float) -> bool:
    """Whether a robot can claim a task instead of telling its name first."""
    known = me.role.listed and bool(me.role.roster) and not me.missed.heard_work
    return known and may_volunteer(me, now) and task_is_free(me, now)


def tasks_to_claim(me: Knowledge, now: float) -> tuple[int, ...]:
    """What is free: of the most urgent tasks, one that is drawn, or the first of the robot's route; and where air is
    scarce another one, the nearest to its place. None, if nothing is free, or others do it sooner. What recurs is
    claimed alone, for its report tells which time it was."""
    free = _most_urgent(me, me.board.free_for(me.role.name, now, me.role.unable))
    route = _route(me, free, now)
    if not route or route[0].every is not None:
        return tuple(task.number for task in route[:1])
    others = [t for t in route[1:] if t.every is None and me.board[t.number].state == OPEN]
    if len(others) <= _free_others(me, now) or not _air_is_scarce(me, route[0], now):
        return (route[0].number,)
    return route[0].number, others[0].number


def leaves_to_others(me: Knowledge, now: float) -> bool:
    """Whether others do all that is free sooner, as far as this robot knows."""
    free = me.board.free_for(me.role.name, now, me.role.unable)
    return me.role.nearest_first and not _route(me, _most_urgent(me, free), now)


def _route(me: Knowledge, free: Sequence[TaskDefinition], now: float) -> Sequence[TaskDefinition]:
    """The tasks that this robot would do next, in order: where the air is scarce, to wait for others costs more than a
    way, and there is no plan."""
    if not free:
        return ()
    first = min(free, key=lambda task: _cost_s(me, task)) if me.role.nearest_first else me.rng.choice(free)
    if me.role.nearest_first and not _air_is_scarce(me, first, now):
        return routes.own(me, free, now)
    return (first, *sorted((t for t in free if t is not first), key=lambda t: routes.cost_s(t, first.place)))


def _cost_s(me: Knowledge, task: TaskDefinition) -> float:
    return routes.cost_s(task, me.body.here or Place(0.0, 0.0))


def _free_others(me: Knowledge, now: float) -> int:
    """The number of others who have no task: one is left for each of them."""
    owners = {e.owner.lower() for e in me.board.entries() if e.state == CLAIMED and e.owner is not None}
    return len(me.expected(now) - owners)


def _air_is_scarce(me: Knowledge, task: TaskDefinition, now: float) -> bool:
    """Whether a round of all robots' turns takes longer than this task, so that robots wait for the air: as many turns
    as there are robots, or as long as this robot's own turn has just been in coming."""
    others, speech = len(me.expected(now)), me.role.speech
    round_s = max(TURN_S * speech.stretch * (1 + others), me.floor.waited_s)
    return others > 0 and not speech.encrypted and round_s > _cost_s(me, task)


def _most_urgent(me: Knowledge, tasks: tuple[TaskDefinition, ...]) -> tuple[TaskDefinition, ...]:
    """Those of the highest priority and, of these, those that are late soonest."""

    def urgency(task: TaskDefinition) -> tuple[int, float]:
        due_s = me.board[task.number].due_s or 0.0
        return -task.priority, due_s + task.deadline_s if task.deadline_s is not None else math.inf

    first = min(map(urgency, tasks), default=None)
    return tuple(task for task in tasks if urgency(task) == first)


def may_claim_with_report(me: Knowledge, now: float) -> bool:
    """Whether a volunteer that reports its task as done, for the first time, claims another one in the same breath."""
    report = me.board[me.report.task] if me.report.task is not None else None
    done = report is not None and not me.report.failed and not report.is_changed
    return done and me.current.partner is None and me.current.repeats == 0 and may_volunteer(me, now)


def is_assured(me: Knowledge, now: float) -> bool:
    """Whether nobody can take the robot's task over before it is carried out."""
    if me.current.partner is not None or not me.peers.present(now):
        return True
    if now - me.missed.last_s < me.timing.bad_air_s or me.current.owner_before not in (None, me.role.name):
        return False  # who had the task before may have done it, and its objection may have been lost
    needs_s = routes.work_s(me.board[me.my_task()].definition)
    return now + needs_s + MARGIN_S <= me.current.assured_s


def next_order(me: Knowledge, now: float) -> tuple[str, TaskDefinition] | None:
    """A robot that can be ordered, and a task for it."""
    free = next(_free_robots(me, now), None)
    return (free[0], me.rng.choice(_most_urgent(me, free[1]))) if free is not None else None


def can_order(me: Knowledge, now: float) -> bool:
    """Whether there is a robot that can be ordered, and a task for it."""
    return any(True for _ in _free_robots(me, now))


def _free_robots(me: Knowledge, now: float) -> Iterator[tuple[str, tuple[TaskDefinition, ...]]]:
    for peer in sorted(me.peers.all(), key=lambda p: p.name):
        if not is_at_work(me, peer, now) and peer.silent_until_s <= now and me.peers.is_present(peer.name, now):
            free = me.board.free_for(peer.name, now, peer.unable)
            if free:
                yield peer.name, free


def is_at_work(me: Knowledge, peer: Peer, now: float) -> bool:
    """Whether a robot has an order that it can still be carrying out, as far as we know."""
    if peer.assigned is None:
        return False
    entry = me.board[peer.assigned]
    return entry.state == CLAIMED and entry.owner == peer.name and now < entry.lease_end_s
