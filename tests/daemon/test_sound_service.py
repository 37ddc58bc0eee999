"""Sound that fails comes back, and time goes on meanwhile; on a clock of its own."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from itertools import pairwise

import numpy as np
import pytest
from structlog.testing import capture_logs

from hvcpd.daemon.sound_service import (
    GAP_S,
    LET_GO_S,
    MUTE_S,
    RETRY_FIRST_S,
    RETRY_MOST_S,
    STEADY_S,
    UNHEARD_S,
    Block,
    SoundService,
)
from hvcpd.errors import DeviceError
from hvcpd.hardware.audio_exchange import StreamCounters
from hvcpd.ports import SAMPLE_RATE_HZ, Samples

BLOCK = 400
BLOCK_S = BLOCK / SAMPLE_RATE_HZ


class Clock:
    """Time that passes when everybody sleeps."""

    def __init__(self) -> None:
        self.now_s = 1000.0
        self._sleepers: list[tuple[float, asyncio.Future[None]]] = []
        self._passing = False

    def __call__(self) -> float:
        return self.now_s

    async def sleep(self, duration_s: float) -> None:
        wake = asyncio.get_running_loop().create_future()
        self._sleepers.append((self.now_s + duration_s, wake))
        if not self._passing:
            self._passing = True
            self._pass(50)
        await wake

    def _pass(self, turns: int) -> None:
        """Let all others have their turn first, then wake who sleeps the shortest."""
        if turns:
            asyncio.get_running_loop().call_soon(self._pass, turns - 1)
            return
        self._sleepers = [(due_s, wake) for due_s, wake in self._sleepers if not wake.done()]
        self._passing = bool(self._sleepers)
        if self._sleepers:
            due_s, wake = min(self._sleepers, key=lambda sleeper: sleeper[0])
            self.now_s = max(self.now_s, due_s)
            wake.set_result(None)
            self._pass(50)


class Streams:
    """Streams in turn; each gives so many blocks and fails, or cannot be opened for the reason given."""

    def __init__(self, clock: Clock, *lives: int | str) -> None:
        self.clock = clock
        self.lives = list(lives)
        self.log: list[tuple[float, str]] = []
        self.counters = StreamCounters()
        self.level = 1.0
        self.written = 0

    def make(self) -> FakeStream:
        return FakeStream(self, self.lives.pop(0) if self.lives else 10**9)

    def times(self, what: str) -> list[float]:
        return [at_s for at_s, word in self.log if word == what]


class FakeStream:
    latency_s = 0.1

    def __init__(self, streams: Streams, life: int | str) -> None:
        self._streams = streams
        self._life = life
        self.counters = StreamCounters()

    def _note(self, word: str) -> None:
        self._streams.log.append((self._streams.clock.now_s, word))

    async def open(self, afresh: bool = False) -> None:
        self._note("open afresh" if afresh else "open")
        if isinstance(self._life, str):
            raise DeviceError(self._life)

    async def start(self) -> None:
        self._note("start")

    async def read(self) -> Samples:
        await self._streams.clock.sleep(BLOCK_S)
        assert isinstance(self._life, int)
        if self._life == 0:
            raise DeviceError("the sound card stopped")
        self._life -= 1
        self.counters = self._streams.counters
        return np.full(BLOCK, self._streams.level, np.float32)

    def write(self, samples: Samples) -> None:
        self._note("write")
        self._streams.written = samples.size

    async def close(self) -> None:
        self._note("close")


@asynccontextmanager
async def served(*lives: int | str) -> AsyncIterator[tuple[SoundService, Streams]]:
    streams = Streams(Clock(), *lives)
    service = SoundService(streams.make, streams.clock, streams.clock.sleep)
    await service.open()
    await service.start()
    try:
        yield service, streams
    finally:
        await service.close()


async def until_heard(service: SoundService) -> list[Block]:
    """All blocks up to the first with sound."""
    blocks = [await service.read()]
    while blocks[-1].samples.size == 0:
        blocks.append(await service.read())
    return blocks


async def test_while_sound_flows_nothing_is_lost() -> None:
    async with served() as (service, streams):
        for _ in range(20):
            block = await service.read()
            assert (block.samples.size, block.lost) == (BLOCK, None)
            service.write(block.samples)
        assert service.flowing
    assert len(streams.times("write")) == 20


async def test_the_failure_is_told_at_once_and_then_how_time_passes() -> None:
    async with served(3) as (service, streams):
        for _ in range(3):
            await service.read()
        heard_s = streams.clock.now_s
        block = await service.read()
        assert block.samples.size == 0
        assert block.lost == BLOCK, "the block that was waited for"
        assert not service.flowing
        service.write(np.zeros(0, np.float32))
        blocks = await until_heard(service)
        assert all(gap.lost <= GAP_S * SAMPLE_RATE_HZ + 1 for gap in blocks if gap.lost is not None)
        accounted = block.lost + sum((each.lost or 0) + each.samples.size for each in blocks)
        assert accounted == pytest.approx((streams.clock.now_s - heard_s) * SAMPLE_RATE_HZ, abs=2)
        assert service.flowing
    assert [word for _, word in streams.log] == ["open", "start", "close", "open afresh", "start", "close"]


async def test_attempts_are_made_ever_more_seldom_and_told() -> None:
    async with served(0, *["no card"] * 7) as (service, streams):
        with capture_logs() as logs:
            await until_heard(service)
        assert [line["event"] for line in logs] == ["sound failed", *["still no sound"] * 7, "sound is back"]
        assert logs[1]["reason"] == "no card"
        assert logs[-1]["after_s"] == pytest.approx(0.5 + 1 + 2 + 4 + 8 + 10 + 10 + 10, abs=0.2)
    tries = streams.times("open afresh")
    pauses = [later - sooner for sooner, later in pairwise(tries)]
    assert pauses == pytest.approx([1.0, 2.0, 4.0, 8.0, RETRY_MOST_S, RETRY_MOST_S, RETRY_MOST_S])
    assert len(streams.times("close")) == 9, "what failed to open is let go of too"


async def test_a_stream_that_fails_again_at_once_does_not_begin_with_short_pauses() -> None:
    async with served(0, 1, 1) as (service, streams):
        for _ in range(3):
            await until_heard(service)
    tries = streams.times("open afresh")
    assert [later - sooner for sooner, later in pairwise(tries)] == pytest.approx(
        [1.0 + 2 * BLOCK_S, 2.0 + 2 * BLOCK_S]
    )


async def test_a_stream_that_was_steady_is_retried_soon() -> None:
    steady = round(STEADY_S / BLOCK_S) + 1
    async with served(0, steady) as (service, streams):
        await until_heard(service)
        for _ in range(steady - 1):
            await service.read()
        failing_s = streams.clock.now_s
        await until_heard(service)
        assert streams.clock.now_s - failing_s == pytest.approx(RETRY_FIRST_S + 2 * BLOCK_S)


async def test_losses_are_counted_over_all_streams_and_belong_to_the_block_after_them() -> None:
    async with served(2) as (service, streams):
        await service.read()
        streams.counters = StreamCounters(input_dropped=70, output_late=5)
        assert (await service.read()).lost == 70
        await until_heard(service)
        assert service.counters == StreamCounters(input_dropped=140, output_late=10), "the second stream lost as much"
        streams.counters = StreamCounters(input_dropped=70, output_late=5, card_overflows=1)
        assert (await service.read()).lost == 0, "lost, but nobody knows how much"
        streams.counters = StreamCounters(input_dropped=70, output_late=5, card_overflows=2, card_lost=300)
        assert (await service.read()).lost == 300, "by the clock"
        assert (await service.read()).lost is None


async def test_what_was_left_out_of_the_own_sentence_disturbs_the_block_after_it() -> None:
    async with served(5) as (service, streams):
        told = [await service.read()]
        streams.counters = StreamCounters(output_late=5)
        told += [await service.read(), await service.read()]
        assert [(block.lost, block.disturbed) for block in told] == [(None, False), (None, True), (None, False)]


async def test_ending_without_sound_waits_for_nothing() -> None:
    async with served(0, *["no card"] * 100) as (service, streams):
        assert (await service.read()).samples.size == 0
    assert streams.times("open afresh") == []


async def test_a_card_that_cannot_be_opened_at_the_start_is_the_callers() -> None:
    with pytest.raises(DeviceError, match="no card"):
        async with served("no card"):
            raise AssertionError("never begins")


async def test_a_library_that_hangs_ends_the_robots_life() -> None:
    assert LET_GO_S > RETRY_MOST_S

    class Hanging(FakeStream):
        async def close(self) -> None:
            await asyncio.get_running_loop().create_future()

    streams = Streams(Clock(), 0)
    service = SoundService(lambda: Hanging(streams, 0), streams.clock, streams.clock.sleep, let_go_s=0.01)
    await service.open()
    await service.start()
    with pytest.raises(DeviceError, match="was not released"):
        await until_heard(service)


async def test_a_microphone_of_nothing_but_zeros_is_told_once() -> None:
    async with served() as (service, streams):
        with capture_logs() as logs:
            for level in (0.0, 1e-6, 0.0):
                streams.level = level
                for _ in range(round(MUTE_S / BLOCK_S) - 1):
                    await service.read()
                    assert not service.mute
            for _ in range(3 * round(MUTE_S / BLOCK_S)):
                await service.read()
            assert service.mute
            streams.level = 1e-6
            await service.read()
            assert not service.mute
        assert [line["event"] for line in logs] == ["the microphone is mute", "the microphone gives sound"]
        assert "audio.input_channel" in logs[0]["remedy"]


async def test_who_does_not_hear_even_itself_stands_still_until_it_hears() -> None:
    """It went on with its tasks, and nobody could stop it by voice."""
    async with served() as (service, streams):

        async def live(for_s: float, said: float) -> Block:
            block = Block(np.zeros(0, np.float32), None)
            for _ in range(round(for_s / BLOCK_S)):
                block = await service.read()
                service.write(np.full(block.samples.size, said, np.float32))
            return block

        streams.level = 0.0
        with capture_logs() as logs:
            assert (await live(2.0 * MUTE_S, 0.0)).samples.size == BLOCK, "the room may be quiet"
            await live(UNHEARD_S, 0.1)
            deaf = await live(5.0, 0.1)
            assert (deaf.samples.size, deaf.lost) == (0, BLOCK)
            assert streams.written == BLOCK, "the loudspeaker does not run dry"
            assert service.deaf
            streams.level = 1e-6
            assert (await live(2.0 * MUTE_S, 0.1)).samples.size == BLOCK
            assert not service.deaf
            streams.level = 0.0
            assert (await live(0.9 * MUTE_S, 0.1)).samples.size == BLOCK
        assert [line["event"] for line in logs] == [
            "the microphone is mute",
            "the robot is deaf",
            "the microphone gives sound",
        ]


async def test_a_library_that_hangs_while_it_is_opened_keeps_nobody_from_ending() -> None:
    class Hanging(FakeStream):
        async def open(self, afresh: bool = False) -> None:
            raise DeviceError("the sound system did not answer")

        async def close(self) -> None:
            await asyncio.get_running_loop().create_future()

    streams = Streams(Clock(), 0)
    service = SoundService(lambda: Hanging(streams, 0), streams.clock, streams.clock.sleep, let_go_s=0.01)
    with pytest.raises(DeviceError, match="did not answer"):
        await service.open()
    with capture_logs() as logs:
        await service.close()
    assert "was not released" in logs[0]["reason"]
