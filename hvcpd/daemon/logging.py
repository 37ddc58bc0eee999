"""What the daemon says of itself in its log: one line an event, for people on a terminal, else as logfmt or JSON."""

from __future__ import annotations

import logging
import os
import sys
import time
from collections.abc import Callable, Mapping
from typing import Any, Literal, TextIO, cast

import structlog

from hvcpd.config.tasks import TaskRepository
from hvcpd.coordination.actions import SavePeer, SaveTask
from hvcpd.daemon.log_lines import LossyStream, RateLimiter, clean_values, hide_secrets, is_journal, with_priority
from hvcpd.reporting.jsonlines import as_strict_json
from hvcpd.robot.records import (
    DoubtRecord,
    EchoRecord,
    GarbledRecord,
    HeardRecord,
    HoldRecord,
    PerformedRecord,
    Record,
    SaidRecord,
    VoiceRecord,
)

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
    that come too often, for `tell_held_back` and for setting it up anew.
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
    processors += [structlog.processors.format_exc_info, clean_values, _renderer(form, out.isatty())]
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


def tell_held_back(limiter: RateLimiter) -> None:
    """One line on every kind of line that was held back."""
    for event, count in limiter.take_held_back().items():
        _log.warning("lines held back", of=event, count=count)


def tell(record: Record, tasks: TaskRepository) -> None:
    """One line on what the robot said, heard or did."""
    match record:
        case SaidRecord():
            _log.info("said", text=record.text, at_s=_s(record.at_s), duration_s=_s(record.duration_s))
        case HeardRecord():
            _log.info(
                "heard",
                text=record.text,
                speaker=record.utterance.speaker,
                confidence=round(record.confidence, 3),
                snr_db=round(record.snr_db, 1),
                voice=record.voice,
                at_s=_s(record.start_s),
            )
        case GarbledRecord():
            _log.info("garbled", at_s=_s(record.start_s), duration_s=_s(record.end_s - record.start_s))
        case EchoRecord():
            _log.warning(
                "heard its own words late", at_s=_s(record.start_s), duration_s=_s(record.end_s - record.start_s)
            )
        case HoldRecord(at_s, until_s):
            _log.info("stood still for what sounded like stop", at_s=_s(at_s), duration_s=_s(until_s - at_s))
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
        case PerformedRecord():
            _log.info("performed", task=record.task, name=_name(record.task, tasks), at_s=_s(record.at_s))
        case SaveTask():
            _log.info(
                "task", number=record.number, name=_name(record.number, tasks), state=record.state, owner=record.owner
            )
        case SavePeer():
            _log.debug("peer", name=record.name, team=record.team, heard_at_s=_s(record.heard_at_s))


def _s(seconds: float) -> float:
    return round(seconds, 2)


def _name(number: int, tasks: TaskRepository) -> str | None:
    task = tasks.by_number(number)
    return task.name if task is not None else None
