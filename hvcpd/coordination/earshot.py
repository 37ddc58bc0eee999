"""Earshot: a robot that gets no answer, however often it asks, goes back to where it last got one, and asks again
there.

A voice carries some metres. So a robot remembers where it stood when each other robot last answered it: there the two
heard each other. It goes back there once; only another answer makes it go back another time. So the way is bounded, and
no two robots follow each other: each drives to a place of its own, and two that both go back stand where they heard
each other before.

A follower that gets no orders, and knows of a task that nobody has, may be unknown to its coordinator: its greeting may
have collided. It asks for the remaining tasks, less and less often, and goes back first if it was heard elsewhere.
"""

from __future__ import annotations

from hvcpd.config.tasks import Place
from hvcpd.coordination import choosing
from hvcpd.coordination.addressing import OPENERS, is_for_me_alone
from hvcpd.coordination.knowledge import Heard, Knowledge
from hvcpd.coordination.peers import Peer
from hvcpd.language import messages as m

NEAR_M = 1.0
"""A shorter way improves no robot's hearing: at the edge of earshot, 5 to 10 m off, a voice grows by 1 to 2 dB."""
ORDER_S = 15.0
"""An order with its read-back and its confirmation takes 12.5 s: each of the others may be given one before this robot,
which waits at least as long for each."""
DOUBLINGS_MAX = 6
"""The pause doubles with each question that brought no order: from 15 s for each of the others up to 16 minutes."""

ANSWERS_ORDER = (m.Claim, m.Unable, m.Unknown, m.Busy, m.Completed, m.Failed)
"""Statements said to one robot in answer to its order, at once or when the task is over."""


def note(me: Knowledge, heard: Heard) -> None:
    """Learn from a sentence which robots hear each other."""
    said, to, alone, waiting = heard.utterance.statement, heard.to, is_for_me_alone(me, heard.to), me.waiting
    peer = me.peers.get(heard.speaker)
    if peer is not None:
        answered = alone and not isinstance(said, OPENERS)
        if answered or peer.met is None:
            peer.met = me.body.here
        peer.sought = peer.sought and not answered
    if isinstance(said, m.Order):
        waiting.giver = heard.speaker
    elif isinstance(said, ANSWERS_ORDER) and isinstance(to, m.ToRobot) and not alone:
        waiting.giver = to.name
    if alone and isinstance(said, m.Order | m.Confirmed):
        waiting.asked, waiting.until_s = 0, None
    if me.role.coordinator:  # a robot that others speak to is in their earshot, so orders to it can be passed on
        other = to.name if isinstance(to, m.ToRobot) and not alone else None
        if other and other.lower() in (me.roster or {other.lower()}) and not me.peers.is_present(other, heard.now):
            me.peers.heard(other, heard.now)
        if choosing.can_order(me, heard.now):
            me.reconsider(heard.now)


def way_back(me: Knowledge, now: float) -> Place | None:
    """The place where this robot was last answered by its partner, or by any robot if it speaks to all; None if it is
    there, or has gone there without success."""
    return next((peer.met for peer in _peers_to_seek(me, now)), None)


def note_sought(me: Knowledge, now: float) -> None:
    """The robot goes back: once for each robot that it seeks."""
    for peer in _peers_to_seek(me, now):
        peer.sought = True


def _peers_to_seek(me: Knowledge, now: float) -> list[Peer]:
    """The robots that may hear this one elsewhere; the last heard comes first."""
    wanted = me.current.partner or (me.waiting.giver if _follows(me) else None)
    peers = [me.peers.get(wanted)] if wanted is not None else me.peers.robots()
    there = [p for p in peers if p is not None and not p.sought and me.peers.is_present(p.name, now)]
    return sorted((p for p in there if _is_far(me, p.met)), key=lambda p: -p.last_heard_s)


def _is_far(me: Knowledge, place: Place | None) -> bool:
    here = me.body.here
    return place is not None and here is not None and here.distance_m(place) > NEAR_M


def _follows(me: Knowledge) -> bool:
    """Whether this robot only follows orders."""
    return not me.role.coordinator and not me.role.volunteer


def has_waited(me: Knowledge, now: float) -> bool:
    """Whether this robot, which only takes orders, has waited for one long enough; notes until when it waits."""
    waiting = me.waiting
    me.expire(now)
    if not _follows(me) or waiting.giver is None or not me.board.free_for(me.role.name, now, me.role.unable):
        waiting.until_s = None
        return False
    if waiting.until_s is None:
        pause_s = ORDER_S * max(len(me.peers.present(now)), 1) * 2.0 ** min(waiting.asked, DOUBLINGS_MAX)
        waiting.until_s = now + pause_s * (1.0 + me.rng.random())
    return now >= waiting.until_s


def note_asked(me: Knowledge) -> None:
    """The robot asks for the remaining tasks, and waits longer before it asks again."""
    me.waiting.asked, me.waiting.until_s = me.waiting.asked + 1, None
