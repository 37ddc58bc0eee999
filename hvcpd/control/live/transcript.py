"""`hvcpctl transcript`: what a robot said and heard, asked of its daemon or else read from its memory file."""

from __future__ import annotations

import argparse
import re
import time
from collections.abc import Callable, Iterable, Mapping
from contextlib import closing, suppress
from dataclasses import asdict
from datetime import datetime
from functools import cached_property
from pathlib import Path
from typing import Any

from hvcpd.config.tasks import TaskDefinition
from hvcpd.control.live.daemon_client import DaemonClient, find_daemon, meant
from hvcpd.control.output import show
from hvcpd.errors import ConfigError, NotAllowedError, NotRunningError
from hvcpd.language.forms import SEALED_KINDS
from hvcpd.language.phrasebook import WORDS, Vocabulary
from hvcpd.memory.store import TranscriptReader, TranscriptRecord, TranscriptRow
from hvcpd.reporting.text import clean, seal_words

POLL_S = 0.2
"""Interval at which `--follow` looks for new lines: a sentence lasts seconds."""

_UNITS_S = {"s": 1.0, "m": 60.0, "h": 3600.0, "d": 86400.0}


class AskedRows:
    """The transcript that a daemon has; the service's file may be nobody else's to read."""

    def __init__(self, daemon: DaemonClient) -> None:
        self._daemon = daemon

    def rows(self, after: int = 0, since_wall_s: float = float("-inf")) -> tuple[TranscriptRow, ...]:
        """As `TranscriptReader`'s. Raises NotRunningError once the daemon has ended."""
        found: list[TranscriptRow] = []
        since = {"since_s": since_wall_s} if since_wall_s > 0 else {}
        while True:
            page = self._daemon.ask("transcript", after=found[-1].number if found else after, **since)["rows"]
            if not page:
                return tuple(found)
            found += [_row(each) for each in page]

    def tasks(self) -> tuple[TaskDefinition, ...]:
        """What can be said and counted of the robot's tasks, which need not be those of the settings here."""
        return tuple(
            TaskDefinition(each["number"], each["name"], None, (), each["icon"], robots=each.get("robots", 1))
            for each in self._told["tasks"]
        )

    def vocabulary(self, speakers: Iterable[str]) -> Vocabulary:
        """The robot's words, with the names of `speakers`; of an older daemon without those of `WORDS`."""
        told = self._told
        settings = {each["key"]: each["value"] for each in self._daemon.ask("config")["settings"]}
        names = {name.lower(): name for name in (*speakers, *settings["names"])}
        words = {kind: tuple(told.get("words", {}).get(kind, ())) for kind in WORDS}
        return Vocabulary(
            tuple(names.values()),
            tuple(settings["teams"]),
            tuple(each["name"] for each in told["tasks"]),
            tuple(each["number"] for each in told["tasks"]),
            **words,
            kinds=SEALED_KINDS,
        )

    @cached_property
    def _told(self) -> dict[str, Any]:
        """The daemon's answer about tasks, which does not change while the transcript is described."""
        return self._daemon.ask("tasks")

    def close(self) -> None:
        """Close the connection."""
        self._daemon.close()


def open_transcript(options: argparse.Namespace) -> AskedRows | TranscriptReader:
    """The memory that the options select: the given file, the running robot's, or that of the robot in the settings."""
    if options.memory is not None:
        return TranscriptReader(Path(options.memory))
    if options.socket is not None:
        return AskedRows(find_daemon(options))
    where = meant(options)
    with suppress(NotRunningError, NotAllowedError):
        return AskedRows(find_daemon(options, where))
    return TranscriptReader(where.memory_path)


def _row(each: Mapping[str, Any]) -> TranscriptRow:
    record = {key: value for key, value in each.items() if key not in ("number", "wall_s")}
    return TranscriptRow(each["number"], each["wall_s"], TranscriptRecord(**record))


def since_wall_s(text: str | None, now_s: float) -> float:
    """`8h`, `30m`, `90s`, `2d` ago, or a time as ISO 8601 has it, in seconds since 1970. Raises ConfigError."""
    if text is None:
        return float("-inf")
    ago = re.fullmatch(r"(\d{1,9}(?:\.\d{1,6})?)([smhd])", text)
    if ago:
        return max(now_s - float(ago[1]) * _UNITS_S[ago[2]], 0.0)
    try:
        return max(datetime.fromisoformat(text).timestamp(), 0.0)
    except (ValueError, OverflowError, OSError):
        raise ConfigError(f"--since {text}: give how long ago, as 30m or 8h, or a time, as 2026-11-21T08:00") from None


def run(
    options: argparse.Namespace, now_s: Callable[[], float] = time.time, wait: Callable[[float], None] = time.sleep
) -> None:
    """Print the transcript, and with --follow whatever is added to it, until interrupted."""
    since_s = since_wall_s(options.since, now_s())
    with closing(open_transcript(options)) as reader:
        last = 0
        while True:
            for row in reader.rows(last, since_s):
                last = row.number
                fields = {"number": row.number, "wall_s": row.wall_s, **asdict(row.record)}
                show(options.json, fields, line_of(row))
            if not options.follow:
                return
            wait(POLL_S)


def line_of(row: TranscriptRow) -> str:
    """One utterance for people."""
    record = row.record
    at = datetime.fromtimestamp(row.wall_s).strftime("%Y-%m-%d %H:%M:%S") if row.wall_s else f"{record.at_s:19.1f}"
    sure = f"  ({record.confidence:.0%})" if record.confidence is not None else ""
    seal = f"  {seal_words(clean(record.seal))}" if record.seal else ""
    kind = "noted" if record.kind == "garbled" and record.text else record.kind
    return f"{at}  {kind:7}  {clean(record.text) or '…'}{sure}{seal}"
