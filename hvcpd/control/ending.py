"""What `hvcpctl` does when a signal ends it."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

ENDING = (signal.SIGTERM, signal.SIGHUP)
"""From `kill`, `timeout` or systemd, and from a terminal that is closed."""


class _Ended(SystemExit):
    """Only this kind of exception, and KeyboardInterrupt, passes from a task through asyncio at once."""

    def __init__(self, number: int) -> None:
        super().__init__(128 + number)
        self.number = number


def _end(number: int, _: FrameType | None) -> None:
    signal.signal(number, signal.SIG_IGN)  # both the shell and the kernel may tell that a terminal is closed
    if signal.getsignal(signal.SIGTERM) not in (_end, signal.SIG_IGN, signal.SIG_DFL):
        signal.raise_signal(signal.SIGTERM)  # the command has its own way to end, as the console's server has
    else:
        raise _Ended(number)


@contextmanager
def ending_in_order() -> Iterator[None]:
    """Have the process leave all its `with` and `finally` blocks before a signal ends it: they delete temporary
    folders, end other processes, and stop wheels. A signal that is ignored stays so (nohup)."""
    if threading.current_thread() is not threading.main_thread():  # no other may take signals
        yield
        return
    taken = [number for number in ENDING if signal.getsignal(number) == signal.SIG_DFL]
    for number in taken:
        signal.signal(number, _end)
    ended: int | None = None
    try:
        yield
    except _Ended as end:
        ended = end.number
    finally:
        for number in taken:
            signal.signal(number, signal.SIG_DFL)
    if ended is not None:
        signal.raise_signal(ended)  # so that systemd, or a shell, knows why
