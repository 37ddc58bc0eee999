"""The transcript: what was said, who heard it, what was garbled, how the tasks went; one JSON object a line."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from hvcpd.reporting.events import Event, Moved, Summary
from hvcpd.reporting.files import write_whole
from hvcpd.reporting.jsonlines import line


def write_transcript(events: Iterable[Event], path: Path) -> None:
    """Write the events but for the robots' moves, by their time, the summary last. Raises OSError."""
    kept = [event for event in events if not isinstance(event, Moved)]
    in_order = sorted((event for event in kept if not isinstance(event, Summary)), key=lambda event: event.at_s)
    last = [event for event in kept if isinstance(event, Summary)]
    write_whole(path, "".join(map(line, [*in_order, *last])).encode("utf-8"))
