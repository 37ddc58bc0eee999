"""The effects that the transition table names: what happens on the way from one state to the next."""

from __future__ import annotations

from typing import TYPE_CHECKING

from hvcpd.config.tasks import Action as TaskAction
from hvcpd.config.tasks import Forward, GoTo, Turn
from hvcpd.coordination import choosing, composing, earshot
from hvcpd.coordination.actions import Halt, Perform, SaveStopped
from hvcpd.coordination.board import DONE
from hvcpd.coordination.claims import confirming_slot
from hvcpd.coordination.floor import RANK_MAX, Urgency
from hvcpd.coordination.table import Trigger
from hvcpd.language import messages as m

if TYPE_CHECKING:
    from hvcpd.coordination.coordination import Coordination

OWN_TURN = "own turn"
"""The topic of what the state machine itself wants to say; answers to others have topics of their own."""

BACK_OFF_DOUBLINGS = 2
"""The time that back-off is drawn from doubles with each attempt, so many times: up to 24 s."""


def rest(c: Coordination, now: float) -> None:
    c.task = c.task_ref = c.partner = c.motion = None
    c.repair.reset()
    c.arm(now, c.timing.decide_s)


def end_report(c: Coordination, now: float) -> None:
    """The report was confirmed, or nobody is there to confirm it."""
    if c.repeats >= c.timing.claims_max and c.peers.last_heard_s < c.asked_since_s:
        c.peers.nobody_answers()
    c.unreported = None
    rest(c, now)


def _back_off_s(c: Coordination, times: int) -> float:
    """How long to hold back a sentence that was said so many times and not answered."""
    if times == 0:
        return 0.0
    return c.chance.random() * c.timing.back_off_s * 2.0 ** min(times - 1, BACK_OFF_DOUBLINGS)


def want_greeting(c: Coordination, now: float) -> None:
    after_s = _back_off_s(c, c.greetings)
    c.greetings += 1
    c.want(Urgency.TURN, OWN_TURN, lambda: composing.greeting(c), now, trigger=Trigger.SPOKEN, after_s=after_s)


def wait_for_greetings(c: Coordination, now: float) -> None:
    c.floor.withdraw_all("greet ")  # it has said its name to all
    c.arm(now, c.timing.greeting_wait_s)


def wait_for_answer(c: Coordination, now: float) -> None:
    c.arm(now, c.timing.answer_s)


def want_question(c: Coordination, now: float) -> None:
    if c.repeats == 0:
        c.asked_since_s = now
    ask = composing.to_all(c, m.WhatLeft())
    after_s = _back_off_s(c, c.repeats)
    c.want(Urgency.TURN, OWN_TURN, lambda: ask, now, trigger=Trigger.SPOKEN, after_s=after_s)


def end_question(c: Coordination, now: float) -> None:
    if c.peers.last_heard_s < c.asked_since_s:
        c.peers.nobody_answers()
        c.ask_again_s = now
    rest(c, now)


def want_claim(c: Coordination, now: float) -> None:
    c.task = None
    c.want(Urgency.TURN, OWN_TURN, lambda: composing.claim(c, now), now, trigger=Trigger.SPOKEN)


def want_claim_again(c: Coordination, now: float) -> None:
    after_s = _back_off_s(c, c.repeats)
    c.want(Urgency.AGAIN, OWN_TURN, lambda: composing.claim(c, now), now, trigger=Trigger.SPOKEN, after_s=after_s)


def wait_for_objections(c: Coordination, now: float) -> None:
    """Time for everybody's slot; the last statement of this kind tells until when a confirmation holds."""
    if c.repeats == 0:
        c.asked_since_s = now
    slots = confirming_slot(c, now) + min(len(c.peers.present(now)), RANK_MAX)
    c.arm(now, c.timing.objection_s + slots * c.timing.slot_s)


def wait_for_confirmation(c: Coordination, now: float) -> None:
    if c.partner is not None:
        wait_for_answer(c, now)
    else:
        wait_for_objections(c, now)


def go(c: Coordination, now: float) -> None:
    _report_before(c, Urgency.TURN, now)
    c.unreported = None
    c.repeats = 0
    c.board.claim(c.my_task(), c.role.name, c.lease_end_s(now))
    if c.partner is not None:
        c.claimed_s = now
    c.do(Perform(c.my_task(), _split(c)[0]))


def go_alone(c: Coordination, now: float) -> None:
    """Nobody has answered, however often it was said: there is nobody."""
    if c.peers.last_heard_s < c.asked_since_s:
        c.peers.nobody_answers()
    go(c, now)


def act(c: Coordination, _now: float) -> None:
    c.do(Perform(c.my_task(), _split(c)[1]))


def _split(c: Coordination) -> tuple[tuple[TaskAction, ...], tuple[TaskAction, ...]]:
    """The task's way there, and what is done there."""
    actions = c.board[c.my_task()].definition.actions
    n = next((i for i, a in enumerate(actions) if not isinstance(a, GoTo | Forward | Turn)), len(actions))
    return actions[:n], actions[n:]


def want_announcement(c: Coordination, now: float) -> None:
    c.want(
        Urgency.AGAIN if c.repeats else Urgency.TURN,
        OWN_TURN,
        lambda: composing.working(c),
        now,
        trigger=Trigger.SPOKEN,
        after_s=_back_off_s(c, c.repeats),
    )


def finish_task(c: Coordination, now: float) -> None:
    c.board.complete(c.my_task(), c.role.name)
    _report_first_time(c, now)


def give_task_up(c: Coordination, now: float) -> None:
    c.do(Halt())
    c.board.give_up(c.my_task(), c.role.name)
    _report_first_time(c, now)


def _report_first_time(c: Coordination, now: float) -> None:
    c.unreported, c.task, c.told_report = c.task, None, False
    c.repeats = 0
    want_report(c, now)


def want_report(c: Coordination, now: float) -> None:
    c.want(
        Urgency.AGAIN if c.repeats else Urgency.TURN,
        OWN_TURN,
        lambda: composing.report(c, now),
        now,
        trigger=Trigger.SPOKEN,
        after_s=_back_off_s(c, c.repeats),
    )


def let_go(c: Coordination) -> None:
    """Stand still, and give the task back if it is not done."""
    c.do(Halt())
    if c.task is not None and c.board[c.task].owner == c.role.name:
        c.board.release(c.task)


def go_back(c: Coordination, now: float) -> None:
    """What was to be said is still due there: a claim or an order is chosen anew, a report or a question said again."""
    let_go(c)
    place = earshot.way_back(c, now)
    earshot.note_sought(c, now)
    c.task = c.task_ref = c.partner = None
    c.do(Perform(0, (GoTo(place),) if place is not None else ()))


def drop_task(c: Coordination, now: float) -> None:
    let_go(c)
    rest(c, now)


def leave_to_others(c: Coordination, now: float) -> None:
    """Somebody knows that the task is another's, without saying whose; or that it is done, and not by whom: whoever is
    denied it again asks what is left."""
    entry = c.board[c.my_task()]
    entry.times_denied += 1
    c.heard_work = c.heard_work or entry.times_denied >= choosing.DENIED_OFTEN
    c.board.claim(c.my_task(), None, now + c.timing.denied_s)
    rest(c, now)


def want_read_back(c: Coordination, now: float) -> None:
    trigger = Trigger.SPOKEN_SURE if c.motion is not None and c.motion_sure else Trigger.SPOKEN
    c.want(Urgency.ANSWER, OWN_TURN, lambda: composing.read_back(c), now, trigger=trigger, slowly=c.repair.speak_slowly)


def turn_to_next_motion(c: Coordination, now: float) -> None:
    c.do(Halt())
    want_read_back(c, now)


def move(c: Coordination, _now: float) -> None:
    """Every spoken motion is bounded: a distance, an angle, or the way home."""
    action: TaskAction | None = None
    match c.motion:
        case m.MoveBy(distance_m, back):
            action = Forward(-distance_m if back else distance_m)
        case m.TurnBy(angle_deg):
            action = Turn(angle_deg)
        case m.ComeBack() if c.home is not None:
            action = GoTo(c.home)
        case _:
            pass
    c.do(Perform(0, (action,) if action is not None else ()))


def want_order(c: Coordination, now: float) -> None:
    c.want(Urgency.TURN, OWN_TURN, lambda: composing.order(c, now), now, trigger=Trigger.SPOKEN)


def want_order_again(c: Coordination, now: float) -> None:
    slowly = c.repair.speak_slowly
    c.want(Urgency.TURN, OWN_TURN, lambda: composing.same_order(c), now, trigger=Trigger.SPOKEN, slowly=slowly)


def want_confirmation(c: Coordination, now: float) -> None:
    if c.partner is not None:
        c.board.claim(c.my_task(), c.partner, c.lease_end_s(now))
        peer = c.peers.get(c.partner)
        if peer is not None:
            peer.assigned = c.my_task()
        c.acquaintance.calls = 0
    confirmed = composing.to_partner(c, m.Confirmed())
    c.want(Urgency.ANSWER, OWN_TURN, lambda: confirmed, now, trigger=Trigger.SPOKEN)


def want_denial(c: Coordination, now: float) -> None:
    denial = composing.to_partner(c, m.Negative())
    c.want(Urgency.ANSWER, OWN_TURN, lambda: denial, now, trigger=Trigger.SPOKEN)


def note_refusal(c: Coordination, now: float) -> None:
    peer = c.peers.get(c.partner) if c.partner else None
    if peer is not None:
        peer.unable |= {c.my_task()}
    rest(c, now)


def note_silence(c: Coordination, now: float) -> None:
    peer = c.peers.get(c.partner) if c.partner else None
    if peer is not None:
        peer.silent_until_s = now + c.timing.silent_peer_s
    rest(c, now)


def release(c: Coordination, now: float) -> None:
    """Resume starts no old motion: the robot is free."""
    c.do(SaveStopped(False))
    rest(c, now)


def want_farewell(c: Coordination, now: float) -> None:
    """Give the task back and say so; what was finished and not yet confirmed is reported once more before."""
    let_go(c)
    c.floor.clear()
    _report_before(c, Urgency.ALARM, now)
    c.task = c.task_ref = c.partner = c.motion = c.unreported = None
    c.arm_until(None)
    _want_to_say_farewell(c, now)


def _want_to_say_farewell(c: Coordination, now: float) -> None:
    farewell = composing.to_all(c, m.Leaving())
    c.want(Urgency.ANSWER, OWN_TURN, lambda: farewell, now, trigger=Trigger.SPOKEN_FAREWELL, slot=1)


def stop_and_leave(c: Coordination, now: float) -> None:
    """It stands, and leaves all the same; it will still be stopped when it is switched on again."""
    latch(c, now)
    if c.floor.speaking is None or c.floor.speaking.trigger is not Trigger.SPOKEN_FAREWELL:
        _want_to_say_farewell(c, now)


def latch(c: Coordination, _now: float) -> None:
    c.do(Halt())
    c.do(SaveStopped(True))


def fall_silent(c: Coordination, _now: float) -> None:
    c.floor.clear()
    c.arm_until(None)


def _report_before(c: Coordination, urgency: Urgency, now: float) -> None:
    """Say once more what is finished and was not confirmed, before it is forgotten."""
    if c.unreported is not None and c.board[c.unreported].state == DONE:
        done = composing.to_all(c, m.Completed(m.TaskByNumber(c.unreported)))
        c.want(urgency, f"done {c.unreported}", lambda: done, now, slot=0)


def halt(c: Coordination, now: float) -> None:
    """Stop, and latch: tasks, turns and motions are forgotten, and nothing but "resume" leads on."""
    let_go(c)
    c.do(SaveStopped(True))
    c.floor.clear()
    _report_before(c, Urgency.TURN, now)
    c.task = c.task_ref = c.partner = c.motion = c.unreported = None
    slot = c.rank("", 0, now)  # in turn: each wants to be heard by all others
    c.want(Urgency.ALARM, "stopped", lambda: composing.to_all(c, m.Stopped()), now, slot=slot)
