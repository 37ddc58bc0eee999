"""A "stop" that is meant for many reaches those who are out of earshot of who said it.

Whoever halts says so. A robot that has not heard all others say it, says "stop" once itself, in its own name: so each
robot that hears one is heard in turn, across a team that hears itself only from one to the next. A robot that stands
says it no more, however often it hears it, so that the talk ends; and nobody's "resume" is passed on.

Only what was understood as a sentence is passed on. A word spotted under other talk halts whoever heard it, for a halt
too many is cheap; it is not sure enough to halt those who heard nothing.
"""

from __future__ import annotations

from hvcpd.coordination import composing
from hvcpd.coordination.addressing import is_for
from hvcpd.coordination.floor import RANK_MAX, Urgency
from hvcpd.coordination.knowledge import Knowledge
from hvcpd.coordination.people import SURE
from hvcpd.coordination.states import State, Trigger
from hvcpd.coordination.table import fire
from hvcpd.language import messages as m


def stop(me: Knowledge, u: m.Utterance, confidence: float, now: float) -> None:
    """Halt, and see to it that all for whom it was meant do."""
    note_halted(me, u.speaker, now)
    if not is_for(me, u) or _stands(me):
        return
    fire(me, Trigger.STOP, now)
    if not _stands(me) or confidence < SURE or isinstance(u.addressee, m.ToRobot):
        return
    again = composing.utterance(me, u.addressee or m.ToAll(), m.Stop())
    compose = lambda: again if _stands(me) and _somebody_goes_on(me, u, now) else None  # noqa: E731
    slot = min(len(me.peers.present(now)), RANK_MAX) + 1 + me.rank("", 0, now)  # after all who say that they halted
    me.want(Urgency.ALARM, "stop", compose, now, slot=slot)


def _stands(me: Knowledge) -> bool:
    return me.state is State.STOPPED


def note_halted(me: Knowledge, name: str | None, now: float) -> None:
    """Somebody said that it stands, or that all are to stand, itself among them."""
    peer = me.peers.get(name) if name else None
    if peer is not None:
        peer.halted_s = now


def _somebody_goes_on(me: Knowledge, u: m.Utterance, since_s: float) -> bool:
    """Whether one who may be meant, and is believed to be there, has not been heard to halt since then.

    It may be a person, who need not: once too often is better than not at all.
    """
    teams = (None, u.addressee.team) if isinstance(u.addressee, m.ToTeam) else None
    meant = [peer for peer in me.peers.all() if teams is None or peer.team in teams]
    return any(me.peers.is_present(peer.name, since_s) and peer.halted_s < since_s for peer in meant)
