"""The robot's conversation as one transition table.

`TRANSITIONS[state, trigger]` is the next state and the effect of the transition, a function of `effects`, `ordering` or
`halting`. A trigger without a row for the present state changes nothing. `python -m release.diagram` draws it for
docs/protocol.md.
"""

from __future__ import annotations

import math
from collections.abc import Callable

from hvcpd.coordination import effects, halting, ordering
from hvcpd.coordination.floor import OWN_TURN
from hvcpd.coordination.knowledge import Knowledge
from hvcpd.coordination.states import AT_WORK, DEPARTING, PROPOSING, State, Trigger

S, T = State, Trigger

Effect = Callable[[Knowledge, float], None]
"""The effect of a transition into a state, at a time in s."""

TRANSITIONS: dict[tuple[State, Trigger], tuple[State, Effect]] = {
    (S.WAKING, T.TIMEOUT): (S.GREETING, effects.want_greeting),
    (S.WAKING, T.GREETED): (S.MEETING, effects.wait_for_greetings),
    (S.WAKING, T.MET): (S.READY, effects.rest),
    (S.GREETING, T.MET): (S.READY, effects.rest),
    (S.MEETING, T.MET): (S.READY, effects.rest),
    (S.GREETING, T.SPOKEN): (S.MEETING, effects.wait_for_greetings),
    (S.GREETING, T.GREETED): (S.MEETING, effects.wait_for_greetings),
    (S.GREETING, T.WITHDRAWN): (S.MEETING, effects.wait_for_greetings),
    (S.MEETING, T.TIMEOUT): (S.READY, effects.rest),
    (S.MEETING, T.GAVE_UP): (S.GREETING, effects.want_greeting),
    # state by ear
    (S.READY, T.CHOSE_QUESTION): (S.ASKING, effects.want_question),
    (S.ASKING, T.SPOKEN): (S.ASKED, effects.wait_for_answer),
    (S.ASKING, T.ANSWERED): (S.READY, effects.rest),
    (S.ASKED, T.ANSWERED): (S.READY, effects.rest),
    (S.ASKED, T.TIMEOUT): (S.ASKING, effects.want_question),
    (S.ASKED, T.GAVE_UP): (S.READY, effects.end_question),
    # volunteering: claim, be confirmed, go, act, report
    (S.READY, T.CHOSE_CLAIM): (S.CLAIMING, effects.want_claim),
    (S.CLAIMING, T.SPOKEN): (S.PROPOSED, effects.wait_for_objections),
    (S.CLAIMING, T.WITHDRAWN): (S.READY, effects.rest),
    (S.CLAIMING, T.DENIED): (S.READY, effects.leave_to_others),
    (S.CLAIMING, T.CONFIRMED): (S.GOING, effects.go),
    (S.PROPOSED, T.CONFIRMED): (S.GOING, effects.go),
    (S.PROPOSED, T.TIMEOUT): (S.CLAIMING, effects.want_claim),
    (S.PROPOSED, T.GAVE_UP): (S.GOING, effects.go_alone),
    (S.PROPOSED, T.DENIED): (S.READY, effects.leave_to_others),
    (S.GOING, T.ARRIVED): (S.ANNOUNCING, effects.want_announcement),
    (S.GOING, T.ARRIVED_SURE): (S.ACTING, effects.act),
    (S.GOING, T.FAILED): (S.REPORTING, effects.give_task_up),
    (S.ANNOUNCING, T.SPOKEN): (S.CHECKING, effects.wait_for_objections),
    (S.ANNOUNCING, T.CONFIRMED): (S.ACTING, effects.act),
    (S.CHECKING, T.CONFIRMED): (S.ACTING, effects.act),
    (S.CHECKING, T.TIMEOUT): (S.ANNOUNCING, effects.want_announcement),
    (S.CHECKING, T.GAVE_UP): (S.ACTING, effects.act),
    (S.ACTING, T.PERFORMED): (S.REPORTING, effects.finish_task),
    (S.ACTING, T.PERFORMED_FIRST): (S.GOING, effects.go_on),
    (S.ACTING, T.FAILED): (S.REPORTING, effects.give_task_up),
    (S.REPORTING, T.SPOKEN): (S.REPORTED, effects.wait_for_confirmation),
    (S.REPORTING, T.CHOSE_CLAIM): (S.CLAIMING, effects.claim_with_report),
    (S.READY, T.CHOSE_REPORT): (S.REPORTING, effects.want_report),
    (S.REPORTING, T.CONFIRMED): (S.READY, effects.end_report),
    (S.REPORTING, T.WITHDRAWN): (S.READY, effects.end_report),
    (S.REPORTED, T.CONFIRMED): (S.READY, effects.end_report),
    (S.REPORTED, T.TIMEOUT): (S.REPORTING, effects.want_report),
    (S.REPORTED, T.GAVE_UP): (S.READY, effects.end_report),
    # following an order or a motion: read it back, be confirmed, go
    (S.READING_BACK, T.SPOKEN): (S.READ_BACK, effects.wait_for_answer),
    (S.READ_BACK, T.CONFIRMED): (S.GOING, effects.go),
    (S.READING_BACK, T.CONFIRMED): (S.GOING, effects.go),  # said when the robot was about to repeat itself
    (S.READING_BACK, T.DENIED): (S.READY, effects.drop_task),  # or before it could say it for the first time
    (S.READING_BACK, T.CONFIRMED_MOTION): (S.MOVING, ordering.move),
    (S.READ_BACK, T.DENIED): (S.READY, effects.drop_task),
    (S.READ_BACK, T.TIMEOUT): (S.READING_BACK, ordering.want_read_back),
    (S.READ_BACK, T.GAVE_UP): (S.READY, effects.drop_task),
    # giving orders
    (S.READY, T.CHOSE_ORDER): (S.ORDERING, ordering.want_order),
    (S.ORDERING, T.SPOKEN): (S.ORDERED, effects.wait_for_answer),
    (S.ORDERING, T.WITHDRAWN): (S.READY, effects.rest),
    (S.ORDERING, T.RIGHT): (S.CONFIRMING, ordering.want_confirmation),
    (S.ORDERING, T.WRONG): (S.DENYING, ordering.want_denial),
    (S.ORDERING, T.REFUSED): (S.READY, ordering.note_refusal),
    (S.ORDERING, T.GAVE_UP): (S.READY, ordering.note_silence),  # it is busy, and said so late
    (S.ORDERED, T.RIGHT): (S.CONFIRMING, ordering.want_confirmation),
    (S.ORDERED, T.WRONG): (S.DENYING, ordering.want_denial),
    (S.ORDERED, T.REFUSED): (S.READY, ordering.note_refusal),
    (S.ORDERED, T.LOST): (S.READY, effects.rest),
    (S.ORDERED, T.TIMEOUT): (S.ORDERING, ordering.want_order),
    (S.ORDERED, T.GAVE_UP): (S.READY, ordering.note_silence),
    (S.CONFIRMING, T.SPOKEN): (S.READY, effects.rest),
    (S.DENYING, T.SPOKEN): (S.ORDERING, ordering.want_order),
    # motions that people order
    (S.MOVING, T.MOTION): (S.READING_BACK, ordering.halt_and_read_back),
    (S.READING_BACK, T.SPOKEN_SURE): (S.MOVING, ordering.move),
    (S.READ_BACK, T.CONFIRMED_MOTION): (S.MOVING, ordering.move),
    (S.MOVING, T.DENIED): (S.READY, effects.drop_task),  # also the read-back of one that was sure
    (S.MOVING, T.PERFORMED): (S.READY, effects.rest),
    (S.MOVING, T.FAILED): (S.READY, effects.rest),
    # out of earshot: back to where it was heard, and say it again there
    (S.READY, T.UNHEARD): (S.RETURNING, effects.go_back),
    (S.ASKED, T.UNHEARD): (S.RETURNING, effects.go_back),
    (S.PROPOSED, T.UNHEARD): (S.RETURNING, effects.go_back),
    (S.REPORTED, T.UNHEARD): (S.RETURNING, effects.go_back),
    (S.ORDERED, T.UNHEARD): (S.RETURNING, effects.go_back),
    (S.RETURNING, T.PERFORMED): (S.READY, effects.rest),
    (S.RETURNING, T.FAILED): (S.READY, effects.rest),
    (S.RETURNING, T.CONFIRMED): (S.READY, effects.drop_task),
    (S.RETURNING, T.ORDER): (S.READING_BACK, ordering.halt_and_read_back),
    (S.RETURNING, T.MOTION): (S.READING_BACK, ordering.halt_and_read_back),
    (S.STOPPED, T.RESUME): (S.READY, halting.release),
    (S.LEAVING, T.SPOKEN_FAREWELL): (S.GONE, halting.fall_silent),
    (S.LEAVING, T.STOP): (S.LEAVING, halting.stop_and_leave),
    (S.GONE, T.STOP): (S.GONE, halting.latch),
}

TRANSITIONS |= {(state, T.LOST): (S.READY, effects.drop_task) for state in State if state in PROPOSING | AT_WORK}
TRANSITIONS |= {
    (state, T.LEFT_ALONE): (S.READY, effects.leave_for_later) for state in State if state in PROPOSING | AT_WORK
}
TRANSITIONS |= {
    (state, T.IN_THE_WAY): (S.RETURNING, effects.make_room)
    for state in (S.WAKING, S.GREETING, S.MEETING, S.READY, S.CLAIMING, S.PROPOSED, S.REPORTING, S.REPORTED)
}
TRANSITIONS |= {(state, T.IN_THE_WAY): (S.RETURNING, effects.make_room_and_ask) for state in (S.ASKING, S.ASKED)}
TRANSITIONS |= {
    (state, trigger): (S.READING_BACK, ordering.want_read_back)
    for state in (S.MEETING, S.ASKING, S.ASKED, S.READY, S.CLAIMING, S.READ_BACK, S.REPORTED)
    for trigger in (T.ORDER, T.MOTION)
}
TRANSITIONS |= {(state, T.STOP): (S.STOPPED, halting.halt) for state in State if state not in DEPARTING | {S.STOPPED}}
TRANSITIONS |= {(state, T.LEAVE): (S.LEAVING, halting.want_farewell) for state in State if state not in DEPARTING}


def states_with(trigger: Trigger) -> frozenset[State]:
    """The states in which a trigger has a row."""
    return frozenset(state for state, each in TRANSITIONS if each is trigger)


def fire(me: Knowledge, trigger: Trigger, now: float) -> None:
    """Move along the table; a trigger without a row changes nothing."""
    row = TRANSITIONS.get((me.state, trigger))
    if row is None:
        return
    me.state, effect = row
    me.timer_s = math.inf
    me.floor.withdraw(OWN_TURN)
    effect(me, now)
