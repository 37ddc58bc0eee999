"""The full-duplex stream: order, alignment, bounds, and a card that stalls or dies."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hvcpd.config.settings import AudioSettings
from hvcpd.errors import DeviceError
from hvcpd.hardware.audio_card import FILLED_BLOCKS
from hvcpd.hardware.audio_exchange import LEAD_BLOCKS, SampleQueue
from hvcpd.hardware.audio_stream import AudioStream
from hvcpd.ports import Samples
from tests.hardware.fake_card import FakeCard, Status

SETTINGS = AudioSettings(block_ms=10, queue_s=0.1, watchdog_s=5.0)
BLOCK = 160
CAPACITY = 1600
LATENCY_BLOCKS = LEAD_BLOCKS + FILLED_BLOCKS


def ramp(first: int, count: int = BLOCK) -> Samples:
    """Samples that carry their own number, exactly."""
    return (np.arange(first, first + count) / 65536).astype(np.float32)


def numbers(samples: Samples) -> list[int]:
    return [round(float(sample) * 65536) for sample in samples]


@asynccontextmanager
async def opened(
    settings: AudioSettings = SETTINGS, card: FakeCard | None = None
) -> AsyncIterator[tuple[AudioStream, FakeCard]]:
    """An open stream, and the card's side of it."""
    card = card or FakeCard()
    stream = AudioStream(settings, card)
    await stream.open()
    await stream.start()
    card.running(10.0)
    try:
        yield stream, card
    finally:
        card.die()
        await stream.close()
    assert card.inputs[-1].closed
    assert card.outputs[-1].closed


@given(st.lists(st.tuples(st.booleans(), st.integers(0, 50)), max_size=40), st.integers(1, 100))
def test_a_queue_is_a_line_of_samples_that_loses_only_the_oldest(moves: list[tuple[bool, int]], capacity: int) -> None:
    queue, line, written = SampleQueue(capacity), [], 0
    for put, count in moves:
        if put:
            lost = queue.put(ramp(written, count))
            line += range(written, written + count)
            written += count
            assert lost == max(0, len(line) - capacity)
            line = line[lost:]
        else:
            assert numbers(queue.take(count)) == line[:count]
            line = line[count:]
        assert len(queue) == len(line)


async def test_every_sample_heard_is_read_once_and_in_order() -> None:
    async with opened() as (stream, card):
        for block in range(5):
            card.interrupt(ramp(block * BLOCK))
        for block in range(5):
            assert numbers(await stream.read()) == list(range(block * BLOCK, (block + 1) * BLOCK))
        assert stream.counters.input_dropped == 0


async def test_a_reader_that_waits_is_woken_from_another_thread() -> None:
    async with opened() as (stream, card):
        reading = asyncio.ensure_future(stream.read())
        await asyncio.sleep(0)
        await asyncio.to_thread(card.interrupt, ramp(0))
        assert numbers(await reading) == list(range(BLOCK))


async def test_blocks_of_another_size_are_cut_anew() -> None:
    async with opened() as (stream, card):
        card.interrupt(ramp(0, 250))
        card.interrupt(ramp(250, 70))
        assert numbers(await stream.read()) == list(range(160))
        assert numbers(await stream.read()) == list(range(160, 320))


async def live(stream: AudioStream, card: FakeCard, first: int, count: int) -> None:
    """A robot in time: each block that is heard is answered with its own samples."""
    for block in range(first, first + count):
        card.interrupt(ramp(block * BLOCK))
        stream.write(await stream.read())


def offsets(card: FakeCard) -> set[int]:
    """By how many samples what was played lies behind the microphone sample that it answers (silence left out)."""
    played = np.concatenate(card.played)
    return {at - number for at, number in enumerate(numbers(played)) if number > 0}


async def test_what_is_written_is_played_a_fixed_time_later() -> None:
    async with opened() as (stream, card):
        await live(stream, card, 0, 20)
        assert stream.latency_s == pytest.approx(LATENCY_BLOCKS * 0.010 + 0.02)
    assert offsets(card) == {LATENCY_BLOCKS * BLOCK}


async def test_a_robot_one_block_late_leaves_no_gap() -> None:
    async with opened() as (stream, card):
        await live(stream, card, 0, 5)
        card.interrupt(ramp(5 * BLOCK))
        card.interrupt(ramp(6 * BLOCK))
        for _ in range(2):
            stream.write(await stream.read())
        await live(stream, card, 7, 5)
        assert stream.counters.output_late == 0
    assert offsets(card) == {LATENCY_BLOCKS * BLOCK}
    assert numbers(np.concatenate(card.played))[(LATENCY_BLOCKS + 1) * BLOCK :] == list(range(BLOCK, BLOCK * 10))


async def test_after_a_stall_the_directions_are_aligned_again() -> None:
    async with opened() as (stream, card):
        await live(stream, card, 0, 5)
        for block in range(5, 11):  # the robot sleeps for six blocks
            card.interrupt(ramp(block * BLOCK))
        for _ in range(6):
            stream.write(await stream.read())
        await live(stream, card, 11, 10)
        assert stream.counters.output_late == (6 - LEAD_BLOCKS) * BLOCK
        assert stream.counters.input_dropped == 0
    assert offsets(card) == {LATENCY_BLOCKS * BLOCK}


async def test_after_a_stall_of_the_sound_server_nothing_is_played_late_for_ever() -> None:
    """Nine blocks that were held up come at once, and only four of them long the loudspeaker has played meanwhile."""
    async with opened() as (stream, card):
        await live(stream, card, 0, 5)
        card.interrupt(ramp(5 * BLOCK, 9 * BLOCK), skew=-5 * BLOCK)
        assert stream.counters.output_late == 3 * BLOCK
        for _ in range(8):
            stream.write(await stream.read())
        for _ in range(100):
            card.interrupt(np.zeros(BLOCK, np.float32))
            stream.write(0 * await stream.read())
        assert card.outputs[-1].level <= (FILLED_BLOCKS + 1) * BLOCK
        assert stream.counters.clock_dropped > 0


async def test_a_stall_longer_than_the_queue_drops_the_oldest_and_counts() -> None:
    async with opened() as (stream, card):
        await live(stream, card, 0, 5)
        for block in range(5, 30):  # 25 blocks, and the queue holds 10
            card.interrupt(ramp(block * BLOCK))
        assert stream.counters.input_dropped == 25 * BLOCK - CAPACITY
        first = await stream.read()
        assert numbers(first)[0] == 20 * BLOCK
        stream.write(first)
        for _ in range(9):
            stream.write(await stream.read())
        await live(stream, card, 30, 10)
    assert offsets(card) == {LATENCY_BLOCKS * BLOCK}
    assert numbers(np.concatenate(card.played[-10:])) == list(range(28 * BLOCK, 38 * BLOCK)), "without a gap again"


async def test_more_than_fits_is_dropped_and_counted() -> None:
    async with opened() as (stream, _):
        stream.write(ramp(1, 2 * CAPACITY))
        assert stream.counters.output_dropped == CAPACITY + LEAD_BLOCKS * BLOCK


async def test_the_cards_own_losses_are_counted() -> None:
    async with opened() as (stream, card):
        card.interrupt(ramp(0), Status(input_overflow=True))
        card.interrupt(ramp(0), Status(output_underflow=True))
        card.interrupt(ramp(0), Status(input_overflow=True, output_underflow=True))
        assert (stream.counters.card_overflows, stream.counters.card_underflows) == (2, 2)


async def test_the_watchdog_tells_of_a_card_that_stalls() -> None:
    async with opened(AudioSettings(block_ms=10, watchdog_s=0.02)) as (stream, card):
        card.interrupt(ramp(0))
        await stream.read()
        with pytest.raises(DeviceError, match=r"no sound came from .* for 0\.02 s"):
            await stream.read()


async def test_a_server_that_fills_its_buffers_first_is_no_card_that_stalls() -> None:
    """PulseAudio's null sink gave its first block after 1.9 s, and every duet over it began with "no sound came"."""
    async with opened(AudioSettings(block_ms=10, watchdog_s=0.02)) as (stream, card):
        reading = asyncio.ensure_future(stream.read())
        for _ in range(20):  # several times the watchdog's time
            await asyncio.wait([reading], timeout=0.005)
        card.interrupt(ramp(0))
        assert numbers(await reading) == list(range(BLOCK))


async def test_a_loop_that_was_held_up_does_not_blame_the_card() -> None:
    async with opened(AudioSettings(block_ms=10, watchdog_s=0.02)) as (stream, card):
        reading = asyncio.ensure_future(stream.read())
        await asyncio.sleep(0)
        card.interrupt(ramp(0))
        loop = asyncio.get_running_loop()
        held_until_s = loop.time() + 0.03
        while loop.time() < held_until_s:
            pass
        assert numbers(await reading) == list(range(BLOCK))


async def test_a_card_that_dies_is_told_at_once_after_its_last_sound() -> None:
    async with opened() as (stream, card):
        card.interrupt(ramp(0))
        card.die()
        assert numbers(await stream.read()) == list(range(BLOCK))
        with pytest.raises(DeviceError, match=r"stopped .*is it still connected"):
            await stream.read()


async def test_a_card_that_dies_wakes_the_reader() -> None:
    async with opened() as (stream, card):
        reading = asyncio.ensure_future(stream.read())
        await asyncio.sleep(0)
        await asyncio.to_thread(card.die)
        with pytest.raises(DeviceError, match="stopped"):
            await reading


async def test_a_card_that_hangs_is_let_go_of_as_soon_as_it_can_be() -> None:
    """The thread waits in `read`; closing makes that end before anything is freed."""
    async with opened() as (stream, card):
        await stream.close()
        assert card.inputs[-1].gone, "aborted"
        assert card.inputs[-1].closed


async def test_counters_are_made_anew_only_when_something_was_lost() -> None:
    async with opened() as (stream, card):
        card.interrupt(ramp(0))
        before = stream.counters
        card.interrupt(ramp(BLOCK))
        assert stream.counters is before
        card.interrupt(ramp(2 * BLOCK), Status(input_overflow=True))
        assert stream.counters is not before
        assert stream.counters.card_overflows == 1
