"""Refuses words of a team that could be taken for other words of its phrasebook."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

from hvcpd.errors import VocabularyError
from hvcpd.language import messages as m
from hvcpd.language.automaton import build_graph
from hvcpd.language.binding import CompiledForm, build, compile_form
from hvcpd.language.forms import FORMS
from hvcpd.language.graph import shortest_with
from hvcpd.language.pattern import SlotValues, Words
from hvcpd.language.words import NUMBER_MAX, number_words

COMPILED = tuple(map(compile_form, FORMS))

SAFETY_WORDS = frozenset({"stop", "resume"})
"""Spoken alone they halt and release robots, so that nothing of a team's own may have one in it."""
RESERVED_WORDS = frozenset({"all", "team"}).union(*(compiled.all_words for compiled in COMPILED))
"""The words of the forms themselves; no robot may be called so."""

NUMBER_SLOTS = ("number", "also", "next", "then", "confirmed", "with", "first", "second", "third")
"""Slots whose values are numbers of tasks."""

_ALL_NUMBERS: dict[object, Words] = {m.TaskByNumber(n): number_words(n) for n in range(1, NUMBER_MAX + 1)}
"""A task may be added later, or be known to others alone."""

_FREE = {"task": 99, "place": 99, "remark": 99, "reason": 99, "team": 3, "addressee": 3, "speaker": 3}
"""Slots whose words a team chooses, and in how many forms each value is tested for a second reading. Task names and
remarks are whole sentences; they are tested in all forms, and first, because a name before one that reads twice is not
to blame. Names and teams stand in the opening, which all forms share."""
_TEXTS = ("team", "place", "task", "remark", "reason")
"""Of these, slots whose words stand inside a sentence: no command may be heard there."""
_STATEMENTS = ("task", "remark")
"""Of these, slots that may be all of a statement, and so stand where another statement could."""


Readings = Callable[[Words], Iterator[m.Utterance]]
"""Every meaning of spoken words."""
Render = Callable[[m.Utterance], Words]
"""The words of an utterance."""


def refuse_reserved(names: Sequence[str]) -> None:
    """Raises VocabularyError for a robot's name that is a word of the forms."""
    for name in names:
        if name.lower() in RESERVED_WORDS:
            text = f"'{name}' is a word of the phrasebook and cannot be a robot's name: choose another"
            raise VocabularyError(text, "names")


def refuse_clashes(forms: Sequence[CompiledForm], slots: SlotValues, render: Render, readings: Readings) -> None:
    """Raises VocabularyError for the first words of a team that have no sound, that are spoken as others are, that read
    as another sentence of the forms, or that are a part of one."""
    _refuse_same(slots)
    _refuse_commands(slots, readings)
    for slot, tries in _FREE.items():
        for compiled in [c for c in forms if slot in c.slots][:tries]:
            for value in slots[slot]:
                words = render(_shortest(compiled, slots, slot, value))
                if len(set(readings(words))) != 1:
                    raise _mistaken(slot, value, words)
    _refuse_parts(forms, slots)


def _refuse_same(slots: SlotValues) -> None:
    for slot, values in slots.items():
        spoken: dict[Words, object] = {}
        for value, words in values.items():
            if not words:
                raise VocabularyError(f"{_describe(slot, value)} has no word that can be spoken", _key(slot, value))
            if words in spoken:
                both = f"{_describe(slot, value)} and {_describe(slot, spoken[words])}"
                raise VocabularyError(f"{both} are spoken the same way: rename one", _key(slot, value))
            spoken[words] = value


def _refuse_commands(slots: SlotValues, readings: Readings) -> None:
    for slot in _TEXTS:
        for value, words in slots[slot].items():
            if SAFETY_WORDS.intersection(words) or any(True for _ in readings(words)):
                text = f"{_describe(slot, value)} can be mistaken for a command: rename it"
                raise VocabularyError(text, _key(slot, value))


def _shortest(compiled: CompiledForm, slots: SlotValues, slot: str, value: object) -> m.Utterance:
    """The form's shortest sentence with that value: words before it that are optional could hide its second reading."""
    return build(compiled.form, {s: next(iter(slots[s])) for s in compiled.needed if slots.get(s)} | {slot: value})


def _refuse_parts(forms: Sequence[CompiledForm], slots: SlotValues) -> None:
    """Refuse "task four", which begins "task four complete", and "i am rob", which ends "hi all i am rob"."""
    others = {slot: values for slot, values in slots.items() if slot not in _STATEMENTS}
    others |= dict.fromkeys(NUMBER_SLOTS, _ALL_NUMBERS)
    known = frozenset[str]().union(*(c.all_words for c in forms), *(w for v in others.values() for w in v.values()))
    doubtful = [(s, v, words) for s in _STATEMENTS for v, words in slots[s].items() if known.issuperset(words)]
    if not doubtful:  # this is the usual case, and to build a network takes time
        return
    graph = build_graph([compiled.node for compiled in forms], others)
    for slot, value, words in doubtful:
        if (sentence := shortest_with(graph, words)) is not None:
            raise _mistaken(slot, value, sentence)


def _mistaken(slot: str, value: object, sentence: Words) -> VocabularyError:
    example = f"as in '{' '.join(sentence)}'"
    text = f"{_describe(slot, value)} can be mistaken for another sentence of the phrasebook, {example}: rename it"
    return VocabularyError(text, _key(slot, value))


def _key(slot: str, value: object) -> str:
    """The setting that an entry of the vocabulary comes from."""
    if slot == "team" or isinstance(value, m.ToTeam):
        return "teams"
    return "names" if slot in ("addressee", "speaker", "other") else "tasks"


def _describe(slot: str, value: object) -> str:
    match value:
        case m.TaskByName(name):
            return f"the task '{name}'"
        case m.TaskByNumber(number):
            return f"task number {number}"
        case m.ToRobot(name):
            return f"the name '{name}'"
        case m.ToTeam(name):
            return f"the team '{name}'"
        case _:
            return f"the {slot} '{value}'"
