"""The motors that may turn a wheel or a joint: DYNAMIXEL models with the registers and units of `registers`."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Model:
    """A motor model; `oldest_firmware` is its first with a bus watchdog."""

    name: str
    oldest_firmware: int


MODELS: dict[int, Model] = {1060: Model("XL430-W250", 38)}
"""By the model number that they answer to a ping (e-Manual, "Model Number" and "Bus Watchdog", note)."""


def model_fault(number: int) -> str:
    """Why a motor of this model number cannot be used, "" if it can."""
    known = " or an ".join(f"{model.name} ({known})" for known, model in MODELS.items())
    return "" if number in MODELS else f"model number {number} is not an {known}"


def firmware_fault(number: int, firmware: int) -> str:
    """Why a known model's firmware cannot be used, with the remedy; "" if it can."""
    oldest = MODELS[number].oldest_firmware
    if firmware >= oldest:
        return ""
    return (
        f"firmware {firmware} has no bus watchdog, so it would not stop by itself; "
        f"update it to {oldest} or newer with Dynamixel Wizard 2.0"
    )
