"""Passing on: a robot between two that cannot hear each other says by name what one said to the other, once."""

from __future__ import annotations

from typing import TYPE_CHECKING

from hvcpd.coordination import claims, composing
from hvcpd.coordination.addressing import is_for_me_alone
from hvcpd.coordination.floor import Urgency
from hvcpd.language import messages as m

if TYPE_CHECKING:
    from hvcpd.coordination.coordination import Coordination


def overhear(c: Coordination, u: m.Utterance, now: float) -> None:
    """Note what may have to be passed on."""


def relayed(c: Coordination, u: m.Utterance, s: m.Relayed, now: float) -> None:
    """Somebody else's words: a report is noted as its speaker's."""
    inner = s.statement
    if not isinstance(inner, m.Completed):
        return
    entry = c.board.find(inner.task)
    if entry is None or u.speaker is None:
        return
    number = entry.definition.number
    if s.speaker.lower() == c.role.name.lower():
        if entry.owner != c.role.name or not entry.known_done:  # words that were never said
            said = composing.to_robot(c, u.speaker, m.Negative())
            c.want(Urgency.ANSWER, f"answer {u.speaker}", lambda: said, now, slot=claims.OWNER_SLOT)
        return
    if is_for_me_alone(c, u) or not entry.known_done:
        claims.note_done(c, s.speaker, number, now)
        c.reconsider(now)
