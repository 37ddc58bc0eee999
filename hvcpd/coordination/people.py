"""People ask, and move robots about; robots may do so too."""

from __future__ import annotations

from hvcpd.coordination import composing
from hvcpd.coordination.addressing import is_for, is_for_me_alone
from hvcpd.coordination.choosing import in_name_conflict
from hvcpd.coordination.floor import Urgency
from hvcpd.coordination.knowledge import Knowledge, Reactions
from hvcpd.coordination.states import NEWCOMER, State, Trigger
from hvcpd.coordination.table import fire
from hvcpd.language import messages as m

SURE = 0.95
"""Confidence from which an order that moves wheels is obeyed as soon as it is read back; below, only once the
read-back is confirmed. The recogniser reports sentences from 0.8; see docs/protocol.md."""
SAID_AGAIN_S = 30.0
"""A "resume" that was not heard surely counts if it is heard again within this time: nobody's talk gives two."""
MOVABLE = frozenset(
    {
        State.READY,
        State.MEETING,
        State.CLAIMING,
        State.READ_BACK,
        State.REPORTED,
        State.MOVING,
        State.RETURNING,
    }
)
"""In the midst of a task a robot is not sent about; it can be stopped at any time."""
SOMEBODY = ""
"""The call of who asks without a name."""


def what_doing(me: Knowledge, u: m.Utterance, _s: m.WhatDoing, now: float) -> None:
    """Everybody who is asked tells, one after the other."""
    if not is_for(me, u):
        return
    name = u.speaker
    slot = 0 if is_for_me_alone(me, u) else me.rank(name or SOMEBODY, 0, now)
    me.want(Urgency.ANSWER, "doing", lambda: composing.occupation(me, name), now, slot=slot)


def what_left(me: Knowledge, u: m.Utterance, _s: m.WhatLeft, now: float) -> None:
    """One answers for all."""
    if not is_for(me, u) or (me.state in NEWCOMER and not is_for_me_alone(me, u)):
        return
    name = u.speaker
    asker = me.peers.get(name) if name else None
    if asker is not None:
        asker.assigned = None  # who asks has no order, or no longer
    slot = 0 if is_for_me_alone(me, u) else me.rank(name or SOMEBODY, 0, now)
    call = (name or SOMEBODY).lower()
    me.want(Urgency.ANSWER, "left", lambda: composing.left(me, name), now, slot=slot, call=call)


def report_wanted(me: Knowledge, u: m.Utterance, _s: m.ReportWanted, now: float) -> None:
    """Everybody who is asked reports, one after the other."""
    if not is_for(me, u):
        return
    name = u.speaker
    slot = 0 if is_for_me_alone(me, u) else me.rank(name or SOMEBODY, 0, now)
    me.want(Urgency.ANSWER, "report", lambda: composing.shift_report(me, name), now, slot=slot)


def motion(me: Knowledge, u: m.Utterance, s: m.Motion, confidence: float, now: float) -> None:
    """A motion moves one robot: the one addressed, or, by a call to nobody, the only one there."""
    for_me = is_for_me_alone(me, u) or (u.addressee is None and _alone_with(me, u.speaker, now))
    if not for_me:
        return
    name = u.speaker
    refusal: m.Statement | None = None
    if in_name_conflict(me, now):
        refusal = m.NameTaken()
    elif me.state is State.STOPPED:
        refusal = m.Stopped()
    elif me.state not in MOVABLE and not (me.state is State.READING_BACK and me.current.motion == s):
        refusal = m.Busy()
    if refusal is not None:
        said = composing.to_asker(me, name, refusal)
        me.want(Urgency.ANSWER, f"answer {name}", lambda: said, now)
        return
    if me.state is State.READING_BACK:
        return
    heard_twice = me.state is State.READ_BACK and me.current.motion == s
    me.current.partner, me.current.task, me.current.task_ref, me.current.motion = name, None, None, s
    me.current.motion_sure = confidence >= SURE or heard_twice
    me.current.repeats = 0
    fire(me, Trigger.MOTION, now)


def resume(me: Knowledge, u: m.Utterance, confidence: float, now: float) -> None:
    """Nothing but this ends a stop, so what only sounded like it must not: it is heard surely, or twice."""
    if not is_for(me, u):
        return
    heard_s, me.repair.resume_s = me.repair.resume_s, now
    if confidence >= SURE or now - heard_s <= SAID_AGAIN_S:
        fire(me, Trigger.RESUME, now)


def _alone_with(me: Knowledge, speaker: str | None, now: float) -> bool:
    return all(name == (speaker or "").lower() for name in me.peers.present(now))


REACTIONS: Reactions = {m.WhatDoing: what_doing, m.WhatLeft: what_left, m.ReportWanted: report_wanted}
