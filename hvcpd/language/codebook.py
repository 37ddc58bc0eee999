"""Every statement of a phrasebook by number: encryption hides a statement's place in the phrasebook, not its words.

The forms follow one another, and within a form its slots count as the digits of a mixed radix (Knuth, The Art of
Computer Programming, 4.1). Names and teams stand in a sentence's opening and are not counted: robots that have
learned of different peers still count alike. Robots with other tasks do not, and `digest` tells them apart.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Iterable
from dataclasses import dataclass

from hvcpd.language import messages as m
from hvcpd.language.binding import CompiledForm, bindings_of, build
from hvcpd.language.forms import OPENING
from hvcpd.language.marks import NEVER_HIDDEN
from hvcpd.language.pattern import Bindings, SlotValues, parts_of

OUTER = frozenset({"addressee", "speaker", "team", "other"})
"""Slots of the opening and of a quoted speaker; they stay plain."""
LEFT_OUT = frozenset({"also", "then", "away"})
"""Slots of a second task, and of the way to one: they would make every message longer. A team that encrypts says
neither."""
LEAST_BYTES = 2
"""65,536 statements: room for about thirty tasks, so that nearly all teams' messages are equally long."""


@dataclass(frozen=True)
class _Entry:
    """The share of the numbers, from `first` on, of one form; `choices` are its bound slots and their values."""

    compiled: CompiledForm
    first: int
    choices: tuple[tuple[str, tuple[object, ...]], ...]

    @property
    def size(self) -> int:
        return math.prod(len(values) for _, values in self.choices)

    def number_of(self, bound: Bindings) -> int | None:
        """The place of those values in this share; None if they have no place in it."""
        if bound.keys() != dict(self.choices).keys():
            return None
        number = 0
        for slot, values in self.choices:
            if bound[slot] not in values:
                return None
            number = number * len(values) + values.index(bound[slot])
        return self.first + number

    def statement_of(self, number: int) -> m.Statement | None:
        """The statement at that place."""
        bound: Bindings = {}
        number -= self.first
        for slot, values in reversed(self.choices):
            number, place = divmod(number, len(values))
            bound[slot] = values[place]
        return build(self.compiled.form, bound).statement


class Codebook:
    """Numbers from 0 to `size` - 1, each of one statement; `digest`: SHA-256 of all their meanings, 32 bytes.

    `n_bytes` hold any of the numbers.
    """

    def __init__(self, forms: Iterable[CompiledForm], slots: SlotValues) -> None:
        self._entries: list[_Entry] = []
        hashed = hashlib.sha256(b"hvcpd codebook 1")
        self.size = 0
        for compiled in filter(_has_place, forms):
            sets = {each - OUTER for each in parts_of(compiled.node).slot_sets if not each & LEFT_OUT}
            for bound in sorted(tuple(sorted(each)) for each in sets):
                entry = _Entry(compiled, self.size, tuple((slot, tuple(slots[slot])) for slot in bound))
                self._entries.append(entry)
                self.size += entry.size
                spoken = [(slot, [" ".join(words) for words in slots[slot].values()]) for slot in bound]
                constants = sorted((name, str(value)) for name, value in compiled.form.constants.items())
                hashed.update(repr((compiled.form.pattern, constants, spoken)).encode())
        self.digest = hashed.digest()
        self.n_bytes = max(LEAST_BYTES, (max(self.size - 1, 0).bit_length() + 7) // 8)

    def number_of(self, statement: m.Statement | None) -> int | None:
        """The statement's number; None if it is never encrypted, or the phrasebook cannot make it."""
        if statement is None:
            return None
        for entry in self._entries:
            bound = bindings_of(entry.compiled, m.Utterance(None, statement=statement))
            number = entry.number_of(bound) if bound is not None else None
            if number is not None:
                return number
        return None

    def statement_of(self, number: int) -> m.Statement | None:
        """The statement of a number; None if it has none."""
        return next((e.statement_of(number) for e in self._entries if e.first <= number < e.first + e.size), None)


def _has_place(compiled: CompiledForm) -> bool:
    form = compiled.form
    hideable = form.statement is not None and not issubclass(form.statement, NEVER_HIDDEN)
    in_passing = "confirmed" in compiled.slots
    return hideable and not form.relayed and not in_passing and form.pattern.startswith(OPENING)
