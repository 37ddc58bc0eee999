"""Where each setting in force comes from."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hvcpd.config.document import Document
from hvcpd.config.environment import leaf_keys


@dataclass(frozen=True)
class Sourced:
    """One setting as it is in force, and its source: an option, a variable, a file with its line, or `default`."""

    key: str
    value: object
    """As JSON has it."""
    source: str


def sources_of(settings: Any, document: Document) -> Iterator[Sourced]:
    """Every setting with its source; `settings` is what was made of the document."""
    for key, _ in leaf_keys(type(settings)):
        value: Any = settings
        for part in key:
            value = getattr(value, str(part))
        source = str(document.place(key)) if document.has(key) else "default"
        yield Sourced(".".join(map(str, key)), plain(value), source)


def plain(value: Any) -> Any:
    """A setting's value as JSON and YAML have it."""
    match value:
        case Path():
            return str(value)
        case tuple():
            return [plain(each) for each in value]
        case Mapping():
            return {key: plain(each) for key, each in value.items()}
        case _ if dataclasses.is_dataclass(value) and not isinstance(value, type):
            return {key: plain(each) for key, each in vars(value).items()}
        case _:
            return value
