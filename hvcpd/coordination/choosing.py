"""Choices: which task to claim, and which task to order from which robot."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence

from hvcpd.config.tasks import Place, TaskDefinition
from hvcpd.coordination import routes, schedule
from hvcpd.coordination.actions import Talk
from hvcpd.coordination.entry import CLAIMED, OPEN, Entry
from hvcpd.coordination.knowledge import Knowledge
from hvcpd.coordination.peers import Peer
from hvcpd.coordination.states import State

CALLS_MAX = 3
"""How often a coordinator calls for robots before it does the tasks itself."""
TURN_S = 7.0
"""A confirmation and a claim in one turn, with the pause before them."""
MARGIN_S = 10.0
"""Between the end of a task's actions and the end of its lease: for a stall, and for the report."""


def claims_max(me: Knowledge) -> int:
    """Number of times that a sentence in need of a confirmation is said: more often while voices are heard."""
    if me.current.task is not None and me.board[me.current.task].is_shared:
        return me.timing.claims_max if me.state is State.CHECKING else me.timing.repeats_max
    times = me.timing.claims_max
    if all(peer.silent for peer in me.peers.robots()):  # who was merely not heard for long may be resting
        is_awaited = not me.peers.robots() and me.roster != {me.role.name.lower()} and not me.acquaintance.alone
        times = me.timing.claims_alone + me.timing.greetings_max
        if not is_awaited:
            return me.timing.claims_alone
    return min(me.current.heard_at + times, me.timing.claims_max * me.timing.claims_among_talkers)


def may_volunteer(me: Knowledge, now: float) -> bool:
    willing = me.role.volunteer if not me.role.coordinator else _orders_in_vain(me, now)
    return willing and not in_name_conflict(me, now)


def _orders_in_vain(me: Knowledge, now: float) -> bool:
    """Whether a coordinator has called for all robots that it knew, and none of them can take an order. A coordinator
    that has never heard anybody keeps waiting: it may be deaf."""
    return me.acquaintance.calls >= CALLS_MAX and bool(me.peers.all()) and not can_order(me, now)


def in_name_conflict(me: Knowledge, now: float) -> bool:
    """Another voice has used this robot's name, twice and recently: a single time may be a misheard word."""
    recent = [t for t in me.acquaintance.own_name_heard_s if now < t + me.timing.name_conflict_s]
    return len(recent) >= 2


def may_claim(me: Knowledge, now: float) -> bool:
    """Whether there is a task that this robot may volunteer for."""
    return may_volunteer(me, now) and bool(_free(me, now))


def _free(me: Knowledge, now: float) -> tuple[TaskDefinition, ...]:
    """The tasks that this robot may claim. A task for several robots counts only if another robot has claimed it, or if
    enough robots that have not given it up are idle, and not soon after an unanswered call for helpers; see also
    `waits_for_next`."""
    me.expire(now)
    entries = me.board.entries()
    shared = [entry for entry in entries if entry.is_shared]
    idle = _free_others(me, now) if shared else frozenset[str]()
    later = {e.number for e in shared if e.call_s > now or not (e.has_room or _can_fill(e, idle))}
    later |= {e.number for e in entries if schedule.waits_for_next(me, e, now)}
    return me.board.free_for(me.role.name, now, me.role.unable | later)


def can_take_part(me: Knowledge, entry: Entry, now: float) -> bool:
    """Whether this robot can do a task; one for several robots, with the robots that are there."""
    enough = not entry.is_shared or entry.has_room or _can_fill(entry, _free_others(me, now))
    return enough and me.board.can_begin(entry) and not me.lacks(entry)


def _can_fill(entry: Entry, idle: frozenset[str]) -> bool:
    return 1 + len(idle - {name.lower() for name in entry.failed_by}) >= entry.definition.robots


def claims_at_once(me: Knowledge, now: float) -> bool:
    """Whether a robot can claim a task without greeting first."""
    known = me.role.listed and bool(me.role.roster) and not me.missed.heard_work and me.role.talk is not Talk.FULL
    return known and may_claim(me, now)


def tasks_to_claim(me: Knowledge, now: float) -> tuple[int, ...]:
    """Free tasks to claim: of the most urgent, one at random, or the first of the robot's route; and, where air time is
    scarce or the robot is terse, a second one, the nearest to its place or the next of the route. Empty if nothing is
    free, or if others do it sooner. A recurring task is claimed alone, because its report states the occurrence; so is
    a task for several robots."""
    free = _most_urgent(me, _free(me, now))
    free = tuple(t for t in free if me.board[t.number].has_room) or free  # a robot waits for it
    route = _route(me, free, now)
    if not route or not _is_plain(route[0]):
        return tuple(task.number for task in route[:1])
    others = [t for t in free if t is not route[0] and _is_plain(t) and me.board[t.number].state == OPEN]
    second = next((t for t in route[1:] if t in others), None)
    if second is None or len(others) <= len(_free_others(me, now)):
        return (route[0].number,)
    both = air_is_scarce(me, route[0], now) or _saves_a_renewal(me, route[0], second)
    return (route[0].number, second.number) if both else (route[0].number,)


def task_ahead(me: Knowledge, now: float) -> int | None:
    """The task to claim while the robot still does its present one: the next of its route; None if there is none, or if
    one is not left for each robot that has no task. Nor where air time is scarce, and by robots that choose at random:
    there the sentences that this takes cost more than it saves."""
    present, free = me.board[me.my_task()].definition, me.board.open_for(me.role.name, me.role.unable)
    free = tuple(t for t in _most_urgent(me, free) if _is_plain(t))
    alone = me.current.partner is not None or not _is_plain(present) or me.board[present.number].is_changed
    spares_talk = me.role.speech.encrypted or me.role.talk is Talk.TERSE or not me.role.nearest_first
    if alone or spares_talk or not may_volunteer(me, now):
        return None
    if not me.peers.present(now) or len(free) <= len(_free_others(me, now)) or air_is_scarce(me, present, now):
        return None
    route = routes.own(me, free, now, after=present)
    return route[0].number if route else None


def _saves_a_renewal(me: Knowledge, first: TaskDefinition, second: TaskDefinition) -> bool:
    """Whether a terse robot claims both at once: it does them before it would have to say that it is still at work."""
    both_s = _cost_s(me, first) + routes.cost_s(second, first.place) + MARGIN_S
    return me.role.talk is Talk.TERSE and not me.role.speech.encrypted and both_s < me.timing.renewal_s


def leaves_to_others(me: Knowledge, now: float) -> bool:
    """Whether others do all free tasks sooner, as far as this robot knows."""
    return me.role.nearest_first and not tasks_to_claim(me, now)


def _route(me: Knowledge, free: Sequence[TaskDefinition], now: float) -> Sequence[TaskDefinition]:
    """The tasks that this robot would do next, in order. There is no plan where air time is scarce, because waiting for
    others costs more than the travel, nor for a task for several robots, because each of them goes."""
    if not free:
        return ()
    first = min(free, key=lambda task: _cost_s(me, task)) if me.role.nearest_first else me.rng.choice(free)
    alone = all(task.robots == 1 for task in free)
    if me.role.nearest_first and alone and not air_is_scarce(me, first, now):
        return routes.own(me, free, now)
    return (first, *sorted((t for t in free if t is not first), key=lambda t: routes.cost_s(t, first.place)))


def _cost_s(me: Knowledge, task: TaskDefinition) -> float:
    return routes.cost_s(task, me.body.here or Place(0.0, 0.0))


def _is_plain(task: TaskDefinition) -> bool:
    return task.every is None and task.robots == 1


def _free_others(me: Knowledge, now: float) -> frozenset[str]:
    """The other robots that have no task, in lower case: one is left for each of them."""
    busy = {name.lower() for e in me.board.entries() if e.state == CLAIMED for name in e.team}
    return me.expected(now) - busy


def air_is_scarce(me: Knowledge, task: TaskDefinition, now: float) -> bool:
    """Whether a round of all robots' turns takes longer than this task, so that robots wait for air time. The length of
    a round is one turn for each robot, or the last wait for this robot's own turn if that was longer."""
    others, speech = len(me.expected(now)), me.role.speech
    round_s = max(TURN_S * speech.stretch * (1 + others), me.floor.waited_s)
    return others > 0 and not speech.encrypted and round_s > _cost_s(me, task)


def _most_urgent(me: Knowledge, tasks: tuple[TaskDefinition, ...]) -> tuple[TaskDefinition, ...]:
    """The tasks of the highest priority and, of these, those with the earliest deadline."""

    def urgency(task: TaskDefinition) -> tuple[int, float]:
        due_s = me.board[task.number].due_s or 0.0
        return -task.priority, due_s + task.deadline_s if task.deadline_s is not None else math.inf

    first = min(map(urgency, tasks), default=None)
    return tuple(task for task in tasks if urgency(task) == first)


def may_claim_with_report(me: Knowledge, now: float) -> bool:
    """Whether a volunteer that first reports its task as done claims another one in the same turn."""
    is_alone = not any(me.board[number].is_shared for number in me.report.tasks) and me.current.partner is None
    return me.has_plain_report and is_alone and me.current.repeats == 0 and may_volunteer(me, now)


def is_assured(me: Knowledge, now: float) -> bool:
    """Whether no other robot can take over this robot's task before it is carried out."""
    if me.board[me.my_task()].is_shared:
        return False  # all begin together
    if me.current.partner is not None or not me.peers.present(now):
        return True
    if me.current.may_be_outbid or me.current.objected or now - me.missed.last_s < me.timing.bad_air_s:
        return False
    if me.current.owner_before not in (None, me.role.name):
        return False  # the previous owner may have done it, and its objection may have been lost
    needs_s = routes.work_s(me.board[me.my_task()].definition)
    return now + needs_s + MARGIN_S <= me.current.assured_s


def next_order(me: Knowledge, now: float) -> tuple[str, TaskDefinition] | None:
    """A robot that can take an order, and a task for it."""
    orders = _possible_orders(me, now)
    waiting = {name: tuple(t for t in tasks if me.board[t.number].has_room) for name, tasks in orders.items()}
    name, tasks = next(((n, t) for each in (waiting, orders) for n, t in each.items() if t), (None, ()))
    return (name, me.rng.choice(_most_urgent(me, tasks))) if name is not None else None


def can_order(me: Knowledge, now: float) -> bool:
    """Whether there is a robot that can take an order, and a task for it."""
    return any(_possible_orders(me, now).values())


def _possible_orders(me: Knowledge, now: float) -> dict[str, tuple[TaskDefinition, ...]]:
    """Each robot that can take an order, and the tasks for it: one for several robots only if a robot waits for others
    there, or enough of them can take that order."""
    me.expire(now)
    ready = (p for p in me.peers.robots() if p.silent_until_s <= now and me.peers.is_present(p.name, now))
    free = {
        p.name: me.board.free_for(p.name, now, p.unable)
        for p in sorted(ready, key=lambda p: p.name)
        if not is_at_work(me, p, now)
    }
    able = Counter(task.number for tasks in free.values() for task in tasks)

    def can_begin(task: TaskDefinition) -> bool:
        return me.board[task.number].has_room or able[task.number] >= task.robots

    return {name: tuple(filter(can_begin, tasks)) for name, tasks in free.items()}


def is_at_work(me: Knowledge, peer: Peer, now: float) -> bool:
    """Whether a robot has an order that it may still be carrying out, as far as this robot knows."""
    if peer.assigned is None:
        return False
    entry = me.board[peer.assigned]
    return peer.name in entry.team and now < entry.lease_end_s
