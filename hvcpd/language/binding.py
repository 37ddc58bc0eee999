"""Between utterances and what the slots of a form bind."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from typing import Any

from hvcpd.language import messages as m
from hvcpd.language.forms import SLOT_FIELDS, Form
from hvcpd.language.pattern import Bindings, Node, parse_pattern, parts_of
from hvcpd.language.spelling import written_name

_UTTERANCE_FIELDS = frozenset(f.name for f in fields(m.Utterance)) - {"statement", "mark"}


@dataclass(frozen=True)
class CompiledForm:
    """A form, its parsed pattern, the slots of that, those of them that must be bound, the words it cannot lack, and
    all its words."""

    form: Form
    node: Node
    slots: frozenset[str]
    needed: frozenset[str]
    words: frozenset[str]
    all_words: frozenset[str]


def compile_form(form: Form) -> CompiledForm:
    """The form with all that follows from its pattern."""
    node = parse_pattern(form.pattern)
    parts = parts_of(node)
    return CompiledForm(form, node, parts.slots, parts.needed_slots, parts.needed_words, parts.words)


def build(form: Form, bindings: Bindings) -> m.Utterance:
    """The utterance that a form makes of what its slots bind."""
    bound: dict[str, Any] = {SLOT_FIELDS[slot]: value for slot, value in bindings.items()} | dict(form.constants)
    if form.spelled:
        bound["speaker"] = written_name(bound["letters"])
    outer = {key: bound.pop(key) for key in list(bound) if key in _UTTERANCE_FIELDS}
    other, confirmed, with_it = (bound.pop(name, None) for name in ("other", "confirmed", "with"))
    statement: Any = form.statement(**bound) if form.statement is not None else None
    if form.will:
        statement = m.WillMove(statement)
    if form.relayed:
        statement = m.Relayed(other, statement)
    if confirmed is not None:
        statement = m.ConfirmedAnd(m.Confirmed(confirmed, form.confirms_complete, with_it), statement)
    return m.Utterance(speaker=outer.pop("speaker", None), statement=statement, **outer)


def bindings_of(compiled: CompiledForm, utterance: m.Utterance) -> Bindings | None:
    """The values that the slots of a form must bind to make the utterance; None if the form cannot make it."""
    form, statement = compiled.form, utterance.statement
    wanted: dict[str, object] = {}
    if form.relayed:
        if not isinstance(statement, m.Relayed):
            return None
        wanted["other"], statement = statement.speaker, statement.statement
    if form.will:
        if not isinstance(statement, m.WillMove):
            return None
        statement = statement.motion
    if "confirmed" in compiled.slots:
        if not isinstance(statement, m.ConfirmedAnd) or statement.confirmed.complete != form.confirms_complete:
            return None
        wanted["confirmed"], wanted["with"] = statement.confirmed.task, statement.confirmed.also
        statement = statement.statement
    if (type(statement) if statement is not None else None) is not form.statement:
        return None
    if form.spelled and isinstance(statement, m.Spelled):
        if utterance.speaker is None or utterance.speaker.lower() != statement.letters:
            return None
        utterance = replace(utterance, speaker=None)
    inner = {f.name: getattr(statement, f.name) for f in fields(statement)} if statement is not None else {}
    if any(inner.pop(name) != value for name, value in form.constants.items()):
        return None
    wanted |= {"speaker": utterance.speaker, "addressee": utterance.addressee, "team": utterance.team} | inner
    wanted = {k: v for k, v in wanted.items() if v is not None}
    bindings: Bindings = {}
    for slot in compiled.slots:
        value = wanted.get(SLOT_FIELDS[slot])
        if value is not None and _fits(slot, value):
            bindings[slot] = wanted.pop(SLOT_FIELDS[slot])
    return None if wanted else bindings


def _fits(slot: str, value: object) -> bool:
    if slot == "number":
        return isinstance(value, m.TaskByNumber)
    if slot == "task":
        return isinstance(value, m.TaskByName)
    return True
