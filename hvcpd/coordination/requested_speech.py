"""What a robot's owner has it say by other means than by ear: `hvcpctl say` over the daemon's socket."""

from __future__ import annotations

from hvcpd.coordination.floor import Urgency
from hvcpd.coordination.knowledge import Knowledge
from hvcpd.coordination.states import DEPARTING
from hvcpd.language import messages as m

MAX_SENTENCES = 8
"""Sentences that may wait for the floor: some 40 s of talk, after which nobody knows why they were wanted."""

_TOPICS = tuple(f"requested {number}" for number in range(MAX_SENTENCES))

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


def refusal(me: Knowledge, u: m.Utterance) -> str | None:
    """Why this robot will not be made to say that, or None."""
    own = me.role.name
    if u.speaker is not None and u.speaker.lower() != own.lower():
        return f"this robot is {own}, not {u.speaker}; say '… I am {own}, …'"
    statement = m.own_words(u.statement)
    if statement is not None and not isinstance(statement, FREE_SPEECH):
        return f"that tells what {own} itself does or knows; {own} says so only when it is so"
    if me.state in DEPARTING:
        return f"{own} is leaving"
    if all(me.floor.wants(topic) for topic in _TOPICS):
        return f"{MAX_SENTENCES} sentences wait to be said already; try again when it is quieter"
    return None


def want_to_say(me: Knowledge, u: m.Utterance, now: float) -> None:
    """Say it when this robot's turn comes; it must not have been refused."""
    topic = next(topic for topic in _TOPICS if not me.floor.wants(topic))
    me.want(Urgency.TURN, topic, lambda: u, now)
