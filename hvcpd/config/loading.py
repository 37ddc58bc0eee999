"""From a file to frozen dataclasses, with every fault told at its line.

What concerns several fields is checked by a function that is given a `Parts` and can name the place of each.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, TypeVar, cast

from hvcpd.config.document import Document, parse, read_bytes
from hvcpd.config.structuring import Converter, FaultError, Hook, KeyPath
from hvcpd.errors import ConfigError

T = TypeVar("T")

MAX_FAULTS_TOLD = 100
"""Lines of one ConfigError; nobody reads more at a time."""


class Parts:
    """A document's values for a check across fields: those parts that are well-formed, and a way to fault any."""

    def __init__(self, document: Document, converter: Converter) -> None:
        self._document = document
        self._converter = converter

    def get(self, path: KeyPath, type_: type[T]) -> T | None:
        """The value at `path`, or None if it is absent or has been faulted."""
        value = self._document.value
        for key in path:
            try:
                value = value[key]
            except (KeyError, IndexError, TypeError):
                return None
        if self._document.is_faulty(path):
            return None
        try:
            return cast(T, self._converter.structure(value, type_))
        except FaultError:
            return None

    def has(self, path: KeyPath) -> bool:
        """Whether something is written at `path`, right or wrong."""
        return self._document.has(path)

    def length(self, path: KeyPath) -> int:
        """How many elements the list at `path` has; 0 if there is no list."""
        value = self.get(path, cast(type[Any], Any))
        return len(value) if isinstance(value, list) else 0

    def line(self, path: KeyPath) -> int:
        """The line (from 1) in which the key or value at `path` stands."""
        return self._document.place(path).line

    def where(self, path: KeyPath, beside: KeyPath) -> str:
        """The line in which the key or value at `path` stands, with its file if `beside` stands in another one."""
        place, other = self._document.place(path), self._document.place(beside)
        if not place.line:
            return str(place)
        return f"line {place.line}" if place.source == other.source else f"line {place.line} of {place.source}"

    def fault(self, path: KeyPath, text: str) -> None:
        """Note what is wrong at `path` and what to do."""
        self._document.fault(path, text)


def load(
    path: Path,
    type_: type[T],
    check: Callable[[Parts], None] | None = None,
    hooks: Mapping[Any, Hook] | None = None,
) -> T:
    """Read the YAML file `path` as a `type_`, a dataclass.

    `check` looks at what concerns several fields; `hooks` read types that are not plain dataclasses. Raises
    ConfigError with every fault of the file, a line each: `FILE:LINE: what is wrong; what to do`.
    """
    return structure(parse(read_bytes(path), str(path)), type_, check, hooks)


def structure(
    document: Document,
    type_: type[T],
    check: Callable[[Parts], None] | None = None,
    hooks: Mapping[Any, Hook] | None = None,
) -> T:
    """As `load`, from a document that has been read already."""
    converter = Converter(hooks)
    if document.value is None and not document.is_faulty(()):
        document.value = {}
    result: T | None = None
    try:
        result = converter.structure(document.value, type_)
    except FaultError as error:
        for fault in error.faults:
            if not document.is_faulty(fault.path):
                document.fault(fault.path, str(fault))
    if check is not None:
        check(Parts(document, converter))
    faults = list(document.faults())
    if faults or result is None:
        more = len(faults) - MAX_FAULTS_TOLD
        told = faults[:MAX_FAULTS_TOLD] + ([f"{document.source}: and {more} more"] if more > 0 else [])
        raise ConfigError("\n".join(told))
    return result
