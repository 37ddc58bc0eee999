"""Refuses words of a team that could be taken for other words of its phrasebook."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from itertools import chain

from hvcpd.errors import VocabularyError
from hvcpd.language import messages as m
from hvcpd.language.automaton import build_graph
from hvcpd.language.binding import CompiledForm, build, compile_form
from hvcpd.language.forms import FORMS
from hvcpd.language.graph import shortest_with
from hvcpd.language.pattern import SlotValues, Words
from hvcpd.language.words import NUMBER_MAX, SAFETY_WORDS, number_words

COMPILED = tuple(map(compile_form, FORMS))

RESERVED_WORDS = frozenset({"all", "team", m.FRIEND}).union(*(compiled.all_words for compiled in COMPILED))
"""The words of the forms themselves; no robot may be called so."""

NUMBER_SLOTS = ("number", "also", "next", "then", "confirmed", "with", "first", "second", "third")
"""Slots whose values are numbers of tasks."""

_ALL_NUMBERS: dict[object, Words] = {m.TaskByNumber(n): number_words(n) for n in range(1, NUMBER_MAX + 1)}
"""A task may be added later, or be known to others alone."""

_STATEMENTS = ("task", "remark")
"""Slots whose words may be all of a statement, and so stand where another statement could."""
_TEXTS = (*_STATEMENTS, "place", "reason")
"""Slots of a statement whose words a team chooses. They are tested for a second reading in all forms, and first: a name
before one that reads twice is not to blame."""
_NAMES = ("team", "addressee", "speaker")
"""Slots of the opening."""
_OPENINGS = 3
"""Number of forms in which names are tested: all forms share the opening."""

Readings = Callable[[Words], Iterator[m.Utterance]]
"""Every meaning of spoken words."""
Render = Callable[[m.Utterance], Words]
"""The words of an utterance."""

Fault = tuple[str, object, VocabularyError]
"""A slot, its value that is at fault, and what is wrong with it."""


def refuse_reserved(names: Sequence[str]) -> None:
    """Raises VocabularyError for robots' names that are words of the forms."""
    text = "'{}' is a word of the phrasebook and cannot be a robot's name: choose another"
    _refuse([VocabularyError(text.format(name), "names") for name in names if name.lower() in RESERVED_WORDS])


def refuse_clashes(forms: Sequence[CompiledForm], slots: SlotValues, render: Render, readings: Readings) -> None:
    """Raises VocabularyError for words of a team that have no sound, are spoken as others are, read as another sentence
    of the forms, or are a part of one; for those of its names only if none of its tasks is to blame."""
    texts = [_ambiguous([c for c in forms if slot in c.slots], slots, slot, render, readings) for slot in _TEXTS]
    openings = [(slot, [c for c in forms if slot in c.slots][:_OPENINGS]) for slot in _NAMES]
    names = [_ambiguous(some, slots, slot, render, readings) for slot, some in openings]
    for faults in ((_same(slots), _commands(slots, readings), *texts, _parts(forms, slots)), names):
        first: dict[tuple[str, object], VocabularyError] = {}
        for slot, value, error in chain.from_iterable(faults):
            first.setdefault((slot, value), error)
        _refuse(list(first.values()))


def _refuse(errors: Sequence[VocabularyError]) -> None:
    if errors:
        first, *others = errors
        raise VocabularyError(str(first), first.key, *others, written=first.written)


def _same(slots: SlotValues) -> Iterator[Fault]:
    for slot, values in slots.items():
        spoken: dict[Words, object] = {}
        for value, words in values.items():
            if not words:
                yield _fault(slot, value, "has no word that can be spoken")
            elif words in spoken:
                yield _fault(slot, value, f"and {_describe(slot, spoken[words])} are spoken the same way: rename one")
            spoken.setdefault(words, value)


def _remedy(slot: str) -> str:
    return "reword it" if slot == "remark" else "rename it"


def _commands(slots: SlotValues, readings: Readings) -> Iterator[Fault]:
    for slot in ("team", *_TEXTS):  # inside other sentences no command may be heard
        for value, words in slots[slot].items():
            if SAFETY_WORDS.intersection(words) or any(True for _ in readings(words)):
                yield _fault(slot, value, f"can be mistaken for a command: {_remedy(slot)}")
            elif m.FRIEND in words and slot not in ("remark", "reason"):  # robots alone say these
                yield _fault(slot, value, f"has the word '{m.FRIEND}', by which any name is heard: {_remedy(slot)}")


def _ambiguous(
    forms: Sequence[CompiledForm], slots: SlotValues, slot: str, render: Render, readings: Readings
) -> Iterator[Fault]:
    for compiled in forms:
        for value in slots[slot]:
            words = render(_shortest(compiled, slots, slot, value))
            if len(set(readings(words))) != 1:
                yield _mistaken(slot, value, words)


def _shortest(compiled: CompiledForm, slots: SlotValues, slot: str, value: object) -> m.Utterance:
    """The form's shortest sentence with that value: words before it that are optional could hide its second reading."""
    return build(compiled.form, {s: next(iter(slots[s])) for s in compiled.needed if slots.get(s)} | {slot: value})


def _parts(forms: Sequence[CompiledForm], slots: SlotValues) -> Iterator[Fault]:
    """ "Task four", which begins "task four complete", and "i am rob", which ends "hi all i am rob"."""
    others = {slot: values for slot, values in slots.items() if slot not in _STATEMENTS}
    others |= dict.fromkeys(NUMBER_SLOTS, _ALL_NUMBERS)
    known = frozenset[str]().union(*(c.all_words for c in forms), *(w for v in others.values() for w in v.values()))
    doubtful = [
        (s, v, words) for s in _STATEMENTS for v, words in slots[s].items() if words and known.issuperset(words)
    ]
    if not doubtful:  # this is the usual case, and to build a network takes time
        return
    graph = build_graph([compiled.node for compiled in forms], others)
    for slot, value, words in doubtful:
        if (sentence := shortest_with(graph, words)) is not None:
            yield _mistaken(slot, value, sentence)


def _mistaken(slot: str, value: object, sentence: Words) -> Fault:
    example = f"as in '{' '.join(sentence)}'"
    return _fault(slot, value, f"can be mistaken for another sentence of the phrasebook, {example}: {_remedy(slot)}")


def _fault(slot: str, value: object, what: str) -> Fault:
    written = value.name if isinstance(value, m.TaskByName) else str(value)
    return slot, value, VocabularyError(f"{_describe(slot, value)} {what}", _key(slot, value), written=written)


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
