"""A robot's sentence once it has the floor, and the consequences for its own state; and its owner's requests."""

from __future__ import annotations

from hvcpd.coordination import changing, chatter, composing, halting, repair
from hvcpd.coordination.actions import Say
from hvcpd.coordination.addressing import note_introduced, note_presence
from hvcpd.coordination.floor import RESUMES, Intent, Urgency
from hvcpd.coordination.knowledge import NOT_HEARD, Knowledge
from hvcpd.coordination.relaying import note_passed_on
from hvcpd.coordination.states import DEPARTING, Trigger
from hvcpd.coordination.table import fire
from hvcpd.language import messages as m

MAX_SENTENCES = 8
"""Maximum number of the owner's sentences that may wait for the floor: about 40 s of talk. Later ones would be said
when their reason is forgotten."""
QUESTIONS = (m.HowFarAway, m.WhatDoing, m.WhoHere, m.WhatLeft, m.ReportWanted)
REQUESTABLE = (m.Order, m.Motion, m.Stop, m.Resume, m.SayAgain, m.Remark, m.Change, *QUESTIONS)
"""Statements that the owner may have the robot say: orders, questions, calls and remarks. Every other statement reports
the robot's own actions or commits it, and the robot says it only when it is true."""


def request(me: Knowledge, utterance: m.Utterance, now: float) -> str | None:
    """Have the owner's sentence said when the robot's turn comes, "stop" at once. Returns why it will not be said, or
    None."""
    own, statement = me.role.name, m.own_words(utterance.statement)
    if utterance.speaker is not None and utterance.speaker.lower() != own.lower():
        return f"this robot is {own}, not {utterance.speaker}; say '… I am {own}, …'"
    if statement is not None and not isinstance(statement, REQUESTABLE):
        return f"that tells what {own} itself does or knows; {own} says so only when it is so"
    if me.state in DEPARTING:
        return f"{own} is leaving"
    if isinstance(statement, m.Change):
        return changing.want(me, statement.task.number, statement.skip, now)
    if isinstance(statement, m.Stop):
        halting.call(me, "call to stop", utterance, now)
        return f"{own} has no sound, or its words are not ready yet: it calls nobody now" if me.floor.muted else None
    kind = RESUMES if isinstance(statement, m.Resume) else "requested"
    topics = (f"{kind} {number}" for number in range(MAX_SENTENCES))
    topic = next((topic for topic in topics if not me.floor.wants(topic)), None)
    if topic is None:
        return f"{MAX_SENTENCES} sentences wait to be said already; try again when it is quieter"
    me.floor.say(Urgency.TURN, topic, utterance, now)
    return None


def announced(me: Knowledge, utterance: m.Utterance) -> m.Utterance:
    """The sentence that is said for a request: of a task's change, what all are told, with its number."""
    statement = m.own_words(utterance.statement)
    entry = me.board.find(statement.task) if isinstance(statement, m.Change) else None
    return composing.to_all(me, composing.change(entry)) if entry is not None else utterance


def begin(me: Knowledge, intent: Intent, now: float) -> None:
    """Say the intended sentence, if it is still to be said."""
    utterance = _with_own_turn(me, intent, now) if intent.tentative else _compose(me, intent, now)
    if utterance is None:
        me.floor.ended(now)
        return
    intent.on_said()
    _note_own_words(me, utterance, now)
    if me.acquaintance.introduced:
        note_presence(me, utterance, now)
    note_introduced(me)
    slowly = repair.speaks_slowly(me) or me.role.speech.slowly
    # Said again, "stop" would halt who has been released since, and "resume" release who has been stopped.
    once = isinstance(utterance.statement, m.Stop | m.Resume)
    me.repair.last_said, me.repair.last_call = None if once else utterance, intent.call
    me.last_heard = NOT_HEARD
    level_db = chatter.level_db(me, intent, utterance, now)
    for_noise = chatter.is_for_noise(me, utterance, level_db, now)
    me.do(Say(utterance, slowly, me.role.speech.times, level_db, for_noise))


def _compose(me: Knowledge, intent: Intent, now: float) -> m.Utterance | None:
    """Make the open choices and compose the sentence; None if there is nothing left to say."""
    chosen = intent.decide(now)
    if chosen is not None:
        fire(me, chosen, now)
    utterance = intent.compose()
    if utterance is None and intent.trigger is not None:
        fire(me, Trigger.WITHDRAWN, now)
    return utterance


def _with_own_turn(me: Knowledge, confirmation: Intent, now: float) -> m.Utterance | None:
    """A confirmation, together with the claim or report that waits for this robot's own turn."""
    said = _compose(me, confirmation, now)
    topic = composing.joinable(me)
    if said is None or not isinstance(said.statement, m.Confirmed) or not said.statement.tasks or topic is None:
        return said
    own = me.floor.take_along(topic, now)
    words = _compose(me, own, now) if own is not None else None
    if words is None:
        me.floor.speaking = confirmation
        return said
    return composing.joined(said, words)


def _note_own_words(me: Knowledge, utterance: m.Utterance, now: float) -> None:
    """Note the consequences of this robot's own sentence."""
    own = m.parts(utterance)[-1]
    statement = own.statement
    claims = isinstance(statement, m.Claim | m.Working)
    if claims or (isinstance(statement, m.Completed) and statement.next is not None):
        me.current.claimed_s = now
    if claims:
        me.report.said = False
    elif isinstance(statement, m.Completed | m.Failed) and statement.task.number in me.report.tasks:
        me.report.said = True
    if isinstance(statement, m.Relayed) and isinstance(utterance.addressee, m.ToRobot):
        note_passed_on(me.relays, utterance.addressee.name, statement, now)
    if isinstance(statement, m.Spelled):
        me.acquaintance.spelled_s = now
    if me.role.listed:  # all have heard its name
        me.floor.withdraw_all("greet ")
        if not isinstance(own.addressee, m.ToRobot):
            me.floor.withdraw_all("here ")
