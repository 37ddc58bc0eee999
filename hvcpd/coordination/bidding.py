"""The spoken auction: who claims a task from a place that nobody knows tells the way, and who is clearly nearer bids.

From the first claim on everybody knows where a robot is bound for, and plans with that (`routes`); so only the first
claim tells its way. A bid is a claim said to whom it outbids, in the slots of objections. It counts: who is outbid
gives way, confirms it, and claims something else in the same breath. One that is nearer still may outbid the bid.
"""

from __future__ import annotations

from hvcpd.coordination import choosing, composing, effects, routes
from hvcpd.coordination.addressing import objection_slot
from hvcpd.coordination.board import OPEN, Entry
from hvcpd.coordination.floor import OWN_TURN, Intent, Urgency
from hvcpd.coordination.knowledge import Heard, Knowledge
from hvcpd.coordination.states import State, Trigger
from hvcpd.coordination.table import fire
from hvcpd.language import messages as m

CLEARLY = 0.75
"""Share of the claimant's way up to which another one is clearly nearer."""
NEARER_M = 1.0
"""And by this much at least: ways are told in whole metres."""


def is_bid(heard: Heard) -> bool:
    """Whether a claim is said to somebody who is to give way."""
    said = heard.utterance.statement
    return isinstance(said, m.Claim) and said.way_m is not None and isinstance(heard.to, m.ToRobot)


def would_bid(me: Knowledge, heard: Heard, entry: Entry, way_m: int | None) -> bool:
    """Whether this robot is clearly nearer to what was just claimed, and would do that first."""
    number, here, last = entry.definition.number, me.body.here, me.claim_heard
    was_open = last is not None and last.before.get(number, ("",))[0] == OPEN
    is_free = me.state in (State.READY, State.CLAIMING) and me.current.task is None
    able = number not in me.role.unable and me.role.name not in entry.failed_by and not entry.is_shared
    if way_m is None or here is None or not (was_open and is_free and able and me.role.nearest_first):
        return False
    own_m = routes.distance_m(here, entry.definition.place or here)
    if own_m > min(CLEARLY * way_m, way_m - NEARER_M) or not routes.is_untold(me):
        return False
    free = (entry.definition, *me.board.free_for(me.role.name, heard.now, me.role.unable))
    mine = routes.own(me, free, heard.now, without=heard.speaker)
    return choosing.may_volunteer(me, heard.now) and bool(mine) and mine[0] is entry.definition


def bid(me: Knowledge, other: str, entry: Entry, now: float) -> None:
    """Want the floor to outbid `other`, unless somebody else is heard to do so."""
    number = entry.definition.number
    fire(me, Trigger.CHOSE_CLAIM, now)  # whoever is claiming already has no row for that

    def compose() -> m.Utterance | None:
        still = me.state is State.CLAIMING and me.current.task is None and entry.owner == other
        if not still:
            return None
        ref = m.TaskByNumber(number)
        return composing.utterance(me, m.ToRobot(other), m.Claim(ref, way_m=routes.spoken_way_m(me, entry.definition)))

    def on_said() -> None:
        me.floor.withdraw(OWN_TURN)
        me.current.task, me.current.ahead, me.current.owner_before = number, None, None
        effects.claim_task(me, now)

    slot = objection_slot(me, other, number, now)
    topic, call = f"bid {number}", other.lower()
    me.floor.want(Intent(Urgency.ANSWER, topic, compose, Trigger.SPOKEN, slot, call, on_said=on_said), now)
