"""Orders, stop, resume, motions and questions: the requests that a person or another robot may make of this robot.

An order is read back, confirmed or corrected, or refused with the reason.

A "stop" that is meant for many also reaches robots out of its speaker's earshot. Each robot that halts says "stop" at
once, over any other speech, and so it travels from one robot to the next. No word is added to it, because each word
costs a third of a second from robot to robot. The robot repeats it once for robots that missed it. All that heard the
same call say it together. A robot that already stands does not say it again, however often it hears it, so the
repetition ends. "Resume" is never passed on.
"""

from __future__ import annotations

from collections.abc import Callable

from hvcpd.coordination import composing, halting
from hvcpd.coordination.addressing import is_for, is_for_me_alone
from hvcpd.coordination.choosing import in_name_conflict
from hvcpd.coordination.entry import Entry
from hvcpd.coordination.floor import Intent, Urgency
from hvcpd.coordination.knowledge import Current, Heard, Knowledge, Reaction, Reactions
from hvcpd.coordination.states import AT_WORK, NEWCOMER, State, Trigger
from hvcpd.coordination.table import fire, states_with
from hvcpd.language import messages as m

SURE = 0.95
"""Confidence from which an order that moves wheels is obeyed as soon as it is read back; below it, only once the
read-back is confirmed; see docs/protocol.md."""
SAID_AGAIN_S = 30.0
"""An uncertain "resume" counts if it is heard again within this time: chance speech does not give two."""
MOVABLE = states_with(Trigger.MOTION)
"""In the middle of a task a robot takes no motions; it can be stopped at any time."""
FREE = states_with(Trigger.ORDER)
"""States in which a robot can take an order. Not while its own claim is unsettled: it would have to take it back."""


def order(me: Knowledge, heard: Heard, s: m.Order) -> None:
    name, entry = heard.name, me.board.find(s.task)
    if not is_for_me_alone(me, heard.to):
        return
    number = entry.number if entry is not None else None
    same = entry is not None and me.current.task == number and me.is_partner(name)
    if entry is not None and entry.known_done and not asks_anew(me, name, entry):
        reply: m.Statement | None = composing.closed(me, entry.number)
    elif same and me.state in AT_WORK and (entry is None or not entry.is_shared or me.state is State.GOING):
        reply = m.Claim(s.task)  # the read-back was lost; at the place, a partner would take it for a beginning
    elif same and me.state is State.READING_BACK:
        return
    else:
        reply = _refusal(me, s.task, entry, heard.now)
    if reply is not None:
        _answer(me, name, reply, heard.now)
        return
    me.current = Current(number, task_ref=s.task, partner=name, repeats=me.current.repeats if same else 0)
    fire(me, Trigger.ORDER, heard.now)


def asks_anew(me: Knowledge, name: str, entry: Entry) -> bool:
    """Whether this speaker's order is a request to do a task that waits for one. Not if the speaker may have missed
    this robot's report; nor if it may be a coordinator, which orders what it takes for open, and may have missed any
    report. Robots that volunteer name their team, and people do not; where a coordinator gives orders, people are known
    by not being one of the robots."""
    if not entry.waits or entry.number in me.report.tasks:
        return False
    if entry.definition.on_demand and entry.change == 1:
        return True  # nobody has asked for it yet: there is nothing to have missed
    if me.role.volunteer:
        peer = me.peers.get(name)
        return peer is None or peer.team is None
    return bool(me.roster) and name.lower() not in me.roster


def _refusal(me: Knowledge, task: m.TaskRef, entry: Entry | None, now: float) -> m.Statement | None:
    """The spoken reason why an order for a task is refused; None if the robot can take it."""
    if in_name_conflict(me, now):
        return m.NameTaken()
    if entry is None:
        return not_known(task)
    has_failed = me.role.name in entry.failed_by and not entry.known_done  # another request is another attempt
    if me.role.coordinator or has_failed or entry.number in me.role.unable:
        return m.Unable(task)
    if me.state is State.STOPPED:
        return m.Stopped()
    has_others = len(entry.team) == entry.definition.robots > 1 and me.role.name not in entry.team
    return None if me.state in FREE and not has_others else m.Busy()


def not_known(task: m.TaskRef) -> m.Unknown | m.Unable:
    """That this robot has no such task. One that it can name is listed as a task that others may speak of."""
    return m.Unknown(task) if isinstance(task, m.TaskByNumber) else m.Unable(task)


def _answer(me: Knowledge, name: str | None, statement: m.Statement, now: float) -> None:
    """Answer a request, unless that is no longer so when its turn comes. After "resume" others would take "I have
    stopped" for another stop, and whoever hears "I am busy" late does not ask again."""

    def still() -> bool:
        is_over = isinstance(statement, m.Stopped) and not me.latched
        return not is_over and not (isinstance(statement, m.Busy) and me.state in FREE)

    composing.answer(me, name, composing.answer_topic(name), statement, now, still=still)


def answers_order(me: Knowledge, heard: Heard) -> bool:
    """Whether a sentence answers this robot's order, even after the time for an answer: in noise a sentence is
    understood later than its voice seems to end."""
    ordered = me.state is State.ORDERED or (me.state is State.ORDERING and me.current.repeats > 0)
    return ordered and heard.speaker == me.current.partner and is_for_me_alone(me, heard.to)


def _order_ends(trigger: Trigger) -> Reaction:
    """A reaction to an answer that ends this robot's order."""

    def reaction(me: Knowledge, heard: Heard, _: m.Statement) -> None:
        if answers_order(me, heard):
            fire(me, trigger, heard.now)

    return reaction


def stop(me: Knowledge, heard: Heard, _: m.Stop) -> None:
    """Halt, and make sure that all for whom it was meant do."""
    now, to = heard.now, heard.to
    halting.withdraw_resumes(me)
    if not is_for(me, to):
        return
    halting.refuse_to_resume(me, heard.said_s)
    if me.latched:
        return
    fire(me, Trigger.STOP, now)
    if me.state is not State.GONE and not isinstance(to, m.ToRobot):
        halting.call(me, "stop", m.Utterance(None, to, None, m.Stop()), now)


def _resume(me: Knowledge, heard: Heard, _: m.Resume) -> None:
    """Nothing else ends a stop, so a sentence that only sounds like it must not: it is heard surely, or twice. What was
    said before the stop does not end it, though it may be understood only now."""
    if not is_for(me, heard.to) or heard.said_s < me.repair.stop_s:
        return
    before_s, me.repair.resume_s = me.repair.resume_s, heard.now
    if heard.confidence >= SURE or heard.now - before_s <= SAID_AGAIN_S:
        fire(me, Trigger.RESUME, heard.now)


def _move(me: Knowledge, heard: Heard, s: m.Motion) -> None:
    """A motion moves one robot: the one addressed, or, if that is nobody in particular, the only one there."""
    name, now = heard.speaker, heard.now
    others = me.expected(now) if now < me.acquaintance.all_heard_s else me.peers.present(now)
    is_alone = set(others) <= {heard.name.lower()}
    if not is_for_me_alone(me, heard.to) and not (is_alone and isinstance(heard.to, m.ToAll | None)):
        return
    same = me.current.motion == s
    refusal: m.Statement | None = None
    if in_name_conflict(me, now):
        refusal = m.NameTaken()
    elif me.state is State.STOPPED:
        refusal = m.Stopped()
    elif me.state not in MOVABLE and not (me.state is State.READING_BACK and same):
        refusal = m.Busy()
    if refusal is not None:
        _answer(me, name, refusal, now)
    elif me.state is not State.READING_BACK:
        me.current = Current(motion=s, motion_sure=heard.confidence >= SURE, partner=name)
        fire(me, Trigger.MOTION, now)


def _answering(topic: str, tell: Callable[[Knowledge, str | None], m.Utterance]) -> Reaction:
    """A reaction in which all robots that are asked answer: at once if asked alone, else in turn."""

    def reaction(me: Knowledge, heard: Heard, _: m.Statement) -> None:
        if is_for(me, heard.to):
            slot = 0 if is_for_me_alone(me, heard.to) else me.rank(heard.name, 0, heard.now)
            me.floor.want(Intent(Urgency.ANSWER, topic, lambda: tell(me, heard.speaker), slot=slot), heard.now)

    return reaction


def _what_left(me: Knowledge, heard: Heard, _: m.WhatLeft) -> None:
    """One robot answers for all: if the asker asks again, another one, because it believes two rather than one."""
    alone, asker = is_for_me_alone(me, heard.to), heard.speaker
    if not is_for(me, heard.to) or (me.state in NEWCOMER and not alone):
        return
    peer = me.peers.get(asker)
    told = peer is not None and peer.told
    slot = 0 if alone else me.rank(heard.name, 0, heard.now) + told * len(me.peers.present(heard.now))
    if peer is not None:
        peer.assigned = None  # a robot that asks for the remaining tasks no longer has an order

    def on_said() -> None:
        if peer is not None:
            peer.told = True

    call = heard.name.lower()
    answer = Intent(Urgency.ANSWER, "left", lambda: composing.left(me, asker), slot=slot, call=call, on_said=on_said)
    me.floor.want(answer, heard.now)


REACTIONS: Reactions = {
    m.Unable: _order_ends(Trigger.REFUSED),
    m.Busy: _order_ends(Trigger.GAVE_UP),  # it is not asked again for a while
    m.Distrusted: _order_ends(Trigger.GAVE_UP),
    m.Stop: stop,
    m.Resume: _resume,
    m.ComeBack: _move,
    m.MoveBy: _move,
    m.TurnBy: _move,
    m.WhatDoing: _answering("doing", composing.occupation),
    m.ReportWanted: _answering("report", composing.shift_report),
    m.WhatLeft: _what_left,
}
