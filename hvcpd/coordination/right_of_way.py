"""Right of way: robots agree aloud on which of them enters a place with room for only one robot.

The robot that had the place last is its keeper, and only the keeper may give it to another robot: "I will use the
corridor", "confirmed the corridor". The place is thus a token that robots hand over by voice (Suzuki & Kasami 1985).
A lost sentence therefore never lets two robots in; it only makes a robot ask again. A robot on its way to the place
asks early, stops at the line outside, and enters when it is given the place. The keeper enters if nobody answers its
own request: if another robot believes that it has the place, it objects, and the keeper gives the place up. A robot
that leaves gives the place to the robot that has waited longest.

The first keeper is the robot whose name comes first among all robots that are, or may be, there. It counts as keeper
once it has listened for half a minute and heard of no other. Two robots that have missed each other may both do so;
therefore it gives the place to a robot that asks, even if it wants it as well. If it is missing or was switched off,
nobody answers requests, not even unintelligibly. After ASKS_MAX such requests in a row, whoever said them, and once the
keeper's lease has lapsed, the robot that asks takes the place. If several robots wait, the first in the alphabet does.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

from hvcpd.config.shared_places import BODY_M, LINE_M, SharedPlace
from hvcpd.config.tasks import Place
from hvcpd.coordination import chatter, composing
from hvcpd.coordination.addressing import is_for_me_alone
from hvcpd.coordination.floor import EARLY_SLOTS, OWN_TURN, Intent, Urgency
from hvcpd.coordination.knowledge import Heard, Knowledge, Reactions
from hvcpd.coordination.place_state import ANSWER_S, ASK_NEXT_S, TELL_S, PlaceState
from hvcpd.coordination.states import State, Trigger
from hvcpd.coordination.table import fire
from hvcpd.language import messages as m

ASK_AHEAD_M = 2.4
"""Before the line: a request and its answer take 7 s, and a sentence already in the air takes as long; the way 12 s."""
STEP_M = 0.05
"""Greatest distance before the line at which a robot stops; it drives as far in a step of 0.2 s."""
OUT_M = 0.1
"""A robot inside must be this much farther out before it has left: odometry may waver at the edge."""
FIRST_SLOT = 2
"""Slot of an answer from a robot that has the place only because it knows no other keeper; a keeper uses slot 0."""
HELD_SLOT, HELD_SLOTS = 2, 3
"""First slot of the robots that wait at a place, and how many slots they draw from: after the keeper's, slot 0."""
YIELD_S = 12.0
"""After a request of a robot that comes first while the keeper is missing: two of its requests, and a margin.
With ASK_NEXT_S two met (seed 10190)."""
ASKS_MAX = 4
"""Number of unanswered requests in a row after which a keeper counts as gone: at a loss of 30 %, a robot that is there
misses all of them with a probability of 0.3⁴ = 0.8 %, and whoever passes through has left by then. With six, robots
waited for more than 60 s in 22 of 1,200 missions instead of 14."""
ASKS_ALONE = 2
"""The same if no other robot was ever heard of."""
LISTENED_S = 30.0
"""A robot that has heard nothing of a place for this long knows that nobody uses it: each use takes two sentences."""
LEASE_S = 45.0
"""A robot that was given the place and does not mention it has left it by then: 4 m of it take 20 s. Each request that
it hears renews the lease, because it answers."""
REPEATED_S = 35.0
"""A robot that was given a place and keeps asking for it, without a longer break, has not heard the answer. The answer
is then repeated, by any robot that has heard it."""
LATELY_S = 25.0
"""A robot that waits asks the one that was given the place this lately by name, because that one may not know it."""
REST_S = 40.0
"""A robot that was given a place, which has since passed to another, does not ask for it again sooner. Robots that
heard it given would otherwise take this for the same request, and give a place that another one has."""


def take_places(me: Knowledge, places: Iterable[SharedPlace], now: float) -> None:
    """Use these places from now on; keep all that is known about those that have not changed."""
    known = {each.place: each for each in me.places}
    me.places = tuple(known.pop(place) if place in known else PlaceState(place, now) for place in places)
    for gone in known.values():
        me.floor.withdraw(gone.topic)
    me.floor.early_slots = EARLY_SLOTS if me.places else 0


def may_drive(me: Knowledge, way: Sequence[Place], now: float) -> bool:
    """Whether the robot may drive on, straight from one place of the `way` to the next. Asks for the places ahead, and
    gives back those behind."""
    here = me.body.here
    passing = [_may_pass(me, each, here, way, now) for each in me.places if here is not None]
    return all(passing)


def _may_pass(me: Knowledge, p: PlaceState, here: Place, way: Sequence[Place], now: float) -> bool:
    was_inside = p.inside
    p.inside = p.place.distance_m(here) < BODY_M + OUT_M * was_inside
    if p.inside:
        _have(me, p, now)
        _make_room(me, p, here, now)
        return True
    if p.place.distance_m(here) >= LINE_M:  # nearer, it would still be in the way
        p.came_from = here
    line_m = p.line_ahead_m(here, way)
    if was_inside or (p.using and line_m is None):
        _leave(me, p, now)
    if p.using:
        return True
    if line_m is None or line_m > ASK_AHEAD_M:
        _want_no_more(me, p)
        return True
    if p.wanted_s is None:
        p.wanted_s = now
        p.ask_s = now if _keeps(me, p, now) else max(now, p.again_s)
    if line_m <= STEP_M and not p.held:
        p.held = True
        if me.floor.wants(p.topic):
            _want_to_ask(me, p, now)
    return not p.held


def _make_room(me: Knowledge, p: PlaceState, here: Place, now: float) -> None:
    """Drive out if another robot waits and nothing is to be done inside; if that fails, try again after a pause."""
    tasks = (each.definition.place for each in me.board.entries())
    p.came_from = p.came_from or p.nearest_outside(here, (me.body.home, *tasks))  # if it was switched on inside
    if p.queue(now) and p.came_from is not None and now >= p.out_s:
        fire(me, Trigger.IN_THE_WAY, now)
        p.out_s = now + ASK_NEXT_S * (me.state is State.RETURNING)


def _want_no_more(me: Knowledge, p: PlaceState) -> None:
    p.wanted_s, p.ask_s, p.held = None, math.inf, False
    me.floor.withdraw(p.topic)


def _have(me: Knowledge, p: PlaceState, now: float, known: bool = False) -> None:
    """Enter, or be inside. The robot says so, unless it was given the place aloud and so this is `known`."""
    if not p.using:
        p.again_s = now + REST_S
        p.tells, p.tell_s = 0, now + TELL_S if known else now
    p.using = True
    p.keep(me.role.name, math.inf)
    _want_no_more(me, p)


def _leave(me: Knowledge, p: PlaceState, now: float) -> None:
    """This robot is outside, and gives the place to the robot that has waited longest."""
    p.using, announced, p.announced, p.tell_s = False, p.announced, False, math.inf
    queue = p.queue(now)
    if queue:
        _give(me, p, queue[0], now)
    elif announced:
        own, free, topic = me.role.name, m.PlaceFree(p.place.name), f"free {p.place.name}"
        composing.answer(me, None, topic, free, now, slot=0, still=lambda: p.keeper == own and not p.using)


def _give(me: Knowledge, p: PlaceState, name: str, now: float, sure: bool = True) -> None:
    p.waiting.pop(name, None)
    p.keep(name, now + LEASE_S)
    p.given_s, p.gave = now, True
    _say_given(me, p, name, now, None if sure else FIRST_SLOT)


def _say_given(me: Knowledge, p: PlaceState, name: str, now: float, slot: int | None) -> None:
    """In the keeper's slot or, unless another robot speaks before it, in a later one."""
    said, topic, others = m.PlaceGiven(p.place.name), f"give {p.place.name}", slot is not None
    composing.answer(me, name, topic, said, now, slot or 0, tentative=others, still=lambda: p.keeper == name)


def next_s(me: Knowledge) -> float:
    """When the next request is due, or the time for an answer ends, s; infinity if neither is pending."""
    return min((each.next_s() for each in me.places), default=math.inf)


def ask(me: Knowledge, now: float) -> None:
    """Say the requests that are due, and that this robot is inside a place; draw conclusions from silence."""
    for p in me.places:
        if now >= p.tell_s:
            p.tell(now)
            if me.expected(now) and me.state is not State.STOPPED:  # it has said that it has stopped there
                _say_taken(me, p, None, now)
        if now >= p.answer_s:
            _judge(me, p, now)
        if now >= p.ask_s:
            p.ask_s = math.inf
            _want_to_ask(me, p, now)


def _want_to_ask(me: Knowledge, p: PlaceState, now: float) -> None:
    """Before all turns; as urgently as an answer once the robot stands still, because it then blocks others too."""
    urgency, slot = Urgency.ANSWER if p.held else Urgency.AGAIN, HELD_SLOT + int(HELD_SLOTS * me.rng.random())
    was_given = p.held and p.keeper != me.role.name and now - p.given_s <= LATELY_S
    request = composing.to_asker(me, p.keeper if was_given else None, m.PlaceWanted(p.place.name))
    asked = Intent(urgency, p.topic, lambda: request if p.wanted_s is not None else None, slot=slot, early=True)
    me.floor.want(asked, now)


def said(me: Knowledge, topic: str, now: float) -> None:
    """This robot has finished a sentence about that topic: an answer to a request may begin."""
    for p in me.places:
        if p.topic == topic and p.wanted_s is not None:
            p.was_asked(None, me.floor.began_s, now)
        elif topic == f"taken {p.place.name}":
            p.hold_off(now)


def _judge(me: Knowledge, p: PlaceState, now: float) -> None:
    """The time for an answer is over, and no answer was understood."""
    somebody_spoke = me.floor.busy_since_s > p.began_s
    settled_s = me.floor.unsettled_until(now)
    if now < settled_s and (me.floor.busy or somebody_spoke or me.floor.speaking is not None):
        p.answer_s = settled_s
        return
    p.answer_s = math.inf
    answered = me.floor.busy_since_s > max(p.asked_s, me.floor.understood_s)
    p.silences = 0 if answered else p.silences + (not somebody_spoke)
    if p.asker is not None or p.wanted_s is None:
        return
    if answered:
        p.answered_s = now
    chatter.raise_voice(me, now)
    if not somebody_spoke and _is_mine(me, p, now):
        _have(me, p, now)
    else:
        p.ask_s = now if p.comes_first(me.role.name, now) else now + ASK_NEXT_S


def _is_mine(me: Knowledge, p: PlaceState, now: float) -> bool:
    """Whether silence means that this robot may enter."""
    if _keeps(me, p, now):
        return True
    if (p.keeper is not None and now < p.lease_end_s) or not p.comes_first(me.role.name, now):
        return False
    alone = not me.peers.robots() and not me.roster - {me.role.name.lower()}
    return p.silences >= (ASKS_ALONE if alone else ASKS_MAX)


def _keeps(me: Knowledge, p: PlaceState, now: float, asker: str | None = None) -> bool:
    """Whether this robot is the keeper: the last that it heard of, or the first that may be, unless another robot than
    the `asker` has asked before: nobody knows whether that one is inside."""
    if asker is not None and p.gave and now >= p.lease_end_s and p.silences >= ASKS_MAX:
        return True  # who was given it has not heard so, nor has anybody else
    own, listened_s = me.role.name.lower(), now - max(p.since_s, p.answered_s)
    if p.keeper is not None or not me.roster or not me.peers.robots() or listened_s < LISTENED_S:
        return p.keeper == me.role.name
    return own == min(me.expected(now) | {own}) and not p.waiting.keys() - {asker}


def find(me: Knowledge, name: str) -> PlaceState | None:
    """The place of that name; None if this robot's task file has none."""
    return next((each for each in me.places if each.place.name == name), None)


def wanted(me: Knowledge, heard: Heard, s: m.PlaceWanted) -> None:
    """Another robot asks for a place: give it, refuse it, or give it again."""
    p, name, now = find(me, s.place), heard.name, heard.now
    if p is None:
        return
    if is_for_me_alone(me, heard.to) and not p.gave:  # otherwise the other one does not know that it was given on
        _note_given(me, p, now)
    elif isinstance(heard.to, m.ToRobot) and p.keeper is None:
        p.keep(heard.to.name, now + LEASE_S)
    p.note_waiting(name, now)
    comes_first, sure = name.lower() < me.role.name.lower(), p.keeper == me.role.name
    if _keeps(me, p, now, name):
        if p.using or (sure and p.wanted_s is not None):
            _refuse(me, p, name, now)
        else:
            _give(me, p, name, now, sure)
            _wait(me, p, now + ASK_NEXT_S)
        return
    yield_s = YIELD_S if p.silences else ASK_NEXT_S
    due_s = p.ask_s if p.ask_s < math.inf else now
    _wait(me, p, max(due_s, now + (yield_s if comes_first else ANSWER_S)))  # an answer takes precedence
    p.was_asked(name, me.floor.busy_since_s, now)
    if p.keeper == name:
        p.waiting.pop(name)
        if now - p.given_s <= REPEATED_S:
            p.given_s, p.lease_end_s = now, now + LEASE_S
            _say_given(me, p, name, now, None if p.gave else 1 + me.rank(name, 0, now))


def _refuse(me: Knowledge, p: PlaceState, name: str, now: float) -> None:
    """The place belongs to this robot, which keeps it, says so, and hurries."""
    if not p.inside:
        _have(me, p, now)
    p.announced, p.tell_s = True, max(p.tell_s, now + TELL_S)
    _say_taken(me, p, name, now)
    me.floor.hasten(OWN_TURN)


def given(me: Knowledge, heard: Heard, s: m.PlaceGiven) -> None:
    """A robot gives the place to another."""
    p, now = find(me, s.place), heard.now
    if p is None or not isinstance(heard.to, m.ToRobot):
        return
    p.waiting.pop(heard.name, None)  # it has been inside
    if is_for_me_alone(me, heard.to):
        _note_given(me, p, now)
        if p.keeper == me.role.name and p.queue(now) and not p.using:
            _leave(me, p, now)
    elif p.using:  # another robot believes that it has it
        p.announced = True
        _say_taken(me, p, None, now)
    else:
        p.waiting.pop(heard.to.name, None)
        p.keep(heard.to.name, now + LEASE_S)
        p.given_s = now
        _wait(me, p, now + ASK_NEXT_S)


def _note_given(me: Knowledge, p: PlaceState, now: float) -> None:
    """Another robot has given this one the place, or says that it was given."""
    if p.wanted_s is not None:
        _have(me, p, now, known=True)
    elif not p.using and now >= p.again_s:  # otherwise it is a repetition of what was heard before
        p.keep(me.role.name, now)


def _say_taken(me: Knowledge, p: PlaceState, name: str | None, now: float) -> None:
    """Say that this robot has the place, to a robot that asked or to all."""
    taken = m.PlaceTaken(p.place.name, stands=me.state is State.STOPPED)
    composing.answer(me, name, f"taken {p.place.name}", taken, now, slot=0, still=lambda: p.using)


def taken(me: Knowledge, heard: Heard, s: m.PlaceTaken) -> None:
    """Another robot has the place: a robot that is not inside yields."""
    p, now = find(me, s.place), heard.now
    if p is None or p.inside:  # both are inside: too late
        return
    p.using, p.tell_s = False, math.inf
    p.waiting.pop(heard.name, None)
    p.is_taken_by(heard.name, now)
    if s.stands:
        p.lease_end_s = now + me.timing.absent_s
    _wait(me, p, now + p.pause_s(me.rng.random(), now))


def free(me: Knowledge, heard: Heard, s: m.PlaceFree) -> None:
    """A robot has left the place, and gives it to whichever robot asks."""
    p, now = find(me, s.place), heard.now
    if p is None or p.using:
        return
    p.waiting.pop(heard.name, None)
    if p.keeper != me.role.name:
        p.keep(heard.name, now)
        _wait(me, p, now)


def _wait(me: Knowledge, p: PlaceState, ask_s: float) -> None:
    """Ask again at that time, if this robot wants the place."""
    if p.wanted_s is not None:
        p.answer_s, p.ask_s = math.inf, max(ask_s, p.again_s)
        me.floor.withdraw(p.topic)


REACTIONS: Reactions = {m.PlaceWanted: wanted, m.PlaceGiven: given, m.PlaceFree: free}
