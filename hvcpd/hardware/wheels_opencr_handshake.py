"""The handshake with an OpenCR controller: checks everything, reports every fault at once, and changes nothing."""

from __future__ import annotations

from dataclasses import dataclass

from hvcpd.hardware import opencr
from hvcpd.hardware.wheels_bus import BusError, DynamixelBus, PortLostError, answer, twice
from hvcpd.hardware.wheels_sense import LOWEST_VOLTAGE_V

LATE_S = 1.5
"""A controller that waits for a silent motor answers after half a second or two (its five reads wait 100 ms each)."""
LATE = (
    "it answers late, as it does while it waits for a motor that has lost its cable or its power; check both motors, "
    "then press its reset button"
)

_WHO = f"OpenCR (ID {opencr.DEVICE_ID})"

STATE_START = opencr.MILLIS.address
STATE_SIZE = opencr.BATTERY_VOLTAGE.address + opencr.BATTERY_VOLTAGE.size - STATE_START


@dataclass(frozen=True)
class ControllerState:
    """The controller's state. `millis` (ms) is 0 at its start."""

    millis: int
    debug_mode: int
    device_status: int
    voltage_v: float


def read_state(bus: DynamixelBus) -> ControllerState:
    """Read the controller's state with one request. Raises BusError."""
    window = bus.read_block(opencr.DEVICE_ID, STATE_START, STATE_SIZE)
    return ControllerState(
        opencr.MILLIS.decode(window, STATE_START),
        opencr.DEBUG_MODE.decode(window, STATE_START),
        opencr.DEVICE_STATUS.decode(window, STATE_START),
        opencr.BATTERY_VOLTAGE.decode(window, STATE_START) * opencr.BATTERY_UNIT_V,
    )


def inspect(bus: DynamixelBus) -> list[str]:
    """Everything that is wrong with the controller, each with its remedy; empty if all is well.

    Raises PortLostError if the adapter goes away meanwhile.
    """
    model = answer(lambda: bus.ping(opencr.DEVICE_ID))
    if model is None:
        if bus.hears(opencr.DEVICE_ID, LATE_S):
            return [f"{_WHO}: {LATE}"]
        return [
            f"{_WHO}: no answer; is the robot switched on, has its start-up melody played, "
            "and does it run the TurtleBot3 firmware?"
        ]
    try:
        found = twice(lambda: _faults(bus, model))
        return [f"{_WHO}: {text}" for text in found]
    except PortLostError:
        raise
    except BusError as error:
        return [f"{_WHO}: it answers a ping but then: {error}; check the cable"]


def _faults(bus: DynamixelBus, model: int) -> list[str]:
    if model != opencr.MODEL_NUMBER:
        return [f"model number {model} is not OpenCR with TurtleBot3 firmware ({opencr.MODEL_NUMBER}); check the ID"]
    faults = []
    kind = bus.read(opencr.DEVICE_ID, opencr.MODEL_INFORMATION)
    if kind != opencr.BURGER_MODEL:
        faults.append(f"its firmware is for model {kind}, not for a Burger ({opencr.BURGER_MODEL}); flash the Burger's")
    state = read_state(bus)
    if state.debug_mode:
        faults.append(
            "debug mode is on, or the firmware is too old to have one: it would not stop when we fall silent; "
            "press its reset button, and if that does not help flash ROBOTIS's newest firmware"
        )
    if state.device_status == opencr.NO_MOTORS:
        faults.append("it finds no motors; check their cable and power, then press its reset button")
    if state.voltage_v < LOWEST_VOLTAGE_V:
        faults.append(f"only {state.voltage_v:.1f} V, {LOWEST_VOLTAGE_V:.1f} V are needed; charge the battery")
    return faults
