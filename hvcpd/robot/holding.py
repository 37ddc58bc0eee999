"""Whether the robot stands still for what may be "stop", which several detectors report independently."""

from __future__ import annotations

from hvcpd.recognition.events import Held, KeywordEvent, Released


class Holding:
    """Push each detector's events; the robot stands still until none of them holds it any longer, or one is sure."""

    def __init__(self) -> None:
        self._detectors: set[object] = set()
        self.since_s: float | None = None
        """Since when it stands still, s; None if it need not."""

    def take(self, event: KeywordEvent, detector: object, now: float) -> float | None:
        """Returns since when it stood still, s, if this event ends that."""
        if isinstance(event, Held):
            self._detectors.add(detector)
            self.since_s = now if self.since_s is None else self.since_s
            return None
        self._detectors.discard(detector)
        if isinstance(event, Released) and self._detectors:
            return None
        self._detectors.clear()
        since_s, self.since_s = self.since_s, None
        return since_s
