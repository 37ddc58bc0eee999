"""Handlers of signals for a while: Ctrl-C while a program is still being imported, or while it must end in order.

Imports nothing that takes time, since an interrupt of its own import is a traceback.
"""

from __future__ import annotations

import signal
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress


@contextmanager
def unwrapped() -> Iterator[None]:
    """Pass on the exception of a signal that came while a class was made: up to 3.11 Python raises a RuntimeError for
    one that comes out of a field's `__set_name__` (cpython 77757)."""
    try:
        yield
    except RuntimeError as error:
        if isinstance(error.__cause__, KeyboardInterrupt | SystemExit):
            raise error.__cause__ from None
        raise


@contextmanager
def handled(handler: signal._HANDLER, *numbers: signal.Signals) -> Iterator[None]:
    """A context in which these signals have another handler, which processes started in it inherit if it is SIG_IGN."""
    before = {number: signal.signal(number, handler) for number in numbers}
    try:
        yield
    finally:
        for number, usual in before.items():
            signal.signal(number, usual)


@contextmanager
def interrupt_ends() -> Iterator[None]:
    """A context in which SIGINT ends the process at once, as the kernel does it (130 in a shell), without a traceback.

    Nothing is open yet that must be closed. If SIGINT is ignored or handled otherwise, or in another thread than the
    main one, nothing changes."""
    with ExitStack() as stack:
        if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
            with suppress(ValueError):  # only the main thread may handle signals
                stack.enter_context(handled(signal.SIG_DFL, signal.SIGINT))
        yield
