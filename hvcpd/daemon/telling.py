"""What the daemon says of itself in its log: one line an event, for people on a terminal, as logfmt for a service."""

from __future__ import annotations

import logging
import os
import sys
from collections.abc import Mapping
from typing import Any, TextIO

import structlog

from hvcpd.config.tasks import TaskRepository
from hvcpd.coordination.actions import SavePeer, SaveTask
from hvcpd.records import GarbledRecord, HeardRecord, HoldRecord, PerformedRecord, Record, SaidRecord

_PRIORITIES = {"debug": 7, "info": 6, "warning": 4, "error": 3, "critical": 2}
"""syslog's numbers, which the journal reads from "<N>" at the beginning of a line (sd-daemon(3))."""

_log = structlog.get_logger(__name__)


def set_up_logging(level: str, stream: TextIO | None = None, environment: Mapping[str, str] = os.environ) -> None:
    """Log to `stream` (standard error by default): readable on a terminal, logfmt otherwise.

    Under systemd (JOURNAL_STREAM is set) lines carry the journal's priority instead of a time, which it has itself.
    """
    out = stream or sys.stderr
    journal = "JOURNAL_STREAM" in environment and not out.isatty()
    processors: list[Any] = [structlog.processors.add_log_level, structlog.processors.format_exc_info]
    if not journal:
        processors.append(structlog.processors.TimeStamper(fmt="iso" if not out.isatty() else "%H:%M:%S", utc=False))
    if out.isatty():
        processors[1:2] = []  # the console's renderer formats exceptions itself
        processors.append(structlog.dev.ConsoleRenderer(colors=True, pad_event_to=12))
    else:
        processors.append(
            structlog.processors.LogfmtRenderer(key_order=["timestamp", "level", "event"], drop_missing=True)
        )
    if journal:
        processors.append(_with_priority)
    structlog.configure(
        processors=processors,
        wrapper_class=structlog.make_filtering_bound_logger(getattr(logging, level.upper())),
        logger_factory=lambda *_: structlog.WriteLogger(stream or sys.stderr),
        cache_logger_on_first_use=False,
    )


def _with_priority(_logger: Any, method: str, line: str) -> str:
    priority = _PRIORITIES.get(method, 6)
    return "\n".join(f"<{priority}>{part}" for part in line.splitlines())


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
        case HoldRecord(at_s, until_s):
            _log.info("stood still for what sounded like stop", at_s=_s(at_s), duration_s=_s(until_s - at_s))
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
