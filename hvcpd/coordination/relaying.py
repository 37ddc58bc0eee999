"""Relays: sentences passed on between two robots that do not hear each other, and reports in their speaker's name.

If one robot does not answer an order or a question, the first robot that has heard both says it again in the speaker's
name ("Hi Bot, I am Max, Rob says, …"). From then on this pair counts as out of each other's earshot, and every sentence
between them is passed on, until one is heard to answer the other by itself. A relayed sentence is never passed on
again, so no sentence goes round in a circle: a message crosses one robot.
"""

from __future__ import annotations

from dataclasses import replace

from hvcpd.coordination import changing, claims, composing
from hvcpd.coordination.addressing import OWNER_SLOT, is_for_me_alone
from hvcpd.coordination.conversation import NEVER_S, QuotedReport, Relays
from hvcpd.coordination.entry import Entry
from hvcpd.coordination.knowledge import Heard, Knowledge, Reactions
from hvcpd.coordination.states import NEWCOMER, State, Trigger
from hvcpd.coordination.table import fire
from hvcpd.language import messages as m
from hvcpd.language.forms import RELAYABLE, SAID_TWICE, SLOT_FIELDS

OPENERS = (m.Order, m.WhatDoing)
"""Statements that begin an exchange and must be answered."""
SILENT_SLOT = 6
"""By then the addressee would have begun: its slot is one of three, and its voice is noticed within another."""
APART_SLOT = 4
"""First slot for passing on between two that are known not to hear each other."""
RANK_MAX = 3
"""Robots beyond this rank share a slot for passing on; the speaker repeats its sentence soon after."""
APART_S = 600.0
"""How long two robots count as out of each other's earshot after something was passed on between them: as long as a
robot that is not heard counts as present."""
REPEATED_S = 60.0
"""Within this time the same words to the same robot are the same message, repeated because nobody answered."""
RELAYS_MAX = 2
"""A message is passed on once, and once more if the speaker, who hears it passed on, still has no answer."""
ANSWER_S = 12.0
"""A robot that hears its words passed on waits this long for the answer to be passed on in turn: the answer, which it
may not hear, lasts 5 s, or 6 if said slowly, and the gaps around it take the same again."""


def note_passed_on(relays: Relays, to: str, s: m.Relayed, now: float) -> None:
    """Note that this robot passes it on to `to` now. A report may be relayed to object to a claim, too."""
    message = (s.speaker.lower(), to.lower(), s.statement)
    if isinstance(s.statement, m.Completed) and not are_apart(relays, frozenset(message[:2]), now):
        return
    relays.passed_on = {msg: seen for msg, seen in relays.passed_on.items() if now - seen[1] < REPEATED_S}
    relays.passed_on[message] = (relays.passed_on.get(message, (0, now))[0] + 1, now)
    relays.apart[frozenset(message[:2])] = now


def are_apart(relays: Relays, pair: frozenset[str], now: float) -> bool:
    """Whether these two are believed not to hear each other."""
    return now - relays.apart.get(pair, NEVER_S) < APART_S


def _topic(speaker: str, listener: str) -> str:
    return f"relay {speaker.lower()} {listener.lower()}"


def overheard(me: Knowledge, heard: Heard) -> None:
    """Pass on a sentence to a robot that stays silent, or is known not to hear the speaker."""
    said, speaker, now = heard.utterance.statement, heard.speaker, heard.now
    if speaker is None or not isinstance(heard.to, m.ToRobot) or me.state in NEWCOMER:
        return
    to = heard.to.name
    if isinstance(said, m.Relayed):
        _note_relay(me, said, to, now)
        return
    if is_for_me_alone(me, heard.to):
        return
    pair, message = frozenset((speaker.lower(), to.lower())), (speaker.lower(), to.lower(), said)
    times, passed_on_s = me.relays.passed_on.get(message, (0, NEVER_S))
    if me.floor.wants(_topic(to, speaker)):
        me.floor.withdraw(_topic(to, speaker))  # it answers before the words were passed on: it has heard them
        me.relays.apart.pop(pair, None)
    apart = are_apart(me.relays, pair, now)
    passed_on_enough = times >= RELAYS_MAX and now - passed_on_s < REPEATED_S
    if not isinstance(said, RELAYABLE if apart else OPENERS) or passed_on_enough:
        return
    if not me.peers.is_present(to, now) or _says_two_things(said):
        return
    slot = (APART_SLOT if apart else SILENT_SLOT) + min(me.rank(speaker, 0, now), RANK_MAX)
    relay = m.Relayed(speaker, said)
    composing.answer(me, to, _topic(speaker, to), relay, now, slot, call=speaker, tentative=not apart)


def _says_two_things(s: m.Statement) -> bool:
    """Whether no form passes it on: that would be too long."""
    return any(getattr(s, SLOT_FIELDS[slot], None) is not None for slot in SAID_TWICE)


def _note_relay(me: Knowledge, s: m.Relayed, to: str, now: float) -> None:
    """Another robot relays a sentence: this robot need not, and the speaker and the addressee have time."""
    me.floor.withdraw(_topic(s.speaker, to))
    note_passed_on(me.relays, to, s, now)
    own, partner = me.role.name.lower(), (me.current.partner or "").lower()
    waiting = me.state in (State.ORDERED, State.READ_BACK, State.REPORTED)
    if waiting and {own, partner} == {s.speaker.lower(), to.lower()}:
        me.arm(now, ANSWER_S * me.role.speech.stretch)


def direct(me: Knowledge, heard: Heard) -> Heard:
    """A sentence relayed to this robot, as if its original speaker had said it; all others unchanged.

    Reports stay as they are, because every robot may learn from them; see `relayed`.
    """
    s = heard.utterance.statement
    if not isinstance(s, m.Relayed) or isinstance(s.statement, m.Completed) or not is_for_me_alone(me, heard.to):
        return heard
    if s.speaker.lower() == me.role.name.lower():
        return heard
    me.peers.heard(s.speaker, heard.now)
    return replace(heard, utterance=m.Utterance(s.speaker, heard.to, None, s.statement))


def relayed(me: Knowledge, heard: Heard, s: m.Relayed) -> None:
    """Another robot's words: a report is noted as its speaker's, who denies it if it never said so."""
    inner, name, now = s.statement, heard.name, heard.now
    if not isinstance(inner, m.Completed) or (entry := me.board.find(inner.task)) is None:
        return
    number, alone = entry.number, is_for_me_alone(me, heard.to)
    if s.speaker.lower() == me.role.name.lower():
        _quoted(me, name, entry, inner.count, now)
        return
    peer = me.peers.get(s.speaker)
    if alone and peer is not None and peer.assigned == number:
        me.peers.heard(peer.name, now)
        claims.confirm_at_once(me, peer.name, now)
    me.report_quoted = QuotedReport(s.speaker, number, now)
    if not claims.doubts(me, name, number, False, now) and (alone or not entry.known_done):
        may_be_older = entry.recurs and me.clock_s is not None and not inner.count
        claims.note_done(me, s.speaker, number, now, hearsay=may_be_older)
        me.reconsider(now)


def _quoted(me: Knowledge, name: str, entry: Entry, count: int | None, now: float) -> None:
    """Another robot says that this robot has done the task. If it has done an earlier occurrence only, it says so; one
    that does not know which occurrence is due learns that it has done it."""
    number, own = entry.number, me.role.name
    has_part = entry.is_shared and entry.acted_s > NEVER_S
    if has_part or (entry.known_done and entry.owner == own):
        return
    if entry.done_by != own:
        answer = composing.change(entry) if entry.skipped else m.Negative()
        composing.answer(me, name, composing.answer_topic(name), answer, now, OWNER_SLOT)
    elif entry.recurs and count:
        if entry.change and (me.clock_s is not None or count != composing.spoken_count(entry)):
            changing.tell(me, name, entry, now)
        elif not me.acts(number):
            me.board.complete(number, own)
            if entry.acted_s < entry.opened_s:
                entry.opened_s = NEVER_S  # it misheard that this was due again
            if me.current.task == number:
                fire(me, Trigger.LOST, now)


REACTIONS: Reactions = {m.Relayed: relayed}
