"""The sentences that a robot says, composed from its knowledge. None: there is nothing left to say."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from hvcpd.coordination.addressing import must_spell_for, shares_slot
from hvcpd.coordination.entry import Entry, spoken_name
from hvcpd.coordination.floor import AHEAD, LEFT_ALONE, OWN_TURN, Intent, Urgency, nothing
from hvcpd.coordination.knowledge import Knowledge
from hvcpd.coordination.states import AT_WORK, UNDER_WAY, State
from hvcpd.language import messages as m
from hvcpd.language.forms import CHANGES
from hvcpd.language.phrasebook import VOLTS, VOLTS_STEP


def utterance(me: Knowledge, to: m.Addressee | None, statement: m.Statement | None) -> m.Utterance:
    return m.Utterance(me.role.name, to, None, statement)


def to_all(me: Knowledge, statement: m.Statement) -> m.Utterance:
    return utterance(me, m.ToAll(), statement)


def to_asker(me: Knowledge, name: str | None, statement: m.Statement) -> m.Utterance:
    """To the asker; the answer to an asker who gave no name is for everybody."""
    return utterance(me, m.ToRobot(name) if name else m.ToAll(), statement)


def answer(
    me: Knowledge,
    name: str | None,
    topic: str,
    statement: m.Statement,
    now: float,
    slot: int | None = None,
    *,
    call: str | None = None,
    tentative: bool = False,
    still: Callable[[], bool] = lambda: True,
    on_said: Callable[[], None] = nothing,
) -> None:
    """Request the floor to answer a speaker (None: everybody), if the statement is `still` true then; see `Intent`. In
    a slot that others share, every answer is tentative."""
    said, key = to_asker(me, name, statement), call.lower() if call is not None else None
    gives_way = tentative or shares_slot(me, slot, now)
    intent = Intent(
        Urgency.ANSWER, topic, lambda: said if still() else None, None, slot, key, tentative=gives_way, on_said=on_said
    )
    me.floor.want(intent, now)


def answer_topic(name: str | None) -> str:
    """The topic of an answer to a speaker: the next one takes its place."""
    return f"answer {name}"


def introduction(me: Knowledge, to: m.Addressee) -> m.Utterance:
    """The name, and the team unless the team is addressed: air time is scarce among many."""
    return m.Utterance(me.role.name, to, None if isinstance(to, m.ToTeam) else me.role.team, None)


def spelled_name(me: Knowledge, to: m.Addressee | None = None, ask: bool = False) -> m.Utterance:
    """This robot's name, spelled to the team or to another addressee; `ask`: listeners are to do the same."""
    return utterance(me, to or to_team(me), m.Spelled(me.role.name.lower(), ask))


def answer_to_greeting(me: Knowledge, name: str | None, now: float) -> m.Utterance:
    """This robot's name, to the asker; spelled, to the team, if the asker may not know it."""
    if must_spell_for(me, name, now):
        return spelled_name(me)
    peer = me.peers.get(name)
    if peer is not None and peer.team is not None and peer.team == me.role.team:
        return introduction(me, to_team(me))
    return introduction(me, m.ToRobot(name) if name else m.ToAll())


def to_team(me: Knowledge) -> m.Addressee:
    return m.ToTeam(me.role.team) if me.role.team else m.ToAll()


def greeting(me: Knowledge) -> m.Utterance:
    """To all, who then answer; while robots are introducing themselves, to the team, which does not answer."""
    to = to_team(me) if me.peers.all() else m.ToAll()
    return introduction(me, to) if me.role.listed else spelled_name(me, to)


def spoken_count(entry: Entry) -> int | None:
    """The number of a task's last change, or of the occurrence that is due, as it is said; None if it is not known."""
    return (entry.change - 1) % CHANGES + 1 if entry.change else None


def done(me: Knowledge, number: int) -> m.Completed:
    """That a task is done; with the number of its change, if it was changed, and of its occurrence, if it recurs."""
    entry = me.board[number]
    counts = entry.is_changed or entry.recurs
    return m.Completed(m.TaskByNumber(number), count=spoken_count(entry) if counts else None)


def change(entry: Entry) -> m.Change:
    """The last change of a task, as it is passed on."""
    return m.Change(m.TaskByNumber(entry.number), entry.skipped, spoken_count(entry))


def closed(me: Knowledge, number: int) -> m.Completed | m.Change:
    """That a task is done, or that it is left out: then nobody has done it."""
    entry = me.board[number]
    return change(entry) if entry.skipped else done(me, number)


def claim(me: Knowledge) -> m.Utterance | None:
    """The claim of a task; with the last one's report, if that is still due."""
    if me.current.task is None:
        return None
    ref, then = _one_or_two(me.my_tasks())
    if me.has_plain_report:
        done, also = _one_or_two(me.report.tasks)
        return to_all(me, m.Completed(done, ref, also=also, then=then))
    return utterance(me, to_team(me), m.Claim(ref, then, me.current.distance_m if then is None else None))


def claim_ahead(me: Knowledge) -> m.Utterance:
    """The claim of a second task with the present one, and the report of the one before, if that is still due."""
    ref, then = _one_or_two(me.my_tasks())
    if me.report.task is not None:
        return to_all(me, m.Completed(m.TaskByNumber(me.report.task), ref, then=then))
    return utterance(me, to_team(me), m.Claim(ref, then))


def _one_or_two(numbers: tuple[int, ...]) -> tuple[m.TaskByNumber, m.TaskByNumber | None]:
    first, *others = map(m.TaskByNumber, numbers)
    return first, others[0] if others else None


def joinable(me: Knowledge) -> str | None:
    """The topic of this robot's own claim or report that waits and can be said with a confirmation, if there is one."""
    if me.state in UNDER_WAY:
        return AHEAD if me.floor.wants(AHEAD) else None
    return OWN_TURN if me.floor.wants(OWN_TURN) and _may_join(me) else None


def _may_join(me: Knowledge) -> bool:
    """Whether it is said to many, and is plain."""
    to_many = me.current.partner is None and me.state in (State.CLAIMING, State.REPORTING)
    plain = me.has_plain_report or not me.report.tasks
    return to_many and plain and not me.floor.wants(LEFT_ALONE) and not me.role.speech.encrypted


def joined(confirmation: m.Utterance, own: m.Utterance) -> m.Utterance:
    """The two in one turn: "confirmed three, I will complete task five"."""
    said, words = confirmation.statement, own.statement
    if not isinstance(said, m.Confirmed) or not isinstance(words, m.Claim | m.Completed):
        raise TypeError(f"{said} and {words} are not said together")
    if isinstance(words, m.Completed):
        words = replace(words, count=None)  # it would be too long; a recurring task's number may be left out
    return replace(confirmation, statement=m.ConfirmedAnd(said, words))


def report(me: Knowledge) -> m.Utterance | None:
    """The outcome of the task; a volunteer claims the next one in the same turn."""
    if me.report.task is None or me.current.task is not None:
        return claim(me)
    if me.report.failed:
        return to_asker(me, me.current.partner, m.Failed(m.TaskByNumber(me.report.task), me.report.reason))
    words = done(me, me.report.task)
    if len(me.report.tasks) > 1:
        words = m.Completed(m.TaskByNumber(me.report.tasks[0]), also=words.task)
    return to_asker(me, me.current.partner, words)


def working(me: Knowledge) -> m.Utterance | None:
    if me.current.task is None:
        return None
    by_number = me.board[me.my_task()].is_new_to_others
    return to_all(me, m.Working(m.TaskByNumber(me.my_task()) if by_number else _my_task(me)))


def renewal(me: Knowledge) -> m.Utterance | None:
    """That the robot still has its task. For a shared task "completing" would mean that the robot is at the place."""
    if me.current.task is not None and me.state is State.GOING and me.board[me.current.task].is_shared:
        return to_all(me, m.Claim(m.TaskByNumber(me.current.task)))
    return working(me)


def occupation(me: Knowledge, asker: str | None) -> m.Utterance:
    """This robot's current activity, addressed to the asker."""
    if me.state is State.STOPPED:
        return to_asker(me, asker, m.Stopped())
    if me.current.task is not None and me.state in AT_WORK:
        return to_asker(me, asker, m.Working(_my_task(me)))
    if me.current.motion is not None and me.state is State.MOVING:
        return to_asker(me, asker, m.WillMove(me.current.motion))
    return to_asker(me, asker, m.Free())


def shift_report(me: Knowledge, asker: str | None) -> m.Utterance:
    """Name, team, task, state and battery in one sentence, addressed to the asker."""
    doing, task = m.Doing.FREE, None
    if me.state is State.STOPPED:
        doing = m.Doing.STOPPED
    elif me.current.task is not None and me.state in AT_WORK:
        doing, task = m.Doing.WORKING, m.TaskByNumber(me.current.task)
    elif me.current.motion is not None:
        doing = m.Doing.BUSY
    report = to_asker(me, asker, m.Report(doing, task, spoken_volts(me.body.battery_v)))
    return replace(report, team=me.role.team)


def spoken_volts(battery_v: float | None) -> float | None:
    """The highest step that can be said and is not above the measured voltage; None if that cannot be said."""
    lower = [volts for volts in VOLTS if battery_v is not None and volts <= battery_v < volts + VOLTS_STEP]
    return lower[0] if lower else None


def left(me: Knowledge, asker: str | None) -> m.Utterance:
    """The tasks that are not known to be done: open ones first, because those can be claimed. Hearsay is not passed on
    as knowledge: two robots that have it from each other, or from one word that both misheard, would make it a
    certainty."""
    numbers = sorted(me.board.not_done() + me.board.hearsay(), key=lambda n: (me.board[n].owner is not None, n))
    refs = [m.TaskByNumber(n) for n in numbers[:3]] + [None] * 3
    return to_asker(me, asker, m.Left(refs[0], refs[1], refs[2], more=len(numbers) > 3))


def read_back(me: Knowledge) -> m.Utterance | None:
    partner, motion, ref = me.current.partner, me.current.motion, me.current.task_ref
    if motion is not None:
        return to_asker(me, partner, m.WillMove(motion))
    return to_asker(me, partner, m.Claim(ref)) if ref is not None else None


def order(me: Knowledge) -> m.Utterance | None:
    ref = me.current.task_ref
    return to_asker(me, me.current.partner, m.Order(ref)) if ref is not None else None


def _my_task(me: Knowledge) -> m.TaskByName:
    return m.TaskByName(spoken_name(me.board[me.my_task()].definition))
