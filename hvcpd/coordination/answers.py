"""What is said of somebody's claim or report: confirmed, denied, or told with all that is left."""

from __future__ import annotations

from hvcpd.coordination import claims
from hvcpd.coordination.addressing import is_for_me_alone
from hvcpd.coordination.board import CLAIMED, DONE
from hvcpd.coordination.knowledge import Knowledge, Reactions
from hvcpd.coordination.states import PROPOSING, State, Trigger
from hvcpd.coordination.table import fire
from hvcpd.language import messages as m

LISTS_OF_ONE = 4
"""What one robot alone tells is believed after so many lists: one that has misheard it asks as often itself, and
hears of the others that it is left."""
LISTS_OF_TWO = 2
"""Where only two are, the other one can have misheard only what this robot has said itself."""


def confirmed(me: Knowledge, u: m.Utterance, s: m.Confirmed, now: float) -> None:
    if u.speaker is None or not isinstance(u.addressee, m.ToRobot):
        return
    if is_for_me_alone(me, u):
        if me.state is State.READ_BACK:
            if u.speaker == me.current.partner or me.current.partner is None:
                fire(me, Trigger.CONFIRMED_MOTION if me.current.motion is not None else Trigger.CONFIRMED, now)
        elif me.current.partner is not None:
            if u.speaker == me.current.partner:
                _be_confirmed(me, now)
        elif s.task is not None and s.task.number == (me.report.task if me.current.task is None else me.current.task):
            _be_confirmed(me, now)
        return
    entry = me.board.find(s.task) if s.task is not None else None
    if entry is None:
        return
    if me.current.task == entry.definition.number:
        if s.complete and not claims.doubts(me, u.addressee.name, me.current.task, False, now):
            claims.note_done(me, u.addressee.name, me.current.task, now)
        return
    if entry.known_done and entry.owner != u.addressee.name and not s.complete:
        # its claim was not heard here, or this robot's objection there
        claims.tell_done(me, u.addressee.name, entry, now)
    if s.complete:
        claims.note_done(me, u.addressee.name, entry.definition.number, now)
        me.reconsider(now)
    if entry.state == DONE:
        return
    given_away = entry.owner == u.speaker
    if given_away or entry.owner == u.addressee.name or not entry.firm or now >= entry.lease_end_s:
        me.board.claim(entry.definition.number, u.addressee.name, me.lease_end_s(now))
        entry.times_heard += 1
        claims.note_moved_on(me, u.addressee.name, entry.definition.number)


def _be_confirmed(me: Knowledge, now: float) -> None:
    """What was last said of a task was heard; a report that is still to be said is not meant, unless it was said in
    answer to somebody's claim."""
    if me.state is State.REPORTING and me.current.repeats == 0 and not me.report.said:
        return
    me.lease.assured_s = me.lease_end_s(me.lease.claimed_s)
    if me.report.said:
        me.report.task = None
    if me.current.task is not None or me.state is not State.CLAIMING:  # a claim still to be chosen is not meant either
        fire(me, Trigger.CONFIRMED, now)


def negative(me: Knowledge, u: m.Utterance, _s: m.Negative, now: float) -> None:
    if u.speaker is None or not isinstance(u.addressee, m.ToRobot):
        return
    if is_for_me_alone(me, u):
        if me.current.partner is None:
            if me.current.task is not None and me.state in PROPOSING:
                fire(me, Trigger.DENIED, now)
        elif u.speaker == me.current.partner:
            fire(me, Trigger.DENIED, now)
        return
    last = me.overheard.claim
    if last is not None and last.speaker == u.addressee.name and now - last.at_s < me.timing.recent_s:
        me.board.restore(last.number, last.before)


def left(me: Knowledge, u: m.Utterance, s: m.Left, now: float) -> None:
    """Somebody told which tasks are not done: a complete list tells of the others, by hearsay, that they are.

    Two that tell so are believed, neither of which has it from the other, or one that tells it over and over.
    """
    me.floor.withdraw("left")
    for number in s.numbers:
        entry = me.board.find(m.TaskByNumber(number))
        if entry is not None and entry.state == DONE and entry.hearsay:
            me.board.reopen(number)
        elif entry is not None and entry.known_done and entry.owner is not None and u.speaker is not None:
            claims.tell_done(me, u.speaker, entry, now)  # else those who know of more than fits in a list ask for ever
    if not s.more:
        for entry in me.board.entries():
            number = entry.definition.number
            lapsed = entry.state != CLAIMED or now >= entry.lease_end_s or entry.owner in (None, u.speaker)
            if number in s.numbers or me.current.task == number or entry.known_done or entry.is_due:
                continue
            if entry.state == DONE:
                entry.times_told += 1
                lists = LISTS_OF_ONE if len(me.peers.present(now)) > 1 else LISTS_OF_TWO
                if entry.told_by != u.speaker or entry.times_told >= lists:
                    me.board.complete(number, entry.owner)
            elif lapsed:
                if entry.owner == me.role.name:
                    me.board.release(number)  # whoever has done it, this robot knows that it was not itself
                me.board.complete(number, None, hearsay=True, told_by=u.speaker)
    fire(me, Trigger.ANSWERED, now)
    me.reconsider(now)


REACTIONS: Reactions = {m.Left: left, m.Confirmed: confirmed, m.Negative: negative}
