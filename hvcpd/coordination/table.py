"""The robot's conversation as one transition table.

`TRANSITIONS[state, trigger]` is the next state and the effect, a method of `Coordination`, that runs on the way.
A trigger that a state has no row for changes nothing. The diagram in docs/protocol.md is drawn from this table.
"""

from __future__ import annotations

from enum import Enum


class State(Enum):
    WAKING = "listens before its first word"
    GREETING = "waits for the floor to greet"
    MEETING = "has greeted and listens for answers"
    READY = "is free"
    CLAIMING = "waits for the floor to claim a task"
    PROPOSED = "has claimed a task and listens for objections"
    GOING = "drives to its task's place"
    ANNOUNCING = "has arrived and waits for the floor to say so"
    CHECKING = "has said that it begins, and listens for objections"
    ACTING = "carries the task out"
    REPORTING = "waits for the floor to report"
    REPORTED = "has reported to who ordered, and listens for the confirmation"
    READING_BACK = "waits for the floor to read an order back"
    READ_BACK = "has read an order back and listens for the confirmation"
    ORDERING = "waits for the floor to give an order"
    ORDERED = "has given an order and listens for the read-back"
    CONFIRMING = "waits for the floor to confirm a read-back"
    DENYING = "waits for the floor to deny a read-back"
    STOPPED = "was told to stop"


class Trigger(Enum):
    TIMEOUT = "the state's time is over"
    SPOKEN = "its sentence is out"
    WITHDRAWN = "nothing is left to be said"
    GREETED = "its answer to a greeting is out"
    CHOSE_CLAIM = "a task is free"
    CHOSE_ORDER = "a task and a robot are free"
    LOST = "the task is another's"
    ARRIVED = "at the place of a task claimed by itself"
    ARRIVED_SURE = "at the place of a task that nobody else can have claimed"
    PERFORMED = "all actions are carried out"
    FAILED = "an action failed"
    ORDER = "an order for it was heard"
    CONFIRMED = "confirmed"
    DENIED = "denied"
    GAVE_UP = "no answer after all repetitions"
    RIGHT = "the read-back is right"
    WRONG = "the read-back is wrong"
    REFUSED = "the order was refused"
    REPORT_DUE = "the report's hearer confirms reports"
    STOP = "stop"
    RESUME = "resume"


S, T = State, Trigger

TRANSITIONS: dict[tuple[State, Trigger], tuple[State, str]] = {
    (S.WAKING, T.TIMEOUT): (S.GREETING, "want_greeting"),
    (S.WAKING, T.GREETED): (S.MEETING, "wait_for_answers"),
    (S.GREETING, T.SPOKEN): (S.MEETING, "wait_for_answers"),
    (S.GREETING, T.GREETED): (S.MEETING, "wait_for_answers"),
    (S.GREETING, T.WITHDRAWN): (S.MEETING, "wait_for_answers"),
    (S.MEETING, T.TIMEOUT): (S.READY, "rest"),
    (S.MEETING, T.GAVE_UP): (S.GREETING, "want_greeting"),
    (S.READY, T.CHOSE_CLAIM): (S.CLAIMING, "want_claim"),
    (S.READY, T.CHOSE_ORDER): (S.ORDERING, "want_order"),
    (S.READY, T.ORDER): (S.READING_BACK, "want_read_back"),
    (S.MEETING, T.ORDER): (S.READING_BACK, "want_read_back"),
    (S.CLAIMING, T.ORDER): (S.READING_BACK, "want_read_back"),
    # volunteering: claim, listen, go, say so, listen, act, report
    (S.CLAIMING, T.SPOKEN): (S.PROPOSED, "listen_for_objections"),
    (S.CLAIMING, T.WITHDRAWN): (S.READY, "rest"),
    (S.PROPOSED, T.TIMEOUT): (S.GOING, "go"),
    (S.PROPOSED, T.LOST): (S.READY, "drop_task"),
    (S.GOING, T.ARRIVED): (S.ANNOUNCING, "want_announcement"),
    (S.GOING, T.ARRIVED_SURE): (S.ACTING, "act"),
    (S.GOING, T.FAILED): (S.REPORTING, "give_task_up"),
    (S.GOING, T.LOST): (S.READY, "drop_task"),
    (S.ANNOUNCING, T.SPOKEN): (S.CHECKING, "listen_for_objections"),
    (S.ANNOUNCING, T.LOST): (S.READY, "drop_task"),
    (S.CHECKING, T.TIMEOUT): (S.ACTING, "act"),
    (S.CHECKING, T.LOST): (S.READY, "drop_task"),
    (S.ACTING, T.PERFORMED): (S.REPORTING, "finish_task"),
    (S.ACTING, T.FAILED): (S.REPORTING, "give_task_up"),
    (S.REPORTING, T.SPOKEN): (S.READY, "rest"),
    (S.REPORTING, T.REPORT_DUE): (S.REPORTED, "wait_for_answer"),
    (S.REPORTED, T.CONFIRMED): (S.READY, "rest"),
    (S.REPORTED, T.ORDER): (S.READING_BACK, "want_read_back"),
    (S.REPORTED, T.TIMEOUT): (S.REPORTING, "want_report"),
    (S.REPORTED, T.GAVE_UP): (S.READY, "rest"),
    # following an order: read it back, be confirmed, go
    (S.READING_BACK, T.SPOKEN): (S.READ_BACK, "wait_for_answer"),
    (S.READING_BACK, T.LOST): (S.READY, "drop_task"),
    (S.READ_BACK, T.CONFIRMED): (S.GOING, "go"),
    (S.READ_BACK, T.ORDER): (S.READING_BACK, "want_read_back"),
    (S.READ_BACK, T.DENIED): (S.READY, "drop_task"),
    (S.READ_BACK, T.LOST): (S.READY, "drop_task"),
    (S.READ_BACK, T.TIMEOUT): (S.READING_BACK, "want_read_back"),
    (S.READ_BACK, T.GAVE_UP): (S.READY, "drop_task"),
    # giving orders
    (S.ORDERING, T.SPOKEN): (S.ORDERED, "wait_for_answer"),
    (S.ORDERING, T.WITHDRAWN): (S.READY, "rest"),
    (S.ORDERED, T.RIGHT): (S.CONFIRMING, "want_confirmation"),
    (S.ORDERED, T.WRONG): (S.DENYING, "want_denial"),
    (S.ORDERED, T.REFUSED): (S.READY, "note_refusal"),
    (S.ORDERED, T.LOST): (S.READY, "rest"),
    (S.ORDERED, T.TIMEOUT): (S.ORDERING, "want_order_again"),
    (S.ORDERED, T.GAVE_UP): (S.READY, "note_silence"),
    (S.CONFIRMING, T.SPOKEN): (S.READY, "rest"),
    (S.DENYING, T.SPOKEN): (S.ORDERING, "want_order_again"),
    (S.STOPPED, T.RESUME): (S.READY, "rest"),
} | {(state, T.STOP): (S.STOPPED, "halt") for state in State if state is not S.STOPPED}
