"""The sources of settings besides their file, and the source of each setting in force.

Environment variables: `HVCPD_NAME=Rob`, `HVCPD_AUDIO__INPUT_DEVICE=mic`, `HVCPD_UNABLE='[2, 3]'`. The variable of a key
is its name in capitals after HVCPD_, with two underscores for each step into a group. Text is taken as it stands;
numbers, lists and groups are written as in the file. `null` is nothing, where a key may be nothing.
"""

from __future__ import annotations

import dataclasses
import types
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, Union, get_args, get_origin, get_type_hints

from cattrs import Converter

from hvcpd.config.document import Document, KeyPath, Place, parse
from hvcpd.config.unknown_keys import synonym_of
from hvcpd.config.whereabouts import FILE_VARIABLE
from hvcpd.errors import ConfigError, did_you_mean

PREFIX = "HVCPD_"


def variable_of(key: KeyPath) -> str:
    """The variable that sets the key."""
    return PREFIX + "__".join(str(part).upper() for part in key)


def leaf_keys(type_: Any, path: KeyPath = ()) -> Iterator[tuple[KeyPath, Any]]:
    """Every key of a dataclass of settings that is no group of its own, with its type, in the order of the fields."""
    hints = get_type_hints(type_)
    for field in dataclasses.fields(type_):
        hint, key = hints[field.name], (*path, field.name)
        if dataclasses.is_dataclass(hint):
            yield from leaf_keys(hint, key)
        else:
            yield key, hint


def overlay_environment(document: Document, type_: Any, environment: Mapping[str, str]) -> None:
    """Put the variables' values over the document's; every variable that cannot be used is noted as a fault."""
    keys = {variable_of(key): (key, hint) for key, hint in leaf_keys(type_)}
    for variable in sorted(environment):
        if not variable.startswith(PREFIX) or variable == FILE_VARIABLE:
            continue
        if variable not in keys:
            synonym = synonym_of(variable.removeprefix(PREFIX), type_)
            meant = variable_of((synonym,)) if synonym else variable
            hint = did_you_mean(meant, [FILE_VARIABLE, *keys]) if len(variable) <= 80 else "delete it"
            text = f"no setting has this variable; {hint.removeprefix('known are: ')}"
            document.fault((), text, Place(variable[:80]))
            continue
        key, hint = keys[variable]
        _overlay(document, key, hint, variable, environment[variable])


def _overlay(document: Document, key: KeyPath, hint: Any, variable: str, text: str) -> None:
    choices = _without_none(hint)
    if text == "null" and choices != (hint,):
        document.overlay(key, None, variable)
        return
    if all(_is_text(choice) for choice in choices):
        document.overlay(key, text, variable)
        return
    try:
        value = parse(text.encode("utf-8", "surrogateescape"), variable)
    except ConfigError as error:
        document.overlay(key, None, variable)
        document.fault(key, str(error).split(": ", 1)[1])
        return
    document.overlay(key, value.value, variable)
    for fault in value.faults():
        document.fault(key, fault.split(": ", 1)[1])


def _without_none(hint: Any) -> tuple[Any, ...]:
    if get_origin(hint) in (Union, types.UnionType):
        return tuple(part for part in get_args(hint) if part is not types.NoneType)
    return (hint,)


def _is_text(hint: Any) -> bool:
    if get_origin(hint) is Literal:
        return all(isinstance(choice, str) for choice in get_args(hint))
    return hint in (str, Path)


_PLAIN = Converter(unstruct_collection_overrides={tuple: list})
"""Turns settings into the types of JSON and YAML."""
_PLAIN.register_unstructure_hook(Path, str)


@dataclass(frozen=True)
class Sourced:
    """One setting as it is in force, and its source: an option, a variable, a file with its line, or `default`."""

    key: str
    value: object
    """As JSON has it."""
    source: str


def sources_of(settings: Any, document: Document) -> Iterator[Sourced]:
    """Every setting with its source; `settings`: the values made from the document."""
    for key, _ in leaf_keys(type(settings)):
        value: Any = settings
        for part in key:
            value = getattr(value, str(part))
        source = str(document.place(key)) if document.has(key) else "default"
        yield Sourced(".".join(map(str, key)), _PLAIN.unstructure(value), source)
