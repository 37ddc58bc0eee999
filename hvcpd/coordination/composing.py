"""The sentences that a robot says, composed when it has the floor. None: there is nothing left to say."""

from __future__ import annotations

from collections.abc import Callable

from hvcpd.coordination import choosing
from hvcpd.coordination.addressing import must_spell_for
from hvcpd.coordination.board import DONE, spoken_name
from hvcpd.coordination.floor import Urgency
from hvcpd.coordination.knowledge import Knowledge
from hvcpd.coordination.states import AT_WORK, State
from hvcpd.language import messages as m
from hvcpd.language.phrasebook import VOLTS, VOLTS_STEP


def utterance(me: Knowledge, to: m.Addressee | None, statement: m.Statement | None) -> m.Utterance:
    return m.Utterance(me.role.name, to, None, statement)


def to_all(me: Knowledge, statement: m.Statement) -> m.Utterance:
    return utterance(me, m.ToAll(), statement)


def to_robot(me: Knowledge, name: str, statement: m.Statement) -> m.Utterance:
    return utterance(me, m.ToRobot(name), statement)


def to_asker(me: Knowledge, name: str | None, statement: m.Statement) -> m.Utterance:
    """To who asked; one who gave no name is answered for everybody."""
    return to_robot(me, name, statement) if name else to_all(me, statement)


def answer(
    me: Knowledge,
    name: str | None,
    topic: str,
    statement: m.Statement,
    now: float,
    *,
    slot: int | None = None,
    call: str | None = None,
    tentative: bool = False,
    still: Callable[[], bool] = lambda: True,
) -> None:
    """Want the floor to answer somebody (None: everybody), if the statement is `still` true then; see `Intent`."""
    said = to_asker(me, name, statement)
    key = call.lower() if call is not None else None
    me.want(Urgency.ANSWER, topic, lambda: said if still() else None, now, slot=slot, call=key, tentative=tentative)


def introduction(me: Knowledge, to: m.Addressee) -> m.Utterance:
    """The name, and the team unless the team is addressed: air is dear among many."""
    return m.Utterance(me.role.name, to, None if isinstance(to, m.ToTeam) else me.role.team, None)


def spelled_name(me: Knowledge, to: m.Addressee | None = None, ask: bool = False) -> m.Utterance:
    """The own name, spelled to the team or to somebody else; `ask`: who hears it is to do the same."""
    return utterance(me, to or to_team(me), m.Spelled(me.role.name.lower(), ask))


def answer_to_greeting(me: Knowledge, name: str | None, now: float) -> m.Utterance:
    """The own name, to who asked for it; spelled, to the team, if that one may not know it."""
    if must_spell_for(me, name, now):
        return spelled_name(me)
    peer = me.peers.get(name)
    if peer is not None and peer.team is not None and peer.team == me.role.team:
        return introduction(me, to_team(me))
    return introduction(me, m.ToRobot(name) if name else m.ToAll())


def to_team(me: Knowledge) -> m.Addressee:
    return m.ToTeam(me.role.team) if me.role.team else m.ToAll()


def greeting(me: Knowledge) -> m.Utterance:
    """To all, who then answer; among robots that are just introducing themselves, to the team, which does not."""
    to = to_team(me) if me.peers.all() else m.ToAll()
    return introduction(me, to) if me.role.listed else spelled_name(me, to)


def claim(me: Knowledge, now: float) -> m.Utterance | None:
    """The claim of a task, chosen now if it is the first time; with the last one's report, if that is still due."""
    if me.current.task is None:
        task = choosing.task_to_claim(me, now)
        if task is None:
            return None
        me.current.task = task
        me.current.owner_before, me.current.doubted = me.board[task].owner, None
        me.current.repeats = 0
    me.board.claim(me.current.task, me.role.name, me.lease_end_s(now))
    ref = m.TaskByNumber(me.current.task)
    if me.report.task is not None and me.board[me.report.task].state == DONE:
        return to_all(me, m.Completed(m.TaskByNumber(me.report.task), ref))
    return utterance(me, to_team(me), m.Claim(ref))


def report(me: Knowledge, now: float) -> m.Utterance | None:
    """What became of the task; a volunteer claims the next one in the same breath."""
    if me.report.task is None:
        return None
    number = m.TaskByNumber(me.report.task)
    if me.board[me.report.task].state != DONE:
        return to_asker(me, me.current.partner, m.Failed(number, me.report.reason))
    if me.current.partner is None and me.current.repeats == 0 and choosing.may_volunteer(me, now):
        both = claim(me, now)
        if both is not None:
            return both
    return to_asker(me, me.current.partner, m.Completed(number))


def working(me: Knowledge) -> m.Utterance | None:
    return to_all(me, m.Working(_by_name(me, me.current.task))) if me.current.task is not None else None


def occupation(me: Knowledge, asker: str | None) -> m.Utterance:
    """What this robot is doing, for who asked."""
    if me.state is State.STOPPED:
        return to_asker(me, asker, m.Stopped())
    if me.current.task is not None and me.state in AT_WORK:
        return to_asker(me, asker, m.Working(_by_name(me, me.current.task)))
    if me.current.motion is not None and me.state is State.MOVING:
        return to_asker(me, asker, m.WillMove(me.current.motion))
    return to_asker(me, asker, m.Free())


def shift_report(me: Knowledge, asker: str | None) -> m.Utterance:
    """Name, team, task, state and battery in one sentence, for who asked."""
    doing, task = m.Doing.FREE, None
    if me.state is State.STOPPED:
        doing = m.Doing.STOPPED
    elif me.current.task is not None and me.state in AT_WORK:
        doing, task = m.Doing.WORKING, m.TaskByNumber(me.current.task)
    elif me.current.motion is not None:
        doing = m.Doing.BUSY
    to = m.ToRobot(asker) if asker else m.ToAll()
    return m.Utterance(me.role.name, to, me.role.team, m.Report(doing, task, spoken_volts(me.body.battery_v)))


def spoken_volts(battery_v: float | None) -> float | None:
    """The highest step that can be said and is not above the measured voltage; None if that cannot be said."""
    lower = [volts for volts in VOLTS if battery_v is not None and volts <= battery_v < volts + VOLTS_STEP]
    return lower[0] if lower else None


def left(me: Knowledge, asker: str | None) -> m.Utterance:
    """Which tasks are not known to be done: open ones first, because those can be claimed. Hearsay is not passed on as
    knowledge: two that have it from each other, or from one word that both misheard, would make a certainty of it."""
    numbers = sorted(me.board.maybe_left(), key=lambda n: (me.board[n].owner is not None, n))
    refs = [m.TaskByNumber(n) for n in numbers[:3]] + [None] * 3
    return to_asker(me, asker, m.Left(refs[0], refs[1], refs[2], more=len(numbers) > 3))


def read_back(me: Knowledge) -> m.Utterance | None:
    if me.current.motion is not None:
        return to_asker(me, me.current.partner, m.WillMove(me.current.motion))
    if me.current.partner is None or me.current.task_ref is None:
        return None
    return to_robot(me, me.current.partner, m.Claim(me.current.task_ref))


def order(me: Knowledge, now: float) -> m.Utterance | None:
    chosen = choosing.next_order(me, now)
    if chosen is None:
        return None
    me.current.partner, task = chosen
    me.current.task = task.number
    me.current.task_ref = m.TaskByName(spoken_name(task))
    return same_order(me)


def same_order(me: Knowledge) -> m.Utterance | None:
    if me.current.partner is None or me.current.task_ref is None:
        return None
    return to_robot(me, me.current.partner, m.Order(me.current.task_ref))


def to_partner(me: Knowledge, statement: m.Statement) -> m.Utterance | None:
    return to_robot(me, me.current.partner, statement) if me.current.partner else None


def _by_name(me: Knowledge, number: int | None) -> m.TaskByName:
    if number is None:
        raise RuntimeError("no task to speak of")
    return m.TaskByName(spoken_name(me.board[number].definition))
