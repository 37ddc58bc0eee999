"""Puts the second look together."""

from __future__ import annotations

from collections.abc import Mapping

from hvcpd.faculties import Ears
from hvcpd.language.phrasebook import Phrasebook
from hvcpd.people.ears import LooksAgain, SecondEars, Worker
from hvcpd.people.enrolled import Person
from hvcpd.people.opinion import SecondOpinion
from hvcpd.synthesis.lexicon import Lexicon


def make_second(phrasebook: Phrasebook, lexicon: Lexicon, people: Mapping[str, Person], strangers: bool) -> LooksAgain:
    """Who looks again at what robots' voices do not explain: for enrolled people and, if `strangers` are to be
    understood, for anybody. People and words that `people` get later count from then on."""
    return SecondOpinion(phrasebook.people_graph, lexicon, people, strangers)


def looking_twice(ears: Ears, listener: LooksAgain, worker: Worker) -> Ears:
    """The ears with a second look."""
    return SecondEars(ears, listener, worker)
