"""What is done about speech that was not understood: ask again, twice, then more slowly, then say that it is no use."""

from __future__ import annotations

from hvcpd.coordination import composing
from hvcpd.coordination.floor import Urgency
from hvcpd.coordination.knowledge import Knowledge
from hvcpd.coordination.states import State
from hvcpd.language import messages as m

ASK_MAX = 2
"""So often "say again" is said; then once "say again slowly"; then the robot gives up and says so."""

ASK_AGAIN = "say again"
"""The topic of asking so; once the other one is understood it is no longer needed."""

SENTENCE_S = 4.0
"""The usual sentence, and some more."""

REPEATING_ANYWAY = frozenset(
    {State.READ_BACK, State.ORDERED, State.REPORTED, State.PROPOSED, State.CHECKING, State.ASKED}
)
"""Who waits for an answer says the sentence again when none comes."""


def speaks_slowly(me: Knowledge) -> bool:
    """Whether the other one asked for it, or two attempts in either direction were not understood."""
    repair = me.repair
    return repair.speak_slowly or repair.was_asked >= ASK_MAX or repair.asked > ASK_MAX


def after_garble(me: Knowledge, over_own_speech: bool, now: float) -> None:
    """Over the own speech: say it again, for nobody heard it. In an exchange with one other: ask that one."""
    if over_own_speech:
        last, me.repair.last_said = me.repair.last_said, None
        if last is None or me.state in REPEATING_ANYWAY:
            return
        me.want(Urgency.ANSWER, "again", lambda: last, now)
        me.postpone(me.timing.answer_s)
        return
    if me.current.partner is None or me.state not in (State.READ_BACK, State.ORDERED):
        return
    partner = me.current.partner
    me.repair.asked += 1
    if me.repair.asked > ASK_MAX + 2:
        return
    statement: m.Statement = m.SayAgain(slowly=me.repair.asked > ASK_MAX)
    if me.repair.asked == ASK_MAX + 2:
        statement = m.NotUnderstood()
    me.want(Urgency.ANSWER, ASK_AGAIN, lambda: composing.to_robot(me, partner, statement), now)
    me.postpone(me.timing.answer_s)


def say_again(me: Knowledge, slowly: bool, now: float) -> None:
    """Somebody did not understand: the last sentence is said once more."""
    last = me.repair.last_said
    if last is None:
        return
    me.repair.speak_slowly = me.repair.speak_slowly or slowly
    me.repair.was_asked += 1
    me.want(Urgency.ANSWER, "again", lambda: _once_more(me, last), now, slowly=speaks_slowly(me))
    if me.state in REPEATING_ANYWAY:
        me.postpone(me.timing.answer_s)


def _once_more(me: Knowledge, last: m.Utterance) -> m.Utterance:
    """While it is said nobody answers it: who waits for an answer waits so much longer."""
    if me.state in REPEATING_ANYWAY:
        me.postpone(SENTENCE_S * me.role.speech.stretch)
    return last
