"""Pins of a single-board computer, by gpiozero over whatever library drives them."""

from __future__ import annotations

from typing import Any

from hvcpd.errors import DeviceError, how_to_install


def device(kind: str, pin: int, whose: str = "", **settings: Any) -> Any:
    """A device of gpiozero's, by the name of its class, on a pin, in Broadcom's numbers.

    Raises DeviceError, with its remedy, if gpiozero is missing, or the pin is not there or somebody else's.
    """
    try:
        import gpiozero
    except ImportError:
        remedy = how_to_install("gpiozero lgpio", "python3-gpiozero python3-lgpio")
        raise DeviceError(f"gpiozero is not installed; run `{remedy}`") from None
    make = getattr(gpiozero, kind)
    try:
        return make(pin, **settings)
    except Exception as error:  # lgpio, pigpio and RPi.GPIO have errors of their own, without a base in common
        text = f"{whose}pin {pin} cannot be used ({error}); end what else uses it, or name another pin"
        raise DeviceError(text) from None
