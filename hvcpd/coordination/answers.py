"""Answers to a robot's claim or report: confirmed, denied, or corrected with a list of all remaining tasks."""

from __future__ import annotations

from collections.abc import Collection

from hvcpd.coordination import ahead, changing, claims, commands, objecting, teaming
from hvcpd.coordination.addressing import confirming_slot, is_for_me_alone
from hvcpd.coordination.conversation import NEVER_S
from hvcpd.coordination.entry import CLAIMED, DONE, OPEN, Entry
from hvcpd.coordination.knowledge import Heard, Knowledge, Reactions
from hvcpd.coordination.states import AT_WORK, PROPOSING, State, Trigger
from hvcpd.coordination.table import fire
from hvcpd.language import messages as m

LISTS_OF_ONE = 4
"""Number of lists after which a single robot is believed: a robot that has misheard a report asks as often itself, and
hears from the others that the task remains."""
LISTS_OF_TWO = 2
"""If only two robots are there, the other one can have misheard only this robot's own sentences."""


def confirmed(me: Knowledge, heard: Heard, s: m.Confirmed) -> None:
    if not isinstance(heard.to, m.ToRobot):
        return
    if not is_for_me_alone(me, heard.to):
        _note_confirmed(me, heard, heard.to.name, s)
    elif _confirms_read_back(me, heard.name, s):
        changing.take_order(me, heard.now)
        fire(me, Trigger.CONFIRMED_MOTION if me.current.motion is not None else Trigger.CONFIRMED, heard.now)
    elif any(teaming.confirmed(me, heard, entry.number, s.complete) for entry in me.board.known(s.tasks)):
        return
    elif _is_meant(me, heard.name, s):
        for entry in (me.board[number] for number in me.report.tasks if me.board[number].is_shared):
            if s.complete:
                me.board.complete(entry.number, me.role.name)
            elif entry.known_done:
                objecting.tell_done(me, heard.name, entry, heard.now)  # the speaker has missed another robot's part
        me.current.assured_s = me.lease_end_s(me.current.claimed_s)
        slots = confirming_slot(me, heard.now)
        me.current.objected_s = heard.now + me.timing.reply_gap_s + slots * me.timing.slot_s
        ahead.confirmed(me, {each.number for each in me.board.known(s.tasks)})
        if me.report.said:
            me.report.tasks = ()
        is_open = me.state is State.CLAIMING and me.current.task is None  # the task is still to be chosen
        if not is_open and me.state not in (State.READING_BACK, State.READ_BACK):
            fire(me, Trigger.CONFIRMED, heard.now)
    elif s.complete:
        _note_told(me, heard, s)
    else:
        teaming.forget_part(me, s.tasks)


def _note_told(me: Knowledge, heard: Heard, s: m.Confirmed) -> None:
    """A robot that knows tells this one, which may have listed tasks for several robots as left, that they are done."""
    for entry in me.board.known(s.tasks):
        if entry.is_shared:
            claims.note_done(me, heard.name, entry.number, heard.now, whole=True)


def _confirms_read_back(me: Knowledge, speaker: str, s: m.Confirmed) -> bool:
    """Whether it lets this robot follow the order that it has read back."""
    names_another = s.complete or not {ref.number for ref in s.tasks}.issubset(me.my_tasks())
    return me.has_read_back and not names_another and me.is_partner(speaker)


def _is_meant(me: Knowledge, speaker: str, s: m.Confirmed) -> bool:
    """Whether it answers this robot's last sentence to its partner, or else its last sentence about a task. A report
    that is still to be said is not meant, unless it was said in answer to another robot's claim. Who confirms a report
    does not mean a claim."""
    if s.complete and not me.report.said:
        return False
    if me.state is State.REPORTING and me.current.repeats == 0 and not me.report.said:
        return False
    if me.current.partner is not None:
        return me.is_partner(speaker) and me.state not in AT_WORK
    waiting = me.my_tasks()[: 1 if me.state in AT_WORK else None] or me.report.tasks
    if not s.tasks and me.report.failed and me.report.said:
        return any(me.board[number].is_shared for number in waiting)
    return bool(waiting) and {ref.number for ref in s.tasks}.issuperset(waiting)


def _note_confirmed(me: Knowledge, heard: Heard, owner: str, s: m.Confirmed) -> None:
    """Another robot's claim or report was confirmed, or that it has given the task up."""
    numbers = {entry.number for entry in me.board.known(s.tasks)}
    for number in sorted(numbers):
        if m.TaskByNumber(number) in heard.given_up:
            me.board.give_up(number, owner)
        else:
            _note_one_confirmed(me, heard.name, owner, number, s.complete, numbers, heard.now)


def _note_one_confirmed(
    me: Knowledge, speaker: str, owner: str, number: int, complete: bool, confirmed: Collection[int], now: float
) -> None:
    """The same for one of the tasks that were `confirmed`."""
    entry = me.board[number]
    if owner in entry.failed_by and not complete:
        return  # what was confirmed is that it failed
    if entry.is_shared and not entry.known_done and not entry.parts and not complete:
        teaming.overheard(me, speaker, owner, entry, now)
        return
    if number in me.my_tasks():
        if not complete:  # two robots were confirmed, or are about to be
            claims.contend_for_own(me, owner, number, True, now)
        elif not claims.doubts(me, owner, number, False, now):
            claims.note_done(me, owner, number, now, whole=True)
        return
    ordered = commands.asks_anew(me, speaker, entry)
    if entry.known_done and (entry.owner != owner or entry.is_shared) and not complete and not ordered:
        objecting.tell_done(me, owner, entry, now)  # its claim was not heard here, or this robot's objection there
    if complete:
        claims.note_done(me, owner, number, now, whole=True)
        me.reconsider(now)
    free_to_claim = entry.owner in (owner, speaker) or not entry.firm or now >= entry.lease_end_s
    if entry.state == CLAIMED and not free_to_claim and not complete:
        objecting.deny_for_third(me, owner, entry, now)
    if entry.state != DONE and free_to_claim:
        me.board.claim(number, owner, me.lease_end_s(now))
        entry.times_heard += 1
        claims.note_moved_on(me, owner, confirmed)


def negative(me: Knowledge, heard: Heard, _: m.Negative) -> None:
    _take_report_back(me, heard)
    if not isinstance(heard.to, m.ToRobot):
        return
    last, partner = me.claim_heard, me.current.partner
    if is_for_me_alone(me, heard.to):
        is_said = me.current.task is not None or me.current.motion is not None
        claims_one = partner is None and is_said and me.state in PROPOSING
        by_people = partner is not None and all(map(me.may_be_person, (partner, heard.name)))
        if by_people and me.state in AT_WORK and me.is_person(heard.name):
            changing.take_order_back(me, heard.now)
        elif claims_one or by_people or me.is_partner(heard.speaker):
            fire(me, Trigger.DENIED, heard.now)
        elif me.state in AT_WORK:  # others have missed its claim, or it has missed theirs
            me.missed.last_s = heard.now
        ahead.denied(me, heard.now)
    elif last.speaker == heard.to.name and heard.now - last.at_s < me.timing.recent_s:
        for before in last.before.values():
            _note_denied(me, before, heard.now)


def _note_denied(me: Knowledge, before: Entry, now: float) -> None:
    """Another robot's claim was denied: the task is as it was `before`."""
    entry = me.board[before.number]
    if entry.firm and not entry.is_shared:
        return  # it was confirmed, and the robot that denies it may have missed what came before
    me.board.restore(before)
    if entry.state == OPEN and not entry.is_shared:  # this robot has missed, too, whose it is
        me.board.claim(entry.number, None, now + me.timing.denied_s)


def _take_report_back(me: Knowledge, heard: Heard) -> None:
    """A robot whose words were passed on says that they are wrong: the tasks that they reported are open."""
    quoted, now = me.report_quoted, heard.now
    if quoted is None or heard.speaker != quoted.speaker or now - quoted.at_s > me.timing.recent_s:
        return
    entry = me.board[quoted.number]
    if entry.state == DONE and entry.owner == quoted.speaker:
        me.missed.last_s = now
        me.board.reopen(quoted.number)
        me.reconsider(now)


def left(me: Knowledge, heard: Heard, s: m.Left) -> None:
    """A robot has listed the unfinished tasks: a complete list implies, by hearsay, that the others are done.

    This is believed from two robots, if neither has it from the other, from one that repeats it often, or at once from
    one whose words are sealed, because those cannot be misheard.
    """
    now, speaker = heard.now, heard.name
    me.floor.withdraw("left")
    if isinstance(heard.to, m.ToRobot) and (peer := me.peers.get(heard.to.name)) is not None:
        peer.told = False
    for number in s.numbers:
        entry = me.board.find(m.TaskByNumber(number))
        if entry is not None and entry.state == DONE and entry.hearsay:
            me.board.reopen(number)
        elif entry is not None and entry.known_done and entry.owner is not None:
            objecting.tell_done(me, speaker, entry, now)  # more may be left than fits in a list
    if not s.more:
        for entry in me.board.entries():
            number = entry.number
            unsaid = number not in s.numbers and number not in me.my_tasks()
            may_not_know = entry.is_due or _is_unheard(me, entry)
            has_claimed = speaker == entry.owner and not (entry.is_changed and entry.state == CLAIMED)
            knows = not may_not_know or speaker in entry.known_to or has_claimed
            if unsaid and not entry.known_done and knows:
                _note_left_out(me, entry, speaker, now)
    fire(me, Trigger.ANSWERED, now)
    me.reconsider(now)


def _is_unheard(me: Knowledge, entry: Entry) -> bool:
    """Whether nobody has spoken of an open task that this robot can do: perhaps nobody else knows it."""
    was_open = entry.was_open or not me.missed.any_work
    is_open = was_open and entry.state != DONE  # otherwise somebody has said that it is done
    return is_open and not entry.known_to and me.role.volunteer and not me.lacks(entry)


def _note_left_out(me: Knowledge, entry: Entry, speaker: str, now: float) -> None:
    number, sealed = entry.number, me.role.speech.sealed
    is_remembered = entry.since_s == NEVER_S  # the claim is from before this robot was switched on
    if entry.state == DONE:
        entry.times_said += 1
        lists = LISTS_OF_ONE if len(me.peers.present(now)) > 1 else LISTS_OF_TWO
        if sealed or entry.said_by != speaker or entry.times_said >= lists:
            me.board.complete(number, entry.owner)
    elif entry.state == CLAIMED and entry.owner == speaker:
        claims.note_done(me, speaker, number, now, whole=True)  # it was asked before it could report
    elif entry.state != CLAIMED or now >= entry.lease_end_s or entry.owner is None or is_remembered:
        if entry.owner == me.role.name:
            me.board.release(number)  # whichever robot has done it, this one knows that it has not
        me.board.complete(number, None, hearsay=not sealed, said_by=speaker)


def _unknown(me: Knowledge, heard: Heard, s: m.Unknown) -> None:
    """A robot does not know the task: an order is refused, and there is no objection to a claim or a report."""
    entry = me.board.find(s.task)
    if commands.answers_order(me, heard):
        fire(me, Trigger.REFUSED, heard.now)
    elif entry is not None:
        entry.is_new_to_others = True
        own, number = me.my_tasks() if me.state in PROPOSING else (), entry.number
        tasks = (own or me.report.tasks) if number in (*own, *me.report.tasks) else (number,)
        if not entry.is_shared:
            first, *more = map(m.TaskByNumber, tasks)
            confirmed(me, heard, m.Confirmed(first, also=more[0] if more else None))


REACTIONS: Reactions = {m.Left: left, m.Confirmed: confirmed, m.Negative: negative, m.Unknown: _unknown}
