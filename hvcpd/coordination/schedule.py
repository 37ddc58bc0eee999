"""Recurring tasks: due again by the wall clock or, without one, by ear.

The time at which an occurrence was due identifies it, and robots speak of it by its number, like a change of the task.
A robot with a clock opens a task that was done before, and knows its number. A robot without one believes any robot
that speaks of the task as open, unless it was done just before, and learns its number from reports. Clocks need to
agree to SKEW_S: a robot that speaks of a task that early means the coming occurrence.
"""

from __future__ import annotations

import math

from hvcpd.config.recurrence import Recurrence
from hvcpd.coordination.entry import CLAIMED, DONE, OPEN, Entry
from hvcpd.coordination.knowledge import Knowledge
from hvcpd.language import messages as m

SKEW_S = 120.0
"""Between two clocks that were set by hand."""
EARLY_S = 600.0
"""A robot that speaks of a task this soon after it was done has missed the report: longer than most leases. The time is
never longer than EARLY of the shortest time between two occurrences. A task may have been done late, so that the next
occurrence is near: then a robot with a clock says so (`changing`)."""
EARLY = 0.5
RHYTHM = 0.8
"""Fraction of the shortest time between two occurrences: a task heard to become due is not due again sooner. Its first
claim may have been late by the rest."""


def next_s(me: Knowledge) -> float:
    """When something is due next (sample clock), s; infinity without a clock, or if nothing ever will be."""
    if me.clock_s is None:
        return math.inf
    return me.due_next_s - me.clock_s if me.due_next_s is not None else -math.inf


def open_due(me: Knowledge, now: float) -> None:
    """Open tasks that are due again since they were done or given up; a task in progress still counts for this time."""
    if me.clock_s is None or (me.due_next_s is not None and now < me.due_next_s - me.clock_s):
        return
    wall_s, me.due_next_s = now + me.clock_s, math.inf
    for entry in me.board.entries():
        every = entry.definition.every
        if every is None:
            continue
        due_s, coming_s = every.last(wall_s), every.next(wall_s)
        me.due_next_s = min(me.due_next_s, coming_s if coming_s is not None else math.inf)
        if entry.due_s is not None and due_s is not None and coming_s is not None and coming_s < entry.due_s:
            _number(entry, every, due_s)  # the clock was ahead; what was done by it counts for this time
        if due_s is None or (entry.due_s is not None and due_s <= entry.due_s):
            entry.change = entry.change or (every.number(entry.due_s) if entry.due_s is not None else 0)
            continue
        _number(entry, every, due_s)
        open_anew(me, entry, now, is_due=wall_s - due_s < SKEW_S)


def _number(entry: Entry, every: Recurrence, due_s: float) -> None:
    """The whole entry describes this occurrence from now on, including people's changes since the last one."""
    number = every.number(due_s)
    if entry.change and entry.due_s is not None:
        number = entry.change + number - every.number(entry.due_s)
    entry.change, entry.due_s = number, due_s


def heard(me: Knowledge, speaker: str, statement: m.Statement | None, now: float) -> None:
    """A robot speaks of tasks as open, or just done: a task that was done here may be due again."""
    own = m.own_words(statement)
    reports = own.tasks if isinstance(own, m.Completed) else ()
    for ref in _spoken_of(own):
        entry = me.board.find(ref)
        if entry is not None and ref in reports:
            _note_reported(me, entry, own is not statement, now)
        elif entry is not None:
            _note_open(me, entry, speaker, now)


def _note_reported(me: Knowledge, entry: Entry, is_quoted: bool, now: float) -> None:
    """What is not known to be done is the occurrence that is meant. Otherwise it may be the coming one, or, for a robot
    without a clock, this one, the last one or, quoted, an even older one."""
    if not entry.known_done or not may_be_due(me, entry, now):
        return
    if me.clock_s is not None:
        open_anew(me, entry, now, is_due=True)
    elif not is_quoted:
        entry.done_s = now


def _note_open(me: Knowledge, entry: Entry, speaker: str, now: float) -> None:
    if entry.state == DONE and may_be_due(me, entry, now):
        me.missed.heard_work |= me.clock_s is None  # other tasks may be due as well
        open_anew(me, entry, now, is_due=True)
    entry.known_to |= {speaker}


def note_done(me: Knowledge, number: int, now: float) -> float | None:
    """A task is done: returns when this occurrence was due, to be remembered; None if uncertain or not recurring."""
    entry = me.board[number]
    if entry.definition.every is None or entry.state != DONE:
        return None
    entry.done_s, entry.done_by = now, entry.owner
    return entry.due_s if entry.known_done else None


def open_anew(me: Knowledge, entry: Entry, now: float, is_due: bool) -> None:
    """The entry describes another occurrence, which is to be done; `is_due`: since now."""
    reopen(me, entry, now)
    entry.is_due, entry.is_changed = is_due, False
    entry.opened_s = now if is_due else -math.inf
    if me.clock_s is None:
        entry.change = 0  # changes missed meanwhile are not known


def reopen(me: Knowledge, entry: Entry, now: float) -> None:
    """Any robot is to do it once more; a list of remaining tasks may come from a robot that does not know."""
    number = entry.number
    entry.failed_by = entry.known_to = frozenset()
    entry.is_due = True
    for peer in me.peers.all():
        peer.unable -= {number}
    me.report.drop(number)  # that time is over
    if entry.state != CLAIMED:
        me.board.reopen(number)
    me.reconsider(now)


def may_be_due(me: Knowledge, entry: Entry, now: float) -> bool:
    """Whether a robot that speaks of a task that was done means another occurrence, which the entry describes from now
    on if this robot has a clock."""
    every = entry.definition.every
    if every is None:
        return False
    if me.clock_s is None:
        return now - entry.done_s >= early_s(every) and now - entry.opened_s >= RHYTHM * every.shortest_s
    return begin_what_comes(me, entry, now)


def begin_what_comes(me: Knowledge, entry: Entry, now: float, within_s: float = SKEW_S) -> bool:
    """The entry now describes the coming occurrence, if that is so near by this robot's clock; whether it is."""
    every, coming_s = entry.definition.every, _coming_s(me, entry, now, within_s)
    if every is None or coming_s is None:
        return False
    _number(entry, every, coming_s)
    return True


def waits_for_next(me: Knowledge, entry: Entry, now: float) -> bool:
    """Whether a robot that has still to ask what is left leaves a task until it is due again: others may have done it,
    and would take a claim so shortly before the next time for one of that time."""
    return me.missed.heard_work and entry.state == OPEN and _coming_s(me, entry, now, 2.0 * SKEW_S) is not None


def _coming_s(me: Knowledge, entry: Entry, now: float, within_s: float) -> float | None:
    """When the occurrence after the one that the entry describes is due, s since 1970; None if that is later than
    `within_s` from now by this robot's clock, or unknown."""
    every = entry.definition.every
    if every is None or me.clock_s is None:
        return None
    wall_s = now + me.clock_s
    coming_s = every.next(max(entry.due_s, wall_s) if entry.due_s is not None else wall_s)
    return coming_s if coming_s is not None and coming_s - wall_s <= within_s else None


def is_just_due(entry: Entry, now: float) -> bool:
    """Whether it became due, by a clock, so recently that a robot without one may not know of it."""
    return entry.recurs and entry.change > 0 and now - entry.opened_s < SKEW_S


def has_just_done(entry: Entry, now: float) -> bool:
    """Whether this robot, which does not know for which occurrence it did the task, and hears soon afterwards that it
    is due, takes its work to count for that occurrence: it must have heard before that it became due, and not too long
    ago for that to be the last one."""
    every = entry.definition.every
    if every is None or entry.change or not entry.known_done:
        return False
    return now - entry.acted_s < 2.0 * SKEW_S and now - entry.opened_s < RHYTHM * every.shortest_s


def early_s(every: Recurrence) -> float:
    """How soon after it was done a robot without a clock, which has not heard it become due, still counts it as
    done."""
    return min(EARLY_S, EARLY * every.shortest_s)


def _spoken_of(statement: m.Statement | None) -> tuple[m.TaskRef, ...]:
    match statement:
        case m.Working(ref) | m.Order(ref):
            return (ref,)
        case m.Claim() | m.Confirmed(complete=False):
            return statement.tasks
        case m.Completed():
            return (*statement.tasks, *(statement.claim.tasks if statement.claim is not None else ()))
        case m.Left():
            return tuple(map(m.TaskByNumber, statement.numbers))
        case _:
            return ()
