"""Claims are leases. Whoever hears one objects, confirms it, or hears another one do so.

Three rules make a task be done once, and need no further talk: a claim is acted on only when somebody has confirmed
it (or nobody answers however often it is said); of two who want one task, who is at work wins over who only claims,
and of equals the name that comes first in the alphabet; objections are said before confirmations.
"""

from __future__ import annotations

from hvcpd.coordination import composing, orders
from hvcpd.coordination.addressing import (
    DOER_SLOT,
    OTHERS_SLOT,
    OWNER_SLOT,
    UNSURE_SLOTS,
    confirming_slot,
    is_for_me_alone,
    objection_slot,
)
from hvcpd.coordination.board import CLAIMED, Entry
from hvcpd.coordination.knowledge import HeardClaim, Knowledge, QuotedReport, Reactions
from hvcpd.coordination.states import AT_WORK, NEWCOMER, PROPOSING, State, Trigger
from hvcpd.coordination.table import fire
from hvcpd.language import messages as m

SMALL_TEAM = 2
"""Where so few others are, each one's knowledge counts: a robot that is not sure of a report has it said again at
once, and does not leave it to others to know."""
HEARD_SURELY = 2
"""So often it must have been heard whose a task is, before anything is concluded from what its owner does next."""


def claim(me: Knowledge, u: m.Utterance, s: m.Claim, now: float) -> None:
    if u.speaker is None:
        return
    entry = me.board.find(s.task)
    if orders.answers_order(me, u):
        right = entry is not None and entry.definition.number == me.current.task
        fire(me, Trigger.RIGHT if right else Trigger.WRONG, now)
        return
    if entry is None:
        return
    peer = me.peers.get(u.speaker)
    if is_for_me_alone(me, u) and peer is not None and peer.assigned == entry.definition.number:
        confirm_at_once(me, u.speaker, now)  # our confirmation was lost
        return
    good = contend(me, u, u.speaker, entry, False, now)
    if good and not isinstance(u.addressee, m.ToRobot):
        _confirm_in_turn(me, u.speaker, entry.definition.number, now)


def working(me: Knowledge, u: m.Utterance, s: m.Working, now: float) -> None:
    entry = me.board.find(s.task)
    if entry is None or u.speaker is None:
        return
    good = contend(me, u, u.speaker, entry, True, now)
    if good and not isinstance(u.addressee, m.ToRobot):
        _confirm_in_turn(me, u.speaker, entry.definition.number, now)


def contend(me: Knowledge, u: m.Utterance, other: str, entry: Entry, other_at_work: bool, now: float) -> bool:
    """Somebody takes or has a task: True if that is right as far as this robot knows; otherwise it objects."""
    number = entry.definition.number
    _note_claim(me, other, entry, now)
    if entry.known_done and entry.owner != other:
        tell_done(me, other, entry, now)
        return False
    if entry.hearsay and entry.told_by is None and entry.owner != other:
        slot = confirming_slot(me, now) + UNSURE_SLOTS + me.rank(other, number, now)
        _deny(me, other, number, entry.owner, slot, now)
        return False
    if me.current.task == number and me.state in PROPOSING | AT_WORK:
        return _contend_for_own(me, other, number, other_at_work, now)
    third = entry.owner if entry.state == CLAIMED and entry.owner != other else None
    live = third is not None and now < entry.lease_end_s
    answer_to_owner = isinstance(u.addressee, m.ToRobot) and u.addressee.name == third
    if third is not None and live and not other_at_work and not answer_to_owner and me.peers.is_present(third, now):
        if entry.firm:
            _deny(me, other, number, third, objection_slot(me, other, number, now), now)
        return False
    if entry.known_done:  # by the one who claims it: it must know
        me.board.reopen(number)
    lease_end_s = me.lease_end_s(now) if other_at_work else now + me.timing.unconfirmed_lease_s
    me.board.claim(number, other, lease_end_s, firm=other_at_work)
    entry.times_heard = HEARD_SURELY if other_at_work else 1  # said again, it did not hear that it was confirmed
    return third is None


def _deny(me: Knowledge, other: str, number: int, owner: str | None, slot: int, now: float) -> None:
    """Object for another one, if it still has the task, or still may have done it, when this robot's turn comes."""

    def still() -> bool:
        return me.board[number].owner == owner

    composing.answer(me, other, f"deny {number}", m.Negative(), now, slot=slot, call=other, still=still)


def _note_claim(me: Knowledge, other: str, entry: Entry, now: float) -> None:
    """Remember who claimed what last, and what was known of it before: objections refer to that."""
    number, last = entry.definition.number, me.overheard.claim
    if last is None or last.speaker != other or last.number != number or now - last.at_s > me.timing.recent_s:
        me.overheard.claim = HeardClaim(other, number, (entry.state, entry.owner, entry.lease_end_s), now)


def _contend_for_own(me: Knowledge, other: str, number: int, other_at_work: bool, now: float) -> bool:
    mine, theirs = (me.state not in AT_WORK, me.role.name.lower()), (not other_at_work, other.lower())
    if me.state is State.ACTING or mine < theirs:
        _say_it_is_mine(me, other, number, now)
        return False
    me.board.claim(number, other, me.lease_end_s(now))
    fire(me, Trigger.LOST, now)
    return True


def _say_it_is_mine(me: Knowledge, other: str, number: int, now: float) -> None:
    ref = m.TaskByNumber(number)
    statement = m.Working(ref) if me.state in AT_WORK else m.Claim(ref)

    def still() -> bool:
        return me.current.task == number

    composing.answer(me, other, f"mine {number}", statement, now, slot=OWNER_SLOT, still=still)


def tell_done(me: Knowledge, other: str, entry: Entry, now: float) -> None:
    """It was not heard that the task is done: who did it says so at once, somebody else if that one does not; nobody
    says of a task that it is done who knows neither that it did it itself nor who else."""
    number, doer = entry.definition.number, entry.owner
    statement: m.Statement = m.Completed(m.TaskByNumber(number))
    to, slot = None, DOER_SLOT
    if doer != me.role.name:
        statement = m.Relayed(doer, statement) if doer is not None else m.Negative()
        me.overheard.report = QuotedReport(doer, me.role.name, number, now) if doer is not None else me.overheard.report
        to, slot = other, objection_slot(me, other, number, now)

    def still() -> bool:
        return me.board[number].known_done

    composing.answer(me, to, f"done {number}", statement, now, slot=slot, call=other, still=still)


def confirm_at_once(me: Knowledge, name: str, now: float) -> None:
    composing.answer(me, name, f"confirm {name}", m.Confirmed(), now, slot=OWNER_SLOT)


def _confirm_in_turn(me: Knowledge, name: str, number: int, now: float, sure: bool = True) -> None:
    """Confirm what `name` said of a task, unless it is no longer true then or another one does."""
    complete = me.board[number].known_done
    statement = m.Confirmed(m.TaskByNumber(number), complete=complete) if sure else m.SayAgain()
    slot = confirming_slot(me, now) + me.rank(name, number, now)
    slot += UNSURE_SLOTS if me.state in NEWCOMER or not sure else 0

    def still() -> bool:
        true = me.board[number].owner == name or complete
        if true and sure:
            me.board.claim(number, name, me.lease_end_s(now))
            note_moved_on(me, name, number)
        return true

    composing.answer(me, name, f"confirm {name}", statement, now, slot=slot, call=name, tentative=True, still=still)


def completed(me: Knowledge, u: m.Utterance, s: m.Completed, now: float) -> None:
    entry = me.board.find(s.task)
    if entry is None or u.speaker is None:
        return
    number = entry.definition.number
    objection = _is_objection(me, u.speaker, number, now)
    if objection:
        me.floor.withdraw(f"done {number}")
    new = not entry.known_done
    doubt = doubts(me, u.speaker, number, s.next is not None, now)
    sure = not doubt and (note_done(me, u.speaker, number, now) or not new)
    good, upon = True, number
    if s.next is not None and (following := me.board.find(s.next)) is not None:
        upon = following.definition.number
        good = contend(me, u, u.speaker, following, False, now)
    if is_for_me_alone(me, u):
        confirm_at_once(me, u.speaker, now)
    elif not sure and not doubt and not objection and len(me.peers.present(now)) <= SMALL_TEAM:
        composing.answer(me, u.speaker, f"again {u.speaker}", m.SayAgain(), now, slot=OTHERS_SLOT)
    elif good and not doubt and not isinstance(u.addressee, m.ToRobot) and not (objection and not new):
        _confirm_in_turn(me, u.speaker, upon, now, sure)
    me.reconsider(now)


def doubts(me: Knowledge, speaker: str, number: int, in_passing: bool, now: float) -> bool:
    """Whether this robot, whose claim may be confirmed, does not believe at first hearing that somebody else has done
    its task: were that misheard, everybody would hold the task for done once this robot goes on to another one.

    Who is at work says so to the speaker, who says it again if it is true; who only claims believes an objection, but
    not what is said in passing, with another claim: its own claim is said again, and can be objected to.
    """
    if me.current.task != number or me.current.partner is not None or speaker == me.current.owner_before:
        return False
    at_work = me.state in AT_WORK and me.state is not State.ACTING
    if not at_work and not (in_passing and me.state in PROPOSING):
        return False
    if me.current.doubted == (speaker, number):
        return False
    me.current.doubted, me.missed.last_s = (speaker, number), now
    if at_work:
        _say_it_is_mine(me, speaker, number, now)
    return True


def _is_objection(me: Knowledge, speaker: str, number: int, now: float) -> bool:
    """Whether "task … complete" answers somebody who has just claimed that task."""
    last = me.overheard.claim
    if me.current.task == number and now - me.lease.claimed_s < me.timing.recent_s:
        return True
    return (
        last is not None and last.number == number and last.speaker != speaker and now - last.at_s < me.timing.recent_s
    )


def note_done(me: Knowledge, doer: str, number: int, now: float) -> bool:
    """It was said that `doer` has done the task; whether that fits what was known, or is heard again."""
    entry = me.board[number]
    last = me.overheard.claim
    before = last.before[1] if last is not None and last.number == number else None
    sure = doer in (entry.owner, before) or (me.current.task == number and doer == me.current.owner_before)
    if not sure or me.current.task == number:
        me.missed.last_s = now
        me.missed.heard_work = me.missed.heard_work or me.state in NEWCOMER
    if me.current.task == number and me.state is State.ACTING:
        return sure  # too late: it is being done twice, and both will say so
    me.board.complete(number, doer, hearsay=not sure)
    release_assignment(me, doer, number)
    if me.current.task == number and me.state is not State.REPORTING:
        fire(me, Trigger.DONE_BEFORE, now)
    return sure


def failed(me: Knowledge, u: m.Utterance, s: m.Failed, now: float) -> None:
    entry = me.board.find(s.task)
    if entry is None or u.speaker is None:
        return
    number = entry.definition.number
    if me.current.task != number or me.state not in AT_WORK:
        me.board.give_up(number, u.speaker)
    release_assignment(me, u.speaker, number)
    if is_for_me_alone(me, u):
        confirm_at_once(me, u.speaker, now)
    elif not isinstance(u.addressee, m.ToRobot):
        name, statement = u.speaker, m.Confirmed(m.TaskByNumber(number))
        slot = confirming_slot(me, now) + me.rank(name, number, now)
        composing.answer(me, name, f"confirm {name}", statement, now, slot=slot, call=name, tentative=True)
    me.reconsider(now)


def release_assignment(me: Knowledge, name: str, number: int) -> None:
    peer = me.peers.get(name)
    if peer is not None and peer.assigned == number:
        peer.assigned = None


def note_moved_on(me: Knowledge, name: str, number: int) -> None:
    """Somebody is known to have this task. If it was at another one, that is over, and most likely done: what was
    given up is said to be so, and so is what was done, but one may miss it."""
    for entry in me.board.entries():
        former = entry.definition.number
        heard = entry.state == CLAIMED and entry.owner == name and entry.times_heard >= HEARD_SURELY
        if heard and entry.firm and former not in (number, me.current.task):
            me.board.complete(former, name, hearsay=True)


REACTIONS: Reactions = {m.Claim: claim, m.Working: working, m.Completed: completed, m.Failed: failed}
