"""Whether the computer is too busy for sound: one alarm for many blocks that were lost or late."""

from __future__ import annotations

from collections import deque

import structlog

from hvcpd.hardware.audio_exchange import StreamCounters

RAISED_BY = 5
RAISED_WITHIN_S = 10
"""Window, s, in which seconds with a disturbed block are counted: one stall, however long, is one or two. At a load of
5 to 13 two robots had one such second in ten (docs/daemon.md), and understood each other."""
CLEARED_BY = 2
CLEARED_WITHIN_S = 30
"""The alarm ends when at most CLEARED_BY of the last CLEARED_WITHIN_S seconds had a disturbed block: hardly one in
three of the longest sentences."""

TOO_BUSY = "the computer is too busy"

_log = structlog.get_logger(__name__)


class Overload:
    """`note` each block; while `standing`, the alarm is raised. Times are seconds of sound that came."""

    def __init__(self) -> None:
        self._disturbed_s: deque[int] = deque()
        self._since_s: float | None = None
        self._blocks = 0

    @property
    def standing(self) -> bool:
        """Whether sound is lost or late so often that what is heard proves little."""
        return self._since_s is not None

    def note(self, now_s: float, before: StreamCounters, after: StreamCounters) -> None:
        """A block came at `now_s`, between these counts of what was lost."""
        if is_disturbed(before, after):
            self._blocks += 1
            if not self._disturbed_s or self._disturbed_s[-1] < int(now_s):
                self._disturbed_s.append(int(now_s))
        while self._disturbed_s and now_s - self._disturbed_s[0] > CLEARED_WITHIN_S:
            self._disturbed_s.popleft()
        if self._since_s is None:
            self._raise(now_s)
        elif now_s - self._since_s >= CLEARED_WITHIN_S and len(self._disturbed_s) <= CLEARED_BY:
            _log.info("the computer keeps up again", after_s=round(now_s - self._since_s, 1), disturbed=self._blocks)
            self._since_s = None
        if self._since_s is None and not self._disturbed_s:
            self._blocks = 0

    def _raise(self, now_s: float) -> None:
        recent = sum(now_s - at_s <= RAISED_WITHIN_S for at_s in self._disturbed_s)
        if recent < RAISED_BY:
            return
        self._since_s = now_s
        _log.warning(
            TOO_BUSY,
            disturbed=self._blocks,
            remedy="sound is lost or late; end other programs, or give the robot a faster computer",
        )


def is_disturbed(before: StreamCounters, after: StreamCounters) -> bool:
    """Whether sound was lost or late between two counts. Silence that evens out two clocks is neither."""
    if before is after:
        return False
    lost = ("input_dropped", "output_dropped", "output_late", "card_overflows", "card_underflows", "card_lost")
    return any(getattr(after, name) > getattr(before, name) for name in lost)
