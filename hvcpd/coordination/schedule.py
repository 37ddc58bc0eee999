"""What is due again: by the clock on the wall, or, without one, by ear.

An occurrence is named by the time at which it was due, and spoken of by its number, as a change of the task is. Who has
a clock opens a task that was done before, and knows its number; who has none believes whoever speaks of it as of
something to be done, unless it was done just before, and learns its number from reports. Clocks need to agree
to SKEW_S: who speaks of a task that early means the time that comes.
"""

from __future__ import annotations

import math

from hvcpd.config.recurrence import Recurrence
from hvcpd.coordination.board import CLAIMED, DONE, Entry
from hvcpd.coordination.knowledge import Knowledge
from hvcpd.language import messages as m

SKEW_S = 120.0
"""Between two clocks that were set by hand."""
EARLY_S = 600.0
"""So soon after it was done, whoever speaks of it has missed that: longer than most leases. And never later than
EARLY of the shortest time between two occurrences; it may have been done late, so that the next one
is near: then who has a clock tells so (`changing`)."""
EARLY = 0.5
RHYTHM = 0.8
"""Of that time: sooner after it became due, as far as was heard, it is not due again. Its first claim may have been
late by the rest."""


def next_s(me: Knowledge) -> float:
    """When something is due next (sample clock), s; infinity without a clock, or if nothing ever will be."""
    if me.clock_s is None:
        return math.inf
    return me.due_next_s - me.clock_s if me.due_next_s is not None else -math.inf


def open_due(me: Knowledge, now: float) -> None:
    """Open what is due again since it was done or given up; what is being done still counts for this time."""
    if me.clock_s is None or (me.due_next_s is not None and now < me.due_next_s - me.clock_s):
        return
    wall_s, me.due_next_s = now + me.clock_s, math.inf
    for entry in me.board.entries():
        every = entry.definition.every
        if every is None:
            continue
        due_s, coming_s = every.last(wall_s), every.next(wall_s)
        me.due_next_s = min(me.due_next_s, coming_s if coming_s is not None else math.inf)
        if due_s is None or (entry.due_s is not None and due_s <= entry.due_s):
            entry.change = entry.change or (every.number(entry.due_s) if entry.due_s is not None else 0)
            continue
        _number(entry, every, due_s)
        _open(me, entry, now, is_due=wall_s - due_s < SKEW_S)


def _number(entry: Entry, every: Recurrence, due_s: float) -> None:
    """All of the entry is about this time from now on. People's changes since the last time have counted, too."""
    number = every.number(due_s)
    if entry.change and entry.due_s is not None:
        number = entry.change + number - every.number(entry.due_s)
    entry.change, entry.due_s = number, due_s


def begin(me: Knowledge, number: int, now: float) -> bool:
    """A task is claimed, or told to be due: take that for the time that comes if that is near; whether it is."""
    return _begin_what_comes(me, me.board[number], now)


def heard(me: Knowledge, statement: m.Statement | None, now: float) -> None:
    """Somebody speaks of tasks as of something to be done, or just done: of what was done here, it may be the next."""
    told = m.own_words(statement)
    for ref in _spoken_of(told):
        entry = me.board.find(ref)
        if entry is None or not _may_be_due(me, entry, now) or not entry.known_done:
            continue
        if me.clock_s is None:
            if isinstance(told, m.Completed) and ref in told.tasks:
                if told is statement:  # not what another one knows of old
                    entry.done_s = now  # this time or the last one: done it is
                continue
            me.missed.heard_work = True  # other tasks may be due as well
        _open(me, entry, now, is_due=True)


def note_done(me: Knowledge, number: int, now: float) -> float | None:
    """A task is done: for which time it was due, to be remembered; None if that is not certain, or it never recurs."""
    entry = me.board[number]
    if entry.definition.every is None or entry.state != DONE:
        return None
    entry.done_s, entry.done_by = now, entry.owner
    return entry.due_s if entry.known_done else None


def _open(me: Knowledge, entry: Entry, now: float, is_due: bool) -> None:
    reopen(me, entry, now)
    entry.is_due, entry.is_changed = is_due, False
    entry.opened_s = now if is_due else -math.inf
    if me.clock_s is None:
        entry.change = 0  # what was missed meanwhile is not known


def reopen(me: Knowledge, entry: Entry, now: float) -> None:
    """It is to be done once more, by whomever; a list of what is left may come from somebody who does not know."""
    number = entry.definition.number
    entry.failed_by, entry.is_due = frozenset(), True
    for peer in me.peers.all():
        peer.unable -= {number}
    me.report.drop(number)  # that time is over
    if entry.state != CLAIMED:
        me.board.reopen(number)
    me.reconsider(now)


def _may_be_due(me: Knowledge, entry: Entry, now: float) -> bool:
    every = entry.definition.every
    if every is None:
        return False
    if me.clock_s is None:
        return now - entry.done_s >= early_s(every) and now - entry.opened_s >= RHYTHM * every.shortest_s
    return _begin_what_comes(me, entry, now)


def _begin_what_comes(me: Knowledge, entry: Entry, now: float) -> bool:
    """Have all be about the time that comes, if that is within SKEW_S by this robot's clock; whether it is."""
    every = entry.definition.every
    if every is None or me.clock_s is None:
        return False
    wall_s = now + me.clock_s
    coming_s = every.next(max(entry.due_s, wall_s) if entry.due_s is not None else wall_s)
    if coming_s is None or coming_s - wall_s > SKEW_S:
        return False
    _number(entry, every, coming_s)
    return True


def is_just_due(entry: Entry, now: float) -> bool:
    """Whether it became due so short a time ago, by a clock, that who has none may not know of it."""
    return entry.recurs and entry.change > 0 and now - entry.opened_s < SKEW_S


def has_just_done(entry: Entry, now: float) -> bool:
    """Whether this robot, which does not know for which time it did the task, and is told soon after it became due,
    takes it to be that time."""
    unknown = entry.recurs and not entry.change
    return unknown and entry.known_done and now - entry.acted_s < 2.0 * SKEW_S


def early_s(every: Recurrence) -> float:
    """So soon after it was done, whoever has no clock, and has not heard it become due, takes it to be done."""
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
