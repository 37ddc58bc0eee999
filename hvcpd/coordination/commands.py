"""Stop, resume, motions and questions: what a person or another robot may ask of this robot.

A "stop" that is meant for many reaches those who are out of earshot of its speaker. Each robot that halts says so. A
robot that has not heard all others say it, says "stop" once itself, in its own name: so each robot that hears one is
heard in turn, across a team that hears itself only from one to the next. A robot that stands says it no more, however
often it hears it, so that the talk ends; and nobody's "resume" is passed on.

Only what was understood as a sentence is passed on. A word spotted under other talk halts whoever heard it, for a halt
too many is cheap; it is not sure enough to halt those who heard nothing.
"""

from __future__ import annotations

from hvcpd.coordination import composing
from hvcpd.coordination.addressing import is_for, is_for_me_alone
from hvcpd.coordination.choosing import in_name_conflict
from hvcpd.coordination.floor import RANK_MAX, Urgency
from hvcpd.coordination.knowledge import Knowledge, Reactions
from hvcpd.coordination.states import NEWCOMER, State, Trigger
from hvcpd.coordination.table import fire, states_with
from hvcpd.language import messages as m

SURE = 0.95
"""Confidence from which an order that moves wheels is obeyed as soon as it is read back; below, only once the
read-back is confirmed. The recogniser reports sentences from 0.8; see docs/protocol.md."""
SAID_AGAIN_S = 30.0
"""A "resume" that was not heard surely counts if it is heard again within this time: nobody's talk gives two."""
MOVABLE = states_with(Trigger.MOTION)
"""In the midst of a task a robot is not sent about; it can be stopped at any time."""
SOMEBODY = ""
"""The call of who asks without a name."""

Command = m.Stop | m.Resume | m.ComeBack | m.MoveBy | m.TurnBy


def obey(me: Knowledge, u: m.Utterance, command: Command, confidence: float, now: float) -> None:
    """Do what was commanded, as far as it was meant for this robot and surely heard."""
    match command:
        case m.Stop():
            _stop(me, u, confidence, now)
        case m.Resume():
            _resume(me, u, confidence, now)
        case _:
            _move(me, u, command, confidence, now)


def _stop(me: Knowledge, u: m.Utterance, confidence: float, now: float) -> None:
    """Halt, and see to it that all for whom it was meant do."""
    note_halted(me, u.speaker, now)
    if not is_for(me, u) or _stands(me):
        return
    fire(me, Trigger.STOP, now)
    if not _stands(me) or confidence < SURE or isinstance(u.addressee, m.ToRobot):
        return
    again = composing.utterance(me, u.addressee or m.ToAll(), m.Stop())
    slot = min(len(me.peers.present(now)), RANK_MAX) + 1 + me.rank("", 0, now)  # after all who say that they halted
    me.want(
        Urgency.ALARM, "stop", lambda: again if _stands(me) and _somebody_goes_on(me, u, now) else None, now, slot=slot
    )


def _stands(me: Knowledge) -> bool:
    return me.state is State.STOPPED


def note_halted(me: Knowledge, name: str | None, now: float) -> None:
    """Somebody said that it stands, or that all are to stand, itself among them."""
    peer = me.peers.get(name)
    if peer is not None:
        peer.halted_s = now


def _somebody_goes_on(me: Knowledge, u: m.Utterance, since_s: float) -> bool:
    """Whether one who may be meant, and is believed to be there, has not been heard to halt since then.

    It may be a person, who need not: once too often is better than not at all.
    """
    teams = (None, u.addressee.team) if isinstance(u.addressee, m.ToTeam) else None
    meant = [peer for peer in me.peers.all() if teams is None or peer.team in teams]
    return any(me.peers.is_present(peer.name, since_s) and peer.halted_s < since_s for peer in meant)


def _resume(me: Knowledge, u: m.Utterance, confidence: float, now: float) -> None:
    """Nothing but this ends a stop, so what only sounded like it must not: it is heard surely, or twice."""
    if not is_for(me, u):
        return
    heard_s, me.repair.resume_s = me.repair.resume_s, now
    if confidence >= SURE or now - heard_s <= SAID_AGAIN_S:
        fire(me, Trigger.RESUME, now)


def _move(me: Knowledge, u: m.Utterance, s: m.Motion, confidence: float, now: float) -> None:
    """A motion moves one robot: the one addressed, or, by a call to nobody, the only one there."""
    alone_with = all(name == (u.speaker or "").lower() for name in me.peers.present(now))
    if not is_for_me_alone(me, u) and (u.addressee is not None or not alone_with):
        return
    refusal: m.Statement | None = None
    if in_name_conflict(me, now):
        refusal = m.NameTaken()
    elif me.state is State.STOPPED:
        refusal = m.Stopped()
    elif me.state not in MOVABLE and not (me.state is State.READING_BACK and me.current.motion == s):
        refusal = m.Busy()
    if refusal is not None:
        composing.answer(me, u.speaker, f"answer {u.speaker}", refusal, now)
        return
    if me.state is State.READING_BACK:
        return
    heard_twice = me.state is State.READ_BACK and me.current.motion == s
    me.current.partner, me.current.task, me.current.task_ref, me.current.motion = u.speaker, None, None, s
    me.current.motion_sure = confidence >= SURE or heard_twice
    me.current.repeats = 0
    fire(me, Trigger.MOTION, now)


def _answering_slot(me: Knowledge, u: m.Utterance, now: float) -> int:
    """At once if only this robot was asked, else in turn."""
    return 0 if is_for_me_alone(me, u) else me.rank(u.speaker or SOMEBODY, 0, now)


def _what_doing(me: Knowledge, u: m.Utterance, _s: m.WhatDoing, now: float) -> None:
    """Everybody who is asked tells, one after the other."""
    if is_for(me, u):
        slot = _answering_slot(me, u, now)
        me.want(Urgency.ANSWER, "doing", lambda: composing.occupation(me, u.speaker), now, slot=slot)


def _report_wanted(me: Knowledge, u: m.Utterance, _s: m.ReportWanted, now: float) -> None:
    """Everybody who is asked reports, one after the other."""
    if is_for(me, u):
        slot = _answering_slot(me, u, now)
        me.want(Urgency.ANSWER, "report", lambda: composing.shift_report(me, u.speaker), now, slot=slot)


def _what_left(me: Knowledge, u: m.Utterance, _s: m.WhatLeft, now: float) -> None:
    """One answers for all."""
    if not is_for(me, u) or (me.state in NEWCOMER and not is_for_me_alone(me, u)):
        return
    asker = me.peers.get(u.speaker)
    if asker is not None:
        asker.assigned = None  # who asks has no order, or no longer
    slot, call = _answering_slot(me, u, now), (u.speaker or SOMEBODY).lower()
    me.want(Urgency.ANSWER, "left", lambda: composing.left(me, u.speaker), now, slot=slot, call=call)


REACTIONS: Reactions = {m.WhatDoing: _what_doing, m.WhatLeft: _what_left, m.ReportWanted: _report_wanted}
