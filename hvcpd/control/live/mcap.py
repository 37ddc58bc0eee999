"""`hvcpctl mcap`: a recorded mission, or a shift that `hvcpctl follow --json` printed, for Foxglove."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from hvcpd.config.files import write_whole
from hvcpd.errors import ConfigError, writing
from hvcpd.hardware.soundfile import read_wav
from hvcpd.reporting.mcap_file import Message, of_event, of_sound, of_trail, write_mcap
from hvcpd.reporting.text import plural
from hvcpd.reporting.transcript import in_words, objects, read_trails

LAST_S = 2.0**64 / 1e9
"""Seconds that an unsigned 64-bit number of nanoseconds holds (https://mcap.dev/spec, "Message")."""


def run(options: argparse.Namespace) -> None:
    """Read the whole recording, then write the whole file."""
    messages = [*messages_of(options.recording)]
    if not messages:
        raise ConfigError(f"{options.recording} has no events")
    with writing(options.output, ConfigError):
        write_whole(options.output, write_mcap(messages))
    sys.stdout.write(f"{options.output}: {plural(len(messages), 'message')}\n")


def messages_of(recording: Path) -> Iterator[Message]:
    """Yield all that a mission's folder, or a file of a robot's events, has. Raises ConfigError."""
    if not recording.is_dir():
        yield from _of_lines(recording)
        return
    yield from _of_lines(recording / "transcript.jsonl")
    trails, sound = recording / "trails.jsonl", recording / "mission.wav"
    if trails.is_file():
        for trail in read_trails(trails):
            yield from of_trail(trail)
    if sound.is_file():
        yield from of_sound(read_wav(sound))


def _of_lines(path: Path) -> Iterator[Message]:
    for number, event in objects(path, growing=True):
        at_s = event.get("wall_s", event.get("at_s")) if event.get("event") != "summary" else None
        try:
            if at_s is not None:
                yield from of_event(event, _time_s(at_s))
        except (ValueError, OverflowError, TypeError, KeyError, AttributeError) as error:
            raise ConfigError(f"{path}, line {number}: no event ({in_words(error)})") from None


def _time_s(value: Any) -> float:
    """Seconds since 1970 or since a mission's beginning. Raises ValueError for what MCAP's 64-bit nanoseconds lack."""
    at_s = float(value)
    if not 0.0 <= at_s < LAST_S:
        raise ValueError(f"its time is {value!r}")
    return at_s
