"""A "stop" that is meant for many reaches those who are out of earshot of who said it.

Whoever halts says so. A robot that has not heard all others say it, says "stop" once itself, in its own name: so each
robot that hears one is heard in turn, across a team that hears itself only from one to the next. A robot that stands
says it no more, however often it hears it, so that the talk ends; and nobody's "resume" is passed on.

Only what was understood as a sentence is passed on. A word spotted under other talk halts whoever heard it, for a halt
too many is cheap; it is not sure enough to halt those who heard nothing.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from hvcpd.coordination import composing
from hvcpd.coordination.addressing import is_for
from hvcpd.coordination.floor import RANK_MAX, Urgency
from hvcpd.coordination.people import SURE
from hvcpd.coordination.table import State, Trigger
from hvcpd.language import messages as m

if TYPE_CHECKING:
    from hvcpd.coordination.coordination import Coordination


def stop(c: Coordination, u: m.Utterance, confidence: float, now: float) -> None:
    """Halt, and see to it that all for whom it was meant do."""
    note_halted(c, u.speaker, now)
    if not is_for(c, u) or _stands(c):
        return
    c.fire(Trigger.STOP, now)
    if not _stands(c) or confidence < SURE or isinstance(u.addressee, m.ToRobot):
        return
    again = composing.utterance(c, u.addressee or m.ToAll(), m.Stop())
    compose = lambda: again if _stands(c) and _somebody_goes_on(c, u, now) else None  # noqa: E731
    slot = min(len(c.peers.present(now)), RANK_MAX) + 1 + c.rank("", 0, now)  # after all who say that they halted
    c.want(Urgency.ALARM, "stop", compose, now, slot=slot)


def _stands(c: Coordination) -> bool:
    return c.state is State.STOPPED


def note_halted(c: Coordination, name: str | None, now: float) -> None:
    """Somebody said that it stands, or that all are to stand, itself among them."""
    peer = c.peers.get(name) if name else None
    if peer is not None:
        peer.halted_s = now


def _somebody_goes_on(c: Coordination, u: m.Utterance, since_s: float) -> bool:
    """Whether one who may be meant, and is believed to be there, has not been heard to halt since then.

    It may be a person, who need not: once too often is better than not at all.
    """
    teams = (None, u.addressee.team) if isinstance(u.addressee, m.ToTeam) else None
    meant = [peer for peer in c.peers.all() if teams is None or peer.team in teams]
    return any(c.peers.is_present(peer.name, since_s) and peer.halted_s < since_s for peer in meant)
