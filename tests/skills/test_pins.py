"""Pins carry calls out; cancelled or killed, they are off."""

from __future__ import annotations

import asyncio
import signal
import subprocess
from pathlib import Path

import pytest

from hil_fakes.pins import FilePins
from hvcpd.config.skill_settings import PinSettings
from hvcpd.errors import DeviceError
from hvcpd.skills.pins import PinRunner
from hvcpd.skills.runners import FailedError
from tests.processes import python
from tests.skills.calls import STOP_S, call, cancelled, fake_pins, met
from tests.skills.virtual_loop import pass_time, virtually


class Pins:
    """Pins in memory, and how long one was on by the loop's virtual time."""

    def __init__(self) -> None:
        from gpiozero.pins.mock import MockFactory

        self.factory = MockFactory()

    def is_on(self, number: int = 17) -> bool:
        return bool(self.factory.pin(number).state)

    async def time_on(self, limit_s: float) -> float:
        on_s = 0.0
        for _ in range(round(limit_s / 0.01)):
            on_s += 0.01 * self.is_on()
            await pass_time(0.01)
        return on_s


@virtually
async def test_a_pin_is_on_for_as_long_as_it_is_told() -> None:
    pins = Pins()
    pin = PinRunner(PinSettings(17, "litres", per_s=0.05), pins.factory)
    assert not pins.is_on()
    told: list[float | None] = []
    task = asyncio.create_task(pin.perform(call(litres=0.1), lambda share, _text: told.append(share)))  # type: ignore[arg-type]
    assert await pins.time_on(5.0) == pytest.approx(2.0, abs=0.03)
    assert dict(await task) == {"litres": 0.1}
    assert told == pytest.approx([0.25, 0.5, 0.75, 1.0])
    await pin.close()


@virtually
async def test_a_pin_that_is_cancelled_is_off_at_once_and_a_held_one_keeps_its_time() -> None:
    pins = Pins()
    pin = PinRunner(PinSettings(17), pins.factory)
    assert await cancelled(pin, pins.is_on, call(seconds=60.0)) < STOP_S
    assert not pins.is_on()
    task = asyncio.create_task(pin.perform(call(seconds=3.0), lambda _share, _text: None))  # type: ignore[arg-type]
    await pass_time(1.2)
    pin.hold(True)
    assert not pins.is_on()
    await pass_time(5.0)
    assert not task.done()
    pin.hold(False)
    assert await pins.time_on(5.0) == pytest.approx(1.8, abs=0.03)
    await task
    await pin.close()


@virtually
async def test_a_call_after_one_that_was_cancelled_while_it_was_held_is_carried_out() -> None:
    """A robot that halted for what might be "stop", and was then stopped for good, never poured again."""
    pins = Pins()
    pin = PinRunner(PinSettings(17), pins.factory)
    first = asyncio.create_task(pin.perform(call(seconds=3.0), lambda _share, _text: None))  # type: ignore[arg-type]
    await pass_time(1.0)
    pin.hold(True)
    first.cancel()
    await asyncio.wait([first])
    second = asyncio.create_task(pin.perform(call(seconds=3.0), lambda _share, _text: None))  # type: ignore[arg-type]
    assert await pins.time_on(5.0) == pytest.approx(3.0, abs=0.03)
    await second
    await pin.close()


@virtually
async def test_a_float_that_closes_ends_a_pumps_call_and_an_empty_tank_does_not_begin_one() -> None:
    pins = Pins()
    pin = PinRunner(PinSettings(17, empty_pin=27), pins.factory)
    task = asyncio.create_task(pin.perform(call(seconds=60.0), lambda _share, _text: None))  # type: ignore[arg-type]
    await pass_time(1.0)
    assert pins.is_on()
    pins.factory.pin(27).drive_low()
    await pass_time(0.1)
    with pytest.raises(FailedError, match="the tank is empty"):
        await task
    assert not pins.is_on()
    with pytest.raises(FailedError, match="the tank is empty"):
        await pin.perform(call(seconds=1.0), lambda _share, _text: None)
    await pin.close()


async def test_a_pin_that_somebody_else_has_is_told_with_its_remedy(tmp_path: Path) -> None:
    pins = FilePins(tmp_path)
    first = PinRunner(PinSettings(17), pins)
    with pytest.raises(DeviceError, match=r"pin 17 cannot be used .*; end what else uses it"):
        PinRunner(PinSettings(17), pins)
    code = "from gpiozero import LED; import signal; led = LED(4); print(1, flush=True); signal.pause()"
    with python("-c", code, env=fake_pins(tmp_path)) as holder:
        assert holder.stdout is not None
        holder.stdout.readline()
        with pytest.raises(DeviceError, match=r"pin 4 cannot be used .*busy"):
            PinRunner(PinSettings(4), pins)
    await first.close()


async def test_a_pump_process_turns_with_its_pin_until_its_tank_is_empty(tmp_path: Path) -> None:
    pins = FilePins(tmp_path)
    words = ("--pins", str(tmp_path), "--pump", "17", "--float", "27", "--litres", "0.005")
    with python("-m", "hil_fakes.pump", *words) as pump:
        await met((tmp_path / "27.level").exists, "the tank's float is there")
        pin = PinRunner(PinSettings(17, "litres", per_s=0.05, empty_pin=27), pins)
        with pytest.raises(FailedError, match="the tank is empty"):
            await pin.perform(call(litres=1.0), lambda _share, _text: None)
        await pin.close()
        assert pump.stdout is not None
        told = [pump.stdout.readline(), pump.stdout.readline()]
    assert told == ["pump on, 0.000 l poured, 0.005 l left\n", "pump off, 0.005 l poured, 0.000 l left\n"]


async def test_a_pump_process_needs_no_gpiozero_and_ends_by_ctrl_c(tmp_path: Path) -> None:
    """Only `hvcpctl skills`, which drives the pins, needs it: both ended in a traceback."""
    heeded = "import signal, sys; signal.signal(signal.SIGINT, signal.default_int_handler)"  # "&" in a shell ignores it
    code = f"{heeded}; sys.modules['gpiozero'] = None; from hil_fakes.pump import main; sys.exit(main())"
    with python("-c", code, "--pins", str(tmp_path), "--float", "27", stderr=subprocess.PIPE) as pump:
        await met((tmp_path / "27.level").exists, "it runs")
        pump.send_signal(signal.SIGINT)
        assert pump.communicate(timeout=30.0)[1] == ""
    assert pump.returncode == 0
