"""The robot's conversation as one transition table.

`TRANSITIONS[state, trigger]` is the next state and the effect, a function of `effects`, that runs on the way.
A trigger that a state has no row for changes nothing. The diagram in docs/protocol.md is drawn from this table.
"""

from __future__ import annotations

from enum import Enum


class State(Enum):
    WAKING = "listens before its first word"
    GREETING = "waits for the floor to greet"
    MEETING = "has greeted and listens for answers"
    ASKING = "waits for the floor to ask what is left"
    ASKED = "has asked what is left and listens for the answer"
    READY = "is free"
    CLAIMING = "waits for the floor to claim a task"
    PROPOSED = "has claimed a task and listens for an answer"
    GOING = "drives to its task's place"
    ANNOUNCING = "has arrived and waits for the floor to say so"
    CHECKING = "has said that it begins and listens for an answer"
    ACTING = "carries the task out"
    REPORTING = "waits for the floor to report"
    REPORTED = "has reported and listens for the confirmation"
    READING_BACK = "waits for the floor to read an order back"
    READ_BACK = "has read an order back and listens for the confirmation"
    ORDERING = "waits for the floor to give an order"
    ORDERED = "has given an order and listens for the read-back"
    CONFIRMING = "waits for the floor to confirm a read-back"
    DENYING = "waits for the floor to deny a read-back"
    MOVING = "makes a motion that it was told to make"
    RETURNING = "drives back to where it was last answered"
    STOPPED = "was told to stop"
    LEAVING = "waits for the floor to say that it leaves"
    GONE = "has said that it leaves, and says no more"


class Trigger(Enum):
    TIMEOUT = "the state's time is over"
    SPOKEN = "its sentence is out"
    SPOKEN_BOTH = "its report is out, with a claim in it"
    SPOKEN_SURE = "its read-back of a motion is out, and the order was clear"
    SPOKEN_FAREWELL = "it has said that it leaves"
    WITHDRAWN = "nothing is left to be said"
    GREETED = "its answer to a greeting is out"
    CHOSE_QUESTION = "it may have missed something"
    CHOSE_CLAIM = "a task is free"
    CHOSE_REPORT = "its last report has not been confirmed"
    CHOSE_ORDER = "a task and a robot are free"
    ANSWERED = "somebody told what is left"
    LOST = "the task is another's"
    DONE_BEFORE = "the task turns out to be done"
    ARRIVED = "at the place of a task whose claim was confirmed long ago"
    ARRIVED_SURE = "at the place of a task that nobody else can have claimed"
    PERFORMED = "all actions are carried out"
    FAILED = "an action failed"
    ORDER = "an order for it was heard"
    MOTION = "a motion was ordered"
    CONFIRMED = "confirmed"
    CONFIRMED_MOTION = "the motion's read-back was confirmed"
    DENIED = "denied"
    GAVE_UP = "no answer after all repetitions"
    UNHEARD = "no answer, and it was answered elsewhere"
    RIGHT = "the read-back is right"
    WRONG = "the read-back is wrong"
    REFUSED = "the order was refused"
    STOP = "stop"
    RESUME = "resume"
    LEAVE = "it is about to be switched off"


S, T = State, Trigger

TRANSITIONS: dict[tuple[State, Trigger], tuple[State, str]] = {
    (S.WAKING, T.TIMEOUT): (S.GREETING, "want_greeting"),
    (S.WAKING, T.GREETED): (S.MEETING, "wait_for_greetings"),
    (S.GREETING, T.SPOKEN): (S.MEETING, "wait_for_greetings"),
    (S.GREETING, T.GREETED): (S.MEETING, "wait_for_greetings"),
    (S.GREETING, T.WITHDRAWN): (S.MEETING, "wait_for_greetings"),
    (S.MEETING, T.TIMEOUT): (S.READY, "rest"),
    (S.MEETING, T.GAVE_UP): (S.GREETING, "want_greeting"),
    # state by ear
    (S.READY, T.CHOSE_QUESTION): (S.ASKING, "want_question"),
    (S.ASKING, T.SPOKEN): (S.ASKED, "wait_for_answer"),
    (S.ASKING, T.ANSWERED): (S.READY, "rest"),
    (S.ASKED, T.ANSWERED): (S.READY, "rest"),
    (S.ASKED, T.TIMEOUT): (S.ASKING, "want_question"),
    (S.ASKED, T.GAVE_UP): (S.READY, "end_question"),
    # volunteering: claim, be confirmed, go, act, report
    (S.READY, T.CHOSE_CLAIM): (S.CLAIMING, "want_claim"),
    (S.CLAIMING, T.SPOKEN): (S.PROPOSED, "wait_for_objections"),
    (S.CLAIMING, T.WITHDRAWN): (S.READY, "rest"),
    (S.CLAIMING, T.LOST): (S.READY, "drop_task"),
    (S.CLAIMING, T.DONE_BEFORE): (S.READY, "drop_task"),
    (S.CLAIMING, T.DENIED): (S.READY, "leave_to_others"),
    (S.CLAIMING, T.CONFIRMED): (S.GOING, "go"),
    (S.PROPOSED, T.CONFIRMED): (S.GOING, "go"),
    (S.PROPOSED, T.TIMEOUT): (S.CLAIMING, "want_claim_again"),
    (S.PROPOSED, T.GAVE_UP): (S.GOING, "go_alone"),
    (S.PROPOSED, T.LOST): (S.READY, "drop_task"),
    (S.PROPOSED, T.DONE_BEFORE): (S.READY, "drop_task"),
    (S.PROPOSED, T.DENIED): (S.READY, "leave_to_others"),
    (S.GOING, T.ARRIVED): (S.ANNOUNCING, "want_announcement"),
    (S.GOING, T.ARRIVED_SURE): (S.ACTING, "act"),
    (S.GOING, T.FAILED): (S.REPORTING, "give_task_up"),
    (S.GOING, T.LOST): (S.READY, "drop_task"),
    (S.GOING, T.DONE_BEFORE): (S.READY, "drop_task"),
    (S.ANNOUNCING, T.SPOKEN): (S.CHECKING, "wait_for_objections"),
    (S.ANNOUNCING, T.CONFIRMED): (S.ACTING, "act"),
    (S.ANNOUNCING, T.LOST): (S.READY, "drop_task"),
    (S.ANNOUNCING, T.DONE_BEFORE): (S.READY, "drop_task"),
    (S.CHECKING, T.CONFIRMED): (S.ACTING, "act"),
    (S.CHECKING, T.TIMEOUT): (S.ANNOUNCING, "want_announcement"),
    (S.CHECKING, T.GAVE_UP): (S.ACTING, "act"),
    (S.CHECKING, T.LOST): (S.READY, "drop_task"),
    (S.CHECKING, T.DONE_BEFORE): (S.READY, "drop_task"),
    (S.ACTING, T.PERFORMED): (S.REPORTING, "finish_task"),
    (S.ACTING, T.FAILED): (S.REPORTING, "give_task_up"),
    (S.REPORTING, T.SPOKEN): (S.REPORTED, "wait_for_confirmation"),
    (S.REPORTING, T.SPOKEN_BOTH): (S.PROPOSED, "wait_for_objections"),
    (S.READY, T.CHOSE_REPORT): (S.REPORTING, "want_report"),
    (S.REPORTING, T.CONFIRMED): (S.READY, "end_report"),
    (S.REPORTING, T.WITHDRAWN): (S.READY, "end_report"),
    (S.REPORTED, T.CONFIRMED): (S.READY, "end_report"),
    (S.REPORTED, T.ORDER): (S.READING_BACK, "want_read_back"),
    (S.REPORTED, T.TIMEOUT): (S.REPORTING, "want_report"),
    (S.REPORTED, T.GAVE_UP): (S.READY, "end_report"),
    # following an order: read it back, be confirmed, go
    (S.READY, T.ORDER): (S.READING_BACK, "want_read_back"),
    (S.MEETING, T.ORDER): (S.READING_BACK, "want_read_back"),
    (S.CLAIMING, T.ORDER): (S.READING_BACK, "want_read_back"),
    (S.ASKING, T.ORDER): (S.READING_BACK, "want_read_back"),
    (S.ASKED, T.ORDER): (S.READING_BACK, "want_read_back"),
    (S.READING_BACK, T.SPOKEN): (S.READ_BACK, "wait_for_answer"),
    (S.READING_BACK, T.LOST): (S.READY, "drop_task"),
    (S.READING_BACK, T.DONE_BEFORE): (S.READY, "drop_task"),
    (S.READ_BACK, T.CONFIRMED): (S.GOING, "go"),
    (S.READ_BACK, T.ORDER): (S.READING_BACK, "want_read_back"),
    (S.READ_BACK, T.DENIED): (S.READY, "drop_task"),
    (S.READ_BACK, T.LOST): (S.READY, "drop_task"),
    (S.READ_BACK, T.DONE_BEFORE): (S.READY, "drop_task"),
    (S.READ_BACK, T.TIMEOUT): (S.READING_BACK, "want_read_back"),
    (S.READ_BACK, T.GAVE_UP): (S.READY, "drop_task"),
    # giving orders
    (S.READY, T.CHOSE_ORDER): (S.ORDERING, "want_order"),
    (S.ORDERING, T.SPOKEN): (S.ORDERED, "wait_for_answer"),
    (S.ORDERING, T.WITHDRAWN): (S.READY, "rest"),
    (S.ORDERING, T.RIGHT): (S.CONFIRMING, "want_confirmation"),
    (S.ORDERING, T.WRONG): (S.DENYING, "want_denial"),
    (S.ORDERING, T.REFUSED): (S.READY, "note_refusal"),
    (S.ORDERED, T.RIGHT): (S.CONFIRMING, "want_confirmation"),
    (S.ORDERED, T.WRONG): (S.DENYING, "want_denial"),
    (S.ORDERED, T.REFUSED): (S.READY, "note_refusal"),
    (S.ORDERED, T.LOST): (S.READY, "rest"),
    (S.ORDERED, T.DONE_BEFORE): (S.READY, "rest"),
    (S.ORDERED, T.TIMEOUT): (S.ORDERING, "want_order_again"),
    (S.ORDERED, T.GAVE_UP): (S.READY, "note_silence"),
    (S.CONFIRMING, T.SPOKEN): (S.READY, "rest"),
    (S.DENYING, T.SPOKEN): (S.ORDERING, "want_order_again"),
    # motions that people order
    (S.READY, T.MOTION): (S.READING_BACK, "want_read_back"),
    (S.MEETING, T.MOTION): (S.READING_BACK, "want_read_back"),
    (S.CLAIMING, T.MOTION): (S.READING_BACK, "want_read_back"),
    (S.READ_BACK, T.MOTION): (S.READING_BACK, "want_read_back"),
    (S.REPORTED, T.MOTION): (S.READING_BACK, "want_read_back"),
    (S.MOVING, T.MOTION): (S.READING_BACK, "turn_to_next_motion"),
    (S.READING_BACK, T.SPOKEN_SURE): (S.MOVING, "move"),
    (S.READ_BACK, T.CONFIRMED_MOTION): (S.MOVING, "move"),
    (S.MOVING, T.PERFORMED): (S.READY, "rest"),
    (S.MOVING, T.FAILED): (S.READY, "rest"),
    # out of earshot: back to where it was heard, and say it again there
    (S.READY, T.UNHEARD): (S.RETURNING, "go_back"),
    (S.ASKED, T.UNHEARD): (S.RETURNING, "go_back"),
    (S.PROPOSED, T.UNHEARD): (S.RETURNING, "go_back"),
    (S.REPORTED, T.UNHEARD): (S.RETURNING, "go_back"),
    (S.ORDERED, T.UNHEARD): (S.RETURNING, "go_back"),
    (S.RETURNING, T.PERFORMED): (S.READY, "rest"),
    (S.RETURNING, T.FAILED): (S.READY, "rest"),
    (S.RETURNING, T.CONFIRMED): (S.READY, "drop_task"),
    (S.RETURNING, T.ORDER): (S.READING_BACK, "turn_to_next_motion"),
    (S.RETURNING, T.MOTION): (S.READING_BACK, "turn_to_next_motion"),
    (S.STOPPED, T.RESUME): (S.READY, "release"),
    (S.LEAVING, T.SPOKEN_FAREWELL): (S.GONE, "fall_silent"),
    (S.LEAVING, T.STOP): (S.LEAVING, "stop_and_leave"),
    (S.GONE, T.STOP): (S.GONE, "latch"),
}

AT_WORK = frozenset({S.GOING, S.ANNOUNCING, S.CHECKING, S.ACTING})
"""Has a task that is its own."""
PROPOSING = frozenset({S.CLAIMING, S.PROPOSED, S.READING_BACK, S.READ_BACK})
"""Means to take a task, and is not yet sure of it."""
NEWCOMER = frozenset({S.WAKING, S.GREETING, S.MEETING})
"""Has not heard enough to know better than others."""
DEPARTING = frozenset({S.LEAVING, S.GONE})
"""Takes no part in the conversation any more; only "stop" is still obeyed."""

TRANSITIONS |= {(state, T.STOP): (S.STOPPED, "halt") for state in State if state not in DEPARTING | {S.STOPPED}}
TRANSITIONS |= {(state, T.LEAVE): (S.LEAVING, "want_farewell") for state in State if state not in DEPARTING}
LEAVES_UNHEARD = frozenset({state for state, trigger in TRANSITIONS if trigger is T.UNHEARD})
"""May be answered elsewhere."""
EXPECTING = frozenset({S.MEETING, S.ASKED, S.PROPOSED, S.CHECKING, S.REPORTED, S.READ_BACK, S.ORDERED})
"""Waits for somebody's answer, and stands still for it."""
