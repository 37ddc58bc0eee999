"""The effects that the transition table names: the robot's actions between one state and the next."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import replace
from functools import partial

from hvcpd.config.tasks import Action as TaskAction
from hvcpd.config.tasks import GoTo, Motion
from hvcpd.coordination import ahead, chatter, choosing, composing, earshot, routes
from hvcpd.coordination.actions import Halt, Perform
from hvcpd.coordination.addressing import confirming_slot, waiting_slots
from hvcpd.coordination.floor import AHEAD, OWN_TURN, RANK_MAX, Intent, Urgency, undecided
from hvcpd.coordination.knowledge import Current, Knowledge, Report
from hvcpd.coordination.states import State, Trigger
from hvcpd.language import messages as m

DENIED_OFTEN = 2
"""Number of denials of one claim after which the robot asks for the remaining tasks: another robot's task is reported
soon, or its lease lapses."""
CALL_S = 15.0
"""Before the next call for helpers; at most twice as long."""
CALL_DOUBLINGS_MAX = 4
"""Number of doublings of that time, up to 4 to 8 minutes."""
REPORTS = ("done ", "failed ")
"""How the topics of repeated reports begin."""
BACK_OFF_DOUBLINGS = 2
"""Number of attempts for which the range of the back-off doubles: up to 24 s."""


def rest(me: Knowledge, now: float) -> None:
    me.current = Current()
    me.repair.reset()
    me.arm(now, me.timing.decide_s)


def end_report(me: Knowledge, now: float) -> None:
    """The report was confirmed, or nobody is there to confirm it."""
    me.peers.nobody_answered(me.current.asked_since_s)
    me.report.tasks = ()
    rest(me, now)


def want_turn(
    me: Knowledge,
    compose: Callable[[Knowledge], m.Utterance | None],
    now: float,
    urgency: Urgency = Urgency.TURN,
    times: int = 0,
    *,
    trigger: Trigger = Trigger.SPOKEN,
    decide: Callable[[float], Trigger | None] = undecided,
) -> None:
    """Request the floor for the state's own sentence; one that was said several `times` unanswered is held back. In a
    place that others wait for, the robot speaks before all turns: they wait for what it has to say."""
    doublings = min(times - 1, BACK_OFF_DOUBLINGS)
    after_s = me.rng.random() * me.timing.back_off_s * 2.0**doublings if times > 0 else 0.0
    intent = Intent(urgency, OWN_TURN, lambda: compose(me), trigger, not_before_s=now + after_s, decide=decide)
    intent.early = any(p.inside and p.queue(now) for p in me.places)
    me.floor.want(intent, now)


def _want_turn_again(
    me: Knowledge,
    compose: Callable[[Knowledge], m.Utterance | None],
    now: float,
    decide: Callable[[float], Trigger | None] = undecided,
) -> None:
    """The same, more urgent once it was said and not answered."""
    urgency = Urgency.AGAIN if me.current.repeats else Urgency.TURN
    want_turn(me, compose, now, urgency, me.current.repeats, decide=decide)


def want_greeting(me: Knowledge, now: float) -> None:
    me.acquaintance.greetings += 1
    want_turn(me, composing.greeting, now, times=me.acquaintance.greetings - 1)


def wait_for_greetings(me: Knowledge, now: float) -> None:
    me.floor.withdraw_all("greet ", "here ")  # it has said its name to all
    me.arm(now, me.timing.greeting_wait_s)


def wait_for_answer(me: Knowledge, now: float) -> None:
    me.arm(now, me.timing.answer_s)


def want_question(me: Knowledge, now: float) -> None:
    if me.current.repeats == 0:
        me.current.asked_since_s = now
    want_turn(me, lambda me: composing.to_all(me, m.WhatLeft()), now, times=me.current.repeats)


def end_question(me: Knowledge, now: float) -> None:
    if me.peers.nobody_answered(me.current.asked_since_s):
        me.missed.ask_again_s = now
    rest(me, now)


def want_claim(me: Knowledge, now: float) -> None:
    """A task that is still open is chosen once this robot has the floor."""
    _want_turn_again(me, composing.claim, now, partial(claim_task, me))


def claim_task(me: Knowledge, now: float) -> None:
    """Claim the same tasks again, or else one or two free ones."""
    me.acquaintance.was_busy = True
    if me.current.task is None:
        tasks = choosing.tasks_to_claim(me, now)
        if not tasks or (me.board[tasks[0]].is_shared and me.report.task is not None):
            return  # a robot that joins it confirms that, and not the report
        me.current.task, me.current.ahead = tasks[0], tasks[1] if len(tasks) > 1 else None
        me.current.owner_before = me.board[tasks[0]].owner
    else:
        tasks = me.my_tasks()
    me.current.distance_m = routes.distance_to_state_m(me, me.board[tasks[0]].definition, now)
    _hold(me, tasks, now)


def _hold(me: Knowledge, tasks: Iterable[int], now: float) -> None:
    for number in tasks:
        me.board.claim(number, me.role.name, me.lease_end_s(now))


def wait_for_objections(me: Knowledge, now: float) -> None:
    """Time for everybody's slot; the last statement of this kind tells until when a confirmation holds."""
    if me.state is State.CHECKING and me.board[me.my_task()].is_shared:
        me.current.there = True
        me.current.confirmed_to = frozenset()  # this robot must tell those that confirm this sentence
        me.arm(now, me.timing.others_s)
        return
    if me.current.repeats == 0:
        me.current.asked_since_s, me.current.heard_at = now, 0
    slots = confirming_slot(me, now) + min(len(me.expected(now)), RANK_MAX) + waiting_slots(me, now)
    me.arm(now, me.timing.objection_s + slots * me.timing.slot_s)


def wait_for_confirmation(me: Knowledge, now: float) -> None:
    if me.current.partner is not None:
        wait_for_answer(me, now)
    else:
        wait_for_objections(me, now)


def go(me: Knowledge, now: float) -> None:
    forget_report(me, Urgency.TURN, now)
    entry, me.current.repeats = me.board[me.my_task()], 0
    entry.calls, entry.parts_before = 0, frozenset()  # parts of another time may have been misheard
    me.current.confirmed_to = me.current.rivals = frozenset()
    _hold(me, me.my_tasks(), now)
    me.current.ahead_sure = me.current.ahead is not None
    if me.current.partner is not None:
        me.current.claimed_s = now
    _drive(me)
    ahead.want(me, now)


def go_alone(me: Knowledge, now: float) -> None:
    """Go without a confirmation: nobody has answered any repetition, so nobody is there."""
    me.peers.nobody_answered(me.current.asked_since_s)
    me.acquaintance.alone = True
    go(me, now)


def _drive(me: Knowledge) -> None:
    me.current.way, _ = _split(me)
    me.do(Perform(me.my_task(), me.current.way))


def drive_anew(me: Knowledge) -> None:
    """Turn to where the task is now, if that has changed on the way."""
    if me.state is State.GOING and _split(me)[0] != me.current.way:
        me.timer_s = math.inf  # that of a robot that has arrived
        _drive(me)


def act(me: Knowledge, now: float) -> None:
    me.board[me.my_task()].parts_before = frozenset()
    way, work = _split(me)
    me.do(Perform(me.my_task(), work if way == me.current.way else (*way, *work)))  # changed while it waited there
    chatter.announce_beginning(me, now)


def _split(me: Knowledge) -> tuple[tuple[TaskAction, ...], tuple[TaskAction, ...]]:
    """The way to the task, and the work there."""
    actions = me.board[me.my_task()].definition.actions
    n = next((i for i, a in enumerate(actions) if not isinstance(a, Motion)), len(actions))
    return actions[:n], actions[n:]


def want_announcement(me: Knowledge, now: float) -> None:
    _want_turn_again(me, composing.working, now)


def finish_task(me: Knowledge, now: float) -> None:
    """Mark the task, or this robot's part of it, as done."""
    me.board.complete_part(me.my_task(), me.role.name, me.lease_end_s(now))
    me.board[me.my_task()].acted_s = now
    _report_first_time(me, now, failed=False)


def go_on(me: Knowledge, now: float) -> None:
    """Go on to the second of two tasks: the first one's report waits for it."""
    done, me.current.task = me.my_tasks()
    me.current.ahead = me.current.owner_before = me.current.doubted = None
    me.board.complete(done, me.role.name)
    if me.board[done].is_changed:
        _tell_done(me, done, Urgency.TURN, now)
    else:
        me.report = Report((done,))
    _drive(me)
    ahead.want(me, now)


def give_task_up(me: Knowledge, now: float) -> None:
    me.do(Halt())
    me.board.give_up(me.my_task(), me.role.name)
    _report_first_time(me, now, failed=True)


def _report_first_time(me: Knowledge, now: float, failed: bool) -> None:
    me.report.failed = failed
    before = me.report.tasks
    if failed or me.board[me.my_task()].is_changed:
        for number in before:
            _tell_done(me, number, Urgency.TURN, now)
        before = ()
    me.report.tasks, me.report.said = (*before, me.my_task()), False
    me.current = Current(partner=me.current.partner)  # if the first of two failed, the other is claimed again later
    me.floor.withdraw(AHEAD)
    want_report(me, now)


def want_report(me: Knowledge, now: float) -> None:
    def decide(now: float) -> Trigger | None:
        if choosing.may_claim_with_report(me, now):
            claim_task(me, now)
        return Trigger.CHOSE_CLAIM if me.current.task is not None else None

    _want_turn_again(me, composing.report, now, decide)


def claim_with_report(_me: Knowledge, _now: float) -> None:
    """The report is about to be said; the robot claims the task that it has just chosen in the same turn."""


def give_tasks_back(me: Knowledge) -> None:
    """Stand still, and release the unfinished tasks."""
    me.do(Halt())
    for number in me.my_tasks():
        me.board.withdraw(number, me.role.name)


def go_back(me: Knowledge, now: float) -> None:
    """The unsaid sentence is still due there: a claim or an order is chosen again, a report or a question repeated."""
    give_tasks_back(me)
    place = earshot.way_back(me, now)
    earshot.note_sought(me, now)
    me.current = Current()
    me.do(Perform(0, (GoTo(place),) if place is not None else ()))


def make_room(me: Knowledge, _now: float) -> None:
    """Go back out to where the robot came in; there it again claims a task that it has not begun, or reports."""
    give_tasks_back(me)
    me.current = Current()
    outside = (each.came_from for each in me.places if each.inside)
    me.do(Perform(0, tuple(GoTo(place) for place in outside if place is not None)))


def make_room_and_ask(me: Knowledge, now: float) -> None:
    """The same; outside it asks what is left."""
    me.missed.heard_work = True
    make_room(me, now)


def drop_task(me: Knowledge, now: float) -> None:
    give_tasks_back(me)
    rest(me, now)


def leave_for_later(me: Knowledge, now: float) -> None:
    """Postpone a shared task for which nobody is there: call again later, less and less often."""
    entry = me.board[me.my_task()]
    entry.call_s = now + CALL_S * 2.0 ** min(entry.calls, CALL_DOUBLINGS_MAX) * (1.0 + me.rng.random())
    entry.calls += 1
    drop_task(me, now)


def leave_to_others(me: Knowledge, now: float) -> None:
    """Another robot says that the task has an owner, without a name, or that it is done, but not by which robot. A
    robot that is denied it again asks for the remaining tasks."""
    for number in me.my_tasks():
        entry = me.board[number]
        entry.times_denied += 1
        if entry.times_denied >= DENIED_OFTEN:
            me.missed.any_work = me.missed.heard_work = True
        me.board.claim(number, None, now + me.timing.denied_s)
    rest(me, now)


def say_only_reports(me: Knowledge, urgency: Urgency, now: float, slot: int = 0) -> None:
    """Withdraw everything but the owner's "stop" for others and the unconfirmed reports, including those that already
    wait for the floor."""
    me.repair.last_said = None
    for intent in me.floor.clear():
        if intent.at_once:
            me.floor.want(intent, now)
        elif intent.topic.startswith(REPORTS) and intent.call is None:
            me.floor.want(replace(intent, urgency=urgency, slot=slot), now)
    forget_report(me, urgency, now, slot)


def forget_report(me: Knowledge, urgency: Urgency, now: float, slot: int = 0) -> None:
    """Repeat once the unconfirmed report of a finished task, or of one that was given up, with the reason."""
    if me.report.failed and me.report.task is not None:
        gave_up = composing.to_all(me, m.Failed(m.TaskByNumber(me.report.task), me.report.reason))
        me.floor.say(urgency, f"failed {me.report.task}", gave_up, now, slot)
    for number in me.report.tasks if not me.report.failed else ():
        _tell_done(me, number, urgency, now, slot)
    me.report.tasks = ()


def _tell_done(me: Knowledge, number: int, urgency: Urgency, now: float, slot: int = 0) -> None:
    me.floor.say(urgency, f"done {number}", composing.to_all(me, composing.done(me, number)), now, slot)
