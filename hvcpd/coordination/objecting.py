"""Objections: a robot that knows better says so before anybody may confirm a claim, or upon a wrong confirmation."""

from __future__ import annotations

from hvcpd.coordination import composing
from hvcpd.coordination.addressing import OWNER_SLOT, objection_slot
from hvcpd.coordination.conversation import QuotedReport
from hvcpd.coordination.entry import CLAIMED, Entry
from hvcpd.coordination.floor import Intent, Urgency
from hvcpd.coordination.knowledge import Knowledge
from hvcpd.language import messages as m


def is_of_third(me: Knowledge, entry: Entry, other: str, now: float) -> bool:
    """Whether neither this robot nor `other` has the task, but a third one, which this robot may never have heard."""
    third = entry.owner if entry.state == CLAIMED and now < entry.lease_end_s else None
    return third is not None and third not in (other, me.role.name)


def deny_for_third(me: Knowledge, other: str, entry: Entry, now: float) -> None:
    """Object to a claim, or to its confirmation, if another robot surely has the task."""
    number = entry.number
    if entry.firm and is_of_third(me, entry, other, now):
        deny(me, other, number, entry.owner, objection_slot(me, other, number, now), now)


def deny(me: Knowledge, other: str, number: int, owner: str | None, slot: int, now: float) -> None:
    """Object for another robot, if that robot still has the task, or may have done it, when this robot's turn comes."""
    topic = f"deny {number}"
    composing.answer(
        me, other, topic, m.Negative(), now, slot, call=other, still=lambda: me.board[number].owner == owner
    )


def say_it_is_mine(me: Knowledge, other: str, number: int, now: float) -> None:
    """Object as the robot that has the task, or that has just done it when its turn comes."""
    entry, ref = me.board[number], m.TaskByNumber(number)

    def compose() -> m.Utterance | None:
        if number in me.my_tasks():
            return composing.to_asker(me, other, m.Working(ref) if me.is_at(number) else m.Claim(ref))
        has_done_it = entry.known_done and entry.owner == me.role.name
        return composing.to_all(me, composing.done(me, number)) if has_done_it else None

    me.floor.want(Intent(Urgency.ANSWER, f"mine {number}", compose, slot=OWNER_SLOT), now)


def tell_done(me: Knowledge, other: str, entry: Entry, now: float) -> None:
    """A robot missed that the task is done: the robot that did it says so at once, or another one if that one does not.
    A robot that neither did the task nor knows which robot did never says that it is done."""
    number, doer = entry.number, entry.owner
    statement: m.Statement = composing.closed(me, number)
    to, slot = None, OWNER_SLOT
    if entry.skipped:
        to = other
    elif doer != me.role.name or entry.is_shared:
        to, slot = other, objection_slot(me, other, number, now)
        statement = m.Relayed(doer, statement) if doer is not None else m.Negative()
        if entry.is_shared:
            statement = m.Confirmed(m.TaskByNumber(number), complete=True)
        elif doer is not None:
            me.report_quoted = QuotedReport(doer, number, now)
    topic = f"done {number}"
    composing.answer(me, to, topic, statement, now, slot, call=other, still=lambda: entry.known_done)
