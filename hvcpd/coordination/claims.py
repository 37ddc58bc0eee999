"""Claims are leases. Whoever hears one objects, confirms it, or hears another one do so.

Three rules make a task be done once, and need no further talk: a claim is acted on only when somebody has confirmed
it (or nobody answers however often it is said); of two who want one task, who is at work wins over who only claims,
and of equals the name that comes first in the alphabet; objections are said before confirmations.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from hvcpd.coordination import composing, orders
from hvcpd.coordination.addressing import is_for_me_alone
from hvcpd.coordination.board import CLAIMED, Entry
from hvcpd.coordination.floor import Urgency
from hvcpd.coordination.table import AT_WORK, NEWCOMER, PROPOSING, State, Trigger
from hvcpd.language import messages as m

if TYPE_CHECKING:
    from hvcpd.coordination.coordination import Coordination

DOER_SLOT = 0
"""Who did the task objects at once;"""
OWNER_SLOT = 1
"""then who is at it, or wants it too: in one slot the two would speak at once, over and over;"""
OTHERS_SLOT = 2
"""then somebody else who knows better, in the slot of its rank."""
OTHERS_RANK_MAX = 2
"""Up to this rank each has a slot of its own before all confirmations;"""
SHARED_SLOTS = 2
"""those after it draw one of so many. If two draw the same, nobody understands them and nobody confirms."""
UNSURE_SLOTS = 4
"""Who knows little, a newcomer or one who missed the claim, answers only if the others don't."""
SMALL_TEAM = 2
"""Where so few others are, each one's knowledge counts: who is not sure of a report has it said again at once, and
does not leave it to others to know."""
HEARD_SURELY = 2
"""So often it must have been heard whose a task is, before anything is concluded from what its owner does next."""


@dataclass(frozen=True)
class HeardClaim:
    """Somebody's latest claim, and what the board said of the task before: state, owner, end of the lease."""

    speaker: str
    number: int
    before: tuple[str, str | None, float]
    at_s: float


def confirming_slot(c: Coordination, now: float) -> int:
    """Confirmations come after all objections, in the slot of each one's rank; where two are alone there is no third
    who could object."""
    others = len(c.peers.present(now))
    if others > OTHERS_RANK_MAX + 1:
        others = OTHERS_RANK_MAX + 1 + SHARED_SLOTS
    return OTHERS_SLOT + (others if others > 1 else 0)


@dataclass(frozen=True)
class Quoted:
    """A report that `by` passed on in the name of `speaker`."""

    speaker: str
    by: str
    number: int
    at_s: float


def _objection_slot(c: Coordination, other: str, number: int, now: float) -> int:
    rank = c.rank(other, number, now)
    if rank > OTHERS_RANK_MAX:
        rank = OTHERS_RANK_MAX + 1 + int(c.chance.random() * SHARED_SLOTS)
    return OTHERS_SLOT + rank


def claim(c: Coordination, u: m.Utterance, s: m.Claim, now: float) -> None:
    if u.speaker is None:
        return
    entry = c.board.find(s.task)
    if orders.answers_order(c, u):
        c.fire(Trigger.RIGHT if entry is not None and entry.definition.number == c.task else Trigger.WRONG, now)
        return
    if entry is None:
        return
    peer = c.peers.get(u.speaker)
    if is_for_me_alone(c, u) and peer is not None and peer.assigned == entry.definition.number:
        confirm_at_once(c, u.speaker, now)  # our confirmation was lost
        return
    good = contend(c, u, u.speaker, entry, False, now)
    if good and not isinstance(u.addressee, m.ToRobot):
        _confirm_in_turn(c, u.speaker, entry.definition.number, now)


def working(c: Coordination, u: m.Utterance, s: m.Working, now: float) -> None:
    entry = c.board.find(s.task)
    if entry is None or u.speaker is None:
        return
    good = contend(c, u, u.speaker, entry, True, now)
    if good and not isinstance(u.addressee, m.ToRobot):
        _confirm_in_turn(c, u.speaker, entry.definition.number, now)


def contend(c: Coordination, u: m.Utterance, other: str, entry: Entry, other_at_work: bool, now: float) -> bool:
    """Somebody takes or has a task: True if that is right as far as this robot knows; otherwise it objects."""
    number = entry.definition.number
    _note_claim(c, other, entry, now)
    if entry.known_done and entry.owner != other:
        tell_done(c, other, entry, now)
        return False
    if entry.hearsay and entry.told_by is None and entry.owner != other:
        _deny(c, other, number, entry.owner, confirming_slot(c, now) + UNSURE_SLOTS + c.rank(other, number, now), now)
        return False
    if c.task == number and c.state in PROPOSING | AT_WORK:
        return _contend_for_own(c, other, number, other_at_work, now)
    third = entry.owner if entry.state == CLAIMED and entry.owner != other else None
    live = third is not None and now < entry.lease_end_s
    answer_to_owner = isinstance(u.addressee, m.ToRobot) and u.addressee.name == third
    if third is not None and live and not other_at_work and not answer_to_owner and c.peers.is_present(third, now):
        if entry.firm:
            _deny(c, other, number, third, _objection_slot(c, other, number, now), now)
        return False
    if entry.known_done:  # by the one who claims it: it must know
        c.board.reopen(number)
    lease_end_s = c.lease_end_s(now) if other_at_work else now + c.timing.unconfirmed_lease_s
    c.board.claim(number, other, lease_end_s, firm=other_at_work)
    entry.times_heard = HEARD_SURELY if other_at_work else 1  # said again, it did not hear that it was confirmed
    return third is None


def _deny(c: Coordination, other: str, number: int, owner: str | None, slot: int, now: float) -> None:
    """Object for another one, if it still has the task, or still may have done it, when this robot's turn comes."""
    denial = composing.to_robot(c, other, m.Negative())
    compose = lambda: denial if c.board[number].owner == owner else None  # noqa: E731
    c.want(Urgency.ANSWER, f"deny {number}", compose, now, slot=slot, call=other.lower())


def _note_claim(c: Coordination, other: str, entry: Entry, now: float) -> None:
    """Remember who claimed what last, and what was known of it before: objections refer to that."""
    number, last = entry.definition.number, c.heard_claim
    if last is None or last.speaker != other or last.number != number or now - last.at_s > c.timing.recent_s:
        c.heard_claim = HeardClaim(other, number, (entry.state, entry.owner, entry.lease_end_s), now)


def _contend_for_own(c: Coordination, other: str, number: int, other_at_work: bool, now: float) -> bool:
    mine, theirs = (c.state not in AT_WORK, c.role.name.lower()), (not other_at_work, other.lower())
    if c.state is State.ACTING or mine < theirs:
        at_work = c.state in AT_WORK
        ref = m.TaskByNumber(number)
        statement = m.Working(ref) if at_work else m.Claim(ref)
        c.want(
            Urgency.ANSWER,
            f"mine {number}",
            lambda: composing.to_robot(c, other, statement) if c.task == number else None,
            now,
            slot=OWNER_SLOT,
        )
        return False
    c.board.claim(number, other, c.lease_end_s(now))
    c.fire(Trigger.LOST, now)
    return True


def tell_done(c: Coordination, other: str, entry: Entry, now: float) -> None:
    """It was not heard that the task is done: who did it says so at once, somebody else if that one does not; nobody
    says of a task that it is done who knows neither that it did it itself nor who else."""
    number, doer = entry.definition.number, entry.owner
    done = m.Completed(m.TaskByNumber(number))
    if doer == c.role.name:
        said, slot = composing.to_all(c, done), DOER_SLOT
    else:
        said = composing.to_robot(c, other, m.Relayed(doer, done) if doer is not None else m.Negative())
        c.quoted = Quoted(doer, c.role.name, number, now) if doer is not None else c.quoted
        slot = _objection_slot(c, other, number, now)
    compose = lambda: said if c.board[number].known_done else None  # noqa: E731
    c.want(Urgency.ANSWER, f"done {number}", compose, now, slot=slot, call=other.lower())


def confirm_at_once(c: Coordination, name: str, now: float) -> None:
    confirmed = composing.to_robot(c, name, m.Confirmed())
    c.want(Urgency.ANSWER, f"confirm {name}", lambda: confirmed, now, slot=OWNER_SLOT)


def _confirm_in_turn(c: Coordination, name: str, number: int, now: float, sure: bool = True) -> None:
    """Confirm what `name` said of a task, unless it is no longer true then or another one does."""
    complete = c.board[number].known_done
    statement = m.Confirmed(m.TaskByNumber(number), complete=complete) if sure else m.SayAgain()
    said = composing.to_robot(c, name, statement)
    slot = (
        confirming_slot(c, now) + c.rank(name, number, now) + (UNSURE_SLOTS if c.state in NEWCOMER or not sure else 0)
    )

    def compose() -> m.Utterance | None:
        if c.board[number].owner != name and not complete:
            return None
        if sure:
            c.board.claim(number, name, c.lease_end_s(now))
            note_moved_on(c, name, number)
        return said

    c.want(Urgency.ANSWER, f"confirm {name}", compose, now, slot=slot, call=name.lower(), tentative=True)


def completed(c: Coordination, u: m.Utterance, s: m.Completed, now: float) -> None:
    entry = c.board.find(s.task)
    if entry is None or u.speaker is None:
        return
    number = entry.definition.number
    objection = _is_objection(c, u.speaker, number, now)
    if objection:
        c.floor.withdraw(f"done {number}")
    new = not entry.known_done
    doubt = doubts(c, u.speaker, number, s.next is not None, now)
    sure = not doubt and (note_done(c, u.speaker, number, now) or not new)
    good, upon = True, number
    if s.next is not None and (following := c.board.find(s.next)) is not None:
        upon = following.definition.number
        good = contend(c, u, u.speaker, following, False, now)
    if is_for_me_alone(c, u):
        confirm_at_once(c, u.speaker, now)
    elif not sure and not doubt and not objection and len(c.peers.present(now)) <= SMALL_TEAM:
        again = composing.to_robot(c, u.speaker, m.SayAgain())
        c.want(Urgency.ANSWER, f"again {u.speaker}", lambda: again, now, slot=OTHERS_SLOT)
    elif good and not doubt and not isinstance(u.addressee, m.ToRobot) and not (objection and not new):
        _confirm_in_turn(c, u.speaker, upon, now, sure)
    c.reconsider(now)


def doubts(c: Coordination, speaker: str, number: int, in_passing: bool, now: float) -> bool:
    """Whether this robot, whose claim may be confirmed, does not believe at first hearing that somebody else has done
    its task: were that misheard, everybody would hold the task for done once this robot goes on to another one.

    Who is at work says so to the speaker, who says it again if it is true; who only claims believes an objection, but
    not what is said in passing, with another claim: its own claim is said again, and can be objected to.
    """
    if c.task != number or c.partner is not None or speaker == c.owner_before:
        return False
    at_work = c.state in AT_WORK and c.state is not State.ACTING
    if not at_work and not (in_passing and c.state in PROPOSING):
        return False
    if c.doubted == (speaker, number):
        return False
    c.doubted, c.missed_s = (speaker, number), now
    if at_work:
        said = composing.to_robot(c, speaker, m.Working(m.TaskByNumber(number)))
        compose = lambda: said if c.task == number else None  # noqa: E731
        c.want(Urgency.ANSWER, f"mine {number}", compose, now, slot=OWNER_SLOT)
    return True


def _is_objection(c: Coordination, speaker: str, number: int, now: float) -> bool:
    """Whether "task … complete" answers somebody who has just claimed that task."""
    last = c.heard_claim
    if c.task == number and now - c.claimed_s < c.timing.recent_s:
        return True
    return (
        last is not None and last.number == number and last.speaker != speaker and now - last.at_s < c.timing.recent_s
    )


def note_done(c: Coordination, doer: str, number: int, now: float) -> bool:
    """It was said that `doer` has done the task; whether that fits what was known, or is heard again."""
    entry = c.board[number]
    last = c.heard_claim
    before = last.before[1] if last is not None and last.number == number else None
    sure = doer in (entry.owner, before) or (c.task == number and doer == c.owner_before)
    if not sure or c.task == number:
        c.missed_s = now
        c.heard_work = c.heard_work or c.state in NEWCOMER
    if c.task == number and c.state is State.ACTING:
        return sure  # too late: it is being done twice, and both will say so
    c.board.complete(number, doer, hearsay=not sure)
    release_assignment(c, doer, number)
    if c.task == number and c.state is not State.REPORTING:
        c.fire(Trigger.DONE_BEFORE, now)
    return sure


def failed(c: Coordination, u: m.Utterance, s: m.Failed, now: float) -> None:
    entry = c.board.find(s.task)
    if entry is None or u.speaker is None:
        return
    number = entry.definition.number
    if c.task != number or c.state not in AT_WORK:
        c.board.give_up(number, u.speaker)
    release_assignment(c, u.speaker, number)
    if is_for_me_alone(c, u):
        confirm_at_once(c, u.speaker, now)
    elif not isinstance(u.addressee, m.ToRobot):
        said = composing.to_robot(c, u.speaker, m.Confirmed(m.TaskByNumber(number)))
        slot = confirming_slot(c, now) + c.rank(u.speaker, number, now)
        c.want(
            Urgency.ANSWER, f"confirm {u.speaker}", lambda: said, now, slot=slot, call=u.speaker.lower(), tentative=True
        )
    c.reconsider(now)


def release_assignment(c: Coordination, name: str, number: int) -> None:
    peer = c.peers.get(name)
    if peer is not None and peer.assigned == number:
        peer.assigned = None


def note_moved_on(c: Coordination, name: str, number: int) -> None:
    """Somebody is known to have this task. If it was at another one, that is over, and most likely done: what was
    given up is said to be so, and so is what was done, but one may miss it."""
    for entry in c.board.entries():
        former = entry.definition.number
        heard = entry.state == CLAIMED and entry.owner == name and entry.times_heard >= HEARD_SURELY
        if heard and entry.firm and former not in (number, c.task):
            c.board.complete(former, name, hearsay=True)
