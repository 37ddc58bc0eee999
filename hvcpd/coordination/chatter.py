"""How much a robot says, how loudly, and whether for noise. Nothing that others need is left out, or said too softly.

A `FULL` robot greets even where its first claim would introduce it, tells the way to each task, and says that it begins
a task and, in the end, that it is free; not where air time is scarce. A `TERSE` one claims two tasks in a sentence, and
does not tell robots that know its name that it is there. Each kind understands the others, so a team may be mixed.

In quiet hours a robot speaks softly. If a sentence is not answered, or another speaker says one to it again, it speaks
at the usual level for a minute. Alarms and all that concerns a stop are never soft.

Where a voice was hardly louder than the noise, because there is much of it or the speaker is far away, robots speak as
people do in noise (`hvcpd.synthesis.delivery`). Robots understand this as well as plain speech, people better.
"""

from __future__ import annotations

from collections.abc import Callable

from hvcpd.coordination import choosing, composing
from hvcpd.coordination.actions import Talk
from hvcpd.coordination.floor import Intent, Urgency
from hvcpd.coordination.knowledge import Knowledge
from hvcpd.coordination.states import State
from hvcpd.language import messages as m

ALOUD_S = 60.0
"""For this long after an unanswered sentence, its own or another speaker's, a robot speaks at the usual level: a claim,
its confirmation and the repetitions of both."""
NOISY_DB = 12.0
"""A voice that is less than this above the noise is hard to understand for people: from 10 dB up Whisper has no more
words of plain speech wrong than of speech for noise, at 6 dB half as many again (docs/voice.md)."""
CLEAR_DB = 20.0
"""A robot that speaks for noise does so until voices are clearer than this: others do it too, and are 3 to 6 dB louder
than before."""
TIMED = (m.HowFarAway, m.Measuring)
"""Their arrival is measured, by their samples in plain speech."""
NEVER_SOFT = (m.Stop, m.Stopped, m.Resume, m.Leaving)


def announce_beginning(me: Knowledge, now: float) -> None:
    """Say that the robot begins its task, if its setting `talk` is full."""
    if me.role.talk is Talk.FULL and not choosing.air_is_scarce(me, me.board[me.my_task()].definition, now):
        _want(me, lambda: composing.working(me) if me.state is State.ACTING else None, now)


def announce_free(me: Knowledge, now: float) -> None:
    """Say once that nothing is left to do, if its setting `talk` is full."""
    was_busy, me.acquaintance.was_busy = me.acquaintance.was_busy, False
    if me.role.talk is Talk.FULL and was_busy and me.expected(now):
        free, after_s = composing.to_all(me, m.Free()), me.timing.back_off_s * me.rng.random()  # all notice at once
        _want(me, lambda: free if me.state is State.READY and me.board.all_done else None, now + after_s)


def _want(me: Knowledge, compose: Callable[[], m.Utterance | None], now: float) -> None:
    me.floor.want(Intent(Urgency.TURN, "chatter", compose, not_before_s=now), now)


def introduces_itself(me: Knowledge, asker: str | None) -> bool:
    """Whether a robot that has nothing else to say answers this greeting with its name, although nobody asked."""
    is_known = me.role.listed and asker is not None and asker.lower() in me.roster
    return me.role.talk is not Talk.TERSE or not is_known


def raise_voice(me: Knowledge, now: float) -> None:
    """A sentence was not answered, or not understood: it may have been too soft."""
    me.repair.aloud_until_s = now + ALOUD_S


def note_heard(me: Knowledge, utterance: m.Utterance, snr_db: float | None, now: float) -> None:
    """Notice that a speaker repeats itself: it has not heard the answer; and how noisy it is."""
    least_db = CLEAR_DB if now < me.repair.noisy_until_s else NOISY_DB
    if snr_db is not None and snr_db < least_db:
        me.repair.noisy_until_s = now + ALOUD_S
    peer = me.peers.get(utterance.speaker)
    if peer is not None:
        if peer.last_said == utterance:
            raise_voice(me, now)
        peer.last_said = utterance


def level_db(me: Knowledge, intent: Intent, utterance: m.Utterance, now: float) -> float:
    """The level of a sentence relative to the usual one, dB."""
    words = m.own_words(utterance.statement)
    of_a_stop = isinstance(words, NEVER_SOFT) or (isinstance(words, m.PlaceTaken) and words.stands)
    always = intent.urgency is Urgency.ALARM or of_a_stop
    return 0.0 if always or now < me.repair.aloud_until_s else me.role.softly_db


def is_noisy(me: Knowledge, now: float) -> bool:
    """Whether the robot speaks for noise now."""
    return me.role.speech.follows_noise and now < me.repair.noisy_until_s


def is_for_noise(me: Knowledge, utterance: m.Utterance, level_db: float, now: float) -> bool:
    """Whether a sentence of this level is said for noise: never if it has to be soft."""
    return is_noisy(me, now) and level_db == 0.0 and not isinstance(m.own_words(utterance.statement), TIMED)
