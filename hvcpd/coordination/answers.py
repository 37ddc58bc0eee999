"""What is said of somebody's claim or report: confirmed, denied, or told with all that is left."""

from __future__ import annotations

from typing import TYPE_CHECKING

from hvcpd.coordination import claims
from hvcpd.coordination.addressing import is_for_me_alone
from hvcpd.coordination.board import CLAIMED, DONE
from hvcpd.coordination.table import PROPOSING, State, Trigger
from hvcpd.language import messages as m

if TYPE_CHECKING:
    from hvcpd.coordination.coordination import Coordination

LISTS_OF_ONE = 4
"""What one robot alone tells is believed after so many lists: one that has misheard it asks as often itself, and
hears of the others that it is left."""
LISTS_OF_TWO = 2
"""Where only two are, the other one can have misheard only what this robot has said itself."""


def confirmed(c: Coordination, u: m.Utterance, s: m.Confirmed, now: float) -> None:
    if u.speaker is None or not isinstance(u.addressee, m.ToRobot):
        return
    if is_for_me_alone(c, u):
        if c.state is State.READ_BACK:
            if u.speaker == c.partner or c.partner is None:
                c.fire(Trigger.CONFIRMED_MOTION if c.motion is not None else Trigger.CONFIRMED, now)
        elif c.partner is not None:
            if u.speaker == c.partner:
                _be_confirmed(c, now)
        elif s.task is not None and s.task.number == (c.unreported if c.task is None else c.task):
            _be_confirmed(c, now)
        return
    entry = c.board.find(s.task) if s.task is not None else None
    if entry is None:
        return
    if c.task == entry.definition.number:
        if s.complete and not claims.doubts(c, u.addressee.name, c.task, False, now):
            claims.note_done(c, u.addressee.name, c.task, now)
        return
    if entry.known_done and entry.owner != u.addressee.name and not s.complete:
        claims.tell_done(
            c, u.addressee.name, entry, now
        )  # its claim was not heard here, or this robot's objection there
    if s.complete:
        claims.note_done(c, u.addressee.name, entry.definition.number, now)
        c.reconsider(now)
    if entry.state == DONE:
        return
    given_away = entry.owner == u.speaker
    if given_away or entry.owner == u.addressee.name or not entry.firm or now >= entry.lease_end_s:
        c.board.claim(entry.definition.number, u.addressee.name, c.lease_end_s(now))
        entry.times_heard += 1
        claims.note_moved_on(c, u.addressee.name, entry.definition.number)


def _be_confirmed(c: Coordination, now: float) -> None:
    """What was last said of a task was heard; a report that is still to be said is not meant, unless it was said in
    answer to somebody's claim."""
    if c.state is State.REPORTING and c.repeats == 0 and not c.told_report:
        return
    c.assured_s = c.lease_end_s(c.claimed_s)
    if c.told_report:
        c.unreported = None
    if c.task is not None or c.state is not State.CLAIMING:  # a claim that is still to be chosen is not meant either
        c.fire(Trigger.CONFIRMED, now)


def negative(c: Coordination, u: m.Utterance, _s: m.Negative, now: float) -> None:
    if u.speaker is None or not isinstance(u.addressee, m.ToRobot):
        return
    if is_for_me_alone(c, u):
        if c.partner is None:
            if c.task is not None and c.state in PROPOSING:
                c.fire(Trigger.DENIED, now)
        elif u.speaker == c.partner:
            c.fire(Trigger.DENIED, now)
        return
    last = c.heard_claim
    if last is not None and last.speaker == u.addressee.name and now - last.at_s < c.timing.recent_s:
        c.board.restore(last.number, last.before)


def left(c: Coordination, u: m.Utterance, s: m.Left, now: float) -> None:
    """Somebody told which tasks are not done: a complete list tells of the others, by hearsay, that they are.

    Two that tell so are believed, neither of which has it from the other, or one that tells it over and over.
    """
    c.floor.withdraw("left")
    for number in s.numbers:
        entry = c.board.find(m.TaskByNumber(number))
        if entry is not None and entry.state == DONE and entry.hearsay:
            c.board.reopen(number)
        elif entry is not None and entry.known_done and entry.owner is not None and u.speaker is not None:
            claims.tell_done(c, u.speaker, entry, now)  # else those who know of more than fits in a list ask for ever
    if not s.more:
        for entry in c.board.entries():
            number = entry.definition.number
            lapsed = entry.state != CLAIMED or now >= entry.lease_end_s or entry.owner in (None, u.speaker)
            if number in s.numbers or c.task == number or entry.known_done:
                continue
            if entry.state == DONE:
                entry.times_told += 1
                lists = LISTS_OF_ONE if len(c.peers.present(now)) > 1 else LISTS_OF_TWO
                if entry.told_by != u.speaker or entry.times_told >= lists:
                    c.board.complete(number, entry.owner)
            elif lapsed:
                if entry.owner == c.role.name:
                    c.board.release(number)  # whoever has done it, this robot knows that it was not itself
                c.board.complete(number, None, hearsay=True, told_by=u.speaker)
    c.fire(Trigger.ANSWERED, now)
    c.reconsider(now)
