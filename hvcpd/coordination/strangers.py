"""Names that were not known beforehand: they are spelled at first, to who may not know them, and when somebody asks.

Whoever does not know a name cannot understand any sentence of its owner. So both sides see to it: who is not answered
spells its name, and who hears speech time and again that cannot be understood asks for names.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from hvcpd.coordination import composing
from hvcpd.coordination.floor import Urgency
from hvcpd.coordination.table import DEPARTING

if TYPE_CHECKING:
    from hvcpd.coordination.coordination import Coordination

JUST_SPELLED_S = 20.0
"""A name that was spelled is not spelled again for so long: others who greet meanwhile have heard it too."""
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


@dataclass
class Acquaintance:
    """Who knows this robot's name, and what it did to have its own and others' known."""

    known_by: set[str] = field(default_factory=set)
    """Who has said this robot's name, in lower case: they need not have it spelled."""
    spelled_s: float = -math.inf
    """When this robot last spelled its name."""
    strangers: bool = False
    """Somebody has spelled its name: there are robots about that were not known beforehand."""
    call_s: float | None = None
    """When this robot asks who is here, for want of somebody to give an order to;"""
    calls: int = 0
    """so often it has."""
    garbled_s: tuple[float, ...] = ()
    ask_s: float = -math.inf
    pause_s: float = ASK_AGAIN_S
    respell_s: float = RESPELL_S
    since_s: float = -math.inf
    met: int = 0
    """How many peers there were when it last asked for names."""


def must_spell_for(c: Coordination, name: str | None, now: float) -> bool:
    """Whether somebody (None: everybody) may not know this robot's name, and was not told just now."""
    a = c.acquaintance
    if c.role.listed or now - a.spelled_s < JUST_SPELLED_S:
        return False
    return name is None or name.lower() not in a.known_by


def spell_if_unknown(c: Coordination, now: float) -> None:
    """Nobody answers: those who are there may not know who speaks."""
    if any(must_spell_for(c, name, now) for name in c.peers.present(now)):
        _spell(c, Urgency.ANSWER, now)


def spell_now_and_then(c: Coordination, now: float) -> None:
    """Somebody is there and has never said this robot's name: spell it again, more and more rarely."""
    a = c.acquaintance
    if c.role.listed or now < max(a.spelled_s, a.since_s) + a.respell_s:
        return
    if any(name not in a.known_by for name in c.peers.present(now)):
        a.respell_s = min(2.0 * a.respell_s, RESPELL_MAX_S)
        a.since_s = now
        _spell(c, Urgency.TURN, now)


def _spell(c: Coordination, urgency: Urgency, now: float) -> None:
    said = composing.spelled_name(c, composing.to_team(c))
    c.want(urgency, "spell", lambda: said, now, slot=0 if urgency is Urgency.ANSWER else None)


def after_garble(c: Coordination, now: float) -> None:
    """Speech that cannot be understood time and again, where strangers are about: ask for names."""
    a = c.acquaintance
    if (c.role.listed and not a.strangers) or c.state in DEPARTING:
        return
    a.garbled_s = (*(t for t in a.garbled_s if now - t < GARBLES_WITHIN_S), now)
    if len(a.garbled_s) <= GARBLES_MAX or now < a.ask_s:
        return
    a.pause_s = ASK_AGAIN_S if len(c.peers.all()) > a.met else min(2.0 * a.pause_s, ASK_AGAIN_MAX_S)
    a.met, a.ask_s, a.garbled_s = len(c.peers.all()), now + a.pause_s, ()
    ask = composing.spelled_name(c, composing.to_team(c), ask=True)
    c.want(Urgency.TURN, "names", lambda: ask, now)
