"""The number of words of an utterance, without rendering each one: sentences of one shape are counted once."""

from __future__ import annotations

from dataclasses import fields, is_dataclass, replace
from functools import lru_cache

from hvcpd.language import messages as m
from hvcpd.language.forms import Kind
from hvcpd.language.marks import hidden, mark_words
from hvcpd.language.phrasebook import Phrasebook, Vocabulary
from hvcpd.language.words import NUMBER_MAX, spoken_words

_SHAPES: dict[object, int] = {}
"""Words of a sentence by its shape, over all missions of a process; a name counts as one word."""
_NAME = "Rob"


def n_words(utterance: m.Utterance) -> int:
    """The number of words of an utterance; see the module."""
    marks = len(mark_words(utterance.mark)) if utterance.mark is not None else 0
    return marks + _count(replace(hidden(utterance), mark=None))


@lru_cache(maxsize=4096)
def _count(u: m.Utterance) -> int:
    shape = (type(u.addressee), u.speaker is None, u.team is None, _shape(u.statement))
    if shape not in _SHAPES:
        task = getattr(m.own_words(u.statement), "task", None)
        tasks = (task.name,) if isinstance(task, m.TaskByName) else ()
        teams = tuple(t for t in (u.team, u.addressee.team if isinstance(u.addressee, m.ToTeam) else None) if t)
        book = Phrasebook(
            Vocabulary(
                tuple(sorted(names_in(u) - {m.FRIEND})) or (_NAME,),
                tuple(dict.fromkeys(teams)),
                tasks,
                tuple(range(NUMBER_MAX)),
                places=(place,) if (place := getattr(u.statement, "place", None)) is not None else (),
                failures=tuple(filter(None, [getattr(u.statement, "reason", None)])),
                kinds=frozenset(Kind),
            )
        )
        _SHAPES[shape] = len(book.render(u))
    return _SHAPES[shape]


def names_in(u: m.Utterance) -> set[str]:
    """The names in an utterance: its speaker's, its addressee's, and that of whom it quotes."""
    addressee = u.addressee.name if isinstance(u.addressee, m.ToRobot) else None
    quoted = u.statement.speaker if isinstance(u.statement, m.Relayed) else None
    return {name for name in (u.speaker, addressee, quoted) if name is not None}


def _shape(value: object) -> object:
    """Everything of a statement that changes its number of words: numbers over twenty have two, names of tasks many."""
    match value:
        case m.Spelled(letters, ask):
            return (m.Spelled, len(letters), ask)
        case m.TaskByNumber(number):
            return number > 20 and number % 10 != 0
        case m.TaskByName(name):
            return len(spoken_words(name))
        case m.PlaceWanted(place) | m.PlaceGiven(place) | m.PlaceTaken(place, False) | m.PlaceFree(place):
            return (type(value), len(place.split()))
        case None | bool() | float() | int():
            return value
        case str():
            return len(value.split())
        case _ if is_dataclass(value):
            return (type(value), *(_shape(getattr(value, f.name)) for f in fields(value)))
        case _:
            return type(value)
