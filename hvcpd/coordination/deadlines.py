"""Actions with a due time: repeat a sentence, give up, choose what to do next, or renew a lease."""

from __future__ import annotations

import math

from hvcpd.coordination import chatter, choosing, composing, earshot, repair, teaming
from hvcpd.coordination.entry import CLAIMED, OPEN
from hvcpd.coordination.floor import CROWD, LEFT_ALONE, Intent, Urgency
from hvcpd.coordination.knowledge import Knowledge
from hvcpd.coordination.states import UNDER_WAY, State, Trigger
from hvcpd.coordination.table import fire, states_with
from hvcpd.language import messages as m

BAD_AIR_REPEATS = 2
"""Number of unanswered repetitions after which a collision is no longer a likely cause."""
ASKS_AT_ONCE = 6
"""Number of questions about tasks that may be done before the pause between two questions doubles; and so on."""
ASKS_LEFT_OUT = 4
"""Number of questions of a robot that can do none of the tasks that are left, the first after a lease in which nobody
has claimed them; the pause doubles. By then it has heard that they are left, or that they are done."""
ASK_DOUBLINGS_MAX = 4
"""Longest pause, if no robot can tell for certain: 8 to 16 minutes."""
CALL_S = 15.0
"""Answers to a greeting have come by then; doubled each time."""
CALL_DOUBLINGS_MAX = 6
"""Maximum number of doublings of CALL_S: the robot never stops looking, in the end every 16 minutes."""
LEFT_TO_OTHERS_S = 3.0
"""A robot that leaves free tasks to others looks again after this time: shorter than a claim."""
LEAVES_UNHEARD = states_with(Trigger.UNHEARD)
"""States in which a robot may get an answer at another place."""


def time_is_over(me: Knowledge, now: float) -> None:
    """The state's time is over."""
    match me.state:
        case State.WAKING if len(me.roster) <= CROWD and choosing.claims_at_once(me, now):
            fire(me, Trigger.MET, now)
        case State.READY:
            _choose(me, now)
        case State.MEETING if not me.peers.all() and me.acquaintance.greetings < me.timing.greetings_max:
            fire(me, Trigger.GAVE_UP, now)
        case State.PROPOSED | State.CHECKING | State.ASKED:
            _again_while_heard(me, now)
        case State.GOING:
            fire(me, Trigger.ARRIVED_SURE if choosing.is_assured(me, now) else Trigger.ARRIVED, now)
        case State.REPORTED if me.current.partner is None:
            _again_while_heard(me, now)
        case State.READ_BACK | State.ORDERED | State.REPORTED:
            _again_or_give_up(me, me.timing.repeats_max, now)
        case _:
            fire(me, Trigger.TIMEOUT, now)


def renewal_s(me: Knowledge) -> float:
    """When the lease of this robot's own claim is to be renewed; infinity if it has none, or nobody is there."""
    if me.state not in UNDER_WAY or not me.peers.robots():
        return math.inf
    return me.current.claimed_s + me.timing.renewal_s


def renew_lease(me: Knowledge, now: float) -> None:
    """Say that the robot is at its task, if it has not mentioned it for long: listeners then renew the lease."""
    if now >= renewal_s(me):
        me.current.claimed_s = now
        me.board.claim(me.my_task(), me.role.name, me.lease_end_s(now))
        renewal = Intent(Urgency.TURN, "renewal", lambda: composing.renewal(me) if me.state in UNDER_WAY else None)
        me.floor.want(renewal, now)


def _again_while_heard(me: Knowledge, now: float) -> None:
    """Repeat the sentence more often if voices are heard meanwhile."""
    if me.floor.busy_since_s > me.current.asked_since_s:
        me.current.asked_since_s, me.current.heard_at = now, me.current.repeats + 1
    _again_or_give_up(me, choosing.claims_max(me), now)


def _again_or_give_up(me: Knowledge, times: int, now: float) -> None:
    me.current.repeats += 1
    chatter.raise_voice(me, now)
    if me.current.distance_m is not None and me.floor.busy_since_s > me.current.claimed_s:
        me.current.may_be_outbid = True
    if me.current.repeats >= BAD_AIR_REPEATS:
        me.missed.last_s = now
        repair.spell_if_unknown(me, now)
    if me.current.repeats < times:
        fire(me, Trigger.TIMEOUT, now)
    elif me.state in LEAVES_UNHEARD and earshot.way_back(me, now) is not None:
        me.missed.heard_work = me.missed.heard_work or me.state is State.ASKED
        fire(me, Trigger.UNHEARD, now)
    elif me.state in (State.PROPOSED, State.CHECKING) and me.board[me.my_task()].is_shared:
        teaming.leave(me, me.my_task(), now)
    else:
        fire(me, Trigger.GAVE_UP, now)


def _choose(me: Knowledge, now: float) -> None:
    repair.spell_now_and_then(me, now)
    waited = earshot.has_waited(me, now)
    if waited and earshot.way_back(me, now) is not None:
        fire(me, Trigger.UNHEARD, now)
    elif waited or (me.missed.heard_work and me.peers.present(now)):
        _ask(me, now)
    elif me.report.task is not None and me.board.shares:
        fire(me, Trigger.CHOSE_REPORT, now)
    elif me.role.coordinator and choosing.can_order(me, now):
        fire(me, Trigger.CHOSE_ORDER, now)
    elif choosing.may_claim(me, now) and not (me.floor.wants(LEFT_ALONE) or choosing.leaves_to_others(me, now)):
        fire(me, Trigger.CHOSE_CLAIM, now)
    else:
        _choose_talk_or_wait(me, now)


def _choose_talk_or_wait(me: Knowledge, now: float) -> None:
    """There is nothing to do: look for robots, report, ask about tasks that may be done, or wait."""
    if me.role.coordinator:
        _look_for_robots(me, now)
    can_do_no_more = not me.board.not_done() or _is_left_out(me, now)
    unsure = can_do_no_more and me.board.hearsay() and now >= me.missed.ask_again_s
    if me.report.task is not None:
        fire(me, Trigger.CHOSE_REPORT, now)
    elif _asks_what_is_left(me, now) and me.peers.present(now):
        me.missed.left_out_asks += 1
        me.missed.left_out_s = now + me.timing.lease_s * 2.0**me.missed.left_out_asks
        _ask(me, now)
    elif unsure and me.peers.present(now):
        pause_s = me.timing.ask_again_s * 2.0 ** min(me.missed.asked // ASKS_AT_ONCE, ASK_DOUBLINGS_MAX)
        me.missed.asked += 1
        me.missed.ask_again_s = now + pause_s * (1.0 + me.rng.random())
        _ask(me, now)
    elif unsure and (me.role.coordinator or choosing.may_volunteer(me, now)):
        for number in me.board.hearsay():
            me.board.reopen(number)  # there is nobody to ask: better twice than not at all
            me.reconsider(now)
    else:
        if not me.board.hearsay():
            me.missed.asked = 0
        if me.board.all_done:
            chatter.announce_free(me, now)
        _wait(me, now)


def _asks_what_is_left(me: Knowledge, now: float) -> bool:
    """Whether the robot has been left out for so long that it asks what is left; notes since when it is."""
    if not _is_left_out(me, now):
        me.missed.left_out_s, me.missed.left_out_asks = math.inf, 0
    elif me.missed.left_out_asks >= ASKS_LEFT_OUT:
        me.missed.left_out_s = math.inf
    elif math.isinf(me.missed.left_out_s):
        me.missed.left_out_s = now + me.timing.lease_s * (1.0 + 0.5 * me.rng.random())
    return now >= me.missed.left_out_s


def _is_left_out(me: Knowledge, now: float) -> bool:
    """Whether nothing is left but tasks that this robot cannot do, or not with the few that are there, and that nobody
    is known to do: others may have done them unheard, and it would wait for them for ever."""
    if me.role.coordinator:
        return False
    left = [me.board[number] for number in me.board.not_done()]
    is_free = all(e.state == OPEN or now >= e.lease_end_s for e in left)
    return bool(left) and is_free and not any(choosing.can_take_part(me, e, now) for e in left)


def _wait(me: Knowledge, now: float) -> None:
    claimed = (e for e in me.board.entries() if e.state == CLAIMED)
    waits = [
        now + LEFT_TO_OTHERS_S if choosing.may_claim(me, now) else None,
        *(end_s for e in claimed for end_s in (e.lease_end_s, *e.helpers.values())),
        *(e.call_s for e in me.board.entries()),
        me.missed.ask_again_s if me.board.hearsay() else None,
        me.missed.left_out_s,
        me.acquaintance.call_s,
        me.waiting.until_s,
        *(p.silent_until_s for p in me.peers.all()),
        *(heard_s + me.timing.name_conflict_s for heard_s in me.acquaintance.own_name_heard_s[:-1]),
    ]
    me.timer_s = min((t for t in waits if t is not None and t > now), default=math.inf)


def _look_for_robots(me: Knowledge, now: float) -> None:
    """A coordinator that has nobody to give an order to asks who is there: the answers to its greeting may have
    collided, and a follower never speaks unasked."""
    a = me.acquaintance
    if not me.board.not_done() or any(choosing.is_at_work(me, peer, now) for peer in me.peers.all()):
        a.call_s = None
        return
    if a.call_s is not None and now >= a.call_s:
        a.calls, a.call_s = a.calls + 1, None
        me.floor.say(Urgency.TURN, "who is here", composing.to_all(me, m.WhoHere()), now)
    if a.call_s is None:
        a.call_s = now + CALL_S * 2.0 ** min(a.calls, CALL_DOUBLINGS_MAX)


def _ask(me: Knowledge, now: float) -> None:
    me.missed.heard_work = False
    earshot.note_asked(me)
    fire(me, Trigger.CHOSE_QUESTION, now)
