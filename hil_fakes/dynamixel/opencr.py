"""A stateful OpenCR with the TurtleBot3 firmware: one Protocol 2.0 device that drives two motors of its own.

Sources: ROBOTIS-GIT OpenCR `turtlebot3_ros2/src/turtlebot3/turtlebot3.cpp` (what the firmware does, as of V221004R1),
ROBOTIS-GIT turtlebot3 `control_table.hpp` (addresses), Dynamixel2Arduino `slave.cpp` (how it answers). Time passes
only in `advance`.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence

from hil_fakes.dynamixel.control_table import Item
from hil_fakes.dynamixel.memory import ItemTable
from hil_fakes.dynamixel.motor import FakeMotor, turtlebot3_pair
from hil_fakes.dynamixel.protocol import Instruction, Packet, StatusError, address_and_size, encode_status

DEVICE_ID = 200
MODEL_NUMBER = 0x5000
FIRMWARE_VERSION = 1
"""Assumption; the sources at hand do not tell which number goes with V221004R1."""

HEARTBEAT_TIMEOUT_S = 0.5
CONTROL_PERIOD_S = 0.02
"""The firmware's INTERVAL_MS_TO_CONTROL_MOTOR and its refresh of the table."""
SILENT_MOTOR_LOOP_S = 0.5
"""A motor that falls silent makes the firmware's loop wait for it at five reads, up to 100 ms each (the time-outs of
Dynamixel2Arduino 0.5 and newer; older ones wait less); and each turn of the loop takes one packet from us only."""
BOOT_S = 2.0
"""Calibration of the gyroscope after power-up, during which nothing answers; order of magnitude."""
BUFFER_SIZE = 256
"""A read whose reply does not fit is not answered; assumption about the library's buffer."""
CUT_OFF_V = 11.0
"""Below this for `CUT_OFF_S` the firmware cuts the motors' power (ROBOTIS e-Manual, TurtleBot3)."""
CUT_OFF_S = 10.0
"""Assumption."""

WHEEL_RADIUS_M = 0.033
SEPARATION_M = 0.160
MAX_LINEAR_M_S = WHEEL_RADIUS_M * 2.0 * math.pi * 61.0 / 60.0
MAX_ANGULAR_RAD_S = MAX_LINEAR_M_S / 0.080
UNITS_PER_M_S = 60.0 / (2.0 * math.pi * WHEEL_RADIUS_M * 0.229)
"""Goal velocity of a motor for a speed of the rim."""
STATUS_RUNNING, STATUS_NOT_CONNECTED_MOTORS = 1, -1

_SENSORS = "angular_velocity_x angular_velocity_y angular_velocity_z acceleration_x acceleration_y acceleration_z"
_SENSORS += " magnetic_x magnetic_y magnetic_z orientation_w orientation_x orientation_y orientation_z"

ITEMS = (
    Item("model_number", 0, 2),
    Item("model_information", 2, 4),
    Item("firmware_version", 6, 1),
    Item("id", 7, 1),
    Item("protocol_version", 9, 1),
    Item("millis", 10, 4),
    Item("debug_mode", 14, 1),
    Item("connect_ros2", 15, 1),
    Item("connect_manipulator", 16, 1),
    Item("device_status", 18, 1, signed=True),
    Item("heartbeat", 19, 1),
    *(Item(f"led_{n + 1}", 20 + n, 1) for n in range(4)),
    *(Item(name, 26 + n, 1) for n, name in enumerate(("button_1", "button_2", "bumper_1", "bumper_2"))),
    Item("illumination", 30, 2),
    Item("infrared", 34, 4),
    Item("sonar", 38, 4),
    Item("battery_voltage", 42, 4),
    Item("battery_percentage", 46, 4),
    Item("sound", 50, 1),
    Item("imu_recalibration", 59, 1),
    *(Item(name, 60 + 4 * n, 4) for n, name in enumerate(_SENSORS.split())),
    Item("present_current_left", 120, 4, signed=True),
    Item("present_current_right", 124, 4, signed=True),
    Item("present_velocity_left", 128, 4, signed=True),
    Item("present_velocity_right", 132, 4, signed=True),
    Item("present_position_left", 136, 4, signed=True),
    Item("present_position_right", 140, 4, signed=True),
    Item("motors_connected", 148, 1),
    Item("motor_torque", 149, 1),
    *(Item(f"linear_{axis}", 150 + 4 * n, 4, signed=True) for n, axis in enumerate("xyz")),
    *(Item(f"angular_{axis}", 162 + 4 * n, 4, signed=True) for n, axis in enumerate("xyz")),
    Item("profile_acceleration_left", 174, 4),
    Item("profile_acceleration_right", 178, 4),
)
BY_NAME = {item.name: item for item in ITEMS}
TABLE_SIZE = 182


class FakeOpenCR(ItemTable):
    """The controller of a TurtleBot3 Burger. `wheels` are its left and its right motor, with their faults."""

    def __init__(self, wheels: Sequence[FakeMotor] | None = None, *, debug_mode: bool = False) -> None:
        super().__init__(BY_NAME, TABLE_SIZE)
        self.wheels = self.left, self.right = wheels or turtlebot3_pair()
        self.powered = True
        """False: it is silent, and its motors are without power."""
        self._debug_at_boot = debug_mode
        self._phase_s = self._clock_s = self._low_s = 0.0
        self._waiting: deque[Packet] = deque()
        self._replies: list[bytes] = []
        self._boot()
        self._booting_s = 0.0  # the first test does not want to wait

    @property
    def motor_id(self) -> int:
        """The identifier that it answers to."""
        return self.get("id")

    @property
    def baud_rate_hz(self) -> int:
        """0: a USB device takes any speed."""
        return 0

    def seed(self, seed: int) -> None:
        """Restart the motors' random generators (encoder noise)."""
        for motor in self.wheels:
            motor.seed(seed)

    def reboot(self) -> None:
        """Reset button or brown-out: the motors lose their power for a moment too."""
        for motor in self.wheels:
            motor.reboot()
        self._boot()

    def respond(self, packet: Packet) -> list[bytes]:
        """Carry out an instruction; it knows ping, read and write, and is silent to all else, broadcasts included.

        While a motor is silent the instruction has to wait, and its reply comes by `collect`.
        """
        if packet.motor_id != self.motor_id or self._booting_s > 0.0:
            return []
        if self._slow or self._waiting:
            self._waiting.append(packet)
            return []
        return self._carry_out(packet)

    def collect(self) -> bytes:
        """The replies that came late, each once."""
        late, self._replies = b"".join(self._replies), []
        return late

    @property
    def _slow(self) -> bool:
        """Whether the firmware waits for a motor in each turn of its loop."""
        return bool(self.get("motors_connected")) and not (self.left.powered and self.right.powered)

    def _carry_out(self, packet: Packet) -> list[bytes]:
        address, size = address_and_size(packet.parameters)
        match packet.instruction:
            case Instruction.PING:
                return [encode_status(self.motor_id, 0, bytes(self._bytes[0:2] + self._bytes[6:7]))]
            case Instruction.READ if len(packet.parameters) == 4 and size + 11 <= BUFFER_SIZE:
                return [encode_status(self.motor_id, 0, self._read(address, size))]
            case Instruction.WRITE if len(packet.parameters) > 2:
                return [encode_status(self.motor_id, self._write(address, packet.parameters[2:]))]
        return []

    def advance(self, dt_s: float) -> None:
        """Let time pass: the firmware's loop runs every 20 ms, or slower while it waits for a motor."""
        left_s = dt_s
        while left_s > 1e-9:
            period_s = SILENT_MOTOR_LOOP_S if self._slow else CONTROL_PERIOD_S
            step_s = min(left_s, max(period_s - self._phase_s, 0.0))
            for motor in self.wheels:
                motor.advance(step_s)
            left_s -= step_s
            self._phase_s += step_s
            self._clock_s += step_s
            self._booting_s = max(self._booting_s - step_s, 0.0)
            if self._phase_s >= period_s - 1e-9:
                self._loop(self._phase_s)
                self._phase_s = 0.0

    def _boot(self) -> None:
        self._bytes[:] = bytes(TABLE_SIZE)
        for name, value in (("model_number", MODEL_NUMBER), ("model_information", 1), ("id", DEVICE_ID)):
            self.set(name, value)
        self.set("firmware_version", FIRMWARE_VERSION)
        self.set("protocol_version", 2)
        self.set("debug_mode", int(self._debug_at_boot))
        self.connected = self._was_connected = False
        """Whether it believes that a program is alive, and so follows the commands."""
        self._beat = 0
        self._beat_s = self._clock_s = self._phase_s = self._low_s = 0.0
        self._booting_s = BOOT_S
        self._waiting.clear()
        self._replies.clear()
        self._command = (0.0, 0.0)
        there = all(motor.powered for motor in self.wheels)
        self.set("device_status", STATUS_RUNNING if there else STATUS_NOT_CONNECTED_MOTORS)
        self.set("motors_connected", int(there))
        for motor in self.wheels:
            motor.memory.set("operating_mode", 1)
        self._set_torque(True)
        self._refresh()

    def _read(self, address: int, size: int) -> bytes:
        """Items that lie wholly within the window; zeros elsewhere."""
        window = bytearray(size)
        for item in _within(address, size):
            at = item.address - address
            window[at : at + item.size] = self._bytes[item.address : item.address + item.size]
        return bytes(window)

    def _write(self, address: int, data: bytes) -> int:
        """Every item that lies wholly within the window is set, even what the firmware only reports (until its next
        loop); an access error for the model information alone."""
        error = StatusError.NONE
        for item in _within(address, len(data)):
            if item.name in ("model_number", "model_information", "firmware_version"):
                error = StatusError.ACCESS
                continue
            at = item.address - address
            self._bytes[item.address : item.address + item.size] = data[at : at + item.size]
            self._act_on(item.name)
        return int(error)

    def _act_on(self, name: str) -> None:
        match name:
            case "linear_x":
                self._command = (_clamp(self.get(name) * 0.01, MAX_LINEAR_M_S), self._command[1])
            case "angular_z":
                self._command = (self._command[0], _clamp(self.get(name) * 0.01, MAX_ANGULAR_RAD_S))
            case "motor_torque":
                self._set_torque(bool(self.get(name)))
            case "profile_acceleration_left" | "profile_acceleration_right":
                motor = self.left if name.endswith("left") else self.right
                motor.write(108, self.get(name).to_bytes(4, "little"))
            case "imu_recalibration":
                self.set(name, 0)

    def _set_torque(self, on: bool) -> None:
        if self.get("motors_connected"):
            for motor in self.wheels:
                motor.write(64, bytes((int(on),)))

    def _loop(self, took_s: float) -> None:
        """One turn; the heartbeat is looked at in its beginning, packets and wheels come behind the reads."""
        if self._slow:
            self._serve(1)
            self._turn_wheels()
            self._watch_heartbeat()
        else:
            self._serve(len(self._waiting))
            self._watch_heartbeat()
            self._turn_wheels()
        self._watch_battery(took_s)
        self._refresh()

    def _serve(self, most: int) -> None:
        for _ in range(min(most, len(self._waiting))):
            self._replies += self._carry_out(self._waiting.popleft())

    def _turn_wheels(self) -> None:
        if not self.connected:
            self._command = (0.0, 0.0)
        linear_m_s, angular_rad_s = self._command
        half_m_s = angular_rad_s * SEPARATION_M / 2.0
        for motor, rim_m_s in ((self.left, linear_m_s - half_m_s), (self.right, linear_m_s + half_m_s)):
            if motor.powered and self.powered and self.get("motors_connected"):
                motor.write(104, int(rim_m_s * UNITS_PER_M_S).to_bytes(4, "little", signed=True))

    def _watch_heartbeat(self) -> None:
        if self._was_connected != self.connected:
            self._was_connected = self.connected
            self._beat_s = self._clock_s
        elif self.get("heartbeat") != self._beat or self.get("debug_mode"):
            self._beat, self._beat_s, self.connected = self.get("heartbeat"), self._clock_s, True
        elif self._clock_s - self._beat_s >= HEARTBEAT_TIMEOUT_S - 1e-9:
            self._beat_s, self.connected = self._clock_s, False

    def _watch_battery(self, took_s: float) -> None:
        self._low_s = self._low_s + took_s if self.left.voltage_v < CUT_OFF_V else 0.0
        if self._low_s > CUT_OFF_S:
            for motor in self.wheels:
                motor.powered = False

    def _refresh(self) -> None:
        """The firmware's readings; for a motor that does not answer it keeps the last values."""
        self.set("millis", int(self._clock_s * 1000.0))
        self.set("connect_ros2", int(self.connected))
        volts = self.left.memory.get("present_input_voltage") / 10.0
        self.set("battery_voltage", round(volts * 100.0))
        self.set("battery_percentage", round(max(volts - 10.5, 0.0) / 1.8 * 10_000.0))
        for motor, side in ((self.left, "left"), (self.right, "right")):
            if motor.powered:
                self.set(f"present_current_{side}", motor.memory.get("present_load"))
                self.set(f"present_velocity_{side}", motor.memory.get("present_velocity"))
                self.set(f"present_position_{side}", motor.memory.get("present_position"))
        torque = [motor.memory.get("torque_enable") for motor in self.wheels if motor.powered]
        self.set("motor_torque", int(len(torque) == 2 and all(torque)))


def _within(address: int, size: int) -> list[Item]:
    """The items that lie wholly in a window of the table."""
    return [item for item in ITEMS if address <= item.address and item.address + item.size <= address + size]


def _clamp(value: float, limit: float) -> float:
    return min(max(value, -limit), limit)
