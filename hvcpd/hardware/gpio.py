"""Pins of a single-board computer, by gpiozero over whatever library drives them."""

from __future__ import annotations

import sys
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
    except pin_errors() as error:
        text = f"{whose}pin {pin} cannot be used ({error}); end what else uses it, or name another pin"
        raise DeviceError(text) from None


def pin_errors() -> tuple[type[Exception], ...]:
    """The errors of gpiozero and of the library that drives its pins. lgpio and pigpio have one of their own, without a
    base in common; they are loaded if they drive the pins."""
    import gpiozero

    loaded = (sys.modules[name] for name in ("lgpio", "pigpio") if name in sys.modules)
    return (gpiozero.GPIOZeroError, OSError, RuntimeError, ValueError, *(module.error for module in loaded))
