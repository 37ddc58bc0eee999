"""What was probably meant by a key that a group does not have."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from typing import Any, get_type_hints

from hvcpd.errors import did_you_mean

_SYNONYMS = "synonyms"


def synonyms(*words: str) -> dict[str, tuple[str, ...]]:
    """Field metadata: words that are no valid keys, but for which the message on an unknown key suggests this field."""
    return {_SYNONYMS: words}


def synonym_of(word: str, cls: Any) -> str | None:
    """The field of a dataclass that has this word among its `synonyms`."""
    fields = dataclasses.fields(cls)
    return next((field.name for field in fields if word.casefold() in field.metadata.get(_SYNONYMS, ())), None)


def instead_of_key(key: str, cls: Any) -> str:
    """The end of a message on a key that the dataclass `cls` does not have."""
    known = [field.name for field in dataclasses.fields(cls)]
    name, colon, value = key.partition(":")
    if colon and name in known:
        return f"put a space after the colon: `{name}: {value[:40]}`"
    group = next((group for group, inner in _keys_of_groups(cls) if key in (inner, f"{group}.{inner}")), None)
    if group is not None:
        return f"it belongs into the group `{group}`: `{group}: {{{key.removeprefix(f'{group}.')}: …}}`"
    return did_you_mean(synonym_of(key, cls) or key[:40], known)


def _keys_of_groups(cls: Any) -> Iterator[tuple[str, str]]:
    """Each group of keys in a dataclass with each of its keys."""
    for group, type_ in get_type_hints(cls).items():
        if dataclasses.is_dataclass(type_):
            yield from ((group, field.name) for field in dataclasses.fields(type_))
