"""Names that were not known beforehand: they are spelled at first, to who may not know them, and when somebody asks.

Whoever does not know a name cannot understand any sentence of its owner. So both sides see to it: who is not answered
spells its name, and who hears speech time and again that cannot be understood asks for names.
"""

from __future__ import annotations

from hvcpd.coordination import composing
from hvcpd.coordination.addressing import must_spell_for
from hvcpd.coordination.floor import Urgency
from hvcpd.coordination.knowledge import Knowledge
from hvcpd.coordination.states import DEPARTING

GARBLES_MAX = 2
"""So many sentences that were not understood may have collided;"""
GARBLES_WITHIN_S = 60.0
"""more within this time are somebody whose name is not known."""
ASK_AGAIN_S = 20.0
"""Between two questions for names, at least; twice as long after each that brought no new name."""
ASK_AGAIN_MAX_S = 160.0
RESPELL_S = 60.0
"""After a name was spelled, everybody has had reason to say it; who has not may not have heard it."""
RESPELL_MAX_S = 960.0
"""A person may never say it."""


def spell_if_unknown(me: Knowledge, now: float) -> None:
    """Nobody answers: those who are there may not know who speaks."""
    if any(must_spell_for(me, name, now) for name in me.peers.present(now)):
        _spell(me, Urgency.ANSWER, now)


def spell_now_and_then(me: Knowledge, now: float) -> None:
    """Somebody is there and has never said this robot's name: spell it again, more and more rarely."""
    a = me.acquaintance
    respell_s = a.respell_s or RESPELL_S
    if me.role.listed or now < max(a.spelled_s, a.respelled_s) + respell_s:
        return
    if any(name not in a.known_by for name in me.peers.present(now)):
        a.respell_s = min(2.0 * respell_s, RESPELL_MAX_S)
        a.respelled_s = now
        _spell(me, Urgency.TURN, now)


def _spell(me: Knowledge, urgency: Urgency, now: float) -> None:
    said = composing.spelled_name(me, composing.to_team(me))
    me.want(urgency, "spell", lambda: said, now, slot=0 if urgency is Urgency.ANSWER else None)


def after_garble(me: Knowledge, now: float) -> None:
    """Speech that cannot be understood time and again, where strangers are about: ask for names."""
    a = me.acquaintance
    if (me.role.listed and not a.strangers) or me.state in DEPARTING:
        return
    a.garbled_s = (*(t for t in a.garbled_s if now - t < GARBLES_WITHIN_S), now)
    if len(a.garbled_s) <= GARBLES_MAX or now < a.ask_s:
        return
    longer_s = min(2.0 * (a.pause_s or ASK_AGAIN_S), ASK_AGAIN_MAX_S)
    a.pause_s = ASK_AGAIN_S if len(me.peers.all()) > a.met else longer_s
    a.met, a.ask_s, a.garbled_s = len(me.peers.all()), now + a.pause_s, ()
    ask = composing.spelled_name(me, composing.to_team(me), ask=True)
    me.want(Urgency.TURN, "names", lambda: ask, now)
