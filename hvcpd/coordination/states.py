"""The states of a robot's conversation, the triggers that move it from one to the next, and groups of states."""

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
    RETURNING = "drives back to where it was last answered, or out of a place that somebody waits for"
    STOPPED = "was told to stop"
    LEAVING = "waits for the floor to say that it leaves"
    GONE = "has said that it leaves, and says no more"


class Trigger(Enum):
    TIMEOUT = "the state's time is over"
    SPOKEN = "its sentence is out"
    SPOKEN_SURE = "its read-back of a motion is out, and the order was clear"
    SPOKEN_FAREWELL = "it has said that it leaves"
    WITHDRAWN = "nothing is left to be said"
    GREETED = "its answer to a greeting is out"
    MET = "there is work: its first claim tells its name"
    CHOSE_QUESTION = "it may have missed something"
    CHOSE_CLAIM = "a task is free"
    CHOSE_REPORT = "its last report has not been confirmed"
    CHOSE_ORDER = "a task and a robot are free"
    ANSWERED = "somebody told what is left"
    LOST = "the task is another's, or is done"
    ARRIVED = "at the place of a task whose claim was confirmed long ago"
    ARRIVED_SURE = "at the place of a task that nobody else can have claimed"
    PERFORMED = "all actions are carried out"
    PERFORMED_FIRST = "all actions are carried out, and it has claimed another task with this one"
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
    LEFT_ALONE = "who was to do the task with it does not"
    STOP = "stop"
    RESUME = "resume"
    LEAVE = "it is about to be switched off"
    IN_THE_WAY = "somebody waits for the place that it rests in"


AT_WORK = frozenset({State.GOING, State.ANNOUNCING, State.CHECKING, State.ACTING})
"""Has a task that is its own."""
UNDER_WAY = frozenset({State.GOING, State.ACTING})
"""Drives to its task's place, or carries the task out: it waits for nobody."""
PROPOSING = frozenset({State.CLAIMING, State.PROPOSED, State.READING_BACK, State.READ_BACK})
"""Wants a task, and is not yet sure of it."""
NEWCOMER = frozenset({State.WAKING, State.GREETING, State.MEETING})
"""Has not heard enough to know better than others."""
DEPARTING = frozenset({State.LEAVING, State.GONE})
"""No longer takes part in the conversation; only "stop" is still obeyed."""
