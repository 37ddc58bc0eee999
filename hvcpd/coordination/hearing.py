"""What a robot does about a sentence that it understood."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from hvcpd.coordination.board import DONE
from hvcpd.coordination.table import State, Trigger
from hvcpd.language import messages as m

if TYPE_CHECKING:
    from hvcpd.coordination.coordination import Coordination

PROPOSING = frozenset({State.PROPOSED, State.READING_BACK, State.READ_BACK})
AT_WORK = frozenset({State.GOING, State.ANNOUNCING, State.CHECKING, State.ACTING})
GREETING_ANSWERED_FOR_S = 10.0
"""A greeting repeated within so long is the same greeting: it was answered."""


def react(c: Coordination, u: m.Utterance, now: float) -> None:
    """Note what everybody may learn from the sentence, and act on it where it is meant for this robot."""
    reaction = _REACTIONS.get(type(u.statement))
    if reaction is not None:
        reaction(c, u, u.statement, now)


def is_for(c: Coordination, u: m.Utterance) -> bool:
    """Whether the sentence is addressed to this robot, alone or among others."""
    match u.addressee:
        case m.ToRobot(name):
            return name.lower() == c.role.name.lower()
        case m.ToTeam(team):
            return c.role.team is not None and team.lower() == c.role.team.lower()
        case _:
            return True


def _is_for_me_alone(c: Coordination, u: m.Utterance) -> bool:
    return isinstance(u.addressee, m.ToRobot) and is_for(c, u)


def _greeting(c: Coordination, u: m.Utterance, _: None, now: float) -> None:
    if u.speaker is None or not is_for(c, u):
        return
    peer = c.peers.get(u.speaker)
    answered = peer is not None and now - peer.answered_s < GREETING_ANSWERED_FOR_S
    if answered or isinstance(u.addressee, m.ToRobot):  # an answer is not answered
        return
    name = u.speaker
    c.peers.update(name, answered_s=now)
    c.greet_back(name, now)


def _claim(c: Coordination, u: m.Utterance, s: m.Claim, now: float) -> None:
    entry = c.board.find(s.task)
    if u.speaker is None:
        return
    if c.state is State.ORDERED and _is_for_me_alone(c, u) and u.speaker == c.partner:
        c.fire(Trigger.RIGHT if entry is not None and entry.definition.number == c.task else Trigger.WRONG, now)
        return
    if entry is None:
        return
    peer = c.peers.get(u.speaker)
    if _is_for_me_alone(c, u) and peer is not None and peer.assigned == entry.definition.number:
        name = u.speaker  # our confirmation was lost
        c.answer(f"confirm {name}", lambda: c.utterance(m.ToRobot(name), m.Confirmed()), now)
        return
    _contend(c, u.speaker, entry.definition.number, False, now)


def _working(c: Coordination, u: m.Utterance, s: m.Working, now: float) -> None:
    entry = c.board.find(s.task)
    if entry is not None and u.speaker is not None:
        _contend(c, u.speaker, entry.definition.number, True, now)


def _contend(c: Coordination, other: str, number: int, other_at_work: bool, now: float) -> None:
    """Somebody takes or has a task. If it is ours too, both sides apply one rule and need no further talk:

    who is at work wins over who only claims; of equals, the name that comes first in the alphabet.
    """
    entry = c.board[number]
    if entry.state == DONE:
        # It was not heard that the task is done; who did it says so at once, the others only if it does not.
        if entry.owner == c.role.name:
            _tell_done(c, number, now)
        return
    if c.task == number and c.state in PROPOSING | AT_WORK:
        mine, theirs = (c.state not in AT_WORK, c.role.name.lower()), (not other_at_work, other.lower())
        if c.state is State.ACTING or mine < theirs:
            statement = m.Claim if c.state not in AT_WORK else m.Working
            ref = m.TaskByNumber(number)
            c.answer(f"mine {number}", lambda: c.utterance(m.ToRobot(other), statement(ref)), now)
            return
        c.board.claim(number, other, c.lease_end_s(now))
        c.fire(Trigger.LOST, now)
        return
    c.board.claim(number, other, c.lease_end_s(now))


def _tell_done(c: Coordination, number: int, now: float) -> None:
    c.answer(f"done {number}", lambda: c.utterance(m.ToAll(), m.Completed(m.TaskByNumber(number))), now)


def _order(c: Coordination, u: m.Utterance, s: m.Order, now: float) -> None:
    if u.speaker is None or not _is_for_me_alone(c, u):
        return
    name, entry = u.speaker, c.board.find(s.task)
    if entry is not None and entry.state == DONE:
        number = m.TaskByNumber(entry.definition.number)
        c.answer(f"done {number.number}", lambda: c.utterance(m.ToRobot(name), m.Completed(number)), now)
        return
    same = entry is not None and c.task == entry.definition.number and c.partner == name
    if same and c.state in AT_WORK:  # it did not hear the read-back
        c.answer("at work", lambda: c.utterance(m.ToRobot(name), m.Claim(s.task)), now)
        return
    if same and c.state is State.READING_BACK:
        return
    free = c.state in (State.READY, State.MEETING, State.CLAIMING, State.READ_BACK, State.REPORTED)
    if entry is None or not free or c.role.coordinator or c.role.name in entry.failed_by:
        c.answer(f"unable {name}", lambda: c.utterance(m.ToRobot(name), m.Unable(s.task)), now)
        return
    if not same:
        c.repeats = 0
    c.partner, c.task, c.task_ref = name, entry.definition.number, s.task
    c.fire(Trigger.ORDER, now)


def _unable(c: Coordination, u: m.Utterance, _s: m.Unable, now: float) -> None:
    if c.state is State.ORDERED and u.speaker == c.partner and _is_for_me_alone(c, u):
        c.fire(Trigger.REFUSED, now)


def _completed(c: Coordination, u: m.Utterance, s: m.Completed, now: float) -> None:
    entry = c.board.find(s.task)
    if entry is None or u.speaker is None:
        return
    number = entry.definition.number
    c.board.complete(number, u.speaker)
    _release_assignment(c, u.speaker, number)
    if c.task == number and c.state not in (State.ACTING, State.REPORTING, State.REPORTED):
        c.fire(Trigger.LOST, now)
    if _is_for_me_alone(c, u):
        name = u.speaker
        c.answer(f"confirm {name}", lambda: c.utterance(m.ToRobot(name), m.Confirmed()), now)
    c.reconsider(now)


def _failed(c: Coordination, u: m.Utterance, s: m.Failed, now: float) -> None:
    entry = c.board.find(s.task)
    if entry is None or u.speaker is None:
        return
    number = entry.definition.number
    if c.task != number or c.state not in AT_WORK:
        c.board.give_up(number, u.speaker)
    _release_assignment(c, u.speaker, number)
    if _is_for_me_alone(c, u):
        name = u.speaker
        c.answer(f"confirm {name}", lambda: c.utterance(m.ToRobot(name), m.Confirmed()), now)
    c.reconsider(now)


def _release_assignment(c: Coordination, name: str, number: int) -> None:
    peer = c.peers.get(name)
    if peer is not None and peer.assigned == number:
        c.peers.update(name, assigned=None)


def _confirmed(c: Coordination, u: m.Utterance, _s: m.Confirmed, now: float) -> None:
    if u.speaker == c.partner and _is_for_me_alone(c, u):
        c.fire(Trigger.CONFIRMED, now)


def _negative(c: Coordination, u: m.Utterance, _s: m.Negative, now: float) -> None:
    if u.speaker == c.partner and _is_for_me_alone(c, u):
        c.fire(Trigger.DENIED, now)


def _say_again(c: Coordination, u: m.Utterance, _s: m.SayAgain, now: float) -> None:
    if is_for(c, u):
        c.say_again(now)


def _stop(c: Coordination, u: m.Utterance, _s: m.Stop, now: float) -> None:
    if is_for(c, u):
        c.fire(Trigger.STOP, now)


def _resume(c: Coordination, u: m.Utterance, _s: m.Resume, now: float) -> None:
    if is_for(c, u):
        c.fire(Trigger.RESUME, now)


def _stopped(c: Coordination, u: m.Utterance, _s: m.Stopped, now: float) -> None:
    """A halted robot has let go of its task."""
    for entry in c.board.entries():
        if entry.owner == u.speaker and entry.state != DONE:
            c.board.release(entry.definition.number)
            _release_assignment(c, u.speaker or "", entry.definition.number)
    c.reconsider(now)


_REACTIONS: dict[type, Callable[[Coordination, m.Utterance, Any, float], None]] = {
    type(None): _greeting,
    m.Claim: _claim,
    m.Working: _working,
    m.Order: _order,
    m.Unable: _unable,
    m.Completed: _completed,
    m.Failed: _failed,
    m.Confirmed: _confirmed,
    m.Negative: _negative,
    m.SayAgain: _say_again,
    m.Stop: _stop,
    m.Resume: _resume,
    m.Stopped: _stopped,
}
