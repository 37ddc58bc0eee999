"""How much was lost is told by the clock."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hvcpd.hardware.audio_losses import MOST_LOST_S, CaptureClock

RATE_HZ = 48_000
BLOCK = 1200


class Card:
    """Captures at a rate of its own, and keeps what is not read in a buffer; time passes as the test says."""

    def __init__(self, drift: float = 0.0) -> None:
        self.now_s = 500.0
        self.waiting = 0.0
        self._rate_hz = RATE_HZ * (1.0 + drift)
        self.clock = CaptureClock(RATE_HZ, lambda: self.now_s)

    def wait(self, duration_s: float) -> None:
        self.now_s += duration_s
        self.waiting += duration_s * self._rate_hz

    def lose(self, frames: int) -> None:
        self.waiting -= frames

    def read(self, overflowed: bool = False) -> int:
        while self.waiting < BLOCK:
            self.wait(0.0005)
        self.waiting -= BLOCK
        return self.clock.block(BLOCK, int(self.waiting), overflowed)


@given(st.lists(st.floats(0.0, 0.2), min_size=20, max_size=60), st.integers(0, 100_000), st.floats(-1e-4, 1e-4))
def test_what_was_lost_is_told_however_late_the_reader_comes(waits: list[float], lost: int, drift: float) -> None:
    card = Card(drift)
    for wait_s in waits:
        card.wait(wait_s)
        assert card.read() == 0
    card.wait((lost + BLOCK) / RATE_HZ)
    card.lose(lost)
    assert card.read(overflowed=True) == pytest.approx(lost, abs=BLOCK // 4 + 1e-4 * RATE_HZ * 12)
    assert card.read() == 0


def test_a_second_overflow_does_not_count_the_first_again() -> None:
    card = Card()
    for _ in range(100):
        card.read()
    for lost in (4000, 2500, 0):
        card.wait((lost + BLOCK) / RATE_HZ)
        card.lose(lost)
        assert card.read(overflowed=True) == pytest.approx(lost, abs=60)


def test_lumps_of_a_sound_server_blur_it_by_no_more_than_a_lump() -> None:
    card = Card()
    rng = np.random.default_rng(1)
    kept = 0.0
    for _ in range(400):
        lump = float(rng.integers(0, 2 * BLOCK))
        card.waiting += kept - lump
        kept = lump
        card.read()
    card.waiting += kept
    card.wait(0.5)
    card.lose(20_000)
    assert card.read(overflowed=True) == pytest.approx(20_000, abs=2 * BLOCK)


def test_a_clock_that_jumps_is_not_believed_beyond_reason() -> None:
    card = Card()
    card.read()
    card.now_s += 1e6
    assert card.read(overflowed=True) == MOST_LOST_S * RATE_HZ
    card.now_s -= 1e6
    assert card.read(overflowed=True) == 0
