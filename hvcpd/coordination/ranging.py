"""Asked how far it is, a robot answers, so that both can measure when the two sentences arrive, and tells its interval.

`hvcpd.ranging` measures and computes; here is only who says what when.
"""

from __future__ import annotations

from hvcpd.coordination import composing
from hvcpd.coordination.addressing import is_for_me_alone
from hvcpd.coordination.knowledge import Heard, Knowledge, Reactions
from hvcpd.coordination.states import UNDER_WAY, State
from hvcpd.language import messages as m
from hvcpd.language.range_messages import measured

DRIVES = UNDER_WAY | {State.MOVING, State.RETURNING}
"""Between the two sentences a robot that drives at 0.2 m/s moves by a metre."""


def asked(me: Knowledge, heard: Heard, _: m.HowFarAway) -> None:
    if is_for_me_alone(me, heard.to):
        answer = m.CannotMeasure() if me.state in DRIVES else m.Measuring()
        composing.answer(me, heard.name, _topic(heard.name), answer, heard.now)


def tell(me: Knowledge, asker: str, ticks: int | None, now: float) -> None:
    """Tell the interval, in samples modulo 10,000; None: it could not be measured."""
    words = measured(ticks) if ticks is not None else m.CannotMeasure()
    composing.answer(me, asker, _topic(asker), words, now)


def _topic(asker: str) -> str:
    return f"measure {asker.lower()}"


REACTIONS: Reactions = {m.HowFarAway: asked}
