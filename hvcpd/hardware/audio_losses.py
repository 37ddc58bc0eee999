"""How much sound a card lost, if it only reports that it lost some."""

from __future__ import annotations

from collections.abc import Callable

SMOOTH = 1.0 / 200.0
"""Weight of a block in the mean of the clock's lead: over about 5 s, in which two clocks 100 ppm apart stray by 0.5
ms."""
MOST_LOST_S = 10.0
"""A longer stay away is the watchdog's, and not told by an overflow."""


class CaptureClock:
    """Compares the samples that came with the time that passed. `clock` is monotonic, s."""

    def __init__(self, rate_hz: int, clock: Callable[[], float]) -> None:
        self._rate_hz = rate_hz
        self._clock = clock
        self._captured = 0
        self._lead: float | None = None

    def block(self, read: int, waiting: int, overflowed: bool) -> int:
        """Take the number of samples read and of those that wait now; return how many were lost before: 0 without an
        overflow."""
        self._captured += read
        lead = self._clock() * self._rate_hz - self._captured - waiting
        if self._lead is None:
            self._lead = lead
        if not overflowed:
            self._lead += SMOOTH * (lead - self._lead)
            return 0
        lost = min(max(round(lead - self._lead), 0), round(MOST_LOST_S * self._rate_hz))
        self._captured += lost
        return lost
