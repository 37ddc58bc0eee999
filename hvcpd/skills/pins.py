"""A pin that is switched on for a while: a pump, a lamp, a buzzer. By gpiozero, whose mock pins serve in tests."""

from __future__ import annotations

import asyncio
from collections.abc import Mapping
from contextlib import suppress
from typing import Any

from hvcpd.config.skill_settings import PinSettings
from hvcpd.errors import DeviceError, how_to_install
from hvcpd.skills.life import Call
from hvcpd.skills.runners import FailedError, Tell

TOLD_EVERY_S = 0.5
"""How far it is, for people to see."""


class Pin:
    """Owns the pin while it lives; off but in a call. Raises DeviceError if there is none, or somebody else has it."""

    def __init__(self, settings: PinSettings) -> None:
        self._settings = settings
        try:
            from gpiozero import DigitalOutputDevice
            from gpiozero.exc import GPIOZeroError
        except ImportError:
            remedy = how_to_install("gpiozero lgpio", "python3-gpiozero python3-lgpio")
            raise DeviceError(f"gpiozero is not installed; run `{remedy}`") from None
        try:
            self._device = DigitalOutputDevice(settings.pin, active_high=settings.active_high, initial_value=False)
        except (GPIOZeroError, OSError) as error:
            text = f"pin {settings.pin} cannot be used ({error}); end what else uses it, or name another pin"
            raise DeviceError(text) from None
        self._goes_on, self._held = asyncio.Event(), asyncio.Event()
        self._goes_on.set()

    async def perform(self, call: Call, tell: Tell) -> Mapping[str, Any]:
        """On for as long as the call says, off at its end, however it ends."""
        amount = dict(call.arguments).get(self._settings.amount)
        if not isinstance(amount, float):
            raise FailedError(f"it is not told `{self._settings.amount}`")
        needed_s, on_s, loop = amount / self._settings.per_s, 0.0, asyncio.get_running_loop()
        try:
            while on_s < needed_s:
                await self._goes_on.wait()
                began_s = loop.time()
                self._device.on()
                with suppress(TimeoutError):
                    await asyncio.wait_for(self._held.wait(), min(TOLD_EVERY_S, needed_s - on_s))
                on_s += loop.time() - began_s
                tell(min(on_s / needed_s, 1.0), "")
        finally:
            self._device.off()
        return {self._settings.amount: amount}

    def hold(self, on: bool) -> None:
        """Off until it is told to go on; the rest of its time is kept."""
        before, after = (self._goes_on, self._held) if on else (self._held, self._goes_on)
        before.clear()
        after.set()
        if on:
            self._device.off()

    async def close(self) -> None:
        """Off, and free for others."""
        self._device.off()
        self._device.close()
