"""What every line of the log goes through: nothing in it can forge another line, tell a secret, or flood the disk."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from typing import Any, TextIO

import structlog
from structlog.typing import EventDict

from hvcpd.reporting.text import clean

PRIORITIES = {"debug": 7, "info": 6, "warning": 4, "error": 3, "exception": 3, "critical": 2}
"""syslog's numbers, which the journal reads from "<N>" at the beginning of a line (sd-daemon(3))."""

MAX_VALUE_LENGTH = 2000
"""Characters of a value; the longest of ours is a message with all faults of a device, some 500."""
MAX_TRACE_LENGTH = 20_000
"""Of a traceback; the journal cuts a line at 48 KiB (journald.conf(5), LineMax)."""

SECRETS = frozenset({"key", "secret", "password", "code", "otp", "token"})
"""Names under which nothing is ever written."""

BURST = 20
"""Maximum number of lines of one kind in a row: five tasks, three retries and every peer's greeting fit."""
REFILL_S = 3.0
"""Interval after which one more line of a kind may follow: a sentence lasts as long, so that no conversation is cut."""


def clean_values(_logger: Any, _method: str, event: EventDict) -> EventDict:
    """Nothing can end a line or steer a terminal, and nothing is endless; only a traceback has lines of its own."""
    return {key: _cleaned(key, value) for key, value in event.items()}


def _cleaned(key: str, value: Any) -> Any:
    if value is None or isinstance(value, bool | int | float):
        return value
    text = str(value)
    if key == "exception":
        return "\n".join(map(clean, text[-MAX_TRACE_LENGTH:].splitlines()))  # what was raised stands at its end
    return clean(text if len(text) <= MAX_VALUE_LENGTH else text[: MAX_VALUE_LENGTH - 1] + "…")


def hide_secrets(_logger: Any, _method: str, event: EventDict) -> EventDict:
    """Nothing is written that is named as a secret."""
    return {key: "(hidden)" if key.lower() in SECRETS else value for key, value in event.items()}


@dataclass
class _Bucket:
    tokens: float
    filled_s: float
    held_back: int = 0


class RateLimiter:
    """Holds back lines of a kind (level and event) that comes too often, and counts them; `clock` is monotonic, s.

    The next line of that kind that passes tells how many were held back before it; `take_held_back` tells of those
    after which none has come yet.
    """

    def __init__(self, clock: Callable[[], float], burst: int = BURST, refill_s: float = REFILL_S) -> None:
        self._clock = clock
        self._burst = burst
        self._refill_s = refill_s
        self._buckets: dict[tuple[str, str], _Bucket] = {}

    def __call__(self, _logger: Any, method: str, event: EventDict) -> EventDict:
        """Pass the line on, or raise structlog.DropEvent."""
        now_s = self._clock()
        bucket = self._buckets.setdefault((method, str(event.get("event"))), _Bucket(self._burst, now_s))
        bucket.tokens = min(bucket.tokens + (now_s - bucket.filled_s) / self._refill_s, self._burst)
        bucket.filled_s = now_s
        if bucket.tokens < 1.0:
            bucket.held_back += 1
            raise structlog.DropEvent
        bucket.tokens -= 1.0
        if bucket.held_back:
            event["held_back"], bucket.held_back = bucket.held_back, 0
        return event

    def take_held_back(self) -> dict[str, int]:
        """How many lines of each event were held back and not told of yet; they then are."""
        found: dict[str, int] = {}
        for (_, event), bucket in self._buckets.items():
            if bucket.held_back:
                found[event] = found.get(event, 0) + bucket.held_back
                bucket.held_back = 0
        return found


def with_priority(_logger: Any, method: str, text: str) -> str:
    """The text as the journal wants it: its priority before each line."""
    priority = PRIORITIES.get(method, 6)
    return "\n".join(f"<{priority}>{line}" for line in text.splitlines())


class LossyStream:
    """A stream for the log that may fail: the robot goes on when the disk is full or the reader has gone."""

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream

    def write(self, text: str) -> None:
        with suppress(OSError, ValueError):  # ValueError: it has been closed
            self._stream.write(text)

    def flush(self) -> None:
        with suppress(OSError, ValueError):
            self._stream.flush()


def is_journal(stream: TextIO, environment: Mapping[str, str], stat: Callable[[int], Any]) -> bool:
    """Whether the stream leads to the journal: JOURNAL_STREAM names its device and inode (systemd.exec(5)).

    The variable alone does not tell: a shell under systemd hands it on to everything that it starts.
    """
    try:
        status = stat(stream.fileno())
    except (OSError, ValueError):
        return False
    return environment.get("JOURNAL_STREAM") == f"{status.st_dev}:{status.st_ino}"
