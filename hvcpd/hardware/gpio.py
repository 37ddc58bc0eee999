"""Pins of a single-board computer, by gpiozero over whatever library drives them."""

from __future__ import annotations

import os
import sys
import warnings
from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from hvcpd.errors import DeviceError, how_to_install
from hvcpd.hardware.groups import group_of


def device(kind: str, pin: int, whose: str = "", **settings: Any) -> Any:
    """A device of gpiozero's, by the name of its class, on a pin, in Broadcom's numbers.

    Raises DeviceError, with its remedy, if gpiozero is missing, or the pin is not there or somebody else's.
    """
    try:
        import gpiozero
    except ImportError:
        raise DeviceError(_not_installed()) from None
    make = getattr(gpiozero, kind)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", gpiozero.PinFactoryFallback)  # it tries several libraries
            return make(pin, **settings)
    except gpiozero.BadPinFactory as error:
        chosen = "GPIOZERO_PIN_FACTORY" in os.environ
        why = f"{error}; correct or unset GPIOZERO_PIN_FACTORY" if chosen else why_no_pins()
        raise DeviceError(f"{whose}pin {pin} cannot be used: {why}") from None
    except pin_errors() as error:
        text = f"{whose}pin {pin} cannot be used ({error}); end what else uses it, or name another pin"
        raise DeviceError(text) from None


def _may_use(chip: Path) -> bool:
    return os.access(chip, os.R_OK | os.W_OK)


def _not_installed() -> str:
    remedy = how_to_install("gpiozero lgpio", "python3-gpiozero python3-lgpio")
    return f"gpiozero is not installed; run `{remedy}`"


def missing(folder: Path = Path("/dev"), may_use: Callable[[Path], bool] = _may_use) -> str | None:
    """What is missing for pins, with the remedy, as far as it shows without opening one; None if nothing is."""
    if find_spec("gpiozero") is None:
        return _not_installed()
    return None if "GPIOZERO_PIN_FACTORY" in os.environ else _no_chip(folder, may_use)


def why_no_pins(folder: Path = Path("/dev"), may_use: Callable[[Path], bool] = _may_use) -> str:
    """Why no library can drive any pin, with the remedy; `folder` has the computer's devices."""
    library = f"no library for them is installed; run `{how_to_install('lgpio', 'python3-lgpio')}`"
    return _no_chip(folder, may_use) or library


def _no_chip(folder: Path, may_use: Callable[[Path], bool]) -> str | None:
    chips = sorted(folder.glob("gpiochip*"))
    if not chips:
        return "this computer has no pins; for a trial use fake ones, GPIOZERO_PIN_FACTORY=files FAKE_PINS=FOLDER"
    if not any(map(may_use, chips)):
        group = group_of(chips[0], "gpio")
        return f"no permission for {chips[0]}; run `sudo usermod -aG {group} $USER`, and log in again"
    return None


def pin_errors() -> tuple[type[Exception], ...]:
    """The errors of gpiozero and of the library that drives its pins. lgpio and pigpio have one of their own, without a
    base in common; they are loaded if they drive the pins."""
    import gpiozero

    loaded = (sys.modules[name] for name in ("lgpio", "pigpio") if name in sys.modules)
    return (gpiozero.GPIOZeroError, OSError, RuntimeError, ValueError, *(module.error for module in loaded))
