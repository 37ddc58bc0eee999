"""Speech that was not understood: ask for a repetition, for slower speech, or for the speaker's name.

In an exchange with one other robot, this robot says "say again" twice, then "say again slowly", then "I did not
understand". It says that, too, when a person said its name and something that is not clear: the person would wait.

A robot that does not know a name cannot understand any sentence of its owner. So a robot whose name others may not know
spells it when nobody answers, and a robot that repeatedly hears speech that it cannot understand asks for names.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from functools import partial

from hvcpd.coordination import chatter, composing
from hvcpd.coordination.addressing import is_for, is_for_me_alone, must_spell_for
from hvcpd.coordination.commands import FREE
from hvcpd.coordination.floor import Intent, Urgency
from hvcpd.coordination.knowledge import Heard, Knowledge, Reactions
from hvcpd.coordination.states import State
from hvcpd.language import messages as m

ASK_MAX = 2
"""Maximum number of times that "say again" is said before "say again slowly"."""
ASK_AGAIN = "say again"
"""The topic of this request; once the other robot is understood it is no longer needed."""
SENTENCE_S = 4.0
"""The usual sentence, and a margin."""
FOREIGN_S = 8.0
"""The code words of a message for others take 4 to 6 s, said slowly 7.5 s."""
REPEATING_ANYWAY = frozenset(
    {State.READ_BACK, State.ORDERED, State.REPORTED, State.PROPOSED, State.CHECKING, State.ASKED}
)
"""A robot that waits for an answer repeats its sentence when none comes."""

UNCLEAR_MAX = 3
"""Maximum number of times within GARBLES_WITHIN_S that "I did not understand" is said to people outside an exchange."""
UNCLEAR = "unclear"
"""The topic of it; once the person is understood it is no longer needed."""

GARBLES_MAX = 2
"""Maximum number of sentences within GARBLES_WITHIN_S that may not be understood because they collided."""
GARBLES_WITHIN_S = 60.0
"""If more than GARBLES_MAX sentences were not understood within this time, their speaker's name is unknown."""
ASK_NAMES_S = 20.0
"""Shortest time between two questions for names; it doubles after each that brought no new name."""
ASK_NAMES_MAX_S = 160.0
SPELLING = "spell"
"""The topic of this robot's name, spelled."""
RESPELL_S = 60.0
"""By then all listeners have had reason to say a spelled name; one that has not may not have heard it."""
RESPELL_MAX_S = 960.0
"""A person may never say it."""


def speaks_slowly(me: Knowledge) -> bool:
    """Whether the other one asked for it, or two attempts in either direction were not understood."""
    repair = me.repair
    return repair.speak_slowly or repair.was_asked >= ASK_MAX or repair.asked > ASK_MAX


def note(me: Knowledge, heard: Heard) -> None:
    """A sentence was understood: update the pending questions and answers, and who knows this robot's name."""
    if isinstance(heard.to, m.ToRobot):
        me.floor.answered(heard.to.name.lower(), isinstance(heard.utterance.statement, m.Confirmed))
    if me.is_partner(heard.speaker):
        me.floor.withdraw(ASK_AGAIN)
    if heard.speaker is not None and is_for_me_alone(me, heard.to):
        me.acquaintance.known_by.add(heard.speaker.lower())
    if is_for_me_alone(me, heard.to):
        me.floor.withdraw(UNCLEAR)


def after_garble(me: Knowledge, over_own_speech: bool, addressed: bool, now: float) -> None:
    """Over the robot's own speech: repeat that, because nobody heard it. In an exchange with one other: ask that
    one. Otherwise, if it was for this robot by name: say that it is not clear."""
    if over_own_speech:
        last, me.repair.last_said = me.repair.last_said, None
        asks_again = last is not None and isinstance(last.statement, m.PlaceWanted)
        if last is not None and me.state not in REPEATING_ANYWAY and not asks_again:
            me.floor.want(Intent(Urgency.ANSWER, "again", partial(_if_so, me, last), call=me.repair.last_call), now)
            me.postpone(me.timing.answer_s)
        return
    if me.current.partner is not None and me.state in (State.READ_BACK, State.ORDERED):
        _ask_partner(me, me.current.partner, now)
    elif addressed:
        _tell_unclear(me, now)
    _ask_names(me, now)


def _ask_partner(me: Knowledge, partner: str, now: float) -> None:
    me.repair.asked += 1
    if me.repair.asked > ASK_MAX + 2:
        return
    gives_up = me.repair.asked == ASK_MAX + 2
    statement = m.NotUnderstood() if gives_up else m.SayAgain(slowly=me.repair.asked > ASK_MAX)
    composing.answer(me, partner, ASK_AGAIN, statement, now)
    me.postpone(me.timing.answer_s)


def _tell_unclear(me: Knowledge, now: float) -> None:
    recent = _recent(me.repair.unclear_s, now)
    if len(recent) < UNCLEAR_MAX:
        me.repair.unclear_s = (*recent, now)
        composing.answer(me, None, UNCLEAR, m.NotUnderstood(), now)


def _recent(times_s: Iterable[float], now: float) -> tuple[float, ...]:
    return tuple(t for t in times_s if now - t < GARBLES_WITHIN_S)


def say_again(me: Knowledge, heard: Heard, s: m.SayAgain) -> None:
    """Another speaker did not understand: repeat the last sentence once."""
    last, now = me.repair.last_said, heard.now
    if last is None or not is_for(me, heard.to):
        return
    me.repair.speak_slowly = me.repair.speak_slowly or s.slowly
    me.repair.was_asked += 1
    chatter.raise_voice(me, now)

    def wait_longer() -> None:  # nobody answers while it is said
        if me.state in REPEATING_ANYWAY:
            me.postpone(SENTENCE_S * me.role.speech.stretch)

    def compose() -> m.Utterance:
        return _if_so(me, last) or composing.occupation(me, heard.speaker)

    me.floor.want(Intent(Urgency.ANSWER, "again", compose, on_said=wait_longer), now)
    if me.state in REPEATING_ANYWAY:
        me.postpone(me.timing.answer_s)


def _if_so(me: Knowledge, said: m.Utterance) -> m.Utterance | None:
    """The robot's own sentence, unless it no longer does, or is no longer about to do, what it said of itself. A report
    is made anew."""
    own = m.parts(said)[-1].statement
    match own.claim or own if isinstance(own, m.Completed) else own:
        case m.Claim(task) | m.Working(task):
            is_so = any(entry.number in me.my_tasks() for entry in me.board.known((task,)))
        case m.WillMove(motion):
            is_so = me.current.motion == motion
        case m.Busy():
            is_so = me.state not in FREE
        case m.Report():
            return replace(said, statement=composing.shift_report(me, None).statement)
        case _:
            is_so = True
    return said if is_so else None


def _sealed_message(me: Knowledge, heard: Heard, _: m.SealedMessage) -> None:
    """A robot speaks to those that have a key that this robot lacks; the code words follow."""
    me.repair.foreign_until_s = heard.now + FOREIGN_S


def spell_if_unknown(me: Knowledge, now: float) -> None:
    """Nobody answers: listeners may not know the speaker."""
    if any(must_spell_for(me, name, now) for name in me.peers.listening(now)):
        me.floor.say(Urgency.ANSWER, SPELLING, composing.spelled_name(me), now, slot=0)


def spell_now_and_then(me: Knowledge, now: float) -> None:
    """A robot is there and has never said this robot's name: spell it again, less and less often."""
    a = me.acquaintance
    respell_s = a.respell_s or RESPELL_S
    if me.role.listed or me.floor.wants(SPELLING) or now < a.spelled_s + respell_s:
        return
    if any(name not in a.known_by for name in me.peers.listening(now)):
        a.respell_s = min(2.0 * respell_s, RESPELL_MAX_S)
        me.floor.say(Urgency.TURN, SPELLING, composing.spelled_name(me), now)


def _ask_names(me: Knowledge, now: float) -> None:
    """Ask for names if speech is repeatedly not understood where strangers may be near."""
    a = me.acquaintance
    if me.role.listed and not a.strangers:
        return
    a.garbled_s = (*_recent(a.garbled_s, now), now)
    if len(a.garbled_s) <= GARBLES_MAX or now < a.ask_s:
        return
    longer_s = min(2.0 * (a.pause_s or ASK_NAMES_S), ASK_NAMES_MAX_S)
    a.pause_s = ASK_NAMES_S if len(me.peers.all()) > a.met else longer_s
    a.met, a.ask_s, a.garbled_s = len(me.peers.all()), now + a.pause_s, ()
    me.floor.say(Urgency.TURN, "names", composing.spelled_name(me, ask=True), now)


REACTIONS: Reactions = {m.SayAgain: say_again, m.SealedMessage: _sealed_message}
