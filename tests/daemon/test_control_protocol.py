"""Lines that come from anywhere: each is a request or a refusal, whatever its bytes."""

from __future__ import annotations

import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hvcpd.daemon.control_protocol import (
    MAX_ID_LENGTH,
    RefusalError,
    Request,
    checked_arguments,
    id_of,
    line_of,
    parse_request,
    refusal_line,
    reply_line,
)

values = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=8),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=8), inner, max_size=3),
    max_leaves=8,
)


def code(line: bytes) -> str:
    with pytest.raises(RefusalError) as refusal:
        parse_request(line)
    return refusal.value.code


def test_a_request_has_a_command_an_id_and_arguments() -> None:
    assert parse_request(b'{"id": "a", "command": "say", "text": "stop"}\r\n') == Request("a", "say", {"text": "stop"})
    assert parse_request(b'{"command": "status"}') == Request(None, "status", {})


@pytest.mark.parametrize(
    "line",
    [
        b"",
        b"\n",
        b"status\n",
        b"[]",
        b'"status"',
        b"{}",
        b'{"command": 5}',
        b'{"command": "status", "id": 1.5}',
        b'{"command": "status", "id": true}',
        b'{"command": "status", "id": 9007199254740993}',
        b'{"command": "status", "id": "' + b"x" * (MAX_ID_LENGTH + 1) + b'"}',
        b'{"command": "status", "id": []}',
        b'{"command": "status", "command": "stop"}',
        b'{"command": "say", "text": NaN}',
        b'{"command": "status"} {"command": "stop"}',
        b'{"command": "\xff"}',
        b"\xef\xbb\xbf{}",
        b"[" * 8000,
        b'{"a":' * 1600,
        b"9" * 8000,
    ],
)
def test_anything_else_is_malformed(line: bytes) -> None:
    assert code(line) == "malformed"


@given(st.binary(max_size=300))
def test_any_bytes_are_a_request_or_malformed(line: bytes) -> None:
    try:
        request = parse_request(line)
    except RefusalError as refusal:
        told = json.loads(refusal_line(id_of(line), refusal))
    else:
        told = json.loads(reply_line(request.id, {"command": request.command}))
    assert told.keys() == {"id", "ok", "result" if told["ok"] else "error"}


@given(values, st.dictionaries(st.sampled_from(["id", "command", "text", "after"]), values))
def test_any_json_is_a_request_or_malformed(value: object, request: dict[str, object]) -> None:
    for each in (value, request):
        line = json.dumps(each).encode()
        try:
            parsed = parse_request(line)
        except RefusalError:
            continue
        reply = json.loads(reply_line(parsed.id, {"x": float("inf")}))
        assert reply == {"id": parsed.id, "ok": True, "result": {"x": None}}


@given(st.text())
def test_a_line_has_no_line_break_but_its_own(text: str) -> None:
    line = line_of({"event": "heard", "text": text})
    assert line.count(b"\n") == 1
    assert json.loads(line)["text"] == text


def test_arguments_are_of_their_type() -> None:
    known: dict[str, tuple[type, ...]] = {"after": (int,), "since_s": (int, float)}
    assert checked_arguments(Request(1, "t", {"after": 3, "since_s": 1.5}), known) == {"after": 3, "since_s": 1.5}
    for arguments, part in (
        ({"aftr": 1}, "did you mean 'after'?"),
        ({"after": True}, "a whole number"),
        ({"since_s": "1"}, "a whole number or a number"),
        ({"after": 10**30}, "too large"),
    ):
        with pytest.raises(RefusalError, match=part.replace("?", r"\?")):
            checked_arguments(Request(1, "t", arguments), known)
    with pytest.raises(RefusalError, match="takes none"):
        checked_arguments(Request(1, "stop", {"x": 1}), {})
