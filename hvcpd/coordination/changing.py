"""Changes that people make while robots work: a task is to be done again, or left out this time.

Each change of a task has a number, and the newer one holds. Each robot that hears a change passes it on, a few times in
all. A robot that has still missed it shows this when it objects to the next claim or leaves the task out of a list of
remaining tasks, and is then told. So all robots reach the same state, whichever changes each has missed.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace

from hvcpd.config.tasks import TaskDefinition
from hvcpd.coordination import claims, commands, composing, objecting, schedule
from hvcpd.coordination.actions import SaveChange
from hvcpd.coordination.addressing import OWNER_SLOT, UNSURE_SLOTS, is_for_me_alone, objection_slot
from hvcpd.coordination.entry import CLAIMED, DONE, Entry
from hvcpd.coordination.floor import Intent, Urgency, nothing
from hvcpd.coordination.knowledge import Heard, Knowledge, Reactions
from hvcpd.coordination.states import DEPARTING, NEWCOMER, Trigger
from hvcpd.coordination.table import fire
from hvcpd.language import messages as m
from hvcpd.language.forms import CHANGES

TIMES = 3
"""How often all robots together say a change: with three of ten sentences lost, 97 of 100 listeners then have it."""
SPREAD_S = 30.0
"""Before the next repetition: a turn, with its confirmation, takes 12.5 s. At most twice as long; doubles each time."""
RUMOUR_S = 240.0
"""For this long a change that was heard once waits to be heard again: longer than robots repeat it."""


def remember(me: Knowledge, changes: Mapping[int, tuple[int, bool]], now: float) -> None:
    """Take the last changes over that this robot knew when it was switched off: perhaps nobody else has heard of
    one."""
    for entry in me.board.entries():
        if entry.definition.on_demand and not any(changes.get(entry.number, ())):
            me.board.await_demand(entry.number)
    for number, (count, skipped) in changes.items():
        entry = me.board[number]
        if not (count or skipped):
            continue  # it has taken the place of another task, and nobody has changed it since
        me.board.change(number, count, skipped)
        if entry.recurs:  # it may have been due since then
            entry.is_changed, entry.change = False, 0
        elif not entry.known_done:
            entry.is_due = True
            me.spreading[number] = now, 1


def want(me: Knowledge, number: int, skip: bool, now: float) -> str | None:
    """Change a task, and tell the others. Returns why this is impossible, or None."""
    entry = me.board.find(m.TaskByNumber(number))
    if me.state in DEPARTING:
        return f"{me.role.name} is leaving"
    if entry is None:
        known = ", ".join(str(each.number) for each in me.board.entries())
        return f"there is no task {number}; the tasks are {known}"
    if _is_applied(entry, skip):
        closed = "left out already" if entry.skipped else "done already"
        return f"task {number} is {closed if skip else 'still to be done'}"
    if skip and me.acts(number):
        return f"task {number} is just being done"
    _take(me, entry, _next(entry), skip, now)
    _say_to_all(me, entry, now)
    return None


def changed(me: Knowledge, heard: Heard, s: m.Change) -> None:
    """Another speaker wants a change, or passes one on."""
    entry, speaker, now = me.board.find(s.task), heard.name, heard.now
    if entry is None:
        if s.count is None:
            _do_not_know(me, speaker, s.task, now)
        return
    if s.count is not None:
        _compare(me, heard, entry, s.skip, s.count)
    elif s.skip and entry.known_done and not entry.skipped:
        objecting.tell_done(me, speaker, entry, now)
    elif s.skip and me.acts(entry.number):
        objecting.say_it_is_mine(me, speaker, entry.number, now)
    else:
        count, has_read_back = _next(entry), not s.skip and _has_read_back(me, speaker, entry)
        if count and not (has_read_back or _is_applied(entry, s.skip) or _was_heard(entry, count, now)):
            _offer(me, speaker, entry, count, s.skip, now)
            return
        if not entry.change or not _is_applied(entry, s.skip):
            _take(me, entry, count, s.skip, now)
        if has_read_back:
            claims.contend(me, heard, (s.task,), not entry.is_shared)
        _answer(me, speaker, entry, now)


def _do_not_know(me: Knowledge, name: str, ref: m.TaskRef, now: float) -> None:
    """Tell a speaker that asks all for a task, unless another robot knows it, or says so first."""
    slot, words = UNSURE_SLOTS + me.rank(name, 0, now), commands.not_known(ref)
    composing.answer(me, name, composing.answer_topic(name), words, now, slot, call=name, tentative=True)


def take_order(me: Knowledge, now: float) -> None:
    """A read-back was confirmed. If the task that was ordered waited until somebody asks for it, it is open now, and
    this robot asks all for it, as the person could have done. It does not give the change a number: others may know of
    more changes, and answer with the right one."""
    entry = me.board[me.current.task] if me.current.task is not None else None
    if entry is not None and entry.known_done:
        _take(me, entry, _next(entry), False, now)
        _say_to_all(me, entry, now, m.Change(m.TaskByNumber(entry.number)))


def take_order_back(me: Knowledge, now: float) -> None:
    """A person does not want the task after all that this robot was ordered to do, and has begun: all leave it out."""
    number = me.my_task()
    fire(me, Trigger.LOST, now)
    want(me, number, True, now)


def replace_tasks(me: Knowledge, tasks: Iterable[TaskDefinition], now: float) -> None:
    """Use these tasks, and no others: nothing that is said or kept of an earlier one is about a new one of its
    number."""
    gone, added = me.board.replace(tasks)
    for number in gone:
        me.spreading.pop(number, None)
        me.report.drop(number)
        if me.current.task == number:
            fire(me, Trigger.LOST, now)
    for number in added:
        me.do(SaveChange(number, 0, False))


def _has_read_back(me: Knowledge, name: str, entry: Entry) -> bool:
    """Whether a speaker who asks for a task is a robot that was ordered to do it: it has just claimed it."""
    last = me.claim_heard
    return last.speaker == name and entry.number in last.before


def _ordered(me: Knowledge, heard: Heard, s: m.Order) -> None:
    """An order to all robots means that one of them is to do the task, once more if it was done."""
    entry = me.board.find(s.task)
    if isinstance(heard.to, m.ToRobot):
        commands.order(me, heard, s)
    elif entry is not None:
        changed(me, heard, m.Change(m.TaskByNumber(entry.number)))
    else:
        _do_not_know(me, heard.name, s.task, heard.now)


def _is_applied(entry: Entry, skip: bool) -> bool:
    return entry.known_done if skip else entry.state != DONE and not entry.failed_by


def _next(entry: Entry) -> int:
    """The number of the next change; 0 (unknown) for a recurring task if this robot does not know the occurrence."""
    return entry.change + 1 if entry.change or not entry.recurs else 0


def _compare(me: Knowledge, heard: Heard, entry: Entry, skip: bool, spoken: int) -> None:
    """Accept a newer change and correct an older one; of two changes with one number, "do it again" holds."""
    number, now = entry.number, heard.now
    count = counted(entry, spoken)
    if has_missed := count <= entry.change and _was_also_heard(me, entry, skip, now):
        count = entry.change + 1
    is_next = not skip and count == entry.change + 1
    if is_next and schedule.begin_what_comes(me, entry, now, 2.0 * schedule.SKEW_S) and entry.state == DONE:
        schedule.open_anew(me, entry, now, is_due=True)  # the coming one, which has begun for a clock that is ahead
    if skip and count == entry.change + 1 and _is_done_by_another(entry, heard.name):
        me.board.change(number, count, False)  # who did it had missed that it was to be left out
    differs = skip is not entry.skipped
    if not skip and schedule.has_just_done(entry, now):
        entry.change = count
    by_ear = entry.recurs and me.clock_s is None and count != entry.change  # its own number may be misheard
    if count > entry.change or by_ear or (count == entry.change and differs and not skip and entry.known_done):
        if not _was_heard(entry, count, now) and not _is_believed(me, heard, entry, count, skip):
            entry.rumoured_change = count, now
        else:
            _take(me, entry, count, skip, now)
            if has_missed or (skip and not entry.skipped):
                tell(me, heard.name, entry, now)  # or it was begun before a robot said that it is left out
        return
    if count == entry.change and differs and skip and entry.owner == heard.name and entry.known_done:
        me.board.change(number, count, True)  # it was believed to have done it, and knows better
    elif count < entry.change or (differs and skip and not entry.known_done):
        tell(me, heard.name, entry, now)
    elif not entry.skipped and entry.known_done and (entry.owner != heard.name or entry.is_shared):
        objecting.tell_done(me, heard.name, entry, now)
    _note_said(me, number, now)


def _is_done_by_another(entry: Entry, name: str) -> bool:
    """Whether it is known which robot did a task, once and for all, and it is not this speaker."""
    return entry.known_done and not (entry.skipped or entry.recurs) and entry.owner not in (None, name)


def _was_heard(entry: Entry, count: int, now: float) -> bool:
    """Whether a change has been heard before, and not believed yet."""
    rumoured, heard_s = entry.rumoured_change
    return rumoured == count and now - heard_s < RUMOUR_S


def _was_also_heard(me: Knowledge, entry: Entry, skip: bool, now: float) -> bool:
    """Whether this robot has heard the same wish for a change: of a task that is as the opposite change wants it,
    nothing else waits to be heard again. Then who answers it has only missed earlier changes, and its number."""
    is_opposite = _is_applied(entry, not skip) and not (entry.recurs or me.acts(entry.number))
    return is_opposite and _was_heard(entry, entry.change + 1, now)


def _is_believed(me: Knowledge, heard: Heard, entry: Entry, count: int, skip: bool) -> bool:
    """Whether to accept a new number that was heard once: it may be another task's, misheard. That does no harm to a
    task that is as the change wants it, and it is unlikely in answer to this robot's own word about the task.

    The number of a recurring task may also be that of the next occurrence. A robot with a clock, which knows the
    occurrence, must hear it twice; for one without, that may be due by now, or the number answers its word that it is
    done."""
    last = me.repair.last_said
    own = m.own_words(last.statement) if last is not None else None
    objection = m.Confirmed if entry.is_shared else m.Completed
    refs = own.tasks if isinstance(own, m.Completed | objection) else ()
    is_answer = is_for_me_alone(me, heard.to) and any(me.board.find(ref) is entry for ref in refs)
    if not entry.recurs:
        return is_answer or _is_applied(entry, skip)
    near = not entry.change or count == entry.change + 1
    by_ear = me.clock_s is None and (is_answer or schedule.may_be_due(me, entry, heard.now))
    return by_ear and near and is_for_me_alone(me, heard.to)


def believe_rumours(me: Knowledge, heard: Heard, claim: m.Statement | None) -> None:
    """A robot claims a task that this one has heard once is to be done again: that was not misheard."""
    refs = claim.tasks if isinstance(claim, m.Claim) and not isinstance(heard.to, m.ToRobot) else ()
    for entry in me.board.known(refs):
        if not entry.recurs and entry.state == DONE:
            count, _ = entry.rumoured_change
            if count > entry.change and _was_heard(entry, count, heard.now):
                _take(me, entry, count, False, heard.now)


def counted(entry: Entry, spoken: int) -> int:
    """The change that a spoken number means: the nearest to the last one that is known."""
    if not entry.change:
        return spoken
    ahead = (spoken - entry.change) % CHANGES
    return entry.change + (ahead if ahead <= CHANGES // 2 else ahead - CHANGES)


def _take(me: Knowledge, entry: Entry, count: int, skip: bool, now: float) -> None:
    number = entry.number
    skip = skip and not me.acts(number)
    if not skip and (entry.state != CLAIMED or entry.failed_by or not entry.recurs):  # others may have missed it
        schedule.reopen(me, entry, now)
    me.board.change(number, count, skip)
    if skip and me.current.task == number:
        fire(me, Trigger.LOST, now)
    if count:
        me.spreading[number] = (now + SPREAD_S * (1.0 + me.rng.random()), 1)
    me.reconsider(now)


def tell(me: Knowledge, other: str, entry: Entry, now: float) -> None:
    """Another robot has missed the last change."""
    number = entry.number
    slot = OWNER_SLOT if me.current.task == number else objection_slot(me, other, number, now)
    composing.answer(me, other, f"change {number}", composing.change(entry), now, slot, call=other)


def _answer(me: Knowledge, name: str, entry: Entry, now: float, on_said: Callable[[], None] = nothing) -> None:
    """One robot answers the person who wanted a change, with its number, so that others learn the number too; or says
    that it has just begun at what is to be left out."""
    number, change = entry.number, composing.change(entry)
    slot = me.rank(name, number, now) + (UNSURE_SLOTS if me.state in NEWCOMER else 0)
    if entry.state == CLAIMED:  # the robot that has it may have begun
        slot = OWNER_SLOT if me.current.task == number else slot + 1

    def compose() -> m.Utterance:
        has_begun = change.skip and me.acts(number)
        return composing.to_asker(me, name, m.Working(change.task) if has_begun else change)

    topic, call = f"change {number}", name.lower()
    me.floor.want(Intent(Urgency.ANSWER, topic, compose, None, slot, call, tentative=True, on_said=on_said), now)


def _offer(me: Knowledge, name: str, entry: Entry, count: int, skip: bool, now: float) -> None:
    """Make the change once this robot says so to the person, or hears another one say so: a robot that has misheard
    which task is meant hears of another one."""
    entry.rumoured_change = count, now

    def take() -> None:
        if entry.change < count and not (skip and me.acts(entry.number)):
            _take(me, entry, count, skip, now)

    _answer(me, name, replace(entry, change=count, skipped=skip), now, take)


def _say_to_all(me: Knowledge, entry: Entry, now: float, words: m.Change | None = None) -> None:
    """Say it while it matters: a task done again since then is reported as such. `words`: this robot was ordered to do
    it, and says so at once, before others can claim it."""

    def compose() -> m.Utterance | None:
        matters = entry.is_changed and (entry.skipped or not entry.known_done)
        return composing.to_all(me, words or composing.change(entry)) if matters else None

    urgency = Urgency.ANSWER if words is not None else Urgency.TURN
    me.floor.want(Intent(urgency, f"change {entry.number}", compose), now)


def _note_said(me: Knowledge, number: int, now: float) -> None:
    """A robot has repeated the change."""
    _, times = me.spreading.pop(number, (now, TIMES))
    if times < TIMES:
        me.spreading[number] = (now + SPREAD_S * 2.0**times * (1.0 + me.rng.random()), times + 1)


def next_s(me: Knowledge) -> float:
    """When the next repetition of a change is due, s; infinity if none is."""
    return min((at_s for at_s, _ in me.spreading.values()), default=math.inf)


def spread(me: Knowledge, now: float) -> None:
    """Repeat the changes that are due."""
    for number in [number for number, (at_s, _) in me.spreading.items() if at_s <= now]:
        _note_said(me, number, now)
        if me.peers.present(now):
            _say_to_all(me, me.board[number], now)


REACTIONS: Reactions = {m.Change: changed, m.Order: _ordered}
