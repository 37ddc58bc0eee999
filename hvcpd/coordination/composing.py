"""The sentences that a robot says of itself, made when it has the floor. None: there is nothing left to say."""

from __future__ import annotations

from typing import TYPE_CHECKING

from hvcpd.coordination import choosing, strangers
from hvcpd.coordination.board import DONE, spoken_name
from hvcpd.coordination.table import AT_WORK, State
from hvcpd.language import messages as m
from hvcpd.language.phrasebook import VOLTS, VOLTS_STEP

if TYPE_CHECKING:
    from hvcpd.coordination.coordination import Coordination


def utterance(c: Coordination, to: m.Addressee | None, statement: m.Statement | None) -> m.Utterance:
    return m.Utterance(c.role.name, to, None, statement)


def to_all(c: Coordination, statement: m.Statement) -> m.Utterance:
    return utterance(c, m.ToAll(), statement)


def to_robot(c: Coordination, name: str, statement: m.Statement) -> m.Utterance:
    return utterance(c, m.ToRobot(name), statement)


def to_asker(c: Coordination, name: str | None, statement: m.Statement) -> m.Utterance:
    """To who asked; one who gave no name is answered for everybody."""
    return to_robot(c, name, statement) if name else to_all(c, statement)


def introduction(c: Coordination, to: m.Addressee) -> m.Utterance:
    """The name, and the team unless the team is addressed: air is dear among many."""
    return m.Utterance(c.role.name, to, None if isinstance(to, m.ToTeam) else c.role.team, None)


def spelled_name(c: Coordination, to: m.Addressee, ask: bool = False) -> m.Utterance:
    return utterance(c, to, m.Spelled(c.role.name.lower(), ask))


def answer_to_greeting(c: Coordination, name: str | None, now: float) -> m.Utterance:
    """The own name, to who asked for it; spelled, to the team, if that one may not know it."""
    if strangers.must_spell_for(c, name, now):
        return spelled_name(c, to_team(c))
    peer = c.peers.get(name) if name else None
    if peer is not None and peer.team is not None and peer.team == c.role.team:
        return introduction(c, to_team(c))
    return introduction(c, m.ToRobot(name) if name else m.ToAll())


def to_team(c: Coordination) -> m.Addressee:
    return m.ToTeam(c.role.team) if c.role.team else m.ToAll()


def greeting(c: Coordination) -> m.Utterance:
    """To all, who then answer; among robots that are just introducing themselves, to the team, which does not."""
    to = to_team(c) if c.peers.all() else m.ToAll()
    return introduction(c, to) if c.role.listed else spelled_name(c, to)


def claim(c: Coordination, now: float) -> m.Utterance | None:
    """The claim of a task, chosen now if it is the first time; with the last one's report, if that is still due."""
    if c.task is None:
        task = choosing.task_to_claim(c, now)
        if task is None:
            return None
        c.task = task
        c.owner_before, c.doubted = c.board[task].owner, None
        c.repeats = 0
    c.board.claim(c.task, c.role.name, c.lease_end_s(now))
    ref = m.TaskByNumber(c.task)
    if c.unreported is not None and c.board[c.unreported].state == DONE:
        return to_all(c, m.Completed(m.TaskByNumber(c.unreported), ref))
    return utterance(c, to_team(c), m.Claim(ref))


def report(c: Coordination, now: float) -> m.Utterance | None:
    """What became of the task; a volunteer claims the next one in the same breath."""
    if c.unreported is None:
        return None
    number = m.TaskByNumber(c.unreported)
    if c.board[c.unreported].state != DONE:
        return to_asker(c, c.partner, m.Failed(number))
    if c.partner is None and c.repeats == 0 and choosing.may_volunteer(c, now):
        both = claim(c, now)
        if both is not None:
            return both
    return to_asker(c, c.partner, m.Completed(number))


def working(c: Coordination) -> m.Utterance | None:
    return to_all(c, m.Working(_by_name(c, c.task))) if c.task is not None else None


def renewal(c: Coordination) -> m.Utterance | None:
    return working(c) if c.state in (State.GOING, State.ACTING) else None


def occupation(c: Coordination, asker: str | None) -> m.Utterance:
    """What this robot is doing, for who asked."""
    if c.state is State.STOPPED:
        return to_asker(c, asker, m.Stopped())
    if c.task is not None and c.state in AT_WORK:
        return to_asker(c, asker, m.Working(_by_name(c, c.task)))
    if c.motion is not None and c.state is State.MOVING:
        return to_asker(c, asker, m.WillMove(c.motion))
    return to_asker(c, asker, m.Free())


def shift_report(c: Coordination, asker: str | None) -> m.Utterance:
    """Name, team, task, state and battery in one sentence, for who asked."""
    doing, task = m.Doing.FREE, None
    if c.state is State.STOPPED:
        doing = m.Doing.STOPPED
    elif c.task is not None and c.state in AT_WORK:
        doing, task = m.Doing.WORKING, m.TaskByNumber(c.task)
    elif c.motion is not None:
        doing = m.Doing.BUSY
    to = m.ToRobot(asker) if asker else m.ToAll()
    return m.Utterance(c.role.name, to, c.role.team, m.Report(doing, task, spoken_volts(c.battery_v)))


def spoken_volts(battery_v: float | None) -> float | None:
    """The highest step that can be said and is not above the measured voltage; None if that cannot be said."""
    lower = [volts for volts in VOLTS if battery_v is not None and volts <= battery_v < volts + VOLTS_STEP]
    return lower[0] if lower else None


def left(c: Coordination, asker: str | None) -> m.Utterance:
    """Which tasks are not known to be done: open ones first, because those can be claimed. Hearsay is not passed on as
    knowledge: two that have it from each other, or from one word that both misheard, would make a certainty of it."""
    numbers = sorted(c.board.maybe_left(), key=lambda n: (c.board[n].owner is not None, n))
    refs = [m.TaskByNumber(n) for n in numbers[:3]] + [None] * 3
    return to_asker(c, asker, m.Left(refs[0], refs[1], refs[2], more=len(numbers) > 3))


def read_back(c: Coordination) -> m.Utterance | None:
    if c.motion is not None:
        return to_asker(c, c.partner, m.WillMove(c.motion))
    if c.partner is None or c.task_ref is None:
        return None
    return to_robot(c, c.partner, m.Claim(c.task_ref))


def order(c: Coordination, now: float) -> m.Utterance | None:
    chosen = choosing.next_order(c, now)
    if chosen is None:
        return None
    c.partner, task = chosen
    c.task = task.number
    c.task_ref = m.TaskByName(spoken_name(task))
    return same_order(c)


def same_order(c: Coordination) -> m.Utterance | None:
    if c.partner is None or c.task_ref is None:
        return None
    return to_robot(c, c.partner, m.Order(c.task_ref))


def to_partner(c: Coordination, statement: m.Statement) -> m.Utterance | None:
    return to_robot(c, c.partner, statement) if c.partner else None


def _by_name(c: Coordination, number: int | None) -> m.TaskByName:
    if number is None:
        raise RuntimeError("no task to speak of")
    return m.TaskByName(spoken_name(c.board[number].definition))
