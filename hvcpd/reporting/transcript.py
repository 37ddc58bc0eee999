"""The record of a mission for programs: the transcript, and the robots' trails; one JSON object a line."""

from __future__ import annotations

import math
from collections.abc import Iterable
from pathlib import Path
from typing import Any, get_args

import cattrs
import numpy as np

from hvcpd.config.files import write_whole
from hvcpd.config.json_objects import json_object
from hvcpd.errors import ConfigError, unreadable
from hvcpd.reporting.events import Event, Moved, Summary, Trail
from hvcpd.reporting.jsonlines import as_strict_json, line
from hvcpd.reporting.simplify import simplified

LONGEST_S = 30 * 86_400.0
"""No mission is longer; whoever shows one goes through its times step by step."""

_KINDS: dict[str, type[Event]] = {each.__name__.lower(): each for each in get_args(Event) if each is not Moved}


def write_transcript(events: Iterable[Event], path: Path) -> None:
    """Write the events but for the robots' moves, by their time, the summary last. Raises OSError."""
    kept = [event for event in events if not isinstance(event, Moved)]
    kept.sort(key=lambda event: (True, 0.0) if isinstance(event, Summary) else (False, event.at_s))
    write_whole(path, "".join(map(line, kept)).encode("utf-8"))


def write_trails(trails: Iterable[Trail], path: Path) -> None:
    """Write the trails by the points that matter, a robot a line. Raises OSError."""
    kept = [simplified(trail) for trail in trails]
    rows = [{"robot": t.robot, "t_s": _rounded(t.t_s), "x_m": _rounded(t.x_m), "y_m": _rounded(t.y_m)} for t in kept]
    write_whole(path, "".join(as_strict_json(row) + "\n" for row in rows).encode("utf-8"))


def _rounded(values: Any) -> list[float]:
    return [round(float(value), 3) for value in values]


def read_transcript(path: Path) -> tuple[Event, ...]:
    """The events that `write_transcript` has written. Raises ConfigError, with the line that is wrong."""
    converter = cattrs.Converter()
    converter.register_structure_hook(float, lambda value, _: math.nan if value is None else float(value))
    converter.register_structure_hook(float | str, _plain)
    events: list[Event] = []
    for number, value in objects(path):
        kind = _KINDS.get(str(value.pop("event", None)))
        if kind is None:
            continue  # of a newer version
        try:
            events.append(converter.structure(value, kind))
        except (cattrs.BaseValidationError, TypeError, ValueError, KeyError) as error:
            wrong = cattrs.transform_error(error)[0].replace(" @ $.", ": ")
            raise ConfigError(
                f"{path}, line {number}: no {kind.__name__.lower()} as a mission has it ({wrong})"
            ) from None
    return tuple(events)


def _plain(value: Any, _: object) -> float | str:
    """A skill's argument or result; cattrs knows no rule of its own for a union of plain types."""
    return value if isinstance(value, str) else float(value)


def read_trails(path: Path) -> tuple[Trail, ...]:
    """The trails that `write_trails` has written. Raises ConfigError, with the line that is wrong."""
    trails = []
    for number, value in objects(path):
        try:
            columns = [np.asarray(value[key], np.float64) for key in ("t_s", "x_m", "y_m")]
            trails.append(Trail(str(value["robot"]), *columns))
        except (KeyError, TypeError, ValueError, OverflowError) as error:
            raise ConfigError(f"{path}, line {number}: no trail ({in_words(error)})") from None
        if len({column.shape for column in columns}) != 1 or columns[0].ndim != 1:
            raise ConfigError(f"{path}, line {number}: no trail (its columns differ in length)")
        t_s = columns[0]
        if not len(t_s) or t_s[0] < 0.0 or np.any(np.diff(t_s) < 0.0) or t_s[-1] > LONGEST_S:
            raise ConfigError(f"{path}, line {number}: no trail (its times are not those of a mission)")
        if not np.all(np.isfinite(columns)):
            raise ConfigError(f"{path}, line {number}: no trail (not all of it are numbers)")
    return tuple(trails)


def in_words(error: Exception) -> str:
    """What is wrong with the fields of a line, by the error of who reads them."""
    return f"{error} is missing" if isinstance(error, KeyError) else str(error)


def objects(path: Path, *, growing: bool = False) -> Iterable[tuple[int, dict[str, Any]]]:
    """Each line's number and JSON object. Raises ConfigError, with the line that is wrong.

    `growing`: a part of a line at the end is left out; who writes the file is still at it, or was killed.
    """
    what = "is this a transcript of `simulate --report`, or the output of `follow --json`?"
    try:
        lines = path.read_text(encoding="utf-8").splitlines(keepends=True)
    except OSError as error:
        raise ConfigError(f"{path}: {unreadable(error)}") from None
    except UnicodeDecodeError:
        raise ConfigError(f"{path}: this is no text; {what}") from None
    for number, text in enumerate(lines, 1):
        value = json_object(text)
        if value is None:
            if growing and not text.endswith("\n"):
                return
            raise ConfigError(f"{path}, line {number}: no JSON object; {what}")
        yield number, value
