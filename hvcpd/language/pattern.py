"""Patterns of the forms: parsed into a small tree, matched against words, rendered from bindings."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache, cached_property
from itertools import takewhile
from typing import NamedTuple

from hvcpd.language.spelling import letters_of

Words = tuple[str, ...]
Bindings = dict[str, object]

COMMA = ","
"""The token of a pause in rendered words."""
LETTERS_SLOT = "letters"
"""`<letters>` in a pattern is any name, letter by letter: the slot whose values nobody can list."""


@dataclass(frozen=True, slots=True)
class Word:
    text: str


@dataclass(frozen=True, slots=True)
class Pause:
    pass


@dataclass(frozen=True, slots=True)
class Slot:
    name: str


@dataclass(frozen=True, slots=True)
class Series:
    parts: tuple[Node, ...]


@dataclass(frozen=True)
class Choice:
    """Alternatives, the preferred first; an optional part is a choice between nothing and the part."""

    options: tuple[Node, ...]

    @cached_property
    def slots(self) -> tuple[frozenset[str], ...]:
        """The names of all slots below each option."""
        return tuple(parts_of(option).slots for option in self.options)


Node = Word | Pause | Slot | Series | Choice

SlotValues = Mapping[str, Mapping[object, Words]]
"""For each slot, its possible values and the words of each."""

_TOKEN = re.compile(r"<[a-z]+>|[a-z]+|[\[\](),|]")


def parse_pattern(text: str) -> Node:
    """The tree of a pattern. Raises ValueError when it is malformed: patterns are ours, so that is a defect."""
    tokens = _TOKEN.findall(text)
    if "".join(tokens) != text.replace(" ", ""):
        raise ValueError(f"a pattern has a character that means nothing: {text!r}")
    node, rest = _parse_choice(tokens, 0)
    if rest != len(tokens):
        raise ValueError(f"a pattern does not end where it should: {text!r}")
    return node


def _parse_choice(tokens: Sequence[str], i: int) -> tuple[Node, int]:
    options = []
    while True:
        option, i = _parse_sequence(tokens, i)
        options.append(option)
        if i >= len(tokens) or tokens[i] != "|":
            return (options[0] if len(options) == 1 else Choice(tuple(options))), i
        i += 1


def _parse_sequence(tokens: Sequence[str], i: int) -> tuple[Node, int]:
    parts: list[Node] = []
    while i < len(tokens) and tokens[i] not in "])|":
        token = tokens[i]
        i += 1
        if token in "([":
            inner, i = _parse_choice(tokens, i)
            if i >= len(tokens) or tokens[i] != {"(": ")", "[": "]"}[token]:
                raise ValueError(f"a bracket is not closed: {' '.join(tokens)!r}")
            i += 1
            parts.append(inner if token == "(" else Choice((Series(()), inner)))
        elif token == COMMA:
            parts.append(Pause())
        elif token.startswith("<"):
            parts.append(Slot(token[1:-1]))
        else:
            parts.append(Word(token))
    return Series(tuple(parts)), i


class Parts(NamedTuple):
    """What is below a node: the slots that are bound together, one set for each combination of optional parts that
    differs in them; and literal words, all of them and those that every sentence of it has."""

    slot_sets: frozenset[frozenset[str]] = frozenset({frozenset()})
    words: frozenset[str] = frozenset()
    needed_words: frozenset[str] = frozenset()

    @property
    def slots(self) -> frozenset[str]:
        """All slots."""
        return frozenset().union(*self.slot_sets)

    @property
    def needed_slots(self) -> frozenset[str]:
        """The slots that every sentence has."""
        return frozenset.intersection(*self.slot_sets)


@cache  # the forms have the same openings and endings
def parts_of(node: Node) -> Parts:
    """What is below a node."""
    match node:
        case Word(text):
            word = frozenset({text})
            return Parts(words=word, needed_words=word)
        case Slot(name):
            return Parts(frozenset({frozenset({name})}))
        case Series(children):
            sets, words, needed_words = Parts()
            for part in map(parts_of, children):
                sets = frozenset(one | other for one in sets for other in part.slot_sets)
                words, needed_words = words | part.words, needed_words | part.needed_words
            return Parts(sets, words, needed_words)
        case Choice(options):
            parts = list(map(parts_of, options))
            return Parts(
                frozenset().union(*(part.slot_sets for part in parts)),
                frozenset().union(*(part.words for part in parts)),
                frozenset.intersection(*(part.needed_words for part in parts)),
            )
        case _:
            return Parts()


def render(node: Node, values: Mapping[str, Words]) -> list[str] | None:
    """The words of a pattern with commas, for the words bound to its slots; None if a needed slot is unbound.

    Of a choice, the option that uses the most bound slots is rendered, the earlier one of equals.
    """
    match node:
        case Word(text):
            return [text]
        case Pause():
            return [COMMA]
        case Slot(name):
            return list(values[name]) if name in values else None
        case Series(parts):
            words: list[str] = []
            for part in parts:
                rendered = render(part, values)
                if rendered is None:
                    return None
                words += rendered
            return words
        case Choice(options):
            made = ((slots, render(o, values)) for slots, o in zip(node.slots, options, strict=True))
            possible = [(len(slots & values.keys()), words) for slots, words in made if words is not None]
            return max(possible, key=lambda pair: pair[0])[1] if possible else None


def as_rendered(node: Node) -> Node:
    """The pattern without what `render` never makes: of a choice, the first option with each set of slots remains."""
    match node:
        case Series(parts):
            return Series(tuple(map(as_rendered, parts)))
        case Choice(options):
            first: dict[frozenset[str], Node] = {}
            for slots, option in zip(node.slots, options, strict=True):
                first.setdefault(slots, option)
            return Choice(tuple(map(as_rendered, first.values())))
        case _:
            return node


def match(node: Node, words: Words, i: int, slots: SlotValues) -> list[tuple[int, Bindings]]:
    """Every way to match `words` from index `i` on: the index after the match, and what the slots bind."""
    match node:
        case Word(text):
            return [(i + 1, {})] if i < len(words) and words[i] == text else []
        case Pause():
            return [(i, {})]
        case Slot(name) if name == LETTERS_SLOT:
            spelled = ((end, letters_of(words[i:end])) for end in range(i + 1, len(words) + 1))
            return [(end, {name: letters}) for end, letters in takewhile(lambda each: each[1] is not None, spelled)]
        case Slot(name):
            values = slots.get(name, {}).items()
            return [(i + len(said), {name: value}) for value, said in values if words[i : i + len(said)] == said]
        case Series(parts):
            found: list[tuple[int, Bindings]] = [(i, {})]
            for part in parts:
                found = [
                    (end, bound | more) for after, bound in found for end, more in match(part, words, after, slots)
                ]
            return found
        case Choice(options):
            return [each for option in options for each in match(option, words, i, slots)]
