"""Tasks for several robots: others join the robot that claims one, and all begin together at its place.

A second robot says "I will complete task three" to join. A robot that already has the task answers "confirmed three",
and both set off. At the place each robot says "completing task three" and answers every other robot that has said so
with "confirmed three". It begins once it has said this to all of them and heard it from all of them. A robot that finds
nobody leaves the task for a while. A robot that gives up, stops, leaves or turns to another task releases the others,
and the task is open again. Each robot reports its own part; the last report completes the task.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable
from functools import partial

from hvcpd.coordination import composing
from hvcpd.coordination.addressing import OWNER_SLOT, is_for_me_alone
from hvcpd.coordination.entry import Entry
from hvcpd.coordination.floor import LEFT_ALONE, Urgency, nothing
from hvcpd.coordination.knowledge import Heard, Knowledge
from hvcpd.coordination.states import AT_WORK, PROPOSING, State, Trigger
from hvcpd.coordination.table import fire
from hvcpd.language import messages as m

AT_PLACE = frozenset({State.ANNOUNCING, State.CHECKING})
"""At the place, waiting for the others."""

SLOTS = 2
"""If two robots each believe that a third does the task with them, both answer it at once, but not repeatedly."""


def contend(me: Knowledge, heard: Heard, entry: Entry, other_at_work: bool) -> None:
    """Another robot claims a task for several robots, or is at its place."""
    number, other, now = entry.number, heard.name, heard.now
    entry.failed_by -= {other}
    me.expire(now)
    if me.role.name in entry.parts_before and not _is_in(me, number):
        # perhaps the others have done their parts, and no robot has heard that from all
        composing.answer(me, None, f"done {number}", composing.done(me, number), now, call=other)
    if not _is_in(me, number):
        lease_end_s = me.lease_end_s(now) if other_at_work else now + me.timing.unconfirmed_lease_s
        if other in entry.parts and not other_at_work:
            me.board.release(number)  # it begins again
        if other_at_work and me.role.name in entry.parts:  # it did not hear that the others began
            composing.answer(me, None, f"done {number}", composing.done(me, number), now, OWNER_SLOT, call=other)
        me.board.claim(number, other, lease_end_s, firm=other_at_work)
        entry.call_s = now
        me.reconsider(now)
        return
    is_member = other in entry.team
    if not is_member and not entry.has_room:
        me.current.rivals |= {other}
        if other_at_work or me.state in AT_WORK or entry.owner == me.role.name:
            _tell(me, other, m.Negative(), number, now)
        return  # otherwise both want to join, and the owner decides
    _note_answer(me, other)
    is_coming = is_member and me.state in AT_PLACE and is_for_me_alone(me, heard.to)
    if not other_at_work:
        me.current.confirmed_to -= {other}
        me.current.promised -= {other}
        me.current.agreed -= {other}
    if other_at_work:
        me.board.claim(number, other, me.lease_end_s(now))
        if me.state in AT_PLACE or me.state is State.ACTING:
            _agree(me, other, number, now, begins=True)
        else:
            _tell(me, other, m.Claim(m.TaskByNumber(number)), number, now)  # this robot is coming
    elif me.state is State.ACTING and is_member:  # the other robot has started again
        leave(me, number, now)
    elif not is_coming and (me.state in AT_WORK or _decides(me, entry, other)):
        me.board.claim(number, other, me.lease_end_s(now))
        _agree(me, other, number, now)


def _note_answer(me: Knowledge, other: str) -> None:
    """A robot has answered: this robot waits longer only if the answer is new. Otherwise two robots that hear each
    other repeatedly would wait for ever for a third that has mistaken another robot for the third, or for the person
    who ordered the task."""
    if other not in me.current.agreed and me.state not in (State.READING_BACK, State.READ_BACK):
        me.current.repeats = 0


def _is_in(me: Knowledge, number: int) -> bool:
    return me.current.task == number and me.state in PROPOSING | AT_WORK


def _decides(me: Knowledge, entry: Entry, other: str) -> bool:
    """Whether this robot, which has claimed the task, decides if another robot joins. If two robots each take the other
    for the first, the one whose name comes first in the alphabet decides."""
    me_first = me.role.name.lower() < other.lower()
    return entry.owner == me.role.name or (entry.owner == other and me_first)


def _agree(me: Knowledge, other: str, number: int, now: float, begins: bool = False) -> None:
    """Tell another robot that it does the task with this robot; or, if both are at the place, that this robot
    begins."""

    def note() -> None:
        me.current.confirmed_to |= {other}
        if begins:
            me.current.there, me.current.promised = True, me.current.promised | {other}

    _tell(me, other, m.Confirmed(m.TaskByNumber(number)), number, now, note)


def _tell(
    me: Knowledge,
    other: str,
    statement: m.Statement,
    number: int,
    now: float,
    on_said: Callable[[], None] = nothing,
) -> None:
    """Answer another robot that has spoken of the task, if this robot still takes part in it."""
    still, slot = partial(_is_in, me, number), OWNER_SLOT + int(me.rng.random() * SLOTS)
    composing.answer(me, other, f"with {other}", statement, now, slot, still=still, on_said=on_said)


def settle(me: Knowledge, now: float) -> None:
    """Set off, or begin, once everything necessary has been said and heard."""
    if me.current.task is None or not me.board[me.current.task].is_shared:
        return
    entry = me.board[me.current.task]
    others = entry.team - {me.role.name}
    if len(others) + 1 < entry.definition.robots or not others <= me.current.confirmed_to:
        return
    if me.state in (State.CLAIMING, State.PROPOSED) or (me.state in AT_PLACE and others <= me.current.agreed):
        fire(me, Trigger.CONFIRMED, now)


def confirmed(me: Knowledge, heard: Heard, number: int, complete: bool) -> bool:
    """Another robot tells this robot that it joins its current task, or that the task is `complete`. Returns whether
    that is a task for several robots."""
    entry, now, other = me.board[number], heard.now, heard.name
    if not entry.is_shared or not _is_in(me, number):
        return False
    if complete and me.state is not State.ACTING:
        me.board.complete(number, me.role.name, hearsay=me.state in AT_WORK)
        fire(me, Trigger.LOST, now)
    if complete or (other not in entry.team and not entry.has_room):
        return True
    me.board.claim(number, other, me.lease_end_s(now))
    _note_answer(me, other)
    if me.state in (State.CLAIMING, State.PROPOSED):
        if entry.owner != me.role.name or not entry.has_room:
            fire(me, Trigger.CONFIRMED, now)
    elif me.state in AT_PLACE and me.current.there:
        me.current.agreed |= {other}
        if other not in me.current.confirmed_to:
            _agree(me, other, number, now, begins=True)
        settle(me, now)
    return True


def forget_part(me: Knowledge, refs: Iterable[m.TaskRef]) -> None:
    """Another robot has heard that this one did its part of these tasks some time ago, and does not say that they are
    complete: the others have not done theirs, and all begin again."""
    for entry in me.board.known(refs):
        entry.parts_before -= {me.role.name}


def overheard(me: Knowledge, one: str, other: str, entry: Entry, now: float) -> None:
    """Two other robots have agreed on the task; a robot that has claimed it too, and is not needed, leaves it to them.
    If two have agreed on it with the same third, the one whose name comes first in the alphabet keeps it, or the one
    that the third tells so."""
    number = entry.number
    is_in = _is_in(me, number)
    if is_in and one not in entry.team and not entry.has_room:
        me.current.rivals |= {one}
    was_taken = one in entry.team - me.current.agreed and other in me.current.rivals
    is_first = me.state is not State.GOING or other not in entry.team or me.role.name.lower() < one.lower()
    is_sure = me.state is State.ACTING or (is_first and not was_taken)
    if is_in and me.state not in PROPOSING and is_sure:
        return
    me.board.pair(number, one, other, me.lease_end_s(now))
    if is_in:
        if entry.has_room or {me.role.name, one, other} <= entry.team:
            me.board.claim(number, me.role.name, me.lease_end_s(now))
        else:
            fire(me, Trigger.LOST, now)


def gone(me: Knowledge, name: str, number: int, now: float) -> None:
    """A robot does not do the task after all: its partners are released, and the task is open."""
    entry = me.board[number]
    if entry.is_shared and name in entry.team:
        if _is_in(me, number):
            leave(me, number, now)
        me.board.release(number)


def moved_on(me: Knowledge, name: str, numbers: Collection[int], now: float) -> None:
    """A robot has claimed these tasks: it is no longer at any other."""
    number = me.current.task
    if number is None or number in numbers or not _is_in(me, number) or name not in me.board[number].team:
        return
    if me.board[number].is_shared:
        _has_ended(me, name, number, now)


def _has_ended(me: Knowledge, name: str, number: int, now: float) -> None:
    """A robot has left the current task. If this robot has told it, at the place, that it begins, it has done its part;
    otherwise this robot may have missed its last sentence, and begins only now."""
    if me.state is State.ACTING or (me.state in AT_PLACE and name in me.current.promised):
        me.board.complete_part(number, name, me.lease_end_s(now))
        fire(me, Trigger.CONFIRMED, now)
    else:
        gone(me, name, number, now)


def done(me: Knowledge, doer: str, number: int, whole: bool, now: float) -> bool:
    """A robot has done its part of a task for several robots, or knows that the `whole` task is done. Returns whether
    the task is still unfinished."""
    entry = me.board[number]
    is_in = _is_in(me, number)
    if not entry.is_shared or entry.known_done or (whole and not (is_in and me.state in AT_WORK)):
        return False
    waits = is_in and me.state is not State.ACTING
    by_others = doer not in entry.team and (waits or bool(entry.parts_before))
    if by_others:
        entry.parts_before |= {doer}
    if (waits or by_others) and len(entry.parts_before | {doer}) >= entry.definition.robots:
        me.board.complete(number, doer)
        if is_in:
            fire(me, Trigger.LOST, now)
        return True
    if by_others:
        return True
    if not is_in:
        return not me.board.complete_part(number, doer, me.lease_end_s(now))
    if doer in entry.team:
        _has_ended(me, doer, number, now)
    return True


def leave(me: Knowledge, number: int, now: float) -> None:
    """Nobody is there to do the task with; a robot that had set off says so, because another may still be on its
    way."""
    if me.state in AT_WORK:
        me.floor.say(Urgency.AGAIN, LEFT_ALONE, composing.to_all(me, m.Failed(m.TaskByNumber(number))), now)
    fire(me, Trigger.LEFT_ALONE, now)
