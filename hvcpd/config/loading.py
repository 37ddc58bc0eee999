"""From a document's values to frozen dataclasses, strictly, with every fault told at its line.

Nothing is converted that a person may not have meant: "5" is no number, 5.7 no whole number, yes no 1. A field may
carry a check in its metadata (`between`, `checked`); what concerns several fields is checked by a function that is
given a `Parts` and can name the place of each.
"""

from __future__ import annotations

import dataclasses
import math
from collections import abc
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import lru_cache
from itertools import repeat
from pathlib import Path
from types import NoneType, UnionType
from typing import Any, Literal, TypeVar, Union, cast, get_args, get_origin, get_type_hints

from hvcpd.config.document import Document, KeyPath, parse, read_bytes
from hvcpd.errors import ConfigError, did_you_mean

T = TypeVar("T")

Check = Callable[[Any], str | None]
"""Says what is wrong with a value and what to do, or None."""

Hook = Callable[[Any, "Converter"], Any]
"""Turns a plain value into one of our types; raises FaultError."""

MAX_FAULTS_TOLD = 100
"""Lines of one ConfigError; nobody reads more at a time."""

_CHECK = "check"

_Part = tuple[str | int, Any, Any, Check | None]
"""Of a value: the key, what stands there, its type, and a check of what becomes of it."""


class FaultError(ValueError):
    """What is wrong with a value and what to do; `path` leads from that value to the part that is meant.

    The text is told after the key that it is about, unless it names that itself (`names_key`).
    """

    def __init__(self, text: str, *path: str | int, names_key: bool = False) -> None:
        super().__init__(text)
        self.path: KeyPath = path
        self.names_key = names_key

    @property
    def faults(self) -> Sequence[FaultError]:
        """This one; several of a `FaultsError`."""
        return (self,)

    @property
    def told(self) -> str:
        """The text with its key."""
        key = next((key for key in reversed(self.path) if isinstance(key, str)), None)
        return str(self) if self.names_key or key is None else f"{key}: {self}"

    def within(self, key: str | int) -> FaultError:
        """The same, told of the value that has this one at `key`."""
        return FaultError(str(self), key, *self.path, names_key=self.names_key)


class FaultsError(FaultError):
    """All that is wrong with the parts of a value."""

    def __init__(self, faults: Sequence[FaultError]) -> None:
        super().__init__(str(faults[0]), *faults[0].path)
        self._faults = faults

    @property
    def faults(self) -> Sequence[FaultError]:
        return self._faults

    def within(self, key: str | int) -> FaultError:
        return FaultsError([fault.within(key) for fault in self._faults])


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
            found: T = self._converter.structure(value, type_)
            return found
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
    converter = Converter(hooks or {})
    if document.value is None and not document.is_faulty(()):
        document.value = {}
    result: T | None = None
    try:
        result = converter.structure(document.value, type_)
    except FaultError as error:
        for fault in error.faults:
            if not document.is_faulty(fault.path):
                document.fault(fault.path, fault.told)
    if check is not None:
        check(Parts(document, converter))
    faults = list(document.faults())
    if faults or result is None:
        more = len(faults) - MAX_FAULTS_TOLD
        told = faults[:MAX_FAULTS_TOLD] + ([f"{document.source}: and {more} more"] if more > 0 else [])
        raise ConfigError("\n".join(told))
    return result


def between(least: float, most: float) -> dict[str, Check]:
    """Field metadata: the number lies from `least` to `most`, both included."""
    return {_CHECK: number_between(least, most)}


def number_between(least: float, most: float) -> Check:
    """The check alone."""

    def check(value: float | None) -> str | None:
        if value is None or least <= value <= most:
            return None
        return f"{describe(value)} is out of range; give a number from {least} to {most}"

    return check


def checked(check: Check) -> dict[str, Check]:
    """Field metadata: `check` says what is wrong with the value and what to do."""
    return {_CHECK: check}


def describe(value: object) -> str:
    """A value in a person's words."""
    match value:
        case None:
            return "nothing"
        case bool():
            return f"yes/no ({str(value).lower()})"
        case int() if abs(value) >= 10**18:
            return "a huge number"
        case int() | float():
            return f"the number {value}"
        case str():
            return f"the text {value[:40]!r}"
        case list():
            return "a list"
        case dict():
            return "a group of keys"
        case _:
            return f"a {type(value).__name__}"


@lru_cache
def field_types(cls: Any) -> Mapping[str, Any]:
    """The type of each field of a dataclass; to work them out takes longer than to read a value."""
    return get_type_hints(cls)


class Converter:
    """Turns plain values into our types: dataclasses, tuples, mappings, choices, and what `hooks` read.

    Keys that a dataclass does not have are faults, unless `extra_keys`.
    """

    def __init__(self, hooks: Mapping[Any, Hook], extra_keys: bool = False) -> None:
        self._hooks: Mapping[Any, Hook] = {**_PLAIN, **hooks}
        self._extra_keys = extra_keys

    def structure(self, value: Any, type_: Any) -> Any:
        """The value as that type. Raises FaultError with all that is wrong, TypeError for a type without a rule."""
        hook = self._hooks.get(type_)
        if hook is not None:
            return hook(value, self)
        if dataclasses.is_dataclass(type_):
            return self._dataclass(value, type_)
        origin, inner = get_origin(type_), get_args(type_)
        if origin in (Union, UnionType) and len(inner) == 2 and NoneType in inner:
            return None if value is None else self.structure(value, inner[inner[0] is NoneType])
        if origin is tuple:
            return self._tuple(value, inner)
        if origin in (dict, abc.Mapping):
            if not isinstance(value, dict):
                raise FaultError(f"expected a group of keys, found {describe(value)}; write `name: ...`")
            return self._each([(key, each, inner[1], None) for key, each in value.items()])
        if origin is Literal:
            return _literal(value, inner)
        raise TypeError(f"no rule reads a {type_}")

    def _dataclass(self, value: Any, cls: Any) -> Any:
        fields = [field for field in dataclasses.fields(cls) if field.init]
        known = [field.name for field in fields]
        if not isinstance(value, dict):
            text = f"expected a group of keys ({', '.join(known)}), found {describe(value)}; write `key: value`"
            raise FaultError(text)
        types = field_types(cls)
        parts, faults = [], []
        for field in fields:
            if field.name in value:
                parts.append((field.name, value[field.name], types[field.name], field.metadata.get(_CHECK)))
            elif field.default is field.default_factory is dataclasses.MISSING:
                faults.append(FaultError(f"the key {field.name!r} is missing; add it", field.name, names_key=True))
        for key in () if self._extra_keys else value.keys() - set(known):
            text = f"unknown key {key[:40]!r}; {did_you_mean(key[:40], known)}"
            faults.append(FaultError(text, key, names_key=True))
        return cls(**self._each(parts, faults))

    def _tuple(self, value: Any, inner: tuple[Any, ...]) -> tuple[Any, ...]:
        if not isinstance(value, list):
            raise FaultError(f"expected a list, found {describe(value)}; write it as [a, b]")
        types = repeat(inner[0], len(value)) if inner[1:] == (...,) else inner
        try:
            parts = [(index, each, type_, None) for index, (each, type_) in enumerate(zip(value, types, strict=True))]
        except ValueError:
            raise FaultError(f"expected a list of {len(inner)}, found {len(value)}; write as many") from None
        return tuple(self._each(parts).values())

    def _each(self, parts: Iterable[_Part], faults: Iterable[FaultError] = ()) -> dict[Any, Any]:
        """Every part as its type, by its key. Raises FaultsError with the faults of all, and those given."""
        found, wrong = {}, list(faults)
        for key, value, type_, check in parts:
            try:
                found[key] = self.structure(value, type_)
                if check is not None and (text := check(found[key])) is not None:
                    raise FaultError(text)
            except FaultError as fault:
                wrong += fault.within(key).faults
        if wrong:
            raise FaultsError(wrong)
        return found


def _int(value: Any, _: Any) -> int:
    if isinstance(value, bool) or not isinstance(value, int):
        raise FaultError(f"expected a whole number, found {describe(value)}; write digits without quotes or point")
    return value


def _as_number(value: object) -> str:
    """How what was meant as a number is written: YAML takes `1e9` for a text."""
    try:
        meant = float(value) if isinstance(value, str) and "e" in value.lower() else math.nan
    except ValueError:
        meant = math.nan
    return f"write {meant:.1e}, with a dot and a sign" if math.isfinite(meant) else "write it without quotes, as 1.5"


def _float(value: Any, _: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise FaultError(f"expected a number, found {describe(value)}; {_as_number(value)}")
    try:
        number = float(value)
    except OverflowError:
        number = math.inf
    if not math.isfinite(number):
        raise FaultError(f"expected a finite number, found {describe(value)}; write a number such as 1.5")
    return number


def _bool(value: Any, _: Any) -> bool:
    if not isinstance(value, bool):
        raise FaultError(f"expected true or false, found {describe(value)}; write true or false")
    return value


def _str(value: Any, _: Any) -> str:
    if not isinstance(value, str):
        raise FaultError(f"expected text, found {describe(value)}; put it in quotes")
    return value


def _path(value: Any, _: Any) -> Path:
    if not isinstance(value, str | Path) or not str(value) or "\0" in str(value):
        raise FaultError(f"expected a file name, found {describe(value)}; write the path")
    return Path(value)


def _literal(value: Any, choices: tuple[Any, ...]) -> Any:
    for choice in choices:
        if value == choice and type(value) is type(choice):
            return choice
    hint = did_you_mean(str(value)[:40], [str(choice) for choice in choices])
    raise FaultError(f"{describe(value)} is not one of the choices; {hint}")


def _any(value: Any, _: Any) -> Any:
    return value


_PLAIN: Mapping[Any, Hook] = {int: _int, float: _float, bool: _bool, str: _str, Path: _path, Any: _any}
