"""The addressees of a sentence, and the slots in which robots answer it: objections first, then confirmations."""

from __future__ import annotations

from hvcpd.coordination.knowledge import Knowledge
from hvcpd.language import messages as m

JUST_SPELLED_S = 20.0
"""A spelled name is not spelled again for this long: others who greet meanwhile have heard it too."""
OPENERS = (
    *(m.HowFarAway, m.Order, m.WhatDoing, m.WhatLeft, m.WhoHere, m.ReportWanted, m.Completed, m.Failed),
    m.PlaceWanted,
)
"""Statements said to one robot unasked; every other statement to one robot answers it."""

OWNER_SLOT = 0
"""The robot that did the task, is at work on it, or wants it, objects first. A slot for each of these made two robots
7 s later with 24 tasks, and twelve 4 s."""
OTHERS_SLOT = 1
"""The first slot of the others that know better."""
OBJECTORS = 3
"""Slots of the others before all confirmations; so many robots have one each. Of more, the first by rank has the first
slot, and the rest share two. Every answer waits for these slots: with five, twelve robots took 10 s longer for 24
tasks."""
OWN_WORDS_SLOTS = 5
"""Slots saved by a sentence that says two things: another sentence and the pause before it take longer. With three,
twelve robots took 6 s longer for 24 tasks; with eleven, much longer where sentences are lost."""
CONFIRMERS = 3
"""Maximum number of confirmations that may still begin before a new turn does: three in a row rarely miss a claim."""
UNSURE_SLOTS = 4
"""Slots that a newcomer, or a robot that missed the claim, leaves to robots that know more."""


def is_for(me: Knowledge, to: m.Addressee | None) -> bool:
    """Whether a sentence to this addressee is meant for this robot, alone or among others."""
    match to:
        case m.ToRobot(name):
            return name.lower() == me.role.name.lower()
        case m.ToTeam(team):
            return me.role.team is not None and team.lower() == me.role.team.lower()
        case _:
            return True


def is_for_me_alone(me: Knowledge, to: m.Addressee | None) -> bool:
    return isinstance(to, m.ToRobot) and to.name.lower() == me.role.name.lower()


def whose_turn(u: m.Utterance) -> str | None:
    """The speaker whose turn this is: an answer belongs to the turn of its addressee."""
    if isinstance(u.addressee, m.ToRobot) and not isinstance(u.statement, (*OPENERS, m.ConfirmedAnd)):
        return u.addressee.name
    return u.speaker


def must_spell_for(me: Knowledge, name: str | None, now: float) -> bool:
    """Whether a listener (None: any) may not know this robot's name, and did not hear it spelled just now."""
    a = me.acquaintance
    if me.role.listed or now - a.spelled_s < JUST_SPELLED_S:
        return False
    return name is None or name.lower() not in a.known_by


def confirming_slot(me: Knowledge, now: float) -> int:
    """The first slot for confirmations, after all objections; two robots alone need no slots for a third's
    objection."""
    others = len(me.expected(now))
    return OTHERS_SLOT + (min(others, OBJECTORS) if others > 1 else 0)


def waiting_slots(me: Knowledge, now: float) -> int:
    """Slots that a robot that only confirms leaves to those that add a sentence of their own."""
    others = len(me.expected(now))
    return min(others, OWN_WORDS_SLOTS) if others > 1 else 0


def answer_slots(me: Knowledge, now: float) -> int:
    """Slots for all robots that confirm a sentence, or object."""
    return confirming_slot(me, now) + waiting_slots(me, now) + CONFIRMERS


def note_presence(me: Knowledge, u: m.Utterance, now: float) -> None:
    """A robot that has not spoken yet may confirm a claim before all others: if another robot does, nobody else is
    there. A robot that has not spoken itself knows that this is wrong, but that the others now believe it."""
    a, speaker = me.acquaintance, (u.speaker or "").lower()
    words = m.parts(u)[0].statement
    in_turn = isinstance(words, m.Confirmed) and words.task is not None  # their giver confirms orders
    nobody_else = (in_turn and speaker in me.roster and speaker not in a.unheard) or now > a.all_heard_s
    a.passed_over = a.passed_over or nobody_else
    a.unheard = frozenset() if nobody_else and a.introduced else a.unheard - {speaker}


def note_introduced(me: Knowledge) -> None:
    """This robot has said its name: the others now count it as present."""
    a = me.acquaintance
    a.unheard = frozenset() if a.passed_over else a.unheard
    a.introduced = True


def objection_slot(me: Knowledge, other: str, number: int, now: float) -> int:
    """The slot in which this robot objects to `other`'s claim, if it knows better and is neither doer nor owner.

    Robots that share slots draw the first with the probability with which one alone is most likely to take it
    (slotted ALOHA). If two object at once, neither is understood, and nobody confirms; for the repeated claim they draw
    anew.
    """
    rank, others = me.rank_with_unheard(other, number, now), len(me.expected(now))
    if others > OBJECTORS and rank > 0:
        rank = 1 if me.rng.random() * (others - 1) < 1.0 else 2
    return OTHERS_SLOT + min(rank, OBJECTORS - 1)


def shares_slot(me: Knowledge, slot: int | None, now: float) -> bool:
    """Whether other robots may object in this slot, too: then the first voice counts as the objection of all."""
    return len(me.expected(now)) > OBJECTORS and OTHERS_SLOT < (slot or 0) < confirming_slot(me, now)
