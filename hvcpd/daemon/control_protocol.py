"""The lines that pass over the control socket: requests in, replies and events out; docs/control.md describes them.

Pure text: nothing here knows of sockets or robots. Whatever bytes come in, a line is a request or a `RefusalError`.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, NoReturn

from hvcpd.config.json_objects import json_object
from hvcpd.errors import did_you_mean
from hvcpd.reporting.jsonlines import as_strict_json

PROTOCOL = 1
"""Raised when something that a client relies on changes; additions do not raise it."""

MAX_LINE_BYTES = 8192
"""Of a request: the longest sentence has about 100 characters, 600 bytes with every one of them escaped."""

LEARN_S = 120.0
"""A client's time limit for requests with new words, which are compared with all others first: a second or two on a
desktop computer, about ten times as long on a Pi."""

NUMBER = (int, float)
"""The type of an argument that is any number."""

MAX_ID_LENGTH = 64
MAX_NUMBER = 2**53
"""Largest number accepted: beyond it JSON's readers in other languages lose digits (RFC 8259, section 6)."""

Id = str | int | None


class RefusalError(Exception):
    """A request cannot be served; `code` is for programs, the text for people."""

    def __init__(self, code: str, text: str) -> None:
        super().__init__(text)
        self.code = code


@dataclass(frozen=True)
class Request:
    """A command with its arguments, and the client's `id` for the reply."""

    id: Id
    command: str
    arguments: Mapping[str, Any] = field(default_factory=dict)


def parse_request(line: bytes) -> Request:
    """The request in a line, without or with its line break. Raises RefusalError `malformed`."""
    try:
        value = json.loads(line, parse_constant=_no_constant, object_pairs_hook=_object)
    except RecursionError:
        raise RefusalError("malformed", "the line is nested too deeply") from None
    except ValueError as error:  # JSONDecodeError, UnicodeDecodeError, a number of thousands of digits
        raise RefusalError("malformed", f"the line is not JSON ({_shortened(str(error), 80)})") from None
    if not isinstance(value, dict):
        raise RefusalError("malformed", 'a request is an object such as {"id": 1, "command": "status"}')
    command = value.pop("command", None)
    mark = value.pop("id", None)
    if not _is_id(mark):
        raise RefusalError("malformed", f"`id` is text of at most {MAX_ID_LENGTH} characters, or a whole number")
    if not isinstance(command, str):
        raise RefusalError("malformed", 'a request names its command, as in {"id": 1, "command": "status"}')
    return Request(mark, command, value)


def says_stop(line: bytes) -> bool:
    """Whether a line is a request to stop."""
    try:
        return parse_request(line).command == "stop"
    except RefusalError:
        return False


def id_of(line: bytes) -> Id:
    """The `id` of a line that cannot be served, if it can be read, so that the client knows which request failed."""
    mark = (json_object(line) or {}).get("id")
    return mark if _is_id(mark) else None


def checked_arguments(request: Request, known: Mapping[str, tuple[type, ...]]) -> dict[str, Any]:
    """The arguments, each of the type that `known` has for it. Raises RefusalError `bad_argument`."""
    for name, value in request.arguments.items():
        if name not in known:
            expected = did_you_mean(_shortened(name), known) if known else f"{request.command} takes none"
            raise RefusalError("bad_argument", f"unknown argument {_shortened(name)!r}; {expected}")
        if type(value) not in known[name]:  # a yes is no number
            wanted = " or ".join(_TYPE_NAMES[each] for each in known[name])
            raise RefusalError("bad_argument", f"{name}: expected {wanted}")
        if type(value) is int and abs(value) > MAX_NUMBER:
            raise RefusalError("bad_argument", f"{name}: the number is too large")
    return dict(request.arguments)


def reply_line(mark: Id, result: Mapping[str, Any]) -> bytes:
    """Return the reply line for a command's result."""
    return line_of({"id": mark, "ok": True, "result": result})


def refusal_line(mark: Id, refusal: RefusalError) -> bytes:
    """Return the reply line for a command that was refused."""
    return line_of({"id": mark, "ok": False, "error": {"code": refusal.code, "text": str(refusal)}})


def line_of(value: Mapping[str, Any]) -> bytes:
    """Return the line for a reply, or for an event, whose kind is in the field "event"."""
    return as_strict_json(value).encode("ascii") + b"\n"


_TYPE_NAMES: dict[type, str] = {
    str: "text",
    int: "a whole number",
    float: "a number",
    bool: "true or false",
    list: "a list",
    dict: "a group of keys",
}


def _is_id(mark: object) -> bool:
    if isinstance(mark, str):
        return len(mark) <= MAX_ID_LENGTH
    return mark is None or (type(mark) is int and abs(mark) <= MAX_NUMBER)


def _no_constant(name: str) -> NoReturn:
    raise ValueError(f"{name} is not JSON")


def _object(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    value = dict(pairs)
    if len(value) != len(pairs):
        raise ValueError("a key is given twice")
    return value


def _shortened(text: str, length: int = 40) -> str:
    return text if len(text) <= length else text[: length - 1] + "…"
