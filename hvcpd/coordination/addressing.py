"""Whom a sentence is for."""

from __future__ import annotations

from typing import TYPE_CHECKING

from hvcpd.language import messages as m

if TYPE_CHECKING:
    from hvcpd.coordination.coordination import Coordination

OPENERS = (m.Order, m.WhatDoing, m.WhatLeft, m.WhoHere, m.ReportWanted, m.Completed, m.Failed)
"""What is said to one robot unasked; everything else that is said to one answers it."""


def is_for(c: Coordination, u: m.Utterance) -> bool:
    """Whether the sentence is addressed to this robot, alone or among others."""
    match u.addressee:
        case m.ToRobot(name):
            return name.lower() == c.role.name.lower()
        case m.ToTeam(team):
            return c.role.team is not None and team.lower() == c.role.team.lower()
        case _:
            return True


def is_for_me_alone(c: Coordination, u: m.Utterance) -> bool:
    return isinstance(u.addressee, m.ToRobot) and u.addressee.name.lower() == c.role.name.lower()


def whose_turn(u: m.Utterance) -> str | None:
    """Who has the turn in which this is said: an answer belongs to the turn of whom it is for."""
    if isinstance(u.addressee, m.ToRobot) and not isinstance(u.statement, OPENERS):
        return u.addressee.name
    return u.speaker
