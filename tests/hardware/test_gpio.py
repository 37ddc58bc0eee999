"""Pins that cannot be had are told, whatever library drives them."""

from __future__ import annotations

import sys
from pathlib import Path
from types import ModuleType

import pytest

from hil_fakes.pins import FOLDER_VARIABLE
from hvcpd.errors import DeviceError
from hvcpd.hardware.gpio import device, why_no_pins


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


def test_a_computer_without_pins_is_told_so_in_one_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, recwarn: pytest.WarningsRecorder
) -> None:
    monkeypatch.setenv("GPIOZERO_PIN_FACTORY", "none")
    with pytest.raises(
        DeviceError, match=r"^pin 17 cannot be used: .*'none'.*; correct or unset GPIOZERO_PIN_FACTORY$"
    ):
        device("DigitalOutputDevice", 17)
    assert not recwarn.list
    assert "this computer has no pins" in why_no_pins(tmp_path)


@pytest.mark.parametrize("folder", [None, ""])
def test_fake_pins_without_a_folder_are_told(folder: str | None, monkeypatch: pytest.MonkeyPatch) -> None:
    """It was a KeyError, with its traceback."""
    monkeypatch.setenv("GPIOZERO_PIN_FACTORY", "files")
    monkeypatch.delenv(FOLDER_VARIABLE, raising=False)
    if folder is not None:
        monkeypatch.setenv(FOLDER_VARIABLE, folder)
    with pytest.raises(DeviceError, match=r"^pin 17 cannot be used: the fake pins have no folder; set FAKE_PINS="):
        device("DigitalOutputDevice", 17)


def test_pins_without_a_library_or_without_permission_are_told_with_the_remedy(tmp_path: Path) -> None:
    chip = tmp_path / "gpiochip0"
    chip.touch()
    assert "install" in why_no_pins(tmp_path)
    assert "sudo usermod -aG" in why_no_pins(tmp_path, lambda _path: False)
