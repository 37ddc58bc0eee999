"""What to do next: which task to claim, whom to order what, and what a time that is over means."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING

from hvcpd.config.tasks import Place, TaskDefinition, Wait
from hvcpd.coordination import composing, earshot, strangers
from hvcpd.coordination.board import CLAIMED
from hvcpd.coordination.floor import Urgency
from hvcpd.coordination.peers import Peer
from hvcpd.coordination.table import LEAVES_UNHEARD, State, Trigger
from hvcpd.language import messages as m

if TYPE_CHECKING:
    from hvcpd.coordination.coordination import Coordination

BAD_AIR_REPEATS = 2
"""So often said without an answer, a sentence did not just collide with another one."""
DENIED_OFTEN = 2
"""A task that is another's is reported soon, or its lease lapses."""
CALL_S = 15.0
"""Who has answered a greeting has done so by then; doubled each time."""
CALLS_MAX = 3
"""So often somebody is looked for before who gives orders does the tasks itself;"""
CALL_DOUBLINGS_MAX = 6
"""and it looks on, at last every 16 minutes."""
MARGIN_S = 10.0
"""Between the end of a task's actions and the end of its lease: for a stall, and for the report."""


def time_is_over(c: Coordination, now: float) -> None:
    """The state's time has run out."""
    match c.state:
        case State.READY:
            _choose(c, now)
        case State.MEETING if not c.peers.all() and c.greetings < c.timing.greetings_max:
            c.fire(Trigger.GAVE_UP, now)
        case State.PROPOSED | State.CHECKING | State.ASKED:
            _again_or_give_up(c, claims_max(c, now), now)
        case State.REPORTED if c.partner is None:
            _again_or_give_up(c, claims_max(c, now), now)
        case State.READ_BACK | State.ORDERED | State.REPORTED:
            _again_or_give_up(c, c.timing.repeats_max, now)
        case _:
            c.fire(Trigger.TIMEOUT, now)


def claims_max(c: Coordination, now: float) -> int:
    """How often a sentence that somebody should confirm is said: most often if others are heard all the while."""
    if c.peers.last_heard_s > c.asked_since_s:
        return c.timing.claims_max * c.timing.claims_among_talkers
    return c.timing.claims_max if c.peers.present(now) else c.timing.claims_alone


def _again_or_give_up(c: Coordination, times: int, now: float) -> None:
    c.repeats += 1
    if c.repeats >= BAD_AIR_REPEATS:
        c.missed_s = now
        strangers.spell_if_unknown(c, now)
    if c.repeats < times:
        c.fire(Trigger.TIMEOUT, now)
    elif c.state in LEAVES_UNHEARD and earshot.way_back(c, now) is not None:
        c.heard_work = c.heard_work or c.state is State.ASKED
        c.fire(Trigger.UNHEARD, now)
    else:
        c.fire(Trigger.GAVE_UP, now)


def _choose(c: Coordination, now: float) -> None:
    strangers.spell_now_and_then(c, now)
    waited = earshot.has_waited(c, now)
    if waited and earshot.way_back(c, now) is not None:
        c.fire(Trigger.UNHEARD, now)
        return
    if waited or (c.heard_work and c.peers.present(now)):
        _ask(c, now)
        return
    if c.role.coordinator and can_order(c, now):
        c.repeats = 0
        c.fire(Trigger.CHOSE_ORDER, now)
        return
    if may_volunteer(c, now) and task_is_free(c, now):
        c.fire(Trigger.CHOSE_CLAIM, now)
        return
    if c.role.coordinator:
        _look_for_robots(c, now)
    if c.unreported is not None:
        c.repeats = 0
        c.fire(Trigger.CHOSE_REPORT, now)
        return
    if not c.board.not_done() and c.board.hearsay() and now >= c.ask_again_s:
        if c.peers.present(now):
            c.ask_again_s = now + c.timing.ask_again_s * (1.0 + c.chance.random())
            _ask(c, now)
        elif may_volunteer(c, now):  # there is nobody to ask: better twice than not at all
            for number in c.board.hearsay():
                c.board.reopen(number)
            c.reconsider(now)
        return
    waits = [
        c.board.next_lapse(now),
        c.ask_again_s if c.board.hearsay() else None,
        c.acquaintance.call_s,
        c.waiting.until_s,
        *(p.silent_until_s for p in c.peers.all() if p.silent_until_s > now),
    ]
    if c.name_heard_s:
        waits.append(c.name_heard_s[-1] + c.timing.name_conflict_s)
    later = [t for t in waits if t is not None and t > now]
    c.arm_until(min(later, default=None))


def _look_for_robots(c: Coordination, now: float) -> None:
    """Who is to give orders, and has nobody that could take one, asks who is there: the answers to its greeting may
    have met each other, and who only takes orders says nothing of itself."""
    a = c.acquaintance
    if not c.board.not_done() or any(_is_at_work(c, peer, now) for peer in c.peers.all()):
        a.call_s = None
        return
    if a.call_s is not None and now >= a.call_s:
        a.calls, a.call_s = a.calls + 1, None
        c.want(Urgency.TURN, "who is here", lambda: composing.to_all(c, m.WhoHere()), now)
    if a.call_s is None:
        a.call_s = now + CALL_S * 2.0 ** min(a.calls, CALL_DOUBLINGS_MAX)


def _ask(c: Coordination, now: float) -> None:
    c.heard_work = False
    earshot.note_asked(c)
    c.repeats = 0
    c.fire(Trigger.CHOSE_QUESTION, now)


def may_volunteer(c: Coordination, now: float) -> bool:
    willing = c.role.volunteer if not c.role.coordinator else _orders_in_vain(c, now)
    return willing and not in_name_conflict(c, now)


def _orders_in_vain(c: Coordination, now: float) -> bool:
    """Whether who gives orders has called for all whom it knew, and none of them can take one. Who has never heard
    anybody waits on: it may be deaf."""
    return c.acquaintance.calls >= CALLS_MAX and bool(c.peers.all()) and not can_order(c, now)


def in_name_conflict(c: Coordination, now: float) -> bool:
    """Another voice has used this robot's name, twice and not long ago: once can be a word misheard."""
    recent = [t for t in c.name_heard_s if now < t + c.timing.name_conflict_s]
    return len(recent) >= 2


def task_is_free(c: Coordination, now: float) -> bool:
    return bool(c.board.free_for(c.role.name, now, c.role.unable))


def task_to_claim(c: Coordination, now: float) -> int | None:
    """A task that is free, drawn or the nearest one."""
    free = c.board.free_for(c.role.name, now, c.role.unable)
    if not free:
        return None
    return (_nearest(c, free) if c.role.nearest_first else c.chance.choice(free)).number


def _nearest(c: Coordination, tasks: tuple[TaskDefinition, ...]) -> TaskDefinition:
    here = c.here or Place(0.0, 0.0)

    def distance_m(task: TaskDefinition) -> float:
        place = task.place or here
        return math.hypot(place.x_m - here.x_m, place.y_m - here.y_m)

    return min(tasks, key=distance_m)


def is_assured(c: Coordination, now: float) -> bool:
    """Whether nobody can take the robot's task over before it is carried out."""
    if c.partner is not None or not c.peers.present(now):
        return True
    if now - c.missed_s < c.timing.bad_air_s or c.owner_before not in (None, c.role.name):
        return False  # who had the task before may have done it, and its objection may have been lost
    actions = c.board[c.my_task()].definition.actions
    needs_s = sum(a.duration_s for a in actions if isinstance(a, Wait))
    return now + needs_s + MARGIN_S <= c.assured_s


def next_order(c: Coordination, now: float) -> tuple[str, TaskDefinition] | None:
    """A robot that can be ordered, and a task for it."""
    free = next(_free_robots(c, now), None)
    return (free[0], c.chance.choice(free[1])) if free is not None else None


def can_order(c: Coordination, now: float) -> bool:
    """Whether there is a robot that can be ordered, and a task for it."""
    return any(True for _ in _free_robots(c, now))


def _free_robots(c: Coordination, now: float) -> Iterator[tuple[str, tuple[TaskDefinition, ...]]]:
    for peer in sorted(c.peers.all(), key=lambda p: p.name):
        if not _is_at_work(c, peer, now) and peer.silent_until_s <= now and c.peers.is_present(peer.name, now):
            free = c.board.free_for(peer.name, now, peer.unable)
            if free:
                yield peer.name, free


def _is_at_work(c: Coordination, peer: Peer, now: float) -> bool:
    """Whether a robot has an order that it can still be carrying out, as far as we know."""
    if peer.assigned is None:
        return False
    entry = c.board[peer.assigned]
    return entry.state == CLAIMED and entry.owner == peer.name and now < entry.lease_end_s
