"""One alarm for many blocks that were lost or late; raised and cleared with hysteresis."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace

import pytest
from structlog.testing import capture_logs

from hvcpd.daemon.sound_service import CLEARED_WITHIN_S, RAISED_BY, RAISED_WITHIN_S, TOO_BUSY, Overload, is_disturbed
from hvcpd.hardware.audio_exchange import StreamCounters

BLOCK_S = 0.025


class Life:
    """Blocks of which some are disturbed."""

    def __init__(self) -> None:
        self.overload = Overload()
        self.counters = StreamCounters()
        self.n = 0

    def blocks(self, duration_s: float, disturbed: Callable[[int], bool], name: str = "card_underflows") -> None:
        for _ in range(round(duration_s / BLOCK_S)):
            before = self.counters
            if disturbed(self.n):
                self.counters = replace(before, **{name: getattr(before, name) + 1})
            self.n += 1
            self.overload.note(1000.0 + self.n * BLOCK_S, is_disturbed(before, self.counters))


def every(blocks: int) -> Callable[[int], bool]:
    return lambda n: n % blocks == 0


def never(_: int) -> bool:
    return False


def events(logs: Iterable[dict[str, object]]) -> list[object]:
    return [line["event"] for line in logs]


@pytest.mark.parametrize(
    "name", ["input_dropped", "output_dropped", "output_late", "card_overflows", "card_underflows"]
)
def test_an_hour_of_torn_sound_is_one_alarm_and_its_end(name: str) -> None:
    life = Life()
    with capture_logs() as logs:
        life.blocks(600.0, every(3), name)
        assert life.overload.standing
        life.blocks(CLEARED_WITHIN_S + 5.0, never)
        assert not life.overload.standing
    assert events(logs) == [TOO_BUSY, "the computer keeps up again"]
    assert "end other programs" in str(logs[0]["remedy"])
    assert logs[1]["disturbed"] == 8000


def test_one_long_stall_is_none() -> None:
    life = Life()
    life.blocks(3.0, every(1))
    life.blocks(20.0, never)
    life.blocks(3.0, every(1))
    assert not life.overload.standing


def test_a_gap_now_and_then_is_none() -> None:
    life = Life()
    with capture_logs() as logs:
        life.blocks(600.0, every(round(RAISED_WITHIN_S / BLOCK_S / RAISED_BY) + 60))
    assert logs == []


def test_around_the_limit_it_does_not_come_and_go() -> None:
    life = Life()
    with capture_logs() as logs:
        for k in range(40):
            life.blocks(12.0, every(20) if k % 2 == 0 else never)
    assert events(logs) == [TOO_BUSY]


def test_two_clocks_that_are_evened_out_are_none() -> None:
    life = Life()
    life.blocks(60.0, every(1), "clock_inserted")
    life.blocks(60.0, every(1), "clock_dropped")
    assert not life.overload.standing
