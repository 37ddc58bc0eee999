"""Drive fakes by the real clock, for software that runs in real time."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable

PERIOD_S = 0.005
"""Step of the motors' time; small against their time constant of 0.1 s."""
LONGEST_STEP_S = 0.02
"""When this thread was kept from running for longer, so was the rest of the fake, and what was sent to the motors
meanwhile still waits to be heard: their time then falls behind the clock instead of passing without those words."""


class RealTimePump:
    """Calls `advance(dt_s)` from a thread of its own, as fast as real time passes, or slower on a busy machine.

    with FakeBus(turtlebot3_pair()) as bus, RealTimePump(bus.advance):
        ...
    """

    def __init__(self, advance: Callable[[float], None], period_s: float = PERIOD_S) -> None:
        self._advance = advance
        self._period_s = period_s
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, name="fake-motor-time", daemon=True)

    def __enter__(self) -> RealTimePump:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._stop.set()
        self._thread.join()

    def _run(self) -> None:
        last_s = time.monotonic()
        while not self._stop.wait(self._period_s):
            now_s = time.monotonic()
            self._advance(min(now_s - last_s, LONGEST_STEP_S))
            last_s = now_s
