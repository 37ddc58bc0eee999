"""A button of one's own that stops the robot: a switch between a pin and ground. By gpiozero, whose mock pins serve in
tests.

It shares the one latch with every other stop. It is read by this program, so it is no emergency stop (ISO 13850): that
one cuts the motors' power by itself.
"""

from __future__ import annotations

from typing import Any

from hvcpd.config.skill_settings import StopButtonSettings
from hvcpd.hardware.gpio import device, pin_errors


class StopButton:
    """Owns the pin while it lives. Raises DeviceError if there is none, or somebody else has it."""

    def __init__(self, pin: int, normally_closed: bool, pins: Any = None) -> None:
        """`pins` is the factory of gpiozero's that makes it; None: the one that suits the computer."""
        self._normally_closed = normally_closed
        self._device = device("InputDevice", pin, "the stop button's ", pull_up=True, pin_factory=pins)

    @property
    def pressed(self) -> bool:
        """Whether it is pressed. A pin that cannot be read counts as pressed, and so does the broken wire of a
        normally closed button."""
        try:
            is_closed = bool(self._device.is_active)  # to ground, against the pull-up
        except pin_errors():
            return True
        return is_closed != self._normally_closed

    def close(self) -> None:
        """Release the pin."""
        self._device.close()


def make_stop_button(settings: StopButtonSettings) -> StopButton | None:
    """The button that the settings name; None if they name none. Raises DeviceError."""
    return StopButton(settings.pin, settings.normally_closed) if settings.pin is not None else None
