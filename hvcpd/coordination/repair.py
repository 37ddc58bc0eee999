"""What is done about speech that was not understood: ask again, twice, then more slowly, then say that it is no use."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from hvcpd.coordination import composing
from hvcpd.coordination.floor import Urgency
from hvcpd.coordination.table import State
from hvcpd.language import messages as m

if TYPE_CHECKING:
    from hvcpd.coordination.coordination import Coordination

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


@dataclass
class Repair:
    """How the understanding of one exchange goes."""

    last_said: m.Utterance | None = None
    asked: int = 0
    """So often this robot had something said again;"""
    was_asked: int = 0
    """so often it was told to say something again."""
    speak_slowly: bool = False
    resume_s: float = -math.inf
    """When "resume" was heard last."""
    foreign_until_s: float = -math.inf
    """Until then what is not understood may be code words of a message for others."""

    @property
    def slow(self) -> bool:
        """Whether the other one asked for it, or neither understood the other one at two attempts."""
        return self.speak_slowly or self.was_asked >= ASK_MAX or self.asked > ASK_MAX

    def reset(self) -> None:
        """A new exchange begins."""
        self.asked, self.was_asked, self.speak_slowly = 0, 0, False


def after_garble(c: Coordination, over_own_speech: bool, now: float) -> None:
    """Over the own speech: say it again, for nobody heard it. In an exchange with one other: ask that one."""
    if over_own_speech:
        last, c.repair.last_said = c.repair.last_said, None
        if last is None or c.state in REPEATING_ANYWAY:
            return
        c.want(Urgency.ANSWER, "again", lambda: last, now)
        c.postpone(c.timing.answer_s)
        return
    if c.partner is None or c.state not in (State.READ_BACK, State.ORDERED):
        return
    partner = c.partner
    c.repair.asked += 1
    if c.repair.asked > ASK_MAX + 2:
        return
    statement: m.Statement = m.SayAgain(slowly=c.repair.asked > ASK_MAX)
    if c.repair.asked == ASK_MAX + 2:
        statement = m.NotUnderstood()
    c.want(Urgency.ANSWER, ASK_AGAIN, lambda: composing.to_robot(c, partner, statement), now)
    c.postpone(c.timing.answer_s)


def say_again(c: Coordination, slowly: bool, now: float) -> None:
    """Somebody did not understand: the last sentence is said once more."""
    last = c.repair.last_said
    if last is None:
        return
    c.repair.speak_slowly = c.repair.speak_slowly or slowly
    c.repair.was_asked += 1
    c.want(Urgency.ANSWER, "again", lambda: _once_more(c, last), now, slowly=c.repair.slow)
    if c.state in REPEATING_ANYWAY:
        c.postpone(c.timing.answer_s)


def _once_more(c: Coordination, last: m.Utterance) -> m.Utterance:
    """While it is said nobody answers it: who waits for an answer waits so much longer."""
    if c.state in REPEATING_ANYWAY:
        c.postpone(SENTENCE_S * c.role.speech.stretch)
    return last
