"""Claims are leases. A robot that hears one objects, confirms it, or hears another robot do so.

Three rules ensure that a task is done once, without further talk: a robot acts on its claim only after a confirmation
(or if nobody answers any of its repetitions); if two robots want one task, the one at work wins over the one that only
claims, and of equals the name that comes first in the alphabet; objections are said before confirmations.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from copy import copy

from hvcpd.coordination import bidding, commands, composing, objecting, teaming
from hvcpd.coordination.addressing import (
    OTHERS_SLOT,
    OWNER_SLOT,
    UNSURE_SLOTS,
    confirming_slot,
    is_for_me_alone,
    waiting_slots,
)
from hvcpd.coordination.conversation import HeardClaim
from hvcpd.coordination.entry import CLAIMED, Entry
from hvcpd.coordination.knowledge import Heard, Knowledge, Reactions
from hvcpd.coordination.states import AT_WORK, NEWCOMER, PROPOSING, State, Trigger
from hvcpd.coordination.table import fire
from hvcpd.language import messages as m

SMALL_TEAM = 2
"""With this few others each robot's knowledge counts: a robot that is not sure of a report asks for it again at once,
and does not rely on others to know."""
HEARD_SURELY = 2
"""How often a task's owner must have been heard before its next action allows a conclusion."""


def claim(me: Knowledge, heard: Heard, s: m.Claim) -> None:
    entry, now = me.board.find(s.task), heard.now
    peer, number = me.peers.get(heard.name), entry.number if entry is not None else None
    if s.also is None and commands.answers_order(me, heard):
        fire(me, Trigger.RIGHT if number is not None and number == me.current.task else Trigger.WRONG, now)
    elif is_for_me_alone(me, heard.to) and peer is not None and number is not None and peer.assigned == number:
        confirm_at_once(me, heard.name, now)  # the confirmation was lost
    else:
        _settle(me, heard, s.tasks, False)


def working(me: Knowledge, heard: Heard, s: m.Working) -> None:
    _settle(me, heard, (s.task,), True)


def _settle(me: Knowledge, heard: Heard, refs: Sequence[m.TaskRef], at_work: bool) -> None:
    """Object to a claim, bid for its task, or confirm it if it was said to many."""
    unsure = _may_have_missed(me, refs, heard.now)
    unknown = _unknown_of(me, refs)
    knows_none = len(unknown) == len(refs)
    good = contend(me, heard, refs, at_work)
    if unknown and (good or knows_none):
        _tell_unknown(me, heard, unknown)
    if not good or unknown:
        return
    me.board[good[0]].distance_m = bidding.stated_m(heard)
    is_first = me.claim_heard.at_s == heard.now
    if bidding.would_bid(me, heard, me.board[good[0]]):
        bidding.bid(me, heard.name, me.board[good[0]], heard.now)
    elif not (unsure and is_first) and (bidding.is_bid(heard) or not isinstance(heard.to, m.ToRobot)):
        _confirm_in_turn(me, heard.name, good, heard.now)


def _may_have_missed(me: Knowledge, refs: Sequence[m.TaskRef], now: float) -> bool:
    """Whether this robot may have missed whose tasks these are, and others may know: it is about to ask what remains,
    or one of the tasks is its own, for which it may be outbid, or was denied to a robot. Then it does not confirm a
    claim until that is said again."""
    entries = me.board.known(refs)
    denied = any(e.state == CLAIMED and e.owner is None and now < e.lease_end_s for e in entries)
    outbid = me.current.may_be_outbid and any(e.number in me.my_tasks() for e in entries)
    unsure = me.missed.heard_work or me.state in (State.ASKING, State.ASKED) or outbid
    return (unsure or denied) and len(me.expected(now)) > 1


def _unknown_of(me: Knowledge, refs: Iterable[m.TaskRef]) -> list[m.TaskRef]:
    """Those of these tasks that this robot does not know."""
    return [ref for ref in refs if me.board.find(ref) is None]


def _tell_unknown(me: Knowledge, heard: Heard, refs: Sequence[m.TaskRef]) -> None:
    """This robot has not heard of a task that another one announces to many, and so does not object; robots that know
    the task speak first."""
    ref, other, now = refs[0], heard.name, heard.now
    if isinstance(ref, m.TaskByNumber) and not isinstance(heard.to, m.ToRobot) and me.state not in NEWCOMER:
        slot = confirming_slot(me, now) + UNSURE_SLOTS + me.rank_with_unheard(other, ref.number, now)
        composing.answer(me, other, f"confirm {other}", m.Unknown(ref), now, slot, call=other, tentative=True)


def contend(me: Knowledge, heard: Heard, refs: Sequence[m.TaskRef], other_at_work: bool) -> tuple[int, ...]:
    """Another robot takes or has these tasks: returns the numbers of those that this robot knows, none if it objects to
    one."""
    entries = me.board.known(refs)
    _note_claim(me, heard.name, entries, heard.now)
    teaming.moved_on(me, heard.name, [entry.number for entry in entries], heard.now)
    good = [_contend_one(me, heard, entry, other_at_work) for entry in entries]
    return tuple(entry.number for entry in entries) if all(good) else ()


def _contend_one(me: Knowledge, heard: Heard, entry: Entry, other_at_work: bool) -> bool:
    number, other, now = entry.number, heard.name, heard.now
    knows_better = entry.owner != other or entry.is_shared or (entry.recurs and me.clock_s is not None)
    if _reads_back(me, heard, entry):
        return False  # it is not open before the speaker says that it was asked for
    if entry.known_done and knows_better:
        objecting.tell_done(me, other, entry, now)
        return False
    if entry.hearsay and entry.said_by is None and entry.owner != other:
        slot = confirming_slot(me, now) + UNSURE_SLOTS + me.rank_with_unheard(other, number, now)
        objecting.deny(me, other, number, entry.owner, slot, now)
        return False
    if entry.is_shared:
        teaming.contend(me, heard, entry, other_at_work)
        return False
    if number in me.my_tasks() and me.state in PROPOSING | AT_WORK:
        outbid = bidding.is_bid(heard) and is_for_me_alone(me, heard.to) and me.state in PROPOSING
        return contend_for_own(me, other, number, other_at_work, now, outbid)
    third = entry.owner if entry.state == CLAIMED and entry.owner != other else None
    answers_owner = isinstance(heard.to, m.ToRobot) and heard.to.name == third
    if objecting.is_of_third(me, entry, other, now) and not other_at_work and not answers_owner:
        objecting.deny_for_third(me, other, entry, now)
        return False
    if entry.known_done:  # by the claimant itself: it must know
        me.board.reopen(number)
    _leave_to(me, other, number, other_at_work, now)
    entry.times_heard = HEARD_SURELY if other_at_work else 1  # a repeated claim: its owner missed the confirmation
    return third is None or bidding.is_bid(heard)


def _reads_back(me: Knowledge, heard: Heard, entry: Entry) -> bool:
    """Whether a claim is the read-back of an order to do the task once more."""
    to = heard.to.name if isinstance(heard.to, m.ToRobot) and not is_for_me_alone(me, heard.to) else None
    return to is not None and commands.asks_anew(me, to, entry)


def _note_claim(me: Knowledge, other: str, entries: Sequence[Entry], now: float) -> None:
    """Remember each robot's last claim, and what was known of the task before: objections refer to that."""
    before, last = {e.number: copy(e) for e in entries}, me.claim_heard
    same = last.speaker == other and last.before.keys() == before.keys()
    if before and (not same or now - last.at_s > me.timing.recent_s):
        me.claim_heard = HeardClaim(other, before, now)


def contend_for_own(
    me: Knowledge, other: str, number: int, other_at_work: bool, now: float, outbid: bool = False
) -> bool:
    """Another robot takes or has this robot's task: returns whether this robot gives way, and objects if not."""
    at_work = me.is_at(number)
    mine, theirs = (not at_work, me.role.name.lower()), (not other_at_work, other.lower())
    if me.acts(number) or (mine < theirs and not outbid):
        if other_at_work:
            me.missed.last_s = now  # so that this one announces its work: the other may not hear the objection
        objecting.say_it_is_mine(me, other, number, now)
        return False
    _leave_to(me, other, number, other_at_work, now)
    if me.current.task == number:
        fire(me, Trigger.LOST, now)
    return True


def _leave_to(me: Knowledge, other: str, number: int, other_at_work: bool, now: float) -> None:
    """Another robot has the task now; until it is heard to be confirmed, for a short time."""
    lease_end_s = me.lease_end_s(now) if other_at_work else now + me.timing.unconfirmed_lease_s
    me.board.claim(number, other, lease_end_s, firm=other_at_work)


def confirm_at_once(me: Knowledge, name: str, now: float) -> None:
    composing.answer(me, name, f"confirm {name}", m.Confirmed(), now, OWNER_SLOT)


def _confirm_in_turn(me: Knowledge, name: str, numbers: tuple[int, ...], now: float, sure: bool = True) -> None:
    """Confirm `name`'s sentence about one or two tasks, unless it is no longer true then or another robot confirms
    it."""
    complete, number = all(me.board[each].known_done for each in numbers), numbers[0]
    refs = tuple(map(m.TaskByNumber, numbers))
    confirmed = m.Confirmed(refs[0], complete, refs[1] if len(refs) > 1 else None)
    statement: m.Statement = confirmed if sure else m.SayAgain()
    rank, first = me.rank_with_unheard(name, number, now), waiting_slots(me, now)
    a = me.acquaintance
    known = bool(a.known_by) or not a.introduced  # otherwise its first words may have collided, and the ranks disagree
    joins = rank < first and known and composing.joinable(me) is not None
    slot = confirming_slot(me, now) + rank + (0 if joins else first)
    others_know_more = len(me.expected(now)) > 1 and (me.state in NEWCOMER or not sure)
    slot += UNSURE_SLOTS if others_know_more else 0

    def still() -> bool:
        entries = [me.board[each] for each in numbers]
        return all(each.known_done if complete else name in (each.owner, *each.parts) for each in entries)

    def on_said() -> None:
        for each in numbers if sure else ():
            me.board.claim(each, name, me.lease_end_s(now))
        if sure:
            note_moved_on(me, name, numbers)

    topic = f"confirm {name}"
    composing.answer(me, name, topic, statement, now, slot, call=name, tentative=True, still=still, on_said=on_said)


def completed(me: Knowledge, heard: Heard, s: m.Completed) -> None:
    speaker, now = heard.name, heard.now
    upon = tuple(entry.number for entry in me.board.known(s.tasks))
    claimed = s.claim.tasks if s.claim is not None else ()
    if not upon:  # it knows nothing of what is reported
        _settle(me, heard, claimed or s.tasks, False)
        return
    objected = [number for number in upon if _is_objection(me, speaker, number, now)]
    for number in objected:
        me.floor.withdraw(f"done {number}")
    new = [number for number in upon if not me.board[number].known_done]
    doubted = [number for number in upon if doubts(me, speaker, number, s.next is not None, now)]
    noted = [number for number in upon if not doubted and note_done(me, speaker, number, now)]
    doubt, sure = bool(doubted), not doubted and (noted == list(upon) or not new)
    entry = me.board[upon[0]]
    if sure and s.count is not None and me.clock_s is None and entry.recurs and entry.owner == speaker:
        entry.change = s.count  # for this occurrence; of its own one, a robot may have misheard the task
    if me.board.known(claimed):
        upon = contend(me, heard, claimed, False)
    unknown = _unknown_of(me, (*claimed, *s.tasks))
    if is_for_me_alone(me, heard.to):
        confirm_at_once(me, speaker, now)
    elif not sure and not doubt and not objected and len(me.peers.present(now)) <= SMALL_TEAM:
        composing.answer(me, speaker, f"again {speaker}", m.SayAgain(), now, OTHERS_SLOT)
    elif unknown and upon:
        _tell_unknown(me, heard, unknown)  # nor does it object to the rest (`answers._unknown`)
    elif upon and not doubt and not isinstance(heard.to, m.ToRobot) and (new or not objected):
        _confirm_in_turn(me, speaker, upon, now, sure)
    me.reconsider(now)


def doubts(me: Knowledge, speaker: str, number: int, in_passing: bool, now: float) -> bool:
    """Whether this robot, whose claim may yet be confirmed, does not believe at first hearing that another robot has
    done its task. If it misheard, all robots would take the task for done once this robot goes on to another one.

    A robot at work says so to the speaker, who repeats the report if it is true. A robot that only claims believes an
    objection, but not a report that comes with another claim: it repeats its own claim, to which others can object.
    """
    if number not in me.my_tasks() or me.current.partner is not None or me.board[number].is_shared:
        return False
    if speaker == me.current.owner_before:
        return False
    only_claimed = me.state in PROPOSING or (number == me.current.ahead and not me.current.ahead_sure)
    at_work = me.state in AT_WORK and not only_claimed
    if not at_work and not (in_passing and only_claimed):
        return False
    if me.current.doubted == (speaker, number):
        return False
    me.current.doubted, me.missed.last_s = (speaker, number), now
    if at_work:
        objecting.say_it_is_mine(me, speaker, number, now)
    return True


def _is_objection(me: Knowledge, speaker: str, number: int, now: float) -> bool:
    """Whether "task … complete" answers a robot that has just claimed that task."""
    last = me.claim_heard
    mine = number in me.my_tasks() and now - me.current.claimed_s < me.timing.recent_s
    theirs = number in last.before and last.speaker != speaker and now - last.at_s < me.timing.recent_s
    return mine or theirs


def note_done(me: Knowledge, doer: str, number: int, now: float, whole: bool = False, hearsay: bool = False) -> bool:
    """A robot is said to have done the task (`doer`). Returns whether that agrees with what was known, or is a
    repetition. `whole`: all robots have done their parts of a shared task. `hearsay`: it may not be true of this
    occurrence."""
    entry = me.board[number]
    if entry.known_done and me.current.task == number and me.state in PROPOSING:
        return True  # it has been ordered once more
    if teaming.done(me, doer, number, whole, now):
        release_assignment(me, doer, number)
        return True
    before = me.claim_heard.before.get(number, entry)
    had_it = doer in (entry.owner, before.owner) or doer in entry.parts
    agrees = had_it or (me.current.task == number and doer == me.current.owner_before)
    did_part = me.role.name in entry.parts  # its partner began with it, and is done as soon
    sure = (agrees or did_part) and not hearsay
    if not sure or me.current.task == number:
        me.missed.last_s = now
        me.missed.any_work = True
        me.missed.heard_work = me.missed.heard_work or me.state in NEWCOMER
    if me.acts(number):
        return sure  # too late: two robots do it, and both will say so
    me.board.complete(number, doer, hearsay=not sure)
    release_assignment(me, doer, number)
    if me.current.task == number:
        fire(me, Trigger.LOST, now)
    return sure


def failed(me: Knowledge, heard: Heard, s: m.Failed) -> None:
    entry, name, now = me.board.find(s.task), heard.name, heard.now
    if entry is None:
        return
    number = entry.number
    # by one that said so before, or by this robot; a robot that cannot do it refuses the coordinator's next order
    may_be_alone = name not in entry.team or entry.calls > 0 or me.role.coordinator
    left_alone = may_be_alone and entry.is_shared and s.reason is None
    teaming.gone(me, name, number, now)
    if not left_alone:
        me.board.give_up(number, name)
    release_assignment(me, name, number)
    if is_for_me_alone(me, heard.to):
        confirm_at_once(me, name, now)
    elif not isinstance(heard.to, m.ToRobot):
        said = m.Confirmed(None if entry.is_shared else m.TaskByNumber(number))  # with it: "I do it with you"
        slot = confirming_slot(me, now) + me.rank_with_unheard(name, number, now)
        composing.answer(me, name, f"confirm {name}", said, now, slot, call=name, tentative=True)
    me.reconsider(now)


def release_assignment(me: Knowledge, name: str, number: int) -> None:
    peer = me.peers.get(name)
    if peer is not None and peer.assigned == number:
        peer.assigned = None


def note_moved_on(me: Knowledge, name: str, numbers: Collection[int]) -> None:
    """A robot is known to have these tasks. If it was at another one, it has most likely done that: robots report what
    they give up and what they have done, but this robot may have missed the report."""
    for entry in me.board.entries():
        former = entry.number
        heard = entry.state == CLAIMED and entry.owner == name and entry.times_heard >= HEARD_SURELY
        if heard and not entry.is_shared and former not in (*numbers, *me.my_tasks()):
            me.board.complete(former, name, hearsay=True)


REACTIONS: Reactions = {m.Claim: claim, m.Working: working, m.Completed: completed, m.Failed: failed}
