"""Whom a sentence is for."""

from __future__ import annotations

from typing import TYPE_CHECKING

from hvcpd.language import messages as m

if TYPE_CHECKING:
    from hvcpd.coordination.coordination import Coordination


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
