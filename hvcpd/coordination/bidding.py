"""What the owner of a robot bids it by other means than by ear: `hvcpctl` over the daemon's socket."""

from __future__ import annotations

from typing import TYPE_CHECKING

from hvcpd.coordination import composing
from hvcpd.coordination.floor import Urgency
from hvcpd.coordination.table import DEPARTING, State, Trigger
from hvcpd.language import messages as m

if TYPE_CHECKING:
    from hvcpd.coordination.coordination import Coordination

MAX_BIDS = 8
"""Sentences that may wait for the floor: some 40 s of talk, after which nobody knows why they were wanted."""

_TOPICS = tuple(f"bid {number}" for number in range(MAX_BIDS))

FREE_SPEECH = (
    m.Order,
    m.WhatDoing,
    m.WhoHere,
    m.WhatLeft,
    m.ReportWanted,
    m.ComeBack,
    m.MoveBy,
    m.TurnBy,
    m.Stop,
    m.Resume,
    m.SayAgain,
    m.Remark,
)
"""What a robot may be made to say: orders, questions, calls and remarks. Every other statement tells of the robot's own
doings or binds it, and it says that only when it is so."""


def refuse_to_say(c: Coordination, u: m.Utterance) -> str | None:
    """Why this robot will not be made to say that, or None."""
    own = c.role.name
    if u.speaker is not None and u.speaker.lower() != own.lower():
        return f"this robot is {own}, not {u.speaker}; say '… I am {own}, …'"
    statement = m.own_words(u.statement)
    if statement is not None and not isinstance(statement, FREE_SPEECH):
        return f"that tells what {own} itself does or knows; {own} says so only when it is so"
    if c.state in DEPARTING:
        return f"{own} is leaving"
    if all(c.floor.wants(topic) for topic in _TOPICS):
        return f"{MAX_BIDS} sentences wait to be said already; try again when it is quieter"
    return None


def say(c: Coordination, u: m.Utterance, now: float) -> None:
    """Say it when this robot's turn comes; it must not have been refused."""
    topic = next(topic for topic in _TOPICS if not c.floor.wants(topic))
    c.want(Urgency.TURN, topic, lambda: u, now)


def stop(c: Coordination, now: float) -> bool:
    """Halt and latch, as if "stop" had been heard, and say so aloud; whether it was not stopped already."""
    moves = c.state is not State.STOPPED
    c.fire(Trigger.STOP, now)
    return moves


def tell_memory_lost(c: Coordination, now: float) -> None:
    """It was switched on stopped, for it has lost its memory: say so aloud, and once it may go ask what is left."""
    c.heard_work = True
    c.want(Urgency.ALARM, "stopped", lambda: composing.to_all(c, m.Stopped(forgot=True)), now, slot=0)


def resume(c: Coordination, now: float) -> bool:
    """Take on tasks again, as if "resume" had been heard; whether it was stopped."""
    was_stopped = c.state is State.STOPPED
    c.fire(Trigger.RESUME, now)
    return was_stopped
