"""When wheels are served, what a halt does, and what happens when they fail."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

import pytest
from structlog.testing import capture_logs

from hvcpd.daemon.wheel_service import LEASE_S, LOST_S, WheelService
from hvcpd.errors import DeviceError
from hvcpd.ports import STANDSTILL, WheelCommand, WheelReading

FORWARD = WheelCommand(2.0, 2.0)
BLOCK_S = 0.025


class GatedWheels:
    """Wheels that keep what they are told, can be held up in the middle of an exchange, and can fail."""

    def __init__(self) -> None:
        self.commands: list[WheelCommand] = []
        self.threads: set[int] = set()
        self.gate = threading.Event()
        self.gate.set()
        self.entered = threading.Event()
        self.error: Exception | None = None
        self.closed = False

    def open(self) -> None:
        self.threads.add(threading.get_ident())

    def exchange(self, command: WheelCommand) -> WheelReading:
        self.threads.add(threading.get_ident())
        self.entered.set()
        assert self.gate.wait(10.0)
        if self.error is not None:
            raise self.error
        self.commands.append(command)
        return WheelReading(float(len(self.commands)), 0.0)

    def close(self) -> None:
        self.threads.add(threading.get_ident())
        self.commands.append(STANDSTILL)
        self.closed = True


@asynccontextmanager
async def served(lease_s: float = LEASE_S) -> AsyncIterator[tuple[WheelService, GatedWheels]]:
    wheels = GatedWheels()
    service = WheelService(wheels, lease_s)
    await service.open()
    yield service, wheels
    await service.close()


async def blocks(service: WheelService, command: WheelCommand, first: int, count: int) -> None:
    for block in range(first, first + count):
        service.serve(command, block * BLOCK_S)
        await service.settled()


async def test_standing_wheels_are_served_every_100_ms_and_moving_ones_every_50_ms() -> None:
    async with served() as (service, wheels):
        await blocks(service, STANDSTILL, 0, 40)
        assert len(wheels.commands) == 10
        await blocks(service, FORWARD, 40, 40)
        assert wheels.commands.count(FORWARD) == 20
    assert wheels.closed
    assert len(wheels.threads) == 1, "one worker thread for all"
    assert threading.get_ident() not in wheels.threads


async def test_a_halt_goes_out_with_its_own_block() -> None:
    async with served() as (service, wheels):
        await blocks(service, FORWARD, 1, 3)  # served at 1 and 3
        assert wheels.commands[-1] == FORWARD
        await blocks(service, STANDSTILL, 4, 1)
        assert wheels.commands[-1] == STANDSTILL


async def test_a_halt_during_an_exchange_follows_it_at_once() -> None:
    async with served() as (service, wheels):
        wheels.gate.clear()
        service.serve(FORWARD, 0.0)
        assert await asyncio.to_thread(wheels.entered.wait, 10.0)
        service.serve(STANDSTILL, 0.001)  # must not block, although the bus is busy
        wheels.gate.set()
        await service.settled()
        assert wheels.commands == [FORWARD, STANDSTILL]


async def test_a_reading_is_handed_out_once() -> None:
    async with served() as (service, _):
        assert service.take_reading() is None
        await blocks(service, STANDSTILL, 0, 1)
        reading = service.take_reading()
        assert reading is not None
        assert reading.left_rad == 1.0
        assert service.take_reading() is None


async def test_without_new_commands_moving_wheels_are_stopped() -> None:
    with capture_logs() as logs:
        async with served(lease_s=0.01) as (service, wheels):
            service.serve(FORWARD, 1.0)
            while wheels.commands[-1:] != [STANDSTILL]:
                await asyncio.sleep(0)
    assert wheels.commands == [FORWARD, STANDSTILL, STANDSTILL], "the lease's and that of closing"
    assert logs[0]["event"] == "wheels stopped"


async def test_failing_wheels_are_told_once_and_may_recover() -> None:
    with capture_logs() as logs:
        async with served() as (service, wheels):
            wheels.error = DeviceError("the wheels do not answer: no reply")
            await blocks(service, STANDSTILL, 0, 80)
            wheels.error = None
            await blocks(service, STANDSTILL, 80, 10)
            assert service.take_reading() is not None
    assert [line["event"] for line in logs] == ["wheels failed", "wheels answer again"]


async def test_lost_wheels_end_the_daemon() -> None:
    async with served() as (service, wheels):
        wheels.error = DeviceError("the wheels do not answer: no reply")
        last = round(LOST_S / BLOCK_S)
        await blocks(service, STANDSTILL, 0, last - 1)
        with pytest.raises(DeviceError, match="have not answered for 10 s"):
            await blocks(service, STANDSTILL, last - 1, 3)
    assert wheels.closed


async def test_our_own_fault_is_raised_not_hidden() -> None:
    async with served() as (service, wheels):
        wheels.error = ValueError("wheel speeds must be finite")
        with pytest.raises(ValueError, match="finite"):
            await blocks(service, STANDSTILL, 0, 20)
