"""YAML text as plain values, each with its place in the file.

The loader follows YAML 1.1 as PyYAML's SafeLoader does, with six differences that serve a file written by hand:
every key and value remembers its line, a key given twice is a fault, keys are text, 22:00 is text and no number to the
base of 60, 010 is a fault and not 8, and the size, the nesting and the number of values (after aliases) are bounded, so
that no file can exhaust a small robot's memory.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import reduce
from itertools import chain
from operator import getitem
from pathlib import Path
from typing import Any

import yaml

from hvcpd.errors import ConfigError, unreadable

_REMEDY = "correct the line, or the one before it"
_REMEDIES: tuple[tuple[str, str, bool], ...] = (
    (r"character '\t'", "use spaces in place of the tab", False),
    ("mapping values are not allowed", "indent it as the lines around it; put text with a colon in quotes", False),
    ("could not find expected ':'", "write a colon and a space after the key", True),
    ("expected <block end>", "indent it as the lines around it; write a quote within quotes twice", False),
    ("a quoted scalar", "close the quote", True),
    ("a flow sequence", "close the bracket; put text with a colon or # in quotes", True),
    ("a flow mapping", "close the brace; put text with a colon or # in quotes", True),
    ("that cannot start any token", "put the text in quotes", False),
    ("another document", "delete the line `---`, or make two files", False),
    ("alias", "put the text in quotes", False),
    ("an anchor", "put the text in quotes", False),
)
"""What to do for parts of PyYAML's messages, and whether its context has the line to be corrected."""

_BY_EIGHTS = re.compile(r"[-+]?0[0-9_]")
"""What begins a whole number to the base of 8, which is 8 for 010."""

_LOST_NUMBER = re.compile(r"[ \t]+#([0-9]+)[ \t\r]*[\n\0]")
"""A comment that is a number and no more: the end of a text as "water rose #1". No comment says so little."""

_IN_NO_TEXT = re.compile("[\0\ud800-\udfff]")
"""What an escape can put into a text, but neither a file's name nor UTF-8 can have: NUL, and half a character."""

KeyPath = tuple[str | int, ...]
"""The way to a value from the top of a document: keys and list indices (from 0)."""

MAX_FILE_BYTES = 1 << 20
"""1 MiB: a hundred tasks with a hundred actions each take about 200 kB."""

MAX_DEPTH = 24
"""Nested lists and groups; a task file needs six."""

MAX_VALUES = 50_000
"""Values after aliases are written out; 99 tasks of 100 actions are about 40,000 keys and values at most."""


@dataclass(frozen=True, order=True)
class Place:
    """The source of a value: a file with line and column (from 1), or a command's option (line 0)."""

    source: str
    line: int = 0
    column: int = 0

    def __str__(self) -> str:
        return f"{self.source}:{self.line}" if self.line else self.source


class Document:
    """The values of a document, the place of each in the file, and the faults found so far."""

    def __init__(self, top: Place) -> None:
        self.source = top.source
        self.value: Any = None
        self.places: dict[KeyPath, Place] = {(): top}
        """Of each key, and of each value that has none: in a list, or the whole."""
        self._overlaid: set[KeyPath] = set()
        self._faults: dict[tuple[Place, str], KeyPath] = {}

    def place(self, path: KeyPath) -> Place:
        """The place of what is at `path`, or of the nearest thing around it."""
        while path not in self.places:
            path = path[:-1]
        return self.places[path]

    def texts(self) -> Iterator[tuple[str, Place]]:
        """The texts among the values, and the place of each."""
        for path, place in self.places.items():
            value = reduce(getitem, path, self.value)
            if isinstance(value, str):
                yield value, place

    def has(self, path: KeyPath) -> bool:
        """Whether there is a value at `path`, valid or not."""
        return path in self.places

    def fault(self, path: KeyPath, text: str, place: Place | None = None) -> None:
        """Note a fault at `path` and its remedy; each path is reported only once."""
        self._faults.setdefault((place or self.place(path), text), path)

    def is_faulty(self, path: KeyPath) -> bool:
        """Whether the value at `path`, or an enclosing one below the top level, already has a fault."""
        found = set(self._faults.values())
        return any(path[:length] in found for length in range(min(1, len(path)), len(path) + 1))

    def faults(self) -> Iterator[str]:
        """One line a fault, in the order of the file."""
        for place, text in sorted(self._faults):
            yield f"{place}: {text}"

    def overlay(self, path: KeyPath, value: object, source: str) -> None:
        """Override a value of the file by one from elsewhere (a command's option); missing parents are created.

        What lies in the way and is no group of keys stays, as the fault that it is.
        """
        if self.value is None:
            self.value = {}
        group = self.value
        for key in path[:-1]:
            group = group.setdefault(key, {}) if isinstance(group, dict) else None
        if isinstance(group, dict):
            group[path[-1]] = value
        self._forget_places(path)
        self.places[path] = Place(source)
        self._overlaid.add(path)

    def drop(self, key: str) -> None:
        """Leave out a value at the top level, as if it were not written."""
        if isinstance(self.value, dict):
            self.value.pop(key, None)
            self._forget_places((key,))

    def _forget_places(self, path: KeyPath) -> None:
        self.places = {known: place for known, place in self.places.items() if known[: len(path)] != path}

    def named_by_place(self, path: KeyPath) -> bool:
        """Whether the place of the key at `path`, an option or a variable, already names the key."""
        return path in self._overlaid

    def gather(self, place: Place) -> None:
        """Give all values and faults the same place: they come from no file."""
        self.places = dict.fromkeys(self.places, place)
        self._faults = {(place, text): path for (_, text), path in self._faults.items()}

    def with_list(self, key: str, elements: Sequence[tuple[Document, int]]) -> Document:
        """This document, a group of keys, with another list under one of them: elements of such lists of documents,
        each with its places and faults."""
        result = Document(self.places[()])
        result.value = {**self.value, key: [document.value[key][index] for document, index in elements]}
        result._take(self, lambda path: path if path[:1] != (key,) or len(path) == 1 else None)
        for n, (document, index) in enumerate(elements):
            result._take(document, _moved((key, index), (key, n)))
        return result

    def _take(self, other: Document, moved: Callable[[KeyPath], KeyPath | None]) -> None:
        """Take places and faults of another document, as far as `moved` has a way for theirs."""
        self.places.update((to, place) for path, place in other.places.items() if (to := moved(path)) is not None)
        faults = ((fault, moved(path)) for fault, path in other._faults.items())
        self._faults.update((fault, path) for fault, path in faults if path is not None)


def _moved(before: KeyPath, now: KeyPath) -> Callable[[KeyPath], KeyPath | None]:
    """The new way to what lay below `before`; None for all else."""
    return lambda path: (*now, *path[len(before) :]) if path[: len(before)] == before else None


def read_bytes(path: Path) -> bytes:
    """The bytes of a configuration file. Raises ConfigError if it is no file, cannot be read, or is too large."""
    try:
        if path.exists() and not path.is_file() and not path.is_dir():  # to open a pipe would wait for its writer
            raise ConfigError(f"{path}: this is a pipe or a device, which cannot be read again; name a regular file")
        with path.open("rb") as file:
            data = file.read(MAX_FILE_BYTES + 1)
    except (OSError, ValueError) as error:  # ValueError: a NUL in the name
        raise ConfigError(f"{path}: {unreadable(error)}") from error
    if len(data) > MAX_FILE_BYTES:
        raise ConfigError(f"{path}: the file is larger than {MAX_FILE_BYTES >> 20} MiB; is it the right file?")
    return data


def parse(data: bytes, source: str) -> Document:
    """The document in `data`. Raises ConfigError when it is not YAML at all; lesser faults are kept in the result."""
    text = decoded(data, source)
    document = Document(Place(source, 1, 1))
    try:
        loader = _Loader(text)  # looks for characters that are not allowed
        try:
            node = loader.get_single_node()
            if node is not None:
                document.value = _Reader(document, loader).read(node, ())
        finally:
            loader.dispose()
    except yaml.MarkedYAMLError as error:
        what = ", ".join(part for part in (error.context, error.problem) if part)
        remedy, is_at_begin = next((cure for part, *cure in _REMEDIES if part in what), (_REMEDY, False))
        marks = (error.context_mark, error.problem_mark)[:: 1 if is_at_begin else -1]
        mark = next(filter(None, marks), None)
        place = Place(source, mark.line + 1, mark.column + 1) if mark else Place(source, 1)
        raise ConfigError(f"{place}: not valid YAML ({what}); {remedy}") from error
    except yaml.reader.ReaderError as error:
        line = text.count("\n", 0, error.position) + 1
        raise ConfigError(f"{source}:{line}: YAML does not allow this character; delete it") from error
    return document


def place_of(file: Path, *texts: str) -> str:
    """The first line of a file where one of the texts is a value, or else a word of one; the file if none is."""
    try:
        found = list(parse(read_bytes(file), str(file)).texts())
    except ConfigError:
        return str(file)
    whole = (place for text, place in found if text in texts)
    parts = (place for text, place in found if not set(texts).isdisjoint(text.split()))
    return str(next(chain(whole, parts), file))


def decoded(data: bytes, source: str) -> str:
    """The text of a configuration file. Raises ConfigError with the first line that is not UTF-8."""
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        raise ConfigError(f"{source}:{line}: not UTF-8 text; save the file as UTF-8") from error


class _Loader(yaml.SafeLoader):
    """PyYAML's safe loader that gives up on deep nesting before Python's own stack does."""

    def __init__(self, stream: str) -> None:
        super().__init__(stream)
        self._depth = 0

    def compose_node(self, parent: yaml.Node | None, index: Any) -> yaml.Node | None:
        if self._depth > MAX_DEPTH:
            mark = self.peek_event().start_mark  # type: ignore[no-untyped-call]
            raise yaml.MarkedYAMLError(problem=f"nested deeper than {MAX_DEPTH} levels", problem_mark=mark)
        self._depth += 1
        node = super().compose_node(parent, index)
        self._depth -= 1
        return node


class _Reader:
    """Turns composed nodes into values, noting places and faults in a document."""

    def __init__(self, document: Document, loader: _Loader) -> None:
        self._document = document
        self._loader = loader
        self._values = 0
        self._open: list[yaml.Node] = []

    def _place(self, node: yaml.Node) -> Place:
        return Place(self._document.source, node.start_mark.line + 1, node.start_mark.column + 1)

    def _fault(self, path: KeyPath, node: yaml.Node, text: str) -> None:
        self._document.fault(path, text, self._place(node))

    def read(self, node: yaml.Node, path: KeyPath) -> Any:
        """The value of a node that stands at `path`."""
        self._values += 1
        if self._values > MAX_VALUES:
            raise yaml.MarkedYAMLError(
                problem=f"more than {MAX_VALUES} values, aliases included", problem_mark=node.start_mark
            )
        self._document.places[path] = self._place(node)
        if isinstance(node, yaml.ScalarNode):
            return self._scalar(node, path)
        if any(node is outer for outer in self._open):
            self._fault(path, node, "an alias that contains itself; write the value out")
            return None
        self._open.append(node)
        try:
            if isinstance(node, yaml.SequenceNode) and node.tag == "tag:yaml.org,2002:seq":
                return [self.read(child, (*path, index)) for index, child in enumerate(node.value)]
            if isinstance(node, yaml.MappingNode) and node.tag == "tag:yaml.org,2002:map":
                return self._mapping(node, path)
        finally:
            self._open.pop()
        self._fault(path, node, f"the tag {node.tag} is not supported; delete it")
        return None

    def _scalar(self, node: yaml.ScalarNode, path: KeyPath) -> Any:
        try:
            value = self._loader.construct_object(node)
        except yaml.constructor.ConstructorError:
            self._fault(path, node, f"the tag {node.tag} is not supported; delete it")
        except (ValueError, OverflowError, KeyError, IndexError, AttributeError):
            # PyYAML's constructors let these through for text such as "2001-99-99", "0b" or "!!int x".
            self._fault(path, node, f"{_shortened(node.value)} cannot be read; put it in quotes if it is text")
        else:
            if isinstance(value, str) and _IN_NO_TEXT.search(value):
                self._fault(path, node, f"{_shortened(value)} has a character that no text can have; delete it")
                return None
            if isinstance(value, str) and node.style is None:
                self._look_for_lost_number(node, path)
            if type(value) not in (int, float) or node.style is not None:
                return value
            if ":" in node.value:  # 22:00 would be 1320
                return node.value
            if _BY_EIGHTS.match(node.value):
                text = f"{_shortened(node.value)} would be read as {value}; write it without the zero before it"
                self._fault(path, node, text)
            return value
        return None

    def _look_for_lost_number(self, node: yaml.ScalarNode, path: KeyPath) -> None:
        end = node.end_mark
        if end.buffer is not None and (found := _LOST_NUMBER.match(end.buffer, end.pointer)) is not None:
            number = found[1][:40]
            text = f"#{number} is a comment, and no part of {_shortened(node.value)}"
            self._fault(path, node, f"{text}; write the number in words, or `# {number}` if it is one")

    def _mapping(self, node: yaml.MappingNode, path: KeyPath) -> dict[str, Any]:
        result: dict[str, Any] = {}
        for key_node, value_node in node.value:
            if isinstance(key_node, yaml.ScalarNode) and key_node.tag == "tag:yaml.org,2002:merge":
                self._fault(path, key_node, "merge keys (<<) are not supported; write the keys out")
                continue
            if not isinstance(key_node, yaml.ScalarNode) or key_node.tag != "tag:yaml.org,2002:str":
                self._fault(path, key_node, _instead_of_key(key_node, value_node))
                continue
            key = key_node.value
            child = (*path, key)
            if key in result:
                first = self._document.places[child].line
                self._fault(child, key_node, f"the key {key!r} is given twice, first in line {first}; keep one")
                continue
            result[key] = self.read(value_node, child)
            self._document.places[child] = self._place(key_node)
        return result


def _instead_of_key(key: yaml.Node, value: yaml.Node) -> str:
    is_decimal = key.tag == "tag:yaml.org,2002:int" and value.value == ""
    remedy = f"a number has a point and no comma, as 1.{key.value}" if is_decimal else "put it in quotes"
    return f"a key must be text; {remedy}"


def _shortened(text: str, length: int = 40) -> str:
    return repr(text if len(text) <= length else text[: length - 1] + "…")
