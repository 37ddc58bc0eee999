"""Which sentences a robot believes, by their seals, and its answers to those that it does not.

One place decides. Statements that change a robot's actions or beliefs need a seal or a code (`marks.SEALED`); those
that set wheels in motion also need proof that their speaker is here, not only its recording. "Stop" is obeyed from
anybody. Where no key is set all trust is OPEN, and everything is believed.
"""

from __future__ import annotations

from hvcpd.coordination import composing
from hvcpd.coordination.addressing import is_for, is_for_me_alone
from hvcpd.coordination.conversation import NEVER_S
from hvcpd.coordination.floor import RANK_MAX
from hvcpd.coordination.knowledge import Knowledge
from hvcpd.coordination.states import State
from hvcpd.language import messages as m
from hvcpd.language.marks import is_sealed
from hvcpd.security.trust import People, Trust

NEED_PRESENCE = (m.Order, m.Resume, m.ComeBack, m.MoveBy, m.TurnBy)
"""A recording of one of these, made while this robot was away, would set its wheels in motion."""
ASK_MAX = 2
"""How often a speaker is asked to repeat a sentence that was not believed: this helps with misheard words, and the
answer to the second question proves presence even if the first was misheard."""
ASK_AGAIN_S = 300.0
"""After ASK_MAX questions none is asked for this long, unless a sentence was believed meanwhile."""
TELL_S = 10.0
"""Before then "I do not trust that" is not repeated to the same speaker; it doubles each time, up to TELL_MOST_S."""
TELL_MOST_S = 640.0
"""A recording that is played for hours does not make a robot talk for hours."""
OTHERS_SLOT = 3
"""If a sentence was said to many, robots that believe it answer first."""


def believes(me: Knowledge, u: m.Utterance, trust: Trust) -> bool:
    """Whether the sentence may be acted on, and learned from."""
    statement = m.own_words(u.statement)
    if trust is Trust.OPEN or isinstance(statement, m.Stop):
        return True
    if trust.proves_speaker:
        return trust.proves_presence or not isinstance(statement, NEED_PRESENCE) or not is_for(me, u.addressee)
    if isinstance(statement, m.SayAgain):
        return True
    person = not _is_robot(me, u.speaker)
    if person and trust is Trust.BARE and (me.role.people is People.EVERYTHING or _answers_read_back(me, u)):
        return True
    return not _needs_proof(u) and not (person and me.role.people is People.NOTHING)


def _needs_proof(u: m.Utterance) -> bool:
    """Whether it is a statement that needs a seal, or may be: an encrypted one is unknown."""
    return is_sealed(u.statement) or isinstance(u.mark, m.Cipher)


def _answers_read_back(me: Knowledge, u: m.Utterance) -> bool:
    """Whether a person whose code was good says yes or no to the read-back of it: a code is valid once, and the codes
    of a clock come every 30 s. No may come while the robot makes the motion, which may have begun at once."""
    takes_back = isinstance(u.statement, m.Negative) and (me.has_read_back or me.state is State.MOVING)
    answers = takes_back or (isinstance(u.statement, m.Confirmed) and me.has_read_back)
    return answers and is_for_me_alone(me, u.addressee) and me.is_partner(u.speaker)


def admit(me: Knowledge, u: m.Utterance, trust: Trust) -> bool:
    """As `believes`; a speaker who is believed with a seal is not asked any more, and may be another time."""
    believed = believes(me, u, trust)
    if believed and u.mark is not None and u.speaker is not None:
        me.doubts.asked.pop(u.speaker.lower(), None)
        me.floor.withdraw(_topic(u.speaker))
    return believed


def _is_robot(me: Knowledge, name: str | None) -> bool:
    """Whether it is one of the names that all were given: those have the key."""
    return name is not None and any(name.lower() == known.lower() for known in me.role.roster)


def refuse(me: Knowledge, u: m.Utterance, trust: Trust, now: float) -> None:
    """Ask for a repetition of a sentence that may have been misheard; else say that it is not believed, and do nothing.

    A right seal is asked about every time: each is valid once, so nobody can play it repeatedly.
    """
    if trust is Trust.REVOKED:
        me.floor.busy_since_s = NEVER_S  # it is no voice that may answer: nobody repeats a claim for it
    if not is_for(me, u.addressee) or not _needs_proof(u):
        return
    name = u.speaker
    misheard = trust.may_be_misheard or (trust is Trust.BARE and _is_robot(me, name))
    asks = trust is Trust.SEALED or (misheard and name is not None and _may_ask(me, name, now))
    if asks and name is not None:
        statement: m.Statement = m.SayAgain()
    elif _may_tell(me, name, now):
        statement = m.Distrusted()
    else:
        return
    key, alone = name or "", is_for_me_alone(me, u.addressee)
    slot = 0 if alone else OTHERS_SLOT + min(me.rank(key, 0, now), RANK_MAX)  # of many listeners, one answers
    call = None if alone else key
    composing.answer(me, name, _topic(key), statement, now, slot=slot, call=call, tentative=not alone)


def _topic(name: str) -> str:
    """The topic of what is said to a speaker who is not believed."""
    return f"trust {name}"


def _may_ask(me: Knowledge, name: str, now: float) -> bool:
    since_s, times = me.doubts.asked.get(name.lower(), (now, 0))
    if now - since_s > ASK_AGAIN_S:
        since_s, times = now, 0
    me.doubts.asked[name.lower()] = (since_s, times + 1)
    return times < ASK_MAX


def _may_tell(me: Knowledge, name: str | None, now: float) -> bool:
    key = (name or "").lower()
    last_s, pause_s = me.doubts.answered.get(key, (float("-inf"), 0.0))
    if now - last_s < pause_s:
        return False
    forgotten = now - last_s > 4.0 * TELL_MOST_S
    me.doubts.answered[key] = (now, TELL_S if forgotten or not pause_s else min(2.0 * pause_s, TELL_MOST_S))
    return True
