"""The handshake with the motors: checks everything, reports every fault at once, then makes them ready to drive."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from functools import partial

from hvcpd.hardware import motors, registers
from hvcpd.hardware.wheels_bus import DynamixelBus, answer
from hvcpd.hardware.wheels_sense import LOWEST_VOLTAGE_V, MotorHealth, MotorState

SEARCH_S = 0.8
"""Listening for other motors when one is missing: 3 ms for each of 253 identifiers, and a reply's time-out."""


WINDOW_START = registers.PRESENT_LOAD.address
WINDOW_SIZE = registers.PRESENT_TEMPERATURE.address + registers.PRESENT_TEMPERATURE.size - WINDOW_START
"""Load, velocity, position, voltage and temperature lie side by side, 21 bytes."""


def read_states(bus: DynamixelBus, ids: Sequence[int]) -> tuple[MotorState, ...]:
    """Read torque, watchdog and errors of several motors with one request. Raises BusError."""
    low = registers.TORQUE_ENABLE.address
    windows = bus.sync_read(low, registers.BUS_WATCHDOG.address + registers.BUS_WATCHDOG.size - low, ids)
    return tuple(
        MotorState(
            motor_id=motor_id,
            torque_on=bool(registers.TORQUE_ENABLE.decode(windows[motor_id], low)),
            watchdog_tripped=registers.BUS_WATCHDOG.decode(windows[motor_id], low) == registers.WATCHDOG_TRIPPED,
            hardware_error=registers.HARDWARE_ERROR_STATUS.decode(windows[motor_id], low),
        )
        for motor_id in ids
    )


def read_health(bus: DynamixelBus, ids: Sequence[int]) -> tuple[MotorHealth, ...]:
    """Read the state of several motors with two requests. Raises BusError."""
    states = read_states(bus, ids)
    windows = bus.sync_read(WINDOW_START, WINDOW_SIZE, ids)
    return tuple(
        MotorHealth(
            **asdict(state),
            voltage_v=registers.PRESENT_INPUT_VOLTAGE.decode(window, WINDOW_START) * registers.VOLTAGE_UNIT_V,
            temperature_c=registers.PRESENT_TEMPERATURE.decode(window, WINDOW_START),
            load=registers.PRESENT_LOAD.decode(window, WINDOW_START) * registers.LOAD_UNIT,
        )
        for state, window in zip(states, (windows[motor_id] for motor_id in ids), strict=True)
    )


def inspect(bus: DynamixelBus, left_id: int, right_id: int) -> list[str]:
    """Everything that is missing or wrong with the two motors, each with its remedy; empty if all is well.

    Changes nothing. Raises PortLostError if the adapter goes away meanwhile.
    """
    if left_id == right_id:
        return [f"left and right motor have the same ID {left_id}: give them different IDs (TurtleBot3: 1 and 2)"]
    problems = []
    missing = []
    for side, motor_id in (("left", left_id), ("right", right_id)):
        found = answer(partial(_faults, bus, motor_id))
        if found is None:
            missing.append((side, motor_id))
        else:
            problems += [f"{side} motor (ID {motor_id}): {text}" for text in found]
    return [*_missing(bus, missing, (left_id, right_id)), *problems]


def strangers(found: Mapping[int, int], ids: Sequence[int]) -> str:
    """The devices other than `ids` in what `DynamixelBus.find` has found, in words; empty if there are none."""
    return ", ".join(
        f"ID {motor_id} ({motors.MODELS[model].name if model in motors.MODELS else f'model {model}'})"
        for motor_id, model in sorted(found.items())
        if motor_id not in ids
    )


def _missing(bus: DynamixelBus, missing: Sequence[tuple[str, int]], ids: tuple[int, int]) -> list[str]:
    if not missing:
        return []
    seen = strangers(bus.find(SEARCH_S), ids)
    if seen:
        remedy = "the line has {seen}: if that is it, set wheels.{side}_id, or make its ID {id} with Dynamixel Wizard 2"
    elif len(missing) < len(ids):
        remedy = (
            "the other motor answers; is the cable between the two plugged in, and has this one ID {id} and "
            "{speed} baud (ID 1 and 57600 baud when new)?"
        )
    else:
        remedy = "is the motors' power on, the cable plugged in, and their speed {speed} baud?"
    return [
        f"{side} motor (ID {motor_id}): no answer; "
        + remedy.format(seen=seen, side=side, id=motor_id, speed=bus.baud_rate)
        for side, motor_id in missing
    ]


def _faults(bus: DynamixelBus, motor_id: int) -> list[str]:
    model = bus.ping(motor_id)
    if fault := motors.model_fault(model):
        return [f"{fault}; fit one, or check the ID"]
    fault = motors.firmware_fault(model, bus.read(motor_id, registers.FIRMWARE_VERSION))
    faults = [fault] if fault else []
    health = read_health(bus, [motor_id])[0]
    if health.hardware_error:
        faults.append(
            f"hardware error: {registers.hardware_error_text(health.hardware_error)}; "
            "remove the cause, then switch the motor's power off and on"
        )
    if health.voltage_v < LOWEST_VOLTAGE_V:
        faults.append(f"only {health.voltage_v:.1f} V, {LOWEST_VOLTAGE_V:.1f} V are needed; charge the battery")
    return faults


def prepare(bus: DynamixelBus, motor_id: int) -> None:
    """Velocity mode at standstill with torque off, an earlier watchdog trip cleared, and no ramp of the motor's own,
    since the motion controller has one. Raises BusError.

    The goal is set to zero after the trip is cleared (before, it is read-only) and before torque comes on.
    """
    bus.write(motor_id, registers.TORQUE_ENABLE, 0)
    bus.write(motor_id, registers.BUS_WATCHDOG, 0)
    if bus.read(motor_id, registers.OPERATING_MODE) != registers.VELOCITY_CONTROL:
        bus.write(motor_id, registers.OPERATING_MODE, registers.VELOCITY_CONTROL)
    bus.write(motor_id, registers.GOAL_VELOCITY, 0)
    bus.write(motor_id, registers.PROFILE_ACCELERATION, 0)


def arm(bus: DynamixelBus, motor_id: int) -> None:
    """Watchdog and torque on. Raises BusError."""
    bus.write(motor_id, registers.BUS_WATCHDOG, registers.WATCHDOG_UNITS)
    bus.write(motor_id, registers.TORQUE_ENABLE, 1)
