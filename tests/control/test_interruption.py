"""Ctrl-C before a program has begun."""

from __future__ import annotations

import signal
import subprocess
import sys
import threading
from collections.abc import Iterator

import pytest

from hvcpd.config.interruption import interrupt_ends

INTERRUPTED = """
import os, signal, sys

class Interrupts:  # as the user does, when this module is looked for
    @staticmethod
    def find_spec(name, path=None, target=None):
        if name == {module!r}:
            os.kill(os.getpid(), signal.SIGINT)

signal.signal(signal.SIGINT, signal.default_int_handler)  # where tests run in a shell's background it is ignored
sys.meta_path.insert(0, Interrupts)
from {program} import main
sys.exit(main({arguments!r}))
"""


@pytest.fixture(autouse=True)
def by_python() -> Iterator[None]:
    """SIGINT as Python handles it by itself; it is ignored where tests run in a shell's background."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("program", "module"),
    [
        ("hvcpd.cli", "argparse"),
        ("hvcpd.cli", "hvcpd.errors"),
        ("hvcpd.cli", "hvcpd.daemon.allocator"),
        ("hvcpd.cli", "hvcpd.daemon.preflight"),
        ("hvcpd.control.cli", "argparse"),
        ("hvcpd.control.cli", "hvcpd.control.arguments"),
        ("hvcpd.control.cli", "hvcpd.control.simulate.simulate_parser"),
        ("hvcpd.control.cli", "hvcpd.language.phrasebook"),
    ],
)
def test_an_interrupt_while_python_imports_is_no_traceback(program: str, module: str) -> None:
    """Within the first 0.15 s it was one."""
    arguments = ["--name", "Rob", "--check"] if program == "hvcpd.cli" else ["phrases"]
    code = INTERRUPTED.format(module=module, program=program, arguments=arguments)
    ended = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=120, check=False)
    assert ended.returncode in (-signal.SIGINT, 128 + signal.SIGINT)  # both are 130 to a shell
    assert (ended.stdout, ended.stderr.strip()) == ("", "")


MAKES_A_CLASS = """
class Comes:
    def __set_name__(self, owner, name):
        os.kill(os.getpid(), {number})
class Interrupts:
    @staticmethod
    def find_spec(name, path=None, target=None):
        if name == {module!r}:
            type("Interrupted", (), dict(field=Comes()))
"""


@pytest.mark.slow
@pytest.mark.parametrize(
    ("program", "module", "number"),
    [
        ("hvcpd.cli", "hvcpd.daemon.preflight", signal.SIGINT),
        ("hvcpd.control.cli", "hvcpd.language.phrasebook", signal.SIGINT),
        ("hvcpd.control.cli", "hvcpd.language.phrasebook", signal.SIGTERM),
        ("hvcpd.control.cli", "hvcpd.language.phrasebook", signal.SIGHUP),
    ],
)
def test_a_signal_while_a_class_is_made_is_no_traceback(program: str, module: str, number: signal.Signals) -> None:
    """Once in some hundred commands that were ended while they began, it was one."""
    arguments = ["--name", "Rob", "--check"] if program == "hvcpd.cli" else ["phrases"]
    before, after = INTERRUPTED.format(module=module, program=program, arguments=arguments).split("signal.signal(")
    code = before + MAKES_A_CLASS.format(module=module, number=int(number)) + "signal.signal(" + after
    ended = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=120, check=False)
    assert ended.returncode in (-number, 128 + number)
    assert (ended.stdout, ended.stderr.strip()) == ("", "")


def test_who_handles_interrupts_goes_on_doing_so() -> None:
    taken: list[int] = []
    before = signal.signal(signal.SIGINT, lambda number, _: taken.append(number))
    try:
        with interrupt_ends():
            signal.raise_signal(signal.SIGINT)
    finally:
        signal.signal(signal.SIGINT, before)
    assert taken == [signal.SIGINT]


def test_afterwards_an_interrupt_is_pythons_again() -> None:
    with pytest.raises(KeyboardInterrupt):
        interrupt_after()


def interrupt_after() -> None:
    with interrupt_ends():
        assert signal.getsignal(signal.SIGINT) == signal.SIG_DFL
    signal.raise_signal(signal.SIGINT)


def test_in_another_thread_nothing_changes() -> None:
    seen: list[object] = []

    def enter() -> None:
        with interrupt_ends():
            seen.append(signal.getsignal(signal.SIGINT))

    thread = threading.Thread(target=enter)
    thread.start()
    thread.join(10.0)
    assert seen == [signal.default_int_handler]
