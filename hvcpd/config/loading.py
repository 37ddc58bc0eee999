"""From a document's values to frozen dataclasses, strictly, with every fault reported at its line.

Nothing is converted that a person may not have meant: "5" is no number, 5.7 no whole number, yes no 1. A field may
carry a check in its metadata (`between`, `checked`); what concerns several fields is checked by a function that is
given a `Parts` and can name the place of each.
"""

from __future__ import annotations

import dataclasses
import math
from collections import abc
from collections.abc import Callable, Iterator, Mapping
from functools import cache
from pathlib import Path
from typing import Any, Literal, TypeVar, cast, get_args, get_origin

from cattrs import Converter
from cattrs.errors import AttributeValidationNote, BaseValidationError, ForbiddenExtraKeysError, IterableValidationNote
from cattrs.gen import make_dict_structure_fn, make_mapping_structure_fn, override

from hvcpd.config.document import Document, KeyPath
from hvcpd.config.unknown_keys import instead_of_key
from hvcpd.errors import ConfigError, did_you_mean

T = TypeVar("T")

Check = Callable[[Any], str | None]
"""Says what is wrong with a value and what to do, or None; for a part of the value it raises FaultError."""

Hook = Callable[[Any, Converter], Any]
"""Turns a plain value into one of our types; raises FaultError, or what the converter raises."""

MAX_FAULTS_TOLD = 100
"""Lines of one ConfigError; nobody reads more at a time."""

_CHECK = "check"


class FaultError(ValueError):
    """A fault of a value, with the remedy; `path` leads from that value to the faulty part."""

    def __init__(self, text: str, *path: str | int) -> None:
        super().__init__(text)
        self.path: KeyPath = path


class Parts:
    """A document's well-formed values, for a check across fields, which can note a fault of any of them."""

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
            return self._converter.structure(value, type_)
        except (FaultError, BaseValidationError):
            return None

    def has(self, path: KeyPath) -> bool:
        """Whether there is a value at `path`, valid or not."""
        return self._document.has(path)

    def plain(self, path: KeyPath) -> Any:
        """The value at `path` as the document has it, or None if it is absent or has been faulted."""
        return self.get(path, cast(type[Any], Any))

    def elements(self, path: KeyPath) -> list[KeyPath]:
        """The path of each element of the list at `path`; none if there is no list."""
        value = self.plain(path)
        return [(*path, index) for index in range(len(value))] if isinstance(value, list) else []

    def where(self, path: KeyPath, beside: KeyPath) -> str:
        """The line in which the key or value at `path` stands, with its file if `beside` stands in another one."""
        place, other = self._document.place(path), self._document.place(beside)
        if not place.line:
            return str(place)
        return f"line {place.line}" if place.source == other.source else f"line {place.line} of {place.source}"

    def fault(self, path: KeyPath, text: str) -> None:
        """Note what is wrong at `path` and what to do."""
        self._document.fault(path, text)


def structure(
    document: Document,
    type_: type[T],
    check: Callable[[Parts], None] | None = None,
    hooks: Mapping[Any, Hook] | None = None,
) -> T:
    """The document as a `type_`, a dataclass.

    `check` looks at what concerns several fields; `hooks` read types that are not plain dataclasses. Raises
    ConfigError with every fault of the document, a line each: `FILE:LINE: what is wrong; what to do`.
    """
    converter = _make_converter(hooks or {})
    if document.value is None and not document.is_faulty(()):
        document.value = {}
    result: T | None = None
    try:
        result = converter.structure(document.value, type_)
    except (FaultError, BaseValidationError) as error:
        for path, text in _flatten(error, (), document):
            if not document.is_faulty(path):
                document.fault(path, text)
    if check is not None:
        check(Parts(document, converter))
    faults = list(document.faults())
    if faults or result is None:
        more = len(faults) - MAX_FAULTS_TOLD
        shown = faults[:MAX_FAULTS_TOLD] + ([f"{document.source}: and {more} more"] if more > 0 else [])
        raise ConfigError("\n".join(shown))
    return result


def between(least: float, most: float) -> dict[str, Check]:
    """Field metadata: the number lies from `least` to `most`, both included."""
    return {_CHECK: number_between(least, most)}


def number_between(least: float, most: float) -> Check:
    """The check of `between` alone."""

    def check(value: float | None) -> str | None:
        if value is None or least <= value <= most:
            return None
        return f"{describe(value)} is out of range; give a number from {least} to {most}"

    return check


def checked(*checks: Check) -> dict[str, Check]:
    """Field metadata: checks of the value; the first fault that one finds is reported."""
    return {_CHECK: lambda value: next((text for check in checks if (text := check(value)) is not None), None)}


def of_each(check: Callable[[str, Any], str | None]) -> Check:
    """A check of a group of keys: of each key with its value; the first fault is told at its key."""

    def check_group(group: Mapping[str, Any]) -> None:
        for key, value in group.items():
            if (wrong := check(key, value)) is not None:
                raise FaultError(wrong, key)

    return check_group


def at_most(most: int, what: str) -> Check:
    """A check of the maximum number of elements; `what` is, for example, "names can be given"."""
    return lambda given: None if len(given) <= most else f"at most {most} {what}, found {len(given)}; remove some"


def describe(value: object) -> str:
    """A value in words for people."""
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
            return "a list" if value else "an empty list"
        case dict():
            return "a group of keys"
        case _:
            return f"a {type(value).__name__}"


def _make_converter(hooks: Mapping[Any, Hook]) -> Converter:
    converter = Converter(forbid_extra_keys=True, detailed_validation=True)

    def dataclass_hook(cls: Any) -> Callable[[Any, Any], Any]:
        fields = dataclasses.fields(cls)

        @cache  # made for the groups that a document has: to make those of all settings takes longer than to read them
        def inner() -> Callable[[Any, Any], Any]:
            checks: dict[str, Any] = {
                field.name: override(struct_hook=_checked_hook(converter, field.metadata[_CHECK]))
                for field in fields
                if _CHECK in field.metadata
            }
            return make_dict_structure_fn(cls, converter, **checks)

        known = ", ".join(field.name for field in fields)
        return _of_group(lambda value: inner()(value, cls), f" ({known})", "key: value")

    def tuple_hook(value: Any, type_: Any) -> Any:
        if not isinstance(value, list):
            raise FaultError(f"expected a list, found {describe(value)}; write it as [a, b]")
        list_type: Any = list[get_args(type_)[0]]  # type: ignore[misc]
        return tuple(converter.structure(value, list_type))

    def mapping_hook(cls: Any) -> Callable[[Any, Any], Any]:
        inner = make_mapping_structure_fn(cls, converter, dict)
        return _of_group(lambda value: inner(value, cls), "", "name: ...")

    converter.register_structure_hook_factory(dataclasses.is_dataclass, dataclass_hook)
    converter.register_structure_hook_factory(_has_origin(abc.Mapping), mapping_hook)
    converter.register_structure_hook_func(_has_origin(tuple), tuple_hook)
    converter.register_structure_hook_func(_has_origin(Literal), _literal)
    for primitive, read in ((int, _int), (float, _float), (bool, _bool), (str, _str), (Path, _path)):
        converter.register_structure_hook(primitive, read)
    for special, read_special in hooks.items():
        converter.register_structure_hook(special, _special_hook(converter, read_special))
    return converter


def _of_group(read: Callable[[Any], Any], keys: str, example: str) -> Callable[[Any, Any], Any]:
    def hook(value: Any, _: Any) -> Any:
        if not isinstance(value, dict):
            raise FaultError(f"expected a group of keys{keys}, found {describe(value)}; write `{example}`")
        return read(value)

    return hook


def _has_origin(origin: Any) -> Callable[[Any], bool]:
    return lambda type_: bool(get_origin(type_) is origin)


def _special_hook(converter: Converter, read: Hook) -> Callable[[Any, Any], Any]:
    return lambda value, _: read(value, converter)


def _checked_hook(converter: Converter, check: Check) -> Callable[[Any, Any], Any]:
    def hook(value: Any, type_: Any) -> Any:
        if type_ is str and not isinstance(value, str):
            wrong = check("?" if value is None else str(value)) if not isinstance(value, bool) else None
            raise FaultError(_no_text(value, wrong.rpartition("; ")[2] if wrong is not None else "put it in quotes"))
        result = converter.structure(value, type_)
        text = check(result)
        if text is not None:
            raise FaultError(text)
        return result

    return hook


def _no_text(value: object, remedy: str) -> str:
    """What is wrong with a value that is no text; `remedy`: what its text needs."""
    if value is None and remedy in ("put it in quotes", "choose another"):
        remedy = "write one, or remove the line"
    return f"expected text, found {describe(value)}; {remedy}"


def _int(value: Any, _: Any) -> int:
    if isinstance(value, bool) or not isinstance(value, int):
        is_quoted = isinstance(value, str) and value.isdecimal()  # or YAML takes it for text: 08
        remedy = "write it without quotes, and without a zero before it" if is_quoted else "write only digits, as 15"
        raise FaultError(f"expected a whole number, found {describe(value)}; {remedy}")
    return value


def as_number(value: object) -> str:
    """The correct spelling of a text that was meant as a number: YAML takes `1e9` for a text."""
    try:
        meant = float(value) if isinstance(value, str) and "e" in value.lower() else math.nan
    except ValueError:
        meant = math.nan
    if math.isfinite(meant):
        return f"write {meant:.1e}, with a dot and a sign"
    return "write it without quotes or unit, as 1.5"


def _float(value: Any, _: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise FaultError(f"expected a number, found {describe(value)}; {as_number(value)}")
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
        raise FaultError(_no_text(value, "write one text" if isinstance(value, list | dict) else "put it in quotes"))
    return value


def _path(value: Any, _: Any) -> Path:
    if not isinstance(value, str | Path) or not str(value) or "\0" in str(value):
        remedy = "name the file that has it" if isinstance(value, list | dict) else "write the path"
        raise FaultError(f"expected a file name, found {describe(value)}; {remedy}")
    return Path(value)


def _literal(value: Any, type_: Any) -> Any:
    choices = get_args(type_)
    for choice in choices:
        if value == choice and type(value) is type(choice):
            return choice
    hint = did_you_mean(str(value)[:40], [str(choice) for choice in choices])
    raise FaultError(f"{describe(value)} is not one of the choices; {hint}")


def _flatten(error: BaseException, path: KeyPath, document: Document) -> Iterator[tuple[KeyPath, str]]:
    """Every fault in a tree of cattrs' exceptions with the way to its value; an error of our own is raised on."""
    for note in reversed(getattr(error, "__notes__", [])):
        if isinstance(note, AttributeValidationNote):
            path = (*path, note.name)
        elif isinstance(note, IterableValidationNote):
            path = (*path, note.index)
    match error:
        case BaseValidationError():
            for child in error.exceptions:
                yield from _flatten(child, path, document)
        case FaultError():
            at = (*path, *error.path)
            name = at  # without the numbers of a list's elements
            while name and not isinstance(name[-1], str):
                name = name[:-1]
            yield at, f"{name[-1]}: {error}" if name and not document.named_by_place(name) else str(error)
        case ForbiddenExtraKeysError():
            for key in error.extra_fields:
                yield (*path, key), f"unknown key {key[:40]!r}; {instead_of_key(key, error.cl)}"
        case KeyError():  # cattrs' way to say that a key is absent
            yield path, f"the key {path[-1]!r} is missing; add it"
        case _:
            raise error
