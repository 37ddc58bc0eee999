"""Pins that cannot be had are told, whatever library drives them."""

from __future__ import annotations

import sys
from types import ModuleType

import pytest

from hvcpd.errors import DeviceError
from hvcpd.hardware.gpio import device


class BusyLine(Exception):
    """An error as lgpio's and pigpio's: neither an OSError nor gpiozero's."""


class BusyPins:
    """A factory of pins that are all another program's."""

    def reserve_pins(self, *_: object) -> None:
        raise BusyLine("GPIO busy")


@pytest.mark.parametrize("library", ["lgpio", "pigpio"])
def test_an_error_of_the_library_below_gpiozero_is_told_with_a_remedy(
    library: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    below = ModuleType(library)
    below.error = BusyLine  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, library, below)  # as where it drives the pins
    told = r"the lamp's pin 17 cannot be used \(GPIO busy\); end what else uses it, or name another pin"
    with pytest.raises(DeviceError, match=told):
        device("DigitalOutputDevice", 17, "the lamp's ", pin_factory=BusyPins())
