"""From plain values, as YAML and JSON have them, to frozen dataclasses, strictly and with every fault found.

Nothing is converted that a person may not have meant: "5" is no number, 5.7 no whole number, yes no 1. A field may
carry a check in its metadata (`between`, `checked`).
"""

from __future__ import annotations

import dataclasses
import math
import types
from collections import abc
from collections.abc import Callable, Iterable, Mapping
from functools import cache
from pathlib import Path
from typing import Any, Literal, NamedTuple, Union, get_args, get_origin, get_type_hints

from hvcpd.errors import did_you_mean

KeyPath = tuple[str | int, ...]
"""The way to a value from the top of a document: keys and list indices (from 0)."""

Check = Callable[[Any], str | None]
"""Says what is wrong with a value and what to do, or None."""

_CHECK = "check"
_NO_CHECKS: Mapping[str, Check] = {}


class Fault(NamedTuple):
    """What is wrong at `path` and what to do; of a key that is unknown or missing the text names it."""

    path: KeyPath
    text: str
    names_key: bool = False

    def __str__(self) -> str:
        key = None if self.names_key else next((key for key in reversed(self.path) if isinstance(key, str)), None)
        return self.text if key is None else f"{key}: {self.text}"


class FaultError(ValueError):
    """Something is wrong with a value or with parts of it, `faults`, whose paths start at that value."""

    def __init__(self, text: str, *path: str | int, faults: Iterable[Fault] = ()) -> None:
        super().__init__(text)
        self.faults = tuple(faults) or (Fault(path, text),)

    def under(self, *path: str | int) -> FaultError:
        """The same of a value around, in which `path` leads to this one."""
        return FaultError(str(self), faults=(fault._replace(path=(*path, *fault.path)) for fault in self.faults))


Hook = Callable[[Any, "Converter"], Any]
"""Turns a plain value into one of our types. Raises FaultError."""


class Converter:
    """Reads dataclasses, tuples, mappings, choices, plain values, and what `hooks` read; each may be optional (None).

    With `unknown_keys`, keys that are no field of a dataclass are passed over.
    """

    def __init__(self, hooks: Mapping[Any, Hook] | None = None, unknown_keys: bool = False) -> None:
        self._hooks = hooks or {}
        self._unknown_keys = unknown_keys

    def structure(self, value: Any, type_: Any) -> Any:
        """`value` as a `type_`. Raises FaultError with every fault, and TypeError for a type that nothing reads."""
        if type_ in self._hooks:
            return self._hooks[type_](value, self)
        if type_ in _PLAIN:
            return _PLAIN[type_](value)
        if dataclasses.is_dataclass(type_):
            return self._dataclass(value, type_)
        arguments = get_args(type_)
        origin = get_origin(type_)
        if origin in (Union, types.UnionType) and types.NoneType in arguments and len(arguments) == 2:
            (needed,) = (each for each in arguments if each is not types.NoneType)
            return None if value is None else self.structure(value, needed)
        if origin is tuple:
            return self._tuple(value, arguments)
        if origin in (abc.Mapping, dict):
            if not isinstance(value, dict):
                raise FaultError(f"expected a group of keys, found {describe(value)}; write `name: ...`")
            return self._parts(value, dict.fromkeys(value, arguments[1]))
        if origin is Literal:
            return _literal(value, arguments)
        raise TypeError(f"no rule to read {type_}")

    def _dataclass(self, value: Any, type_: Any) -> Any:
        hints, checks, needed = _fields_of(type_)
        if not isinstance(value, dict):
            known = ", ".join(hints)
            raise FaultError(f"expected a group of keys ({known}), found {describe(value)}; write `key: value`")
        unknown = () if self._unknown_keys else [key for key in value if key not in hints]
        texts = {key: f"unknown key {key[:40]!r}; {did_you_mean(key[:40], list(hints))}" for key in unknown}
        texts |= {name: f"the key {name!r} is missing; add it" for name in needed if name not in value}
        faults = [Fault((key,), text, names_key=True) for key, text in texts.items()]
        given = {key: each for key, each in value.items() if key in hints}
        return type_(**self._parts(given, hints, checks, faults))

    def _tuple(self, value: Any, arguments: tuple[Any, ...]) -> tuple[Any, ...]:
        if not isinstance(value, list):
            raise FaultError(f"expected a list, found {describe(value)}; write it as [a, b]")
        kinds = arguments[:1] * len(value) if arguments[-1] is Ellipsis else arguments
        if len(kinds) != len(value):
            raise FaultError(f"expected {len(kinds)} values, found {len(value)}")
        return tuple(self._parts(dict(enumerate(value)), dict(enumerate(kinds))).values())

    def _parts(
        self,
        values: Mapping[Any, Any],
        kinds: Mapping[Any, Any],
        checks: Mapping[str, Check] = _NO_CHECKS,
        faults: Iterable[Fault] = (),
    ) -> dict[Any, Any]:
        """Each value as its kind. Raises FaultError with the faults of all, and those that are known already."""
        result, found = {}, list(faults)
        for key, value in values.items():
            try:
                result[key] = self.structure(value, kinds[key])
                if key in checks and (text := checks[key](result[key])) is not None:
                    raise FaultError(text)
            except FaultError as error:
                found += error.under(key).faults
        if found:
            raise FaultError("; ".join(map(str, found)), faults=found)
        return result


@cache
def _fields_of(type_: Any) -> tuple[Mapping[str, Any], Mapping[str, Check], tuple[str, ...]]:
    """Of a dataclass: each field's type, the checks of those that have one, and the fields without a default."""
    fields, hints = dataclasses.fields(type_), get_type_hints(type_)
    needed = (f.name for f in fields if f.default is f.default_factory is dataclasses.MISSING)
    return (
        {f.name: hints[f.name] for f in fields},
        {f.name: f.metadata[_CHECK] for f in fields if _CHECK in f.metadata},
        tuple(needed),
    )


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


def _int(value: Any) -> int:
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


def _float(value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise FaultError(f"expected a number, found {describe(value)}; {_as_number(value)}")
    try:
        number = float(value)
    except OverflowError:
        number = math.inf
    if not math.isfinite(number):
        raise FaultError(f"expected a finite number, found {describe(value)}; write a number such as 1.5")
    return number


def _bool(value: Any) -> bool:
    if not isinstance(value, bool):
        raise FaultError(f"expected true or false, found {describe(value)}; write true or false")
    return value


def _str(value: Any) -> str:
    if not isinstance(value, str):
        raise FaultError(f"expected text, found {describe(value)}; put it in quotes")
    return value


def _path(value: Any) -> Path:
    if not isinstance(value, str | Path) or not str(value) or "\0" in str(value):
        raise FaultError(f"expected a file name, found {describe(value)}; write the path")
    return Path(value)


def _literal(value: Any, choices: tuple[Any, ...]) -> Any:
    for choice in choices:
        if value == choice and type(value) is type(choice):
            return choice
    hint = did_you_mean(str(value)[:40], [str(choice) for choice in choices])
    raise FaultError(f"{describe(value)} is not one of the choices; {hint}")


_PLAIN: Mapping[Any, Callable[[Any], Any]] = {
    int: _int,
    float: _float,
    bool: _bool,
    str: _str,
    Path: _path,
    Any: lambda value: value,
}
