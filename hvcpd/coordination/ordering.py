"""The effects of orders, which the transition table names: of those that the robot follows, and of those it gives."""

from __future__ import annotations

from functools import partial

from hvcpd.config.tasks import Action as TaskAction
from hvcpd.config.tasks import Forward, GoTo, Turn
from hvcpd.coordination import choosing, composing, effects
from hvcpd.coordination.actions import Halt, Perform
from hvcpd.coordination.entry import spoken_name
from hvcpd.coordination.floor import Urgency
from hvcpd.coordination.knowledge import Knowledge
from hvcpd.coordination.states import Trigger
from hvcpd.language import messages as m


def want_read_back(me: Knowledge, now: float) -> None:
    me.floor.withdraw(composing.answer_topic(me.current.partner))  # "I am busy" to an earlier order is no longer so
    sure = me.current.motion is not None and me.current.motion_sure
    trigger = Trigger.SPOKEN_SURE if sure else Trigger.SPOKEN
    effects.want_turn(me, composing.read_back, now, Urgency.ANSWER, trigger=trigger)


def halt_and_read_back(me: Knowledge, now: float) -> None:
    me.do(Halt())
    want_read_back(me, now)


def move(me: Knowledge, _now: float) -> None:
    """Every spoken motion is bounded: a distance, an angle, or the way home."""
    actions: tuple[TaskAction, ...] = ()
    match me.current.motion:
        case m.MoveBy(distance_m, back):
            actions = (Forward(-distance_m if back else distance_m),)
        case m.TurnBy(angle_deg):
            actions = (Turn(angle_deg),)
        case m.ComeBack() if me.body.home is not None:
            actions = (GoTo(me.body.home),)
    me.do(Perform(0, actions))


def want_order(me: Knowledge, now: float) -> None:
    """The same task again, or another one, chosen once this robot has the floor."""
    effects.want_turn(me, composing.order, now, decide=partial(choose_order, me))


def choose_order(me: Knowledge, now: float) -> None:
    if me.current.partner is None and (chosen := choosing.next_order(me, now)) is not None:
        me.current.partner, task = chosen
        me.current.task, me.current.task_ref = task.number, m.TaskByName(spoken_name(task))


def want_confirmation(me: Knowledge, now: float) -> None:
    me.board.claim(me.my_task(), me.current.partner, me.lease_end_s(now))
    if (peer := me.peers.get(me.current.partner)) is not None:
        peer.assigned = me.my_task()
    me.acquaintance.calls = 0
    _want_to_answer(me, m.Confirmed(), now)


def want_denial(me: Knowledge, now: float) -> None:
    _want_to_answer(me, m.Negative(), now)


def _want_to_answer(me: Knowledge, words: m.Statement, now: float) -> None:
    effects.want_turn(me, lambda me: composing.to_asker(me, me.current.partner, words), now, Urgency.ANSWER)


def note_refusal(me: Knowledge, now: float) -> None:
    if (peer := me.peers.get(me.current.partner)) is not None:
        peer.unable |= {me.my_task()}
    effects.rest(me, now)


def note_silence(me: Knowledge, now: float) -> None:
    if (peer := me.peers.get(me.current.partner)) is not None:
        peer.silent_until_s = now + me.timing.silent_peer_s
    effects.rest(me, now)
