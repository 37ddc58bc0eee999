"""Puts the second look together."""

from __future__ import annotations

from collections.abc import Mapping

from hvcpd.faculties import Ears
from hvcpd.language.phrasebook import Phrasebook
from hvcpd.people.ears import LooksAgain, SecondEars, Worker
from hvcpd.people.enrolled import Person
from hvcpd.people.opinion import SecondOpinion
from hvcpd.synthesis.lexicon import Lexicon


def make_second(
    phrasebook: Phrasebook, lexicon: Lexicon, people: Mapping[str, Person], strangers: bool
) -> LooksAgain | None:
    """Who looks again at what robots' voices do not explain: for enrolled people and, if `strangers` are to be
    understood, for anybody; None if there is nobody to look for. Words that `people` get later count from then on."""
    if not strangers and not people:
        return None
    return SecondOpinion(phrasebook.people_graph, lexicon, people, strangers)


def looking_twice(ears: Ears, listener: LooksAgain | None, worker: Worker) -> Ears:
    """The ears with a second look, if there is anybody who looks."""
    return ears if listener is None else SecondEars(ears, listener, worker)
