"""Orders between robots, and from people: read back, confirmed or corrected, refused with the reason."""

from __future__ import annotations

from typing import TYPE_CHECKING

from hvcpd.coordination import composing
from hvcpd.coordination.addressing import is_for_me_alone
from hvcpd.coordination.choosing import in_name_conflict
from hvcpd.coordination.floor import Urgency
from hvcpd.coordination.table import AT_WORK, State, Trigger
from hvcpd.language import messages as m

if TYPE_CHECKING:
    from hvcpd.coordination.coordination import Coordination

FREE = frozenset(
    {
        State.READY,
        State.MEETING,
        State.ASKING,
        State.ASKED,
        State.CLAIMING,
        State.READ_BACK,
        State.REPORTED,
        State.RETURNING,
    }
)
"""Who can take an order. Not while a claim of its own is unsettled: it would have to be taken back."""


def order(c: Coordination, u: m.Utterance, s: m.Order, now: float) -> None:
    if u.speaker is None or not is_for_me_alone(c, u):
        return
    name, entry = u.speaker, c.board.find(s.task)
    if entry is not None and entry.known_done:
        number = m.TaskByNumber(entry.definition.number)
        _answer(c, name, m.Completed(number), now)
        return
    same = entry is not None and c.task == entry.definition.number and c.partner == name
    if same and c.state in AT_WORK:  # it did not hear the read-back
        _answer(c, name, m.Claim(s.task), now)
        return
    if same and c.state is State.READING_BACK:
        return
    refusal = refusal_of(c, s.task, now)
    if refusal is not None or entry is None:
        _answer(c, name, refusal or m.Unable(s.task), now)
        return
    if not same:
        c.repeats = 0
    c.partner, c.task, c.task_ref, c.motion = name, entry.definition.number, s.task, None
    c.fire(Trigger.ORDER, now)


def refusal_of(c: Coordination, task: m.TaskRef, now: float) -> m.Statement | None:
    """Why an order for a task cannot be taken, as it is said; None if it can."""
    if in_name_conflict(c, now):
        return m.NameTaken()
    entry = c.board.find(task)
    if entry is None:
        return m.Unknown(task) if isinstance(task, m.TaskByNumber) else m.Unable(task)
    number = entry.definition.number
    if c.role.coordinator or c.role.name in entry.failed_by or number in c.role.unable:
        return m.Unable(task)
    if c.state is State.STOPPED:
        return m.Stopped()
    return None if c.state in FREE else m.Busy()


def _answer(c: Coordination, name: str, statement: m.Statement, now: float) -> None:
    said = composing.to_robot(c, name, statement)
    c.want(Urgency.ANSWER, f"answer {name}", lambda: said, now)


def answers_order(c: Coordination, u: m.Utterance) -> bool:
    """Whether somebody answers this robot's order, be it after the time for that: in noise a sentence is understood
    later than its voice seems to end."""
    ordered = c.state is State.ORDERED or (c.state is State.ORDERING and c.repeats > 0)
    return ordered and u.speaker == c.partner and is_for_me_alone(c, u)


def unable(c: Coordination, u: m.Utterance, _s: m.Unable | m.Unknown, now: float) -> None:
    if answers_order(c, u):
        c.fire(Trigger.REFUSED, now)


def busy(c: Coordination, u: m.Utterance, _s: m.Busy, now: float) -> None:
    if c.state is State.ORDERED and u.speaker == c.partner and is_for_me_alone(c, u):
        c.fire(Trigger.GAVE_UP, now)
