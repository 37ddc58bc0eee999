"""What robots say to be done without knowing that it is to be done again: they are told so (`changing`)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from hvcpd.coordination import changing, claims, composing, schedule
from hvcpd.coordination.addressing import is_for_me_alone
from hvcpd.coordination.entry import DONE, Entry
from hvcpd.coordination.knowledge import Heard, Knowledge
from hvcpd.language import messages as m


def up_to_date(me: Knowledge, heard: Heard) -> Heard | None:
    """The sentence without what is outdated in it, of which its speaker is told; None if it says nothing else."""
    said, now = m.own_words(heard.utterance.statement), heard.now
    changing.believe_rumours(me, heard, said.claim if isinstance(said, m.Completed) else said)
    match said:
        case m.Completed() | m.Confirmed(complete=True):
            doer = _doer(heard, said)
            outdated = [entry for entry in me.board.known(said.tasks) if _is_old(me, heard, entry, said, doer)]
            for entry in outdated:
                if entry.owner == doer and now - entry.since_s >= me.timing.recent_s:  # it was done before it was due
                    claims.release_assignment(me, heard.name, entry.number)
                    me.board.release(entry.number)
                by_doer = isinstance(said, m.Confirmed) and not (entry.is_shared or doer == me.role.name)
                changing.tell(me, doer if by_doer and doer else heard.name, entry, now)
            return _without(heard, said, [entry.number for entry in outdated])
        case m.Negative() if is_for_me_alone(me, heard.to) and me.current.task is not None:
            is_shared = me.board[me.current.task].is_shared  # then others do it, or it is denied as complete
            if not me.is_partner(heard.speaker) and not is_shared:  # otherwise it denies a read-back
                _tell_if_changed(me, heard, me.current.task)
        case m.Left(more=False):
            for number in me.board.not_done():
                if number not in said.numbers:
                    _tell_if_changed(me, heard, number)
    return heard


def _doer(heard: Heard, said: m.Completed | m.Confirmed) -> str | None:
    """The robot that has done the tasks of a report, or of its confirmation; None if that is not known."""
    if isinstance(said, m.Confirmed):
        return heard.to.name if isinstance(heard.to, m.ToRobot) else None
    statement = heard.utterance.statement
    return statement.speaker if isinstance(statement, m.Relayed) else heard.speaker


def _is_old(me: Knowledge, heard: Heard, entry: Entry, said: m.Completed | m.Confirmed, doer: str | None) -> bool:
    """Whether what is said to be done may be this task before its last change, or another occurrence of it."""
    if isinstance(said, m.Completed):
        in_passing = said.claim is not None  # its doer says it, just after
        of_another_time = not in_passing and _is_of_another_time(me, entry, doer, said.count, heard.now)
        return _is_outdated(me, entry, doer, said.count) or of_another_time
    of_another_time = _is_of_another_time(me, entry, doer, None, heard.now)
    return doer is not None and (of_another_time or _may_be_outdated(me, heard, entry, doer))


def _without(heard: Heard, said: m.Completed | m.Confirmed, numbers: Sequence[int]) -> Heard | None:
    """The sentence without these tasks; None if nothing is left of it."""
    if not numbers:
        return heard
    left = [ref for ref in said.tasks if ref.number not in numbers]
    rest = replace(said, task=left[0], also=None) if left else said.claim if isinstance(said, m.Completed) else None
    return replace(heard, utterance=replace(heard.utterance, statement=rest)) if rest is not None else None


def _may_be_outdated(me: Knowledge, heard: Heard, entry: Entry, name: str) -> bool:
    """Whether a robot that confirms to another one (`name`) that a task is complete may not know that it is to be done
    again. Of a task for several robots that may be an objection to a claim. But the speaker knows if it confirms a part
    whose report this robot has heard, too, or answers this robot, which has just told it."""
    if not entry.is_shared:
        return _is_outdated(me, entry, name, None)
    last = me.repair.last_said
    told = last.addressee if last is not None and m.own_words(last.statement) == composing.change(entry) else None
    answers = told in (m.ToAll(), m.ToRobot(heard.name)) and is_for_me_alone(me, heard.to)
    return entry.is_changed and not entry.known_done and name not in entry.parts and not answers


def _tell_if_changed(me: Knowledge, heard: Heard, number: int) -> None:
    if me.board[number].is_changed or (me.current.task == number and schedule.is_just_due(me.board[number], heard.now)):
        changing.tell(me, heard.name, me.board[number], heard.now)


def _is_outdated(me: Knowledge, entry: Entry, doer: str | None, count: int | None) -> bool:
    """Whether a robot reports a task as done without knowing that it is to be done again. Notes a change that this
    robot did not know."""
    known = changing.counted(entry, count) if count is not None else 0
    if known > entry.change and not entry.recurs:
        me.board.change(entry.number, known, False)
    return entry.is_changed and not entry.known_done and entry.owner != doer and known < entry.change


def _is_of_another_time(me: Knowledge, entry: Entry, doer: str | None, count: int | None, now: float) -> bool:
    """Whether a robot that reports a recurring task as done may mean the last occurrence: it says an earlier number, or
    this robot knows that the task has just become due, and the other one, whose claim it has heard only just now, or
    not at all, says another number, or none."""
    at_work = me.is_at(entry.number)  # then see `claims`
    part_is_done = bool(entry.parts) or (entry.is_shared and entry.state == DONE)
    had_it = doer in (entry.owner, *entry.helpers) and now - entry.since_s >= me.timing.recent_s
    if me.clock_s is None or not entry.recurs or entry.known_done or part_is_done or at_work:
        return False
    known = changing.counted(entry, count) if count is not None else None
    is_older = known is not None and known < entry.change
    return is_older or (not had_it and schedule.is_just_due(entry, now) and known != entry.change)
