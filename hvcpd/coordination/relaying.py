"""Somebody else's words: a robot that knows of a report tells it in the name of who made it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from hvcpd.coordination import claims, composing
from hvcpd.coordination.addressing import is_for_me_alone
from hvcpd.coordination.board import DONE
from hvcpd.coordination.claims import Quoted
from hvcpd.coordination.floor import Urgency
from hvcpd.language import messages as m

if TYPE_CHECKING:
    from hvcpd.coordination.coordination import Coordination


def relayed(c: Coordination, u: m.Utterance, s: m.Relayed, now: float) -> None:
    """Somebody else's words: a report is noted as its speaker's, who denies it if it never said so."""
    inner = s.statement
    if not isinstance(inner, m.Completed):
        return
    entry = c.board.find(inner.task)
    if entry is None or u.speaker is None:
        return
    number = entry.definition.number
    if s.speaker.lower() == c.role.name.lower():
        if entry.owner != c.role.name or not entry.known_done:
            said = composing.to_robot(c, u.speaker, m.Negative())
            c.want(Urgency.ANSWER, f"answer {u.speaker}", lambda: said, now, slot=claims.OWNER_SLOT)
        return
    c.quoted = Quoted(s.speaker, u.speaker, number, now)
    if claims.doubts(c, u.speaker, number, False, now):
        return
    if is_for_me_alone(c, u) or not entry.known_done:
        claims.note_done(c, s.speaker, number, now)
        c.reconsider(now)


def denied(c: Coordination, u: m.Utterance, now: float) -> None:
    """Whose words were passed on says that they are wrong: what they told of is open."""
    quoted = c.quoted
    if quoted is None or u.speaker != quoted.speaker or now - quoted.at_s > c.timing.recent_s:
        return
    entry = c.board[quoted.number]
    if entry.state == DONE and entry.owner == quoted.speaker:
        c.missed_s = now
        c.board.reopen(quoted.number)
        c.reconsider(now)
