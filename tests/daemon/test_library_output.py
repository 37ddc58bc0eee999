"""What libraries write to file descriptor 2: gathered and counted; our own lines and tracebacks arrive."""

from __future__ import annotations

import subprocess
import sys

UNDERRUN = "ALSA lib pcm.c:8568:(snd_pcm_recover) underrun occurred"

PROGRAM = f"""
import ctypes, os, sys, threading
from hvcpd.daemon.library_output import LibraryOutput
from hvcpd.daemon.logging import set_up_logging
import structlog
limiter = set_up_logging("info", form="json")
log = structlog.get_logger()
output = LibraryOutput()
output.begin()
def complain(times, text={UNDERRUN!r}):
    for _ in range(times):
        ctypes.CDLL(None).dprintf(2, text.encode() + b"\\n")
"""


def lines_of(program: str, status: int = 0) -> list[str]:
    command = [sys.executable, "-c", PROGRAM + program]
    result = subprocess.run(command, capture_output=True, text=True, timeout=60)
    assert result.returncode == status, result.stderr
    return result.stderr.splitlines()


def test_a_flood_is_one_line_with_a_count_and_an_example() -> None:
    first, second = lines_of("""
for _ in range(40):
    complain(300)
    output.drain()
complain(2, "something else")
output.report()
output.report()
complain(3)
output.end()
""")
    assert '"lines": 12002' in first
    assert UNDERRUN in first
    assert '"lines": 3' in second


def test_who_writes_more_than_is_read_is_not_held_up() -> None:
    (line,) = lines_of("complain(10_000)\noutput.end()")
    assert UNDERRUN in line


def test_who_writes_as_fast_as_it_is_read_holds_up_nobody() -> None:
    """The event loop read on as long as there was anything: the robot hung, until systemd killed it."""
    (line,) = lines_of("""
class Flooded(LibraryOutput):
    def _take(self, line):
        super()._take(line)
        assert self._count < 10_000
        complain(1)
output.end()
output = Flooded()
output.begin()
complain(2)
output.drain()
output.report()
""")
    assert '"lines": 4' in line


def test_our_own_lines_and_what_comes_after_the_end_arrive() -> None:
    lines = lines_of("""
log.info("ours")
print("printed", file=sys.stderr)
os.write(2, b"unfinished")
output.end()
complain(1)
print("printed", file=sys.stderr)
""")
    assert '"event": "ours"' in lines[0]
    assert lines[1] == "printed"
    assert '"example": "unfinished"' in lines[2]
    assert lines[3:] == [UNDERRUN, "printed"]


def test_tracebacks_arrive() -> None:
    assert "ZeroDivisionError: division by zero" in lines_of("complain(1)\n1 / 0", status=1)
    lines = lines_of("threading.Thread(target=lambda: 1 / 0).start()")
    assert "ZeroDivisionError: division by zero" in lines


def test_a_crash_in_a_library_shows_where() -> None:
    lines = lines_of("ctypes.CDLL(None).abort()", status=-6)
    assert lines[0] == "Fatal Python error: Aborted"
    assert any("<string>" in line for line in lines)


def test_what_a_terminal_must_not_see_is_replaced() -> None:
    (line,) = lines_of('complain(1, "red \\x1b[31m" + 500 * "x")\noutput.end()')
    assert "\x1b" not in line
    assert len(line) < 500


def test_where_standard_error_is_not_descriptor_2_nothing_is_changed() -> None:
    program = "\noutput.end()\nsys.stderr = open('/dev/null', 'w')\noutput.begin()\ncomplain(1)\noutput.end()"
    assert lines_of(program) == [UNDERRUN]
