"""The sentences by which a person enrols: a few that have as many joints of two phones as possible, and do no harm."""

from __future__ import annotations

import random
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

from hvcpd.language import messages as m
from hvcpd.language.phrasebook import Phrasebook
from hvcpd.people.phones import Pronounce

SENTENCES = 5
HARMLESS = (m.Order, m.MoveBy, m.TurnBy, m.WhatDoing, m.WhatLeft, m.ReportWanted, m.SayAgain, m.Negative, m.WhoHere)
"""What a person says to one robot: said to the one whose microphone is used, no other in the room does anything."""
CANDIDATES = 2000
LONGEST = 12
"""Words: people read longer sentences with pauses in them."""
PAUSE = ""
"""Stands for the silence around a sentence."""


def sentences_for(phrasebook: Phrasebook, robot: str, person: str, pronounce: Pronounce) -> list[tuple[str, ...]]:
    """What a person is to say to a robot, SENTENCES in number, always the same for the same phrasebook."""
    rng = random.Random(1)
    drawn = (phrasebook.sample(rng) for _ in range(CANDIDATES))
    candidates = [
        replace(utterance, speaker=person, addressee=m.ToRobot(robot), team=None)
        for utterance in drawn
        if isinstance(utterance.statement, HARMLESS) and utterance.speaker is not None
    ]
    texts = {words for each in candidates if len(words := _words(phrasebook, each)) <= LONGEST}
    joints = {words: _joints(words, pronounce) for words in sorted(texts)}
    chosen: list[tuple[str, ...]] = []
    covered: set[tuple[str, str]] = set()
    while joints and len(chosen) < SENTENCES:
        best = max(joints, key=lambda words: len(joints[words] - covered))
        covered |= joints.pop(best)
        chosen.append(best)
    return chosen


def _words(phrasebook: Phrasebook, utterance: m.Utterance) -> tuple[str, ...]:
    return tuple(word for phrase in phrasebook.phrases(utterance) for word in phrase)


def _joints(words: Sequence[str], pronounce: Pronounce) -> set[tuple[str, str]]:
    """Each phone with the one after it."""
    phones = [PAUSE, *(phone for word in words for phone in pronounce(word)[0]), PAUSE]
    return set(pairwise(phones))
