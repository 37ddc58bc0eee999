"""The next task, claimed while the robot drives to the present one or does it, so that it never stands and waits.

The claim names both tasks ("I will complete task three and five"), or comes with the report of the one before ("task
two complete, I will complete task three and five"). So listeners treat it as a claim of two tasks. The robot goes on
to the second without a pause once a robot has confirmed both; otherwise it claims it again after its report. There is
no such claim where air time is scarce: there robots claim two tasks at once, which takes fewer sentences.
"""

from __future__ import annotations

import math
from collections.abc import Collection
from functools import partial

from hvcpd.coordination import choosing, composing
from hvcpd.coordination.floor import AHEAD, Intent, Urgency
from hvcpd.coordination.knowledge import Knowledge
from hvcpd.coordination.states import UNDER_WAY
from hvcpd.language import messages as m

AGAIN_S = 8.0
"""Least time before an unanswered claim is repeated, at most twice as long: another robot's sentence, with the pauses
before and after it."""
LOOK_S = 5.0
"""Before a robot that finds no task to claim ahead looks again: others claim theirs meanwhile."""


def want(me: Knowledge, now: float) -> None:
    """Request the floor to claim the next task, if the robot has none yet."""
    me.current.ahead_claims, me.current.ahead_s = 0, math.inf
    if len(me.my_tasks()) == 1:
        _want(me, now)


def _want(me: Knowledge, now: float) -> None:
    if len(me.my_tasks()) == 1 and choosing.task_ahead(me, now) is None:
        me.current.ahead_s = now + LOOK_S
        return
    claim = Intent(Urgency.TURN, AHEAD, partial(_compose, me), decide=partial(_choose, me))
    me.floor.want(claim, now)


def _choose(me: Knowledge, now: float) -> None:
    """Choose the task, or keep the one that was claimed and not confirmed."""
    if me.state not in UNDER_WAY or len(me.my_tasks()) > 1:
        return
    me.current.ahead, me.current.ahead_sure = choosing.task_ahead(me, now), False
    if me.current.ahead is None:
        me.current.ahead_s = now + LOOK_S
    else:
        me.board.claim(me.current.ahead, me.role.name, me.lease_end_s(now))


def _compose(me: Knowledge) -> m.Utterance | None:
    is_open = me.state in UNDER_WAY and not me.current.ahead_sure and len(me.my_tasks()) > 1
    return composing.claim_ahead(me) if is_open else None


def said(me: Knowledge, topic: str, now: float) -> None:
    """This robot has finished a sentence about that topic: an answer may begin."""
    if topic == AHEAD:
        me.current.ahead_claims += 1
        is_last = me.current.ahead_claims >= me.timing.repeats_max
        me.current.ahead_s = math.inf if is_last else now + AGAIN_S * (1.0 + me.rng.random())


def repeat(me: Knowledge, now: float) -> None:
    """Claim again what was not confirmed."""
    if now >= me.current.ahead_s:
        me.current.ahead_s = math.inf
        if me.state in UNDER_WAY and not me.current.ahead_sure:
            _want(me, now)


def confirmed(me: Knowledge, numbers: Collection[int]) -> None:
    """A robot has confirmed this robot's last sentence about these tasks."""
    if me.current.ahead in numbers:
        me.current.ahead_sure = True


def denied(me: Knowledge, now: float) -> None:
    """A robot says that the task has an owner, without a name, or that it is done, but not by which robot."""
    if me.state in UNDER_WAY and not me.current.ahead_sure:
        for number in me.my_tasks()[1:]:
            me.board.claim(number, None, now + me.timing.denied_s)
        me.current.ahead = None
