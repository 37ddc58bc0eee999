"""Orders between robots, and from people: read back, confirmed or corrected, refused with the reason."""

from __future__ import annotations

from hvcpd.coordination import composing
from hvcpd.coordination.addressing import is_for_me_alone
from hvcpd.coordination.choosing import in_name_conflict
from hvcpd.coordination.knowledge import Knowledge, Reactions
from hvcpd.coordination.states import AT_WORK, State, Trigger
from hvcpd.coordination.table import fire, states_with
from hvcpd.language import messages as m

FREE = states_with(Trigger.ORDER)
"""Who can take an order. Not while a claim of its own is unsettled: it would have to be taken back."""


def order(me: Knowledge, u: m.Utterance, s: m.Order, now: float) -> None:
    if u.speaker is None or not is_for_me_alone(me, u):
        return
    name, entry = u.speaker, me.board.find(s.task)
    if entry is not None and entry.known_done:
        composing.answer(me, name, f"answer {name}", m.Completed(m.TaskByNumber(entry.definition.number)), now)
        return
    same = entry is not None and me.current.task == entry.definition.number and me.current.partner == name
    if same and me.state in AT_WORK:  # it did not hear the read-back
        composing.answer(me, name, f"answer {name}", m.Claim(s.task), now)
        return
    if same and me.state is State.READING_BACK:
        return
    refusal = refusal_of(me, s.task, now)
    if refusal is not None or entry is None:
        composing.answer(me, name, f"answer {name}", refusal or m.Unable(s.task), now)
        return
    if not same:
        me.current.repeats = 0
    me.current.partner, me.current.motion = name, None
    me.current.task, me.current.task_ref = entry.definition.number, s.task
    fire(me, Trigger.ORDER, now)


def refusal_of(me: Knowledge, task: m.TaskRef, now: float) -> m.Statement | None:
    """Why an order for a task cannot be taken, as it is said; None if it can."""
    if in_name_conflict(me, now):
        return m.NameTaken()
    entry = me.board.find(task)
    if entry is None:
        return m.Unknown(task) if isinstance(task, m.TaskByNumber) else m.Unable(task)
    number = entry.definition.number
    if me.role.coordinator or me.role.name in entry.failed_by or number in me.role.unable:
        return m.Unable(task)
    if me.state is State.STOPPED:
        return m.Stopped()
    return None if me.state in FREE else m.Busy()


def answers_order(me: Knowledge, u: m.Utterance) -> bool:
    """Whether somebody answers this robot's order, be it after the time for that: in noise a sentence is understood
    later than its voice seems to end."""
    ordered = me.state is State.ORDERED or (me.state is State.ORDERING and me.current.repeats > 0)
    return ordered and u.speaker == me.current.partner and is_for_me_alone(me, u)


def unable(me: Knowledge, u: m.Utterance, _s: m.Unable | m.Unknown, now: float) -> None:
    if answers_order(me, u):
        fire(me, Trigger.REFUSED, now)


def busy(me: Knowledge, u: m.Utterance, _s: m.Busy, now: float) -> None:
    if me.state is State.ORDERED and u.speaker == me.current.partner and is_for_me_alone(me, u):
        fire(me, Trigger.GAVE_UP, now)


REACTIONS: Reactions = {m.Order: order, m.Unable: unable, m.Unknown: unable, m.Busy: busy}
