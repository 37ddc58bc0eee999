"""Whom a sentence is for."""

from __future__ import annotations

from hvcpd.coordination.knowledge import Knowledge
from hvcpd.language import messages as m

JUST_SPELLED_S = 20.0
"""A name that was spelled is not spelled again for so long: others who greet meanwhile have heard it too."""
OPENERS = (m.Order, m.WhatDoing, m.WhatLeft, m.WhoHere, m.ReportWanted, m.Completed, m.Failed)
"""What is said to one robot unasked; everything else that is said to one answers it."""


def is_for(me: Knowledge, u: m.Utterance) -> bool:
    """Whether the sentence is addressed to this robot, alone or among others."""
    match u.addressee:
        case m.ToRobot(name):
            return name.lower() == me.role.name.lower()
        case m.ToTeam(team):
            return me.role.team is not None and team.lower() == me.role.team.lower()
        case _:
            return True


def is_for_me_alone(me: Knowledge, u: m.Utterance) -> bool:
    return isinstance(u.addressee, m.ToRobot) and u.addressee.name.lower() == me.role.name.lower()


def whose_turn(u: m.Utterance) -> str | None:
    """Who has the turn in which this is said: an answer belongs to the turn of whom it is for."""
    if isinstance(u.addressee, m.ToRobot) and not isinstance(u.statement, OPENERS):
        return u.addressee.name
    return u.speaker


def must_spell_for(me: Knowledge, name: str | None, now: float) -> bool:
    """Whether somebody (None: everybody) may not know this robot's name, and was not told just now."""
    a = me.acquaintance
    if me.role.listed or now - a.spelled_s < JUST_SPELLED_S:
        return False
    return name is None or name.lower() not in a.known_by
