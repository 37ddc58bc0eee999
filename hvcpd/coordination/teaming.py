"""Tasks for several robots: who claims one is joined by others, and at its place all begin together.

"I will complete task three" said by a second robot means that it does it, too; one who has it already answers
"confirmed three", and both set off. At the place each says "completing task three", tells each other one that has
said so "confirmed three", and begins once it has said that to all and has heard it from all. Who finds nobody leaves
the task for a while. Who gives up, stops, leaves or turns to something else frees the others, and the task is open
again. Each reports its own part; with the last one the task is done.
"""

from __future__ import annotations

from collections.abc import Callable, Collection
from functools import partial

from hvcpd.coordination import composing
from hvcpd.coordination.addressing import OWNER_SLOT, is_for_me_alone, objection_slot
from hvcpd.coordination.board import Entry
from hvcpd.coordination.floor import Intent, Urgency, nothing
from hvcpd.coordination.knowledge import Heard, Knowledge
from hvcpd.coordination.states import AT_WORK, PROPOSING, State, Trigger
from hvcpd.coordination.table import fire
from hvcpd.language import messages as m

AT_PLACE = frozenset({State.ANNOUNCING, State.CHECKING})
"""There, and waiting for the others."""

SLOTS = 2
"""Two who each believe that a third does it with them answer that one at the same time, but not over and over."""


def contend(me: Knowledge, heard: Heard, other: str, entry: Entry, other_at_work: bool) -> None:
    """Somebody else claims a task for several robots, or is at its place."""
    number, now = entry.definition.number, heard.now
    me.board.expire(now, me.my_tasks())
    if me.role.name in entry.half and not _is_in(
        me, number
    ):  # perhaps the others have done theirs, and nobody has heard it of all
        composing.answer(me, None, f"done {number}", composing.done(me, number), now, call=other)
    if not _is_in(me, number):
        lease_end_s = me.lease_end_s(now) if other_at_work else now + me.timing.unconfirmed_lease_s
        if other in entry.parts and not other_at_work:
            me.board.release(number)  # it begins anew
        if other_at_work and entry.parts:
            _tell_that_others_ended(me, other, entry, now)
        me.board.claim(number, other, lease_end_s, firm=other_at_work)
        entry.call_s = now
        me.reconsider(now)
        return
    is_member = other in entry.team
    if not is_member and (other in entry.parts or not entry.has_room):
        _tell(me, other, m.Negative(), number, now)
        return
    _note_answer(me, other)
    is_coming = is_member and me.state in AT_PLACE and is_for_me_alone(me, heard.to)
    if not other_at_work:
        for words in ("told", "promised", "agreed"):
            setattr(me.current, words, getattr(me.current, words) - {other})
    if other_at_work:
        me.board.claim(number, other, me.lease_end_s(now))
        if me.state in AT_PLACE or me.state is State.ACTING:
            _agree(me, other, number, now, begins=True)
        else:
            _tell(me, other, m.Claim(m.TaskByNumber(number)), number, now)  # it is coming
    elif me.state is State.ACTING and is_member:  # it has begun anew
        leave(me, number, now)
        me.board.claim(number, other, now + me.timing.unconfirmed_lease_s)
    elif not is_coming and (me.state in AT_WORK or _decides(me, entry, other)):
        me.board.claim(number, other, me.lease_end_s(now))
        _agree(me, other, number, now)


def _note_answer(me: Knowledge, other: str) -> None:
    """Somebody has answered: as long as that is news, this robot waits on. Two that hear each other again and again
    would wait for ever for a third that takes somebody else for the third."""
    if other not in me.current.agreed:
        me.current.repeats = 0


def _tell_that_others_ended(me: Knowledge, other: str, entry: Entry, now: float) -> None:
    """Somebody waits at the place who has missed that the others began."""
    number, doer = entry.definition.number, min(entry.parts)
    if me.role.name in entry.parts:
        composing.answer(me, None, f"done {number}", composing.done(me, number), now, OWNER_SLOT, call=other)
    elif other not in entry.parts:
        slot, words = objection_slot(me, other, number, now), m.Relayed(doer, composing.done(me, number))
        composing.answer(me, other, f"done {number}", words, now, slot, call=other)


def _is_in(me: Knowledge, number: int) -> bool:
    return me.current.task == number and me.state in PROPOSING | AT_WORK


def _decides(me: Knowledge, entry: Entry, other: str) -> bool:
    """Whether it is for this robot, which has claimed the task, to say that another one does it, too. Of two of whom
    each takes the other for the first, it is the one whose name comes first in the alphabet."""
    me_first = me.role.name.lower() < other.lower()
    return entry.owner == me.role.name or (entry.owner == other and me_first)


def _agree(me: Knowledge, other: str, number: int, now: float, begins: bool = False) -> None:
    """Tell another one that it does the task with this robot; or, if both are there, that this robot begins."""

    def note() -> None:
        me.current.told |= {other}
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
    """Answer another one that has spoken of the task, as long as this robot is in on it."""
    still, slot = partial(_is_in, me, number), OWNER_SLOT + int(me.rng.random() * SLOTS)
    composing.answer(me, other, f"with {other}", statement, now, slot, still=still, on_said=on_said)


def settle(me: Knowledge, now: float) -> None:
    """Set off, or begin, if all that is needed for it is said and heard."""
    if me.current.task is None or not me.board[me.current.task].is_shared:
        return
    entry = me.board[me.current.task]
    others = entry.team - {me.role.name}
    if len(others) + 1 < entry.definition.robots or not others <= me.current.told:
        return
    if me.state in (State.CLAIMING, State.PROPOSED) or (me.state in AT_PLACE and others <= me.current.agreed):
        fire(me, Trigger.CONFIRMED, now)


def confirmed(me: Knowledge, heard: Heard, number: int, complete: bool) -> bool:
    """Somebody says to this robot that it does its current task with it, or that it is `complete`; whether that is a
    task for several robots."""
    entry, now, other = me.board[number], heard.now, heard.speaker
    if not entry.is_shared or other is None or not _is_in(me, number):
        return False
    if complete and me.state in PROPOSING:
        me.board.complete(number, me.role.name)
        fire(me, Trigger.DONE_BEFORE, now)
    if complete or (other not in entry.team and not entry.has_room):
        return True
    me.board.claim(number, other, me.lease_end_s(now))
    _note_answer(me, other)
    if me.state in (State.CLAIMING, State.PROPOSED):
        if entry.owner != me.role.name or not entry.has_room:
            fire(me, Trigger.CONFIRMED, now)
    elif me.state in AT_PLACE and me.current.there:
        me.current.agreed |= {other}
        if other not in me.current.told:
            _agree(me, other, number, now, begins=True)
        settle(me, now)
    return True


def overheard(me: Knowledge, one: str, other: str, entry: Entry, now: float) -> None:
    """Two others have agreed on the task; who has claimed it, too, and is not needed, leaves it to them. Of two who
    have agreed on it with the same third, the one whose name comes first in the alphabet has it."""
    number = entry.definition.number
    is_sure = me.state is not State.GOING or other not in entry.team or me.role.name.lower() < one.lower()
    if _is_in(me, number) and me.state not in PROPOSING and is_sure:
        return
    me.board.pair(number, one, other, me.lease_end_s(now))
    if _is_in(me, number):
        if not entry.has_room:
            fire(me, Trigger.LOST, now)
        else:
            me.board.claim(number, me.role.name, me.lease_end_s(now))


def gone(me: Knowledge, name: str, number: int, now: float) -> None:
    """Somebody does not do the task after all: whoever was to do it with it is free, and the task open."""
    entry = me.board[number]
    if entry.is_shared and name in entry.team:
        if _is_in(me, number):
            leave(me, number, now)
        me.board.release(number)


def moved_on(me: Knowledge, name: str, numbers: Collection[int], now: float) -> None:
    """Somebody has claimed these tasks: it is at no other one any more."""
    number = me.current.task
    if number is None or number in numbers or not _is_in(me, number) or name not in me.board[number].team:
        return
    if me.board[number].is_shared:
        _has_ended(me, name, number, now)


def _has_ended(me: Knowledge, name: str, number: int, now: float) -> None:
    """Somebody is not at the current task any more. If this robot has told it, at the place, that it begins, it has
    done its part; but this robot may have missed its last word, and begins only now."""
    if me.state is State.ACTING or (me.state in AT_PLACE and name in me.current.promised):
        me.board.complete_part(number, name, me.lease_end_s(now))
        fire(me, Trigger.CONFIRMED, now)
    else:
        gone(me, name, number, now)


def done(me: Knowledge, doer: str, number: int, whole: bool, now: float) -> bool:
    """Somebody has done its part of a task for several robots, or knows that the `whole` task is done; whether it is
    not done yet."""
    entry = me.board[number]
    is_in = _is_in(me, number)
    if not entry.is_shared or entry.known_done or (whole and not (is_in and me.state in AT_WORK)):
        return False
    if entry.half and doer not in entry.team:
        entry.half |= {doer}
        if len(entry.half) >= entry.definition.robots:
            me.board.complete(number, doer)
            if is_in:
                fire(me, Trigger.DONE_BEFORE, now)
        return True
    if not is_in:
        return not me.board.complete_part(number, doer, me.lease_end_s(now))
    if doer in entry.team:
        _has_ended(me, doer, number, now)
    return True


def leave(me: Knowledge, number: int, now: float) -> None:
    """Nobody is there to do the task with; who had set off says so, for somebody may still be on the way."""
    if me.state in AT_WORK:
        failed = composing.to_all(me, m.Failed(m.TaskByNumber(number)))
        me.floor.want(Intent(Urgency.TURN, f"left {number}", lambda: failed), now)
    fire(me, Trigger.LEFT_ALONE, now)
