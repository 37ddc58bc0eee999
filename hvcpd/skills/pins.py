"""A pin that is switched on for a while: a pump, a lamp, a buzzer. By gpiozero, whose mock pins serve in tests."""

from __future__ import annotations

import asyncio
from collections.abc import Mapping
from contextlib import suppress
from typing import Any

from hvcpd.config.skill_settings import PinSettings
from hvcpd.hardware.gpio import device
from hvcpd.skills.life import Call
from hvcpd.skills.runners import FailedError, Tell, number_of

REPORT_EVERY_S = 0.5
"""Progress, for people to see."""
SLACK_S = 1e-6
"""Tolerance for the arithmetic of the clock; no relay is so quick."""
LOOK_S = 0.05
"""Between two checks of the switch that shows that a tank is empty: a small pump runs dry for longer without harm."""


class PinRunner:
    """Owns the pin while it lives; off except during a call. Raises DeviceError if it is missing or in use.

    `pins` is the factory of gpiozero's that makes them; None: the one that suits the computer.
    """

    def __init__(self, settings: PinSettings, pins: Any = None) -> None:
        self._settings = settings
        number, empty, high = settings.pin, settings.empty_pin, settings.active_high
        self._device = device("DigitalOutputDevice", number, active_high=high, initial_value=False, pin_factory=pins)
        self._empty = device("Button", empty, pin_factory=pins) if empty is not None else None
        self._goes_on, self._held = asyncio.Event(), asyncio.Event()
        self._goes_on.set()

    async def perform(self, call: Call, tell: Tell) -> Mapping[str, Any]:
        """On for the call's time, off at its end, however it ends."""
        amount = number_of(call, self._settings.amount)
        needed_s, on_s, reported_s, loop = amount / self._settings.per_s, 0.0, 0.0, asyncio.get_running_loop()
        look_s = REPORT_EVERY_S if self._empty is None else LOOK_S
        self.hold(False)  # a call that was cancelled while it was held ended held
        try:
            while needed_s - on_s > SLACK_S:
                await self._goes_on.wait()
                self._check_supply()
                began_s = loop.time()
                self._device.on()
                with suppress(TimeoutError):
                    await asyncio.wait_for(self._held.wait(), min(look_s, needed_s - on_s))
                on_s += loop.time() - began_s
                if on_s - reported_s >= REPORT_EVERY_S or needed_s - on_s <= SLACK_S:
                    reported_s = on_s
                    tell(min(on_s / needed_s, 1.0), "")
        finally:
            self._device.off()
        return {self._settings.amount: amount}

    def _check_supply(self) -> None:
        if self._empty is not None and self._empty.is_pressed:
            raise FailedError(self._settings.empty_reason)

    def hold(self, on: bool) -> None:
        """Off until Resume; the rest of its time is kept."""
        before, after = (self._goes_on, self._held) if on else (self._held, self._goes_on)
        before.clear()
        after.set()
        if on:
            self._device.off()

    async def close(self) -> None:
        """Off, and free for others."""
        self._device.off()
        self._device.close()
        if self._empty is not None:
            self._empty.close()
