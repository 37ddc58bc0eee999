"""What a robot does about a sentence that it understood: the way from a statement to its reaction."""

from __future__ import annotations

import math

from hvcpd.coordination import answers, claims, commands, composing, earshot, orders, relaying, repair
from hvcpd.coordination.addressing import is_for, is_for_me_alone, must_spell_for
from hvcpd.coordination.floor import Urgency
from hvcpd.coordination.knowledge import Knowledge, Reactions
from hvcpd.coordination.states import DEPARTING, PROPOSING, State, Trigger
from hvcpd.coordination.table import fire
from hvcpd.language import messages as m

GREETING_ANSWERED_FOR_S = 5.0
"""A greeting repeated within so long is the same greeting: it was answered."""
GREETED_AGAIN_WITHIN_S = 60.0
"""A greeting repeated within so long tells that the answer was not heard, maybe because another one, whom this robot
does not hear, answered at the same time: the next answer waits for a random time."""
FOREIGN_S = 8.0
"""The code words of a message for others take 4 to 6 s, said slowly 7.5 s."""


def react(me: Knowledge, u: m.Utterance, confidence: float, now: float) -> None:
    """Note what everybody may learn from the sentence, and act on it where it is meant for this robot."""
    relaying.overheard(me, u, now)
    quoted = relaying.direct(me, u)
    if quoted is not None and quoted.speaker is not None:
        me.peers.heard(quoted.speaker, None, now, confidence, None)
        react(me, quoted, confidence, now)
        return
    if isinstance(u.addressee, m.ToRobot):
        me.floor.answered(u.addressee.name.lower(), isinstance(u.statement, m.Confirmed))
    if u.speaker is not None and u.speaker == me.current.partner:
        me.floor.withdraw(repair.ASK_AGAIN)
    statement = u.statement
    if me.state in DEPARTING and not isinstance(statement, m.Stop):
        return
    earshot.note(me, u, now)
    if is_for_me_alone(me, u) and u.speaker is not None:
        me.acquaintance.known_by.add(u.speaker.lower())
    if isinstance(statement, m.Negative):
        relaying.denied(me, u, now)
    if isinstance(statement, commands.Command):
        commands.obey(me, u, statement, confidence, now)
        return
    reaction = _REACTIONS.get(type(statement))
    if reaction is not None:
        reaction(me, u, statement, now)


def hear_own_name(me: Knowledge, now: float) -> None:
    """Another voice says that it is this robot. Twice is no mishearing: both are to say so, and to do nothing."""
    me.acquaintance.own_name_heard_s = (*me.acquaintance.own_name_heard_s[-3:], now)
    recent = [t for t in me.acquaintance.own_name_heard_s if now < t + me.timing.name_conflict_s]
    if len(recent) == 2:
        if me.state in PROPOSING:
            fire(me, Trigger.LOST, now)
        composing.answer(me, None, "my name", m.NameTaken(), now)


def _greeting(me: Knowledge, u: m.Utterance, _: m.Spelled | None, now: float) -> None:
    if u.speaker is None:
        return
    if me.state is State.MEETING:
        me.arm(now, me.timing.greeting_wait_s)
    peer = me.peers.get(u.speaker)
    answered_ago_s = now - peer.answered_s if peer is not None else math.inf
    if answered_ago_s < GREETING_ANSWERED_FOR_S:
        return
    if isinstance(u.addressee, m.ToRobot | m.ToTeam):  # an answer is not answered, nor an introduction
        return
    _introduce(me, u.speaker, now)


def _spelled(me: Knowledge, u: m.Utterance, s: m.Spelled, now: float) -> None:
    me.acquaintance.strangers = True
    if not s.ask:
        _greeting(me, u, s, now)
    elif u.speaker is not None and must_spell_for(me, u.speaker, now):
        _introduce(me, u.speaker, now)


def _introduce(me: Knowledge, name: str | None, now: float) -> None:
    """Say the own name; a robot that has not greeted yet has done so by this."""
    peer, after_s = me.peers.get(name), 0.0
    if peer is not None:
        if now - peer.answered_s < GREETED_AGAIN_WITHIN_S:
            after_s = 2.0 * me.timing.back_off_s * me.rng.random()
        peer.answered_s = now
    trigger = Trigger.GREETED if me.state in (State.WAKING, State.GREETING) else None
    topic = f"greet {name}"
    me.want(
        Urgency.TURN, topic, lambda: composing.answer_to_greeting(me, name, now), now, trigger=trigger, after_s=after_s
    )


def _who_here(me: Knowledge, u: m.Utterance, _s: m.WhoHere, now: float) -> None:
    if is_for(me, u):
        _introduce(me, u.speaker, now)


def _say_again(me: Knowledge, u: m.Utterance, s: m.SayAgain, now: float) -> None:
    if is_for(me, u):
        repair.say_again(me, s.slowly, now)


def _let_go(me: Knowledge, u: m.Utterance, s: m.Stopped | m.Leaving, now: float) -> None:
    """A robot that has halted, or leaves, has given its task back."""
    if u.speaker is None:
        return
    if isinstance(s, m.Stopped):
        commands.note_halted(me, u.speaker, now)
    for entry in me.board.entries():
        if entry.owner == u.speaker:
            me.board.release(entry.definition.number)
            claims.release_assignment(me, u.speaker, entry.definition.number)
    if isinstance(s, m.Leaving):
        me.peers.has_left(u.speaker)
    me.reconsider(now)


def _name_taken(me: Knowledge, u: m.Utterance, _s: m.NameTaken, now: float) -> None:
    """Two robots answer to this name: no order for it."""
    peer = me.peers.get(u.speaker)
    if peer is not None:
        peer.silent_until_s = now + me.timing.name_conflict_s


def _sealed_message(me: Knowledge, _u: m.Utterance, _s: m.SealedMessage, now: float) -> None:
    """Somebody speaks to those who have a key that this robot has not; the code words follow."""
    me.repair.foreign_until_s = now + FOREIGN_S


def _distrusted(me: Knowledge, u: m.Utterance, _s: m.Distrusted, now: float) -> None:
    """Who does not believe this robot's order is not asked again for a while."""
    if me.state is State.ORDERED and u.speaker == me.current.partner and is_for_me_alone(me, u):
        fire(me, Trigger.GAVE_UP, now)


_REACTIONS: Reactions = {
    **claims.REACTIONS,
    **answers.REACTIONS,
    **orders.REACTIONS,
    **commands.REACTIONS,
    **relaying.REACTIONS,
    type(None): _greeting,
    m.Spelled: _spelled,
    m.WhoHere: _who_here,
    m.SayAgain: _say_again,
    m.Stopped: _let_go,
    m.Leaving: _let_go,
    m.NameTaken: _name_taken,
    m.Distrusted: _distrusted,
    m.SealedMessage: _sealed_message,
}
