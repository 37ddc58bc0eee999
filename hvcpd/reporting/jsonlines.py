"""Events for machines: one JSON object a line."""

from __future__ import annotations

import json
import math
from typing import TYPE_CHECKING, Any, TextIO

from hvcpd.config.command_line import discard_output

if TYPE_CHECKING:
    from hvcpd.reporting.events import Event


def line(event: Event) -> str:
    """The event as one line of strict JSON (RFC 8259) with a line break; what is not finite becomes null."""
    from hvcpd.reporting.events import as_json  # not for those who only ask a daemon: each of its classes takes time

    return as_strict_json(as_json(event)) + "\n"


def as_strict_json(value: Any) -> str:
    """The value as strict JSON (RFC 8259) on one line, in ASCII; what is not finite becomes null."""
    return json.dumps(_finite(value), allow_nan=False, default=float)


def _finite(value: Any) -> Any:
    match value:
        case float():
            return value if math.isfinite(value) else None
        case dict():
            return {str(key): _finite(each) for key, each in value.items()}
        case list() | tuple():
            return [_finite(each) for each in value]
        case _:
            return value


class JsonLines:
    """Writes every event as it comes, and at once, so that a reader at the other end of a pipe can follow.

    When that reader goes away (`… --json | head -1`) the mission goes on unseen: its report is still written, and its
    exit status still tells how it ended.
    """

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream
        self._heeded = True

    def handle(self, event: Event) -> None:
        """Write one event. A closed pipe is no error; any other fault of the stream raises OSError."""
        if not self._heeded:
            return
        try:
            self._stream.write(line(event))
            self._stream.flush()
        except BrokenPipeError:
            self._heeded = False
            discard_output(self._stream)
