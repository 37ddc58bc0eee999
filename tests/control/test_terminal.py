"""What follows a robot, when its reader goes away."""

from __future__ import annotations

import os
from contextlib import suppress

import pytest

from hvcpd.control.live.terminal import Terminal


def test_a_reader_that_goes_away_is_an_error_as_of_any_output() -> None:
    """`hvcpctl follow | head -1` ended with status 1, unlike `hvcpctl follow --json | head -1`."""
    reads, writes = os.pipe()
    os.close(reads)
    stream = os.fdopen(writes, "w")
    with pytest.raises(BrokenPipeError):
        Terminal(file=stream).print("Hi Rob")
    with suppress(BrokenPipeError):
        stream.close()
