"""`hvcpctl transcript`: what a robot said and heard, from its memory, also while its daemon runs."""

from __future__ import annotations

import argparse
import json
import re
import sys
import time
from collections.abc import Callable
from contextlib import closing
from dataclasses import asdict
from datetime import datetime
from pathlib import Path

from hvcpd.config.settings import load_settings
from hvcpd.errors import EX_OK, ConfigError
from hvcpd.store import TranscriptReader, TranscriptRow

POLL_S = 0.2
"""So often `--follow` looks for new lines: a sentence lasts seconds."""

_UNITS_S = {"s": 1.0, "m": 60.0, "h": 3600.0, "d": 86400.0}


def memory_of(options: argparse.Namespace) -> Path:
    """The file that the options mean: named, or that of the robot in the settings."""
    if options.memory is not None:
        return Path(options.memory)
    settings = load_settings(options.config, {"name": options.name}, name_needed=False)
    return settings.state_dir / f"{settings.name.lower()}.sqlite3"


def since_wall_s(text: str | None, now_s: float) -> float:
    """`8h`, `30m`, `90s`, `2d` ago, or a time as ISO 8601 has it, in seconds since 1970. Raises ConfigError."""
    if text is None:
        return float("-inf")
    ago = re.fullmatch(r"(\d{1,9}(?:\.\d{1,6})?)([smhd])", text)
    if ago:
        return now_s - float(ago[1]) * _UNITS_S[ago[2]]
    try:
        return datetime.fromisoformat(text).timestamp()
    except (ValueError, OverflowError, OSError):
        raise ConfigError(f"--since {text}: give how long ago, as 30m or 8h, or a time, as 2026-11-21T08:00") from None


def run(
    options: argparse.Namespace,
    now_s: Callable[[], float] = time.time,
    wait: Callable[[float], None] = time.sleep,
) -> int:
    """Print the transcript, and with --follow whatever is added to it, until interrupted."""
    since_s = since_wall_s(options.since, now_s())
    with closing(TranscriptReader(memory_of(options))) as reader:
        last = 0
        while True:
            for row in reader.rows(last, since_s):
                last = row.number
                sys.stdout.write(line_of(row, options.json) + "\n")
            sys.stdout.flush()
            if not options.follow:
                return EX_OK
            wait(POLL_S)


def line_of(row: TranscriptRow, as_json: bool) -> str:
    """One utterance for people, or as a JSON object."""
    record = row.record
    if as_json:
        return json.dumps({"number": row.number, "wall_s": row.wall_s, **asdict(record)})
    at = datetime.fromtimestamp(row.wall_s).strftime("%Y-%m-%d %H:%M:%S") if row.wall_s else f"{record.at_s:19.1f}"
    sure = f"  ({record.confidence:.0%})" if record.confidence is not None else ""
    return f"{at}  {record.kind:7}  {_plain(record.text) or '…'}{sure}"


def _plain(text: str) -> str:
    """Without characters that a terminal would obey: the file may come from elsewhere."""
    return "".join(c if c.isprintable() else "\N{REPLACEMENT CHARACTER}" for c in text)
