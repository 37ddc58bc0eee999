"""Every statement of a phrasebook by number: what is encrypted is not words but a statement's place in the phrasebook.

The forms follow one another, and within a form its slots count as the digits of a mixed radix (Knuth, The Art of Computer
Programming, 4.1). Names and teams stand in a sentence's opening and have no part in it: robots that have learned of
different peers still count alike. Those with other tasks do not, and `digest` tells them apart.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterable
from dataclasses import dataclass

from hvcpd.language import messages as m
from hvcpd.language.binding import CompiledForm, build, unbuild
from hvcpd.language.forms import OPENING
from hvcpd.language.marks import NEVER_HIDDEN
from hvcpd.language.pattern import Bindings, SlotValues

OUTER = frozenset({"addressee", "speaker", "team", "other"})
"""Slots of the opening, and of who is quoted; they stay plain."""
OPTIONAL = frozenset({"second", "third"})
"""Slots that a statement may lack; lacking one is one more digit."""
LEAST_BYTES = 2
"""65,536 statements: room for some thirty tasks, so that nearly all teams' messages are equally long."""


@dataclass(frozen=True)
class _Entry:
    """One form's share of the numbers, from `first` on; `choices` are its slots' values, None where one may lack."""

    compiled: CompiledForm
    first: int
    choices: tuple[tuple[str, tuple[object, ...]], ...]

    @property
    def size(self) -> int:
        size = 1
        for _, values in self.choices:
            size *= len(values)
        return size


class Codebook:
    """Numbers from 0 to `size` - 1, each of one statement; `digest`: shape (32,) bytes, SHA-256 of all that they mean.

    `n_bytes` hold any of the numbers.
    """

    def __init__(self, forms: Iterable[CompiledForm], slots: SlotValues) -> None:
        self._entries: list[_Entry] = []
        hashed = hashlib.sha256(b"hvcpd codebook 1")
        first = 0
        for compiled in forms:
            if not _has_place(compiled):
                continue
            own = sorted(compiled.slots - OUTER)
            choices = tuple((slot, (*slots[slot], *([None] if slot in OPTIONAL else []))) for slot in own)
            entry = _Entry(compiled, first, choices)
            self._entries.append(entry)
            first += entry.size
            spoken = [(slot, [" ".join(words) for words in slots[slot].values()]) for slot in own]
            hashed.update(repr((compiled.form.pattern, sorted(compiled.form.constants.items()), spoken)).encode())
        self.size = first
        self.digest = hashed.digest()
        self.n_bytes = max(LEAST_BYTES, (max(first - 1, 0).bit_length() + 7) // 8)

    def number_of(self, statement: m.Statement | None) -> int | None:
        """The statement's number; None if it is never encrypted, or the phrasebook cannot make it."""
        if statement is None or isinstance(statement, NEVER_HIDDEN):
            return None
        for entry in self._entries:
            bound = unbuild(entry.compiled, m.Utterance("", statement=statement))
            number = _number_in(entry, bound) if bound is not None else None
            if number is not None:
                return entry.first + number
        return None

    def statement_of(self, number: int) -> m.Statement | None:
        """The statement of a number; None if it is nobody's."""
        for entry in self._entries:
            if entry.first <= number < entry.first + entry.size:
                statement = build(entry.compiled.form, _bindings_of(entry, number - entry.first)).statement
                return statement if self.number_of(statement) == number else None
        return None


def _has_place(compiled: CompiledForm) -> bool:
    form = compiled.form
    hideable = form.statement is not None and not issubclass(form.statement, NEVER_HIDDEN)
    return hideable and not form.relayed and form.pattern.startswith(OPENING)


def _number_in(entry: _Entry, bound: Bindings) -> int | None:
    number = 0
    for slot, values in entry.choices:
        if bound.get(slot) not in values:
            return None
        number = number * len(values) + values.index(bound.get(slot))
    missing = {slot for slot in OPTIONAL if dict(entry.choices).get(slot) and bound.get(slot) is None}
    return None if missing == {"second"} else number


def _bindings_of(entry: _Entry, number: int) -> Bindings:
    bound: Bindings = {"speaker": ""}
    for slot, values in reversed(entry.choices):
        number, place = divmod(number, len(values))
        if values[place] is not None:
            bound[slot] = values[place]
    return bound
