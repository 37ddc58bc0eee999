"""The daemon's log: one line an event, for people on a terminal, otherwise as logfmt or JSON.

Nothing in a line can forge another one, tell a secret, or flood the disk.
"""

from __future__ import annotations

import logging
import math
import os
import sys
import time
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from typing import Any, Literal, TextIO, cast

import structlog
from structlog.typing import EventDict

from hvcpd.config.tasks import TaskRepository
from hvcpd.coordination.actions import SavePeer, SaveTask
from hvcpd.reporting.jsonlines import as_strict_json
from hvcpd.reporting.text import clean
from hvcpd.robot.records import (
    DoubtRecord,
    EchoRecord,
    GarbledRecord,
    HeardRecord,
    HoldRecord,
    PerformedRecord,
    RangeRecord,
    Record,
    SaidRecord,
    SkillRecord,
    StuckRecord,
    UnsaidRecord,
    VoiceRecord,
)

PRIORITIES = {"debug": 7, "info": 6, "warning": 4, "error": 3, "exception": 3, "critical": 2}
"""syslog's numbers, which the journal reads from "<N>" at the beginning of a line (sd-daemon(3))."""

MAX_VALUE_LENGTH = 2000
"""Characters of a value; the longest of ours is a message with all faults of a device, about 500."""
MAX_TRACE_LENGTH = 20_000
"""Of a traceback; the journal cuts a line at 48 KiB (journald.conf(5), LineMax)."""

SECRETS = frozenset({"key", "secret", "password", "code", "otp", "token"})
"""Names under which nothing is ever written."""

BURST = 20
"""Number of lines of one kind that may come in a row: five tasks, three retries and every peer's greeting fit."""
REFILL_S = 3.0
"""Interval after which one more line may come. A sentence lasts as long, so no conversation is cut."""


def clean_values(_logger: Any, _method: str, event: EventDict) -> EventDict:
    """Escape line breaks and control characters, and truncate long values; only a traceback keeps its lines."""
    return {key: _cleaned(key, value) for key, value in event.items()}


def _cleaned(key: str, value: Any) -> Any:
    if isinstance(value, float) and not math.isfinite(value):
        return None
    if value is None or isinstance(value, bool | int | float):
        return value
    text = str(value)
    if key == "exception":
        return "\n".join(map(clean, text[-MAX_TRACE_LENGTH:].splitlines()))  # what was raised stands at its end
    return clean(text if len(text) <= MAX_VALUE_LENGTH else text[: MAX_VALUE_LENGTH - 1] + "…")


def leave_out_unknown(_logger: Any, _method: str, event: EventDict) -> EventDict:
    """Drop fields without a value from lines for people."""
    return {key: value for key, value in event.items() if value is not None}


def hide_secrets(_logger: Any, _method: str, event: EventDict) -> EventDict:
    """Redact fields whose names say that they are secret."""
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

    def __init__(self, clock: Callable[[], float]) -> None:
        self._clock = clock
        self._buckets: dict[tuple[str, str], _Bucket] = {}

    def __call__(self, _logger: Any, method: str, event: EventDict) -> EventDict:
        """Pass the line on, or raise structlog.DropEvent."""
        now_s = self._clock()
        bucket = self._buckets.setdefault((method, str(event.get("event"))), _Bucket(BURST, now_s))
        bucket.tokens = min(bucket.tokens + (now_s - bucket.filled_s) / REFILL_S, BURST)
        bucket.filled_s = now_s
        if bucket.tokens < 1.0:
            bucket.held_back += 1
            raise structlog.DropEvent
        bucket.tokens -= 1.0
        if bucket.held_back:
            event["held_back"], bucket.held_back = bucket.held_back, 0
        return event

    def take_held_back(self) -> dict[str, int]:
        """Number of lines of each event that were held back since the last call."""
        found: dict[str, int] = {}
        for (_, event), bucket in self._buckets.items():
            if bucket.held_back:
                found[event] = found.get(event, 0) + bucket.held_back
                bucket.held_back = 0
        return found


def with_priority(_logger: Any, method: str, text: str) -> str:
    """The text with the journal's priority before each line."""
    priority = PRIORITIES.get(method, 6)
    return "\n".join(f"<{priority}>{line}" for line in text.splitlines())


class LossyStream:
    """A stream for the log that ignores errors: the robot goes on if the disk is full or the reader has gone."""

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


LogFormat = Literal["auto", "console", "keyvalue", "json"]

HELD_BACK_EVERY_S = 60.0
"""Interval of reports on lines that were held back and after which none of their kind has come."""

_log = structlog.get_logger(__name__)


def set_up_logging(
    level: str,
    stream: TextIO | None = None,
    environment: Mapping[str, str] = os.environ,
    form: LogFormat = "auto",
    clock: Callable[[], float] = time.monotonic,
    limiter: RateLimiter | None = None,
) -> RateLimiter:
    """Log to `stream` (standard error by default), one line an event; see `log_format` in etc/hvcpd.yaml.

    Lines for the journal carry its priority instead of a time, which it has itself. Returns what holds back lines
    that come too often, for `log_held_back` and for setting it up anew.
    """
    out = stream or sys.stderr
    if form == "auto":
        form = "console" if out.isatty() else "keyvalue"
    journal = is_journal(out, environment, os.fstat)
    limiter = limiter or RateLimiter(clock)
    processors: list[Any] = [limiter, hide_secrets, structlog.processors.add_log_level]
    if not journal:
        short = form == "console" and out.isatty()
        processors.append(structlog.processors.TimeStamper(fmt="%H:%M:%S" if short else "iso", utc=False))
    processors += [structlog.processors.format_exc_info, clean_values]
    if form != "json":
        processors.append(leave_out_unknown)
    processors.append(_renderer(form, out.isatty()))
    if journal:
        processors.append(with_priority)
    structlog.configure(
        processors=processors,
        wrapper_class=structlog.make_filtering_bound_logger(getattr(logging, level.upper())),
        logger_factory=lambda *_: structlog.WriteLogger(cast(TextIO, LossyStream(stream or sys.stderr))),
        cache_logger_on_first_use=False,
    )
    return limiter


def _renderer(form: LogFormat, colors: bool) -> Any:
    if form == "json":
        return structlog.processors.JSONRenderer(serializer=lambda event, **_: as_strict_json(event))
    if form == "keyvalue":
        order = ["timestamp", "level", "event"]
        return structlog.processors.LogfmtRenderer(key_order=order, drop_missing=True, bool_as_flag=False)
    plain = structlog.dev.plain_traceback  # the others show the values of variables
    return structlog.dev.ConsoleRenderer(colors=colors, pad_event_to=12, exception_formatter=plain)


def log_held_back(limiter: RateLimiter) -> None:
    """Log a line for each kind of line that was held back."""
    for event, count in limiter.take_held_back().items():
        _log.warning("lines held back", of=event, count=count)


def log_record(record: Record, tasks: TaskRepository) -> None:
    """Log a record: something that the robot said, heard or did."""
    match record:
        case SaidRecord():
            at_s, duration_s = _s(record.at_s), _s(record.duration_s)
            _log.info("said", text=record.text, at_s=at_s, duration_s=duration_s, for_noise=record.for_noise or None)
        case HeardRecord():
            _log.info(
                "heard",
                text=record.text,
                speaker=record.utterance.speaker,
                confidence=round(record.confidence, 3),
                snr_db=round(record.snr_db, 1),
                voice=record.voice or None,
                at_s=_s(record.start_s),
            )
        case GarbledRecord():
            duration_s = _s(record.end_s - record.start_s)
            _log.info("garbled", at_s=_s(record.start_s), duration_s=duration_s, addressed=record.addressed or None)
        case HoldRecord(at_s, until_s):
            _log.info("stood still for what sounded like stop", at_s=_s(at_s), duration_s=_s(until_s - at_s))
        case RangeRecord():
            _log.info(
                "measured how far",
                peer=record.peer,
                distance_m=round(record.distance_m, 3),
                deviation_m=round(record.deviation_m, 3),
                sure=record.sure,
            )
        case PerformedRecord():
            _log.info("performed", task=record.task, name=_name(record.task, tasks), at_s=_s(record.at_s))
        case SaveTask():
            _log.info(
                "task", number=record.number, name=_name(record.number, tasks), state=record.state, owner=record.owner
            )
        case SavePeer():
            _log.debug("peer", name=record.name, team=record.team, heard_at_s=_s(record.heard_at_s))
        case _:
            _warn(record, tasks)


def _warn(record: Record, tasks: TaskRepository) -> None:
    """Log a record of something that went wrong."""
    match record:
        case UnsaidRecord(at_s, utterance):
            _log.warning("not said", sentence=utterance, reason="what it names was forgotten", at_s=_s(at_s))
        case EchoRecord():
            _log.warning(
                "heard its own words late", at_s=_s(record.start_s), duration_s=_s(record.end_s - record.start_s)
            )
        case DoubtRecord():
            _log.warning(
                "not believed",
                text=record.text,
                speaker=record.speaker,
                reason=record.why,
                not_listened_to_s=record.silence_s,
                at_s=_s(record.at_s),
            )
        case VoiceRecord():
            _log.warning(
                "another voice",
                speaker=record.speaker,
                voice=record.voice,
                expected=record.expected,
                at_s=_s(record.at_s),
            )
        case SkillRecord(at_s, call, report) if record.note is not None:
            _log.warning(
                "skill failed", skill=call.skill, task=call.task, reason=report.text or "not given", at_s=_s(at_s)
            )
        case StuckRecord(at_s, task, reason):
            _log.warning("driving failed", task=task, name=_name(task, tasks), reason=reason, at_s=_s(at_s))


def _s(seconds: float) -> float:
    return round(seconds, 2)


def _name(number: int, tasks: TaskRepository) -> str | None:
    task = tasks.by_number(number)
    return task.name if task is not None else None
