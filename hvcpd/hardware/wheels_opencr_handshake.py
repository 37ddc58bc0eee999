"""The handshake with an OpenCR controller: checks everything, reports every fault at once, and changes nothing."""

from __future__ import annotations

from dataclasses import dataclass

from hvcpd.hardware import opencr
from hvcpd.hardware.wheels_bus import BusError, DynamixelBus, PortLostError, twice
from hvcpd.hardware.wheels_sense import LOWEST_VOLTAGE_V

LATE_S = 1.5
"""A controller that waits for a silent motor answers after half a second or two (its five reads wait 100 ms each)."""
LATE = (
    "it answers late, as it does while it waits for a motor that has lost its cable or its power; check both motors, "
    "then press its reset button"
)

STATE_START = opencr.MILLIS.address
STATE_SIZE = opencr.BATTERY_VOLTAGE.address + opencr.BATTERY_VOLTAGE.size - STATE_START


@dataclass(frozen=True)
class ControllerState:
    """What the controller says about itself. `millis` (ms) starts at 0 with it."""

    millis: int
    debug_mode: int
    device_status: int
    voltage_v: float


def read_state(bus: DynamixelBus, device_id: int) -> ControllerState:
    """Read the controller's state with one request. Raises BusError."""
    window = bus.read_block(device_id, STATE_START, STATE_SIZE)
    return ControllerState(
        opencr.MILLIS.decode(window, STATE_START),
        opencr.DEBUG_MODE.decode(window, STATE_START),
        opencr.DEVICE_STATUS.decode(window, STATE_START),
        opencr.BATTERY_VOLTAGE.decode(window, STATE_START) * opencr.BATTERY_UNIT_V,
    )


def inspect(bus: DynamixelBus, device_id: int, lowest_voltage_v: float = LOWEST_VOLTAGE_V) -> list[str]:
    """Everything that is wrong with the controller, each with its remedy; empty if all is well.

    Raises PortLostError if the adapter goes away meanwhile.
    """
    try:
        model = twice(lambda: bus.ping(device_id))
    except PortLostError:
        raise
    except BusError:
        if bus.hears(device_id, LATE_S):
            return [f"OpenCR (ID {device_id}): {LATE}"]
        return [
            f"OpenCR (ID {device_id}): no answer; is the robot switched on, has its start-up melody played, "
            "and does it run the TurtleBot3 firmware?"
        ]
    try:
        found = twice(lambda: _faults(bus, device_id, model, lowest_voltage_v))
        return [f"OpenCR (ID {device_id}): {text}" for text in found]
    except PortLostError:
        raise
    except BusError as error:
        return [f"OpenCR (ID {device_id}): it answers a ping but then: {error}; check the cable"]


def _faults(bus: DynamixelBus, device_id: int, model: int, lowest_voltage_v: float) -> list[str]:
    if model != opencr.MODEL_NUMBER:
        return [f"model number {model} is not OpenCR with TurtleBot3 firmware ({opencr.MODEL_NUMBER}); check the ID"]
    faults = []
    kind = bus.read(device_id, opencr.MODEL_INFORMATION)
    if kind != opencr.BURGER_MODEL:
        faults.append(f"its firmware is for model {kind}, not for a Burger ({opencr.BURGER_MODEL}); flash the Burger's")
    state = read_state(bus, device_id)
    if state.debug_mode:
        faults.append(
            "debug mode is on, or the firmware is too old to have one: it would not stop when we fall silent; "
            "press its reset button, and if that does not help flash ROBOTIS's newest firmware"
        )
    if state.device_status == opencr.NO_MOTORS:
        faults.append("it finds no motors; check their cable and power, then press its reset button")
    if state.voltage_v < lowest_voltage_v:
        faults.append(f"only {state.voltage_v:.1f} V, {lowest_voltage_v:.1f} V are needed; charge the battery")
    return faults
