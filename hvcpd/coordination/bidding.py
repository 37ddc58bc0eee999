"""The spoken auction: a robot that claims a task from an unknown place states its distance, and nearer robots bid.

After a robot's first claim all others know where it is going, and plan with that (`routes`); so only the first claim
states the distance. A bid is a claim addressed to the robot that it outbids, in the slots of objections. It counts: the
robot that is outbid gives way, confirms the bid, and claims another task in the same turn. A robot that is nearer still
may outbid the bid.
"""

from __future__ import annotations

from hvcpd.coordination import choosing, composing, effects, routes
from hvcpd.coordination.addressing import objection_slot
from hvcpd.coordination.entry import OPEN, Entry
from hvcpd.coordination.floor import OWN_TURN, Intent, Urgency
from hvcpd.coordination.knowledge import Heard, Knowledge
from hvcpd.coordination.states import State, Trigger
from hvcpd.coordination.table import fire
from hvcpd.language import messages as m

CLEARLY = 0.75
"""Fraction of the claimant's distance below which another robot is clearly nearer."""
NEARER_M = 1.0
"""Least difference: distances are stated in whole metres."""


def stated_m(heard: Heard) -> int | None:
    """The distance that a claim states."""
    said = heard.utterance.statement
    return said.distance_m if isinstance(said, m.Claim) else None


def is_bid(heard: Heard) -> bool:
    """Whether a claim is addressed to a robot that should give way."""
    return stated_m(heard) is not None and isinstance(heard.to, m.ToRobot)


def would_bid(me: Knowledge, heard: Heard, entry: Entry) -> bool:
    """Whether this robot is clearly nearer to the task that was just claimed, and would do it first."""
    distance_m, here, before = stated_m(heard), me.body.here, me.claim_heard.before.get(entry.number)
    was_open = before is not None and before.state == OPEN
    is_free = me.state in (State.READY, State.CLAIMING) and me.current.task is None
    able = me.role.nearest_first and not me.lacks(entry)
    if distance_m is None or here is None or not (was_open and is_free and able):
        return False
    own_m = here.distance_m(entry.definition.place or here)
    if own_m > min(CLEARLY * distance_m, distance_m - NEARER_M) or not routes.has_unknown_place(me):
        return False
    free = (entry.definition, *me.board.free_for(me.role.name, heard.now, me.role.unable))
    mine = routes.own(me, free, heard.now, without=heard.speaker)
    return choosing.may_volunteer(me, heard.now) and bool(mine) and mine[0] is entry.definition


def bid(me: Knowledge, other: str, entry: Entry, now: float) -> None:
    """Request the floor to outbid `other`, unless another robot is heard to do so, or to confirm its claim."""
    number = entry.number
    fire(me, Trigger.CHOSE_CLAIM, now)  # a robot that already claims a task has no row for that

    def compose() -> m.Utterance | None:
        still = me.state is State.CLAIMING and me.current.task is None and entry.owner == other and not entry.firm
        if not still:
            return None
        ref = m.TaskByNumber(number)
        return composing.utterance(
            me, m.ToRobot(other), m.Claim(ref, distance_m=routes.spoken_distance_m(me, entry.definition))
        )

    def on_said() -> None:
        me.floor.withdraw(OWN_TURN)
        me.current.task, me.current.ahead, me.current.owner_before = number, None, None
        effects.claim_task(me, now)

    slot = objection_slot(me, other, number, now)
    topic, call = f"bid {number}", other.lower()
    me.floor.want(Intent(Urgency.ANSWER, topic, compose, Trigger.SPOKEN, slot, call, on_said=on_said), now)
