"""A robot's response to a sentence that it understood: from a statement to its reaction."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

from hvcpd.coordination import (
    answers,
    changing,
    chatter,
    choosing,
    claims,
    commands,
    composing,
    earshot,
    outdated,
    ranging,
    relaying,
    repair,
    right_of_way,
    teaming,
)
from hvcpd.coordination.addressing import is_for, is_for_me_alone, must_spell_for
from hvcpd.coordination.floor import Intent, Urgency
from hvcpd.coordination.knowledge import Heard, Knowledge, Reactions
from hvcpd.coordination.states import AT_WORK, PROPOSING, State, Trigger
from hvcpd.coordination.table import fire
from hvcpd.language import messages as m
from hvcpd.security.trust import Trust

GREETED_AGAIN_WITHIN_S = 60.0
"""A greeting repeated within this time shows that the answer was not heard. Another robot, which this one does not
hear, may have answered at the same time; so the next answer waits for a random time."""
HERE_S = 6.0
"""Time for each robot's answer to a question who is here: 4.4 s, as measured, and what may come between."""


def react(me: Knowledge, heard: Heard) -> None:
    """Note the information that the sentence gives to every listener, and react if it is meant for this robot."""
    relaying.overheard(me, heard)
    heard = relaying.direct(me, heard)  # from here on as if the original speaker had said them itself
    repair.note(me, heard)
    earshot.note(me, heard)
    if (rest := outdated.up_to_date(me, heard)) is None:
        return
    heard, statement = rest, rest.utterance.statement
    if isinstance(statement, m.Claim) and choosing.claims_at_once(me, heard.now):
        fire(me, Trigger.MET, heard.now)  # the greeting is answered, and work has begun
    reaction = _REACTIONS.get(type(statement))
    if reaction is not None:
        reaction(me, heard, statement)


def hear_namesake(me: Knowledge, utterance: m.Utterance, trust: Trust, now: float) -> None:
    """Another voice uses this robot's name, or another name was misheard for it: only "stop" is obeyed."""
    if trust.proves_speaker:  # otherwise it was a speaker without the key, or a recording of this robot
        _note_namesake(me, now)
    if isinstance(utterance.statement, m.Stop):
        commands.stop(me, Heard(replace(utterance, speaker=None), 1.0, now), utterance.statement)


def _note_namesake(me: Knowledge, now: float) -> None:
    """Twice is no mishearing: both robots must say so, and do nothing."""
    was_known = choosing.in_name_conflict(me, now)
    me.acquaintance.own_name_heard_s = (*me.acquaintance.own_name_heard_s[-1:], now)
    if choosing.in_name_conflict(me, now) and not was_known:
        if me.state in PROPOSING:
            fire(me, Trigger.LOST, now)
        composing.answer(me, None, "my name", m.NameTaken(), now)


def _greeting(me: Knowledge, heard: Heard, _: m.Spelled | None) -> None:
    if me.current.task is not None and me.state in AT_WORK and not _is_answer(me, heard):
        teaming.gone(me, heard.name, me.current.task, heard.now)  # it has been switched on again
    if me.state is State.MEETING:
        me.arm(heard.now, me.timing.greeting_wait_s)
    if isinstance(heard.to, m.ToRobot | m.ToTeam):  # an answer, or an introduction
        wants_answer = is_for_me_alone(me, heard.to) and _may_be_a_persons(me, heard.name, heard.now)
    else:
        wants_answer = not _answers_who_is_here(me, heard.name, heard.now)
        me.acquaintance.called_s = heard.now
    if wants_answer:
        _introduce(me, heard.speaker, heard.now)


def _is_answer(me: Knowledge, heard: Heard) -> bool:
    """Whether a robot that says its name may do so because it was asked."""
    return isinstance(heard.to, m.ToRobot) or heard.now <= me.acquaintance.called_s + _answers_s(me, heard.now)


def _answers_s(me: Knowledge, now: float) -> float:
    """How long after a question who is here robots may still answer it."""
    return HERE_S * (1 + len(me.expected(now)))


def _may_be_a_persons(me: Knowledge, name: str, now: float) -> bool:
    """Whether a greeting by name, which between robots is an answer, may be a person's. A robot of no team is answered
    once at most: two of these would go on for ever."""
    peer = me.peers.get(name)
    is_new = peer is None or now - peer.answered_s >= GREETED_AGAIN_WITHIN_S
    return is_new and me.role.team is not None and me.may_be_person(name)


def _answers_who_is_here(me: Knowledge, name: str, now: float) -> bool:
    """Whether a robot says its name to a person who asked without one, which is noted: if it says it once
    more, it greets."""
    asked_s, peer = me.acquaintance.who_here_s, me.peers.get(name)
    is_over = now > asked_s + _answers_s(me, now)
    if is_over or peer is None or me.may_be_person(name) or peer.answered_s >= asked_s:
        return False
    peer.answered_s = now
    return True


def _spelled(me: Knowledge, heard: Heard, s: m.Spelled) -> None:
    me.acquaintance.strangers = True
    if not s.ask:
        _greeting(me, heard, s)
    elif must_spell_for(me, heard.name, heard.now):
        _introduce(me, heard.speaker, heard.now)


def _introduce(me: Knowledge, name: str | None, now: float, asked: bool = False) -> None:
    """Say this robot's name; for a robot that has not greeted yet, this is its greeting."""
    peer, after_s = me.peers.get(name), 0.0
    if peer is not None:
        if now - peer.answered_s < GREETED_AGAIN_WITHIN_S:
            after_s = 2.0 * me.timing.back_off_s * me.rng.random()
        peer.answered_s = now
    begins = me.state in (State.WAKING, State.GREETING)
    if begins and choosing.claims_at_once(me, now):  # the claim tells its name; without one it greets
        fire(me, Trigger.MET, now)
        if not (asked or chatter.introduces_itself(me, name)):
            return
        after_s += max(me.acquaintance.all_heard_s - now, 0.0)
    trigger = Trigger.GREETED if begins else None
    answer = partial(composing.answer_to_greeting, me, name, now)
    topic = f"{'here' if asked else 'greet'} {name}"
    me.floor.want(Intent(Urgency.TURN, topic, answer, trigger, not_before_s=now + after_s), now)


def _who_here(me: Knowledge, heard: Heard, _: m.WhoHere) -> None:
    me.acquaintance.called_s = heard.now
    if heard.speaker is None:
        me.acquaintance.who_here_s = heard.now
    if is_for(me, heard.to):
        _introduce(me, heard.speaker, heard.now, asked=True)


def _let_go(me: Knowledge, heard: Heard, s: m.Stopped | m.Leaving) -> None:
    """A robot that has halted, or leaves, has given its task back."""
    name = heard.name
    for entry in me.board.entries():
        teaming.gone(me, name, entry.number, heard.now)
        if entry.owner == name:
            me.board.release(entry.number)
            claims.release_assignment(me, name, entry.number)
    if isinstance(s, m.Leaving):
        me.peers.has_left(name)
    me.reconsider(heard.now)


def _place_taken(me: Knowledge, heard: Heard, s: m.PlaceTaken) -> None:
    """A robot has been stopped inside a place."""
    right_of_way.taken(me, heard, s)
    if s.stands:
        _let_go(me, heard, m.Stopped())


def _name_taken(me: Knowledge, heard: Heard, _: m.NameTaken) -> None:
    """Two robots answer to this name: give no order to it."""
    peer = me.peers.get(heard.speaker)
    if peer is not None:
        peer.silent_until_s = heard.now + me.timing.name_conflict_s


_REACTIONS: Reactions = {
    **changing.REACTIONS,
    **claims.REACTIONS,
    **answers.REACTIONS,
    **commands.REACTIONS,
    **relaying.REACTIONS,
    **repair.REACTIONS,
    **ranging.REACTIONS,
    **right_of_way.REACTIONS,
    type(None): _greeting,
    m.Spelled: _spelled,
    m.WhoHere: _who_here,
    m.Hail: _who_here,
    m.PlaceTaken: _place_taken,
    m.Stopped: _let_go,
    m.Leaving: _let_go,
    m.NameTaken: _name_taken,
}
