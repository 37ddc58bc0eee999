"""The conversation as the page lists it: numbered lines, many of them kept, few sent at a time."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping
from typing import Any

from hvcpd.reporting.palette import robot_slot
from hvcpd.reporting.text import clean, how_sure, skill_words

Line = dict[str, Any]

MAX_LINES = 40_000
"""Lines kept: a day of a busy team, about 20 MB."""
PAGE_LINES = 150
"""Lines sent at a time: a few screens full."""
SURE = 0.9
"""Confidence below which a sentence is marked as doubtful; the recogniser reports sentences from 0.75."""


class SpeakerColours:
    """The colour of each speaker, assigned in the order in which they appear."""

    def __init__(self) -> None:
        self._colours: dict[str, int] = {}

    def of(self, name: str) -> int:
        """The colour's number: see `hvcpd.reporting.palette`."""
        return self._colours.setdefault(name.lower(), robot_slot(len(self._colours)))


class Lines:
    """The newest MAX_LINES lines, each with a fixed number, counted from 0."""

    def __init__(self) -> None:
        self._lines: deque[Line] = deque(maxlen=MAX_LINES)
        self._next = 0

    @property
    def first(self) -> int:
        """The number of the oldest line that is kept."""
        return self._next - len(self._lines)

    def add(self, line: Line) -> Line:
        """Number a line and keep it."""
        line["n"] = self._next
        self._next += 1
        self._lines.append(line)
        return line

    def page(self, before: int | None = None, after: int | None = None) -> list[Line]:
        """At most PAGE_LINES lines, in their order: those right after the line `after`, or right before the line
        `before`, or the newest."""
        if after is not None:
            begin = max(after + 1 - self.first, 0)
            return [self._lines[i] for i in range(begin, min(begin + PAGE_LINES, len(self._lines)))]
        end = len(self._lines) if before is None else min(max(before - self.first, 0), len(self._lines))
        return [self._lines[i] for i in range(max(end - PAGE_LINES, 0), end)]


Event = Mapping[str, Any]
Mark = dict[str, str]
Sort = tuple[str, str | None, str, list[Mark]]


def is_passing(event: Event) -> bool:
    """Whether the event only reports a skill's progress, which gets no line."""
    return event.get("event") == "skill" and event.get("state") in ("initializing", "running") and bool(event["share"])


def line_of(event: Event, at_s: float, colours: SpeakerColours, task: Callable[[int], str]) -> Line | None:
    """The line for a daemon's event (docs/control.md), None if it has none; `task` tells a task as people do.

    `at_s` is when it was, as the page counts. Text is as it was heard, cleaned of what steers a terminal; the page
    shows it as text and never as markup.
    """
    told = _told(event, task) if not is_passing(event) else None
    return make_line(at_s, *told, colours.of) if told is not None else None


def make_line(
    at_s: float, sort: str, who: str | None, text: str, marks: list[Mark], slot_of: Callable[[str], int | None]
) -> Line:
    """A line as the page takes it; `slot_of` tells a speaker's colour."""
    slot = slot_of(who) if who else None
    return {
        "at_s": round(at_s, 3),
        "sort": sort,
        "who": who and clean(who),
        "slot": slot,
        "text": clean(text),
        "marks": marks,
    }


def mark(kind: str, text: str) -> Mark:
    """The small print below a line: good, unsure, odd (understood differently) or bad."""
    return {"kind": kind, "text": text}


def seal_notes(seal: str | None) -> list[Mark]:
    """The small print about a sentence's seal; nothing if it has none."""
    return [mark("bad" if seal == "not trusted" else "good", clean(seal))] if seal else []


def confidence_note(confidence: float | None, snr_db: float | None = None) -> Mark:
    """The small print about a sentence's confidence."""
    return mark("good" if (confidence or 0.0) >= SURE else "unsure", how_sure(confidence, snr_db))


def _told(event: Event, task: Callable[[int], str]) -> Sort | None:
    match event.get("event"):
        case "said":
            return "said", event["speaker"], event["text"], seal_notes(event.get("seal"))
        case "heard":
            marks = [confidence_note(event["confidence"], event["snr_db"]), *seal_notes(event.get("seal"))]
            return "heard", event["speaker"], event["text"], marks
        case "garbled":
            return "garbled", None, "Somebody spoke and was not understood", []
        case "held":
            length_s = event["until_s"] - event["at_s"]
            return "act", None, f"Stood still for {length_s:.1f} s for what sounded like “stop”", []
        case "noted":
            return "note", None, event["text"], []
        case "performed":
            return "act", event["robot"], f"has carried out {task(event['task'])}", []
        case "skill":
            sort = "note" if event["state"] == "failed" else "act"
            return sort, event["robot"], skill_words(event), []
        case _:
            return None


def line_of_row(row: Event, colours: SpeakerColours) -> Line:
    """The line for a row of a daemon's transcript."""
    kind, text, who = row["kind"], row["text"], row["speaker"]
    marks = [confidence_note(row["confidence"])] if row["confidence"] is not None else []
    marks += seal_notes(row.get("seal"))
    if kind == "garbled":
        who, kind, text = None, "note" if text else kind, text or "Somebody spoke and was not understood"
    elif kind == "heard":
        who = who or "somebody"
    return make_line(row["wall_s"] or 0.0, kind, who, text, marks, colours.of)
