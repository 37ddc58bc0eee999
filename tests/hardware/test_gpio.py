"""Pins that cannot be had are told, whatever library drives them."""

from __future__ import annotations

import pytest

from hvcpd.errors import DeviceError
from hvcpd.hardware.gpio import device


class BusyLine(Exception):
    """What lgpio raises: neither an OSError nor gpiozero's."""


class BusyPins:
    """A factory of pins that are all another program's."""

    def reserve_pins(self, *_: object) -> None:
        raise BusyLine("GPIO busy")


def test_an_error_of_the_library_below_gpiozero_is_told_with_a_remedy() -> None:
    told = r"the lamp's pin 17 cannot be used \(GPIO busy\); end what else uses it, or name another pin"
    with pytest.raises(DeviceError, match=told):
        device("DigitalOutputDevice", 17, "the lamp's ", pin_factory=BusyPins())
