"""A stateful DYNAMIXEL motor: registers, bus watchdog, velocity and position mode. Time passes only in `advance`.

Source of the behaviour: ROBOTIS e-Manual, page xl430-w250. Where the manual is silent, the fake takes the answer that
punishes a careless driver: a goal velocity survives torque off and a tripped watchdog, and acts again afterwards.
Modes other than velocity and position control hold the shaft still. `obstacle_ticks` is a joint's load.
"""

from __future__ import annotations

import math
import random

from hil_fakes.dynamixel import control_table as ct
from hil_fakes.dynamixel.memory import ControlMemory
from hil_fakes.dynamixel.physics import (
    ACCELERATION_UNIT_RAD_S2,
    NO_LOAD_RAD_S_PER_V,
    TICKS_PER_TURN,
    VELOCITY_UNIT_RAD_S,
    Shaft,
    ShaftSettings,
)
from hil_fakes.dynamixel.protocol import ALERT, StatusError

WATCHDOG_UNIT_S = 0.020
POSITION_GAIN_PER_S = 10.0
"""Position mode's speed by the way that is left; assumption."""
REVERSE = 0x01
"""Bit 0 of the drive mode: positive is clockwise."""
FRICTION_LOAD = 50
"""Load of a wheel that rolls freely, in units of 0.1 %; assumption."""
ERROR_VOLTAGE, SHUTDOWN_OVERHEAT, SHUTDOWN_OVERLOAD = 1 << 0, 1 << 2, 1 << 5
"""Bits of the hardware error status (e-Manual)."""
OVERLOAD_SHARE = 0.8
OVERLOAD_S = 3.0
"""Duration of an effort beyond the limit that is an overload; the manual says "persistent" and gives no figures:
assumption."""
SAG_V = 0.4
"""The supply falls by this at full effort: about 0.3 ohm of battery, switch and cable at 1.3 A; assumption."""
FULL_PWM = 885
"""The PWM items' value for all of the voltage (e-Manual)."""
AMBIENT_C = 30.0
HEATING_C = 60.0
HEATING_S = 300.0
"""Final rise of the temperature at full effort, °C, and its time constant; assumptions."""


JOINT = ShaftSettings(time_constant_s=0.03)
"""A joint's shaft has no wheel to turn: less lag, so that position mode hardly overshoots; an assumption."""


class FakeMotor:
    """One motor.

    `mounting` is +1 if a counter-clockwise turn of the shaft, seen at the horn, drives the robot forward (a left
    wheel), and -1 if it drives it backward (a right wheel). `drive_mode` 1 makes the motor count the other way.
    """

    def __init__(
        self,
        motor_id: int = 1,
        *,
        baud_rate_hz: int = 1_000_000,
        drive_mode: int = 0,
        mounting: int = 1,
        voltage_v: float = 12.0,
        start_ticks: int = 0,
        shaft: ShaftSettings | None = None,
    ) -> None:
        self.mounting = mounting
        self.powered = True
        """False: the motor is silent and without torque."""
        self.memory = ControlMemory()
        self.memory.set("id", motor_id)
        self.memory.set("baud_rate", ct.BAUD_RATES_HZ.index(baud_rate_hz))
        self.memory.set("drive_mode", drive_mode)
        self._shaft = Shaft(shaft or ShaftSettings())
        self._random = random.Random(motor_id)
        self._base_ticks = start_ticks
        self._noise_ticks = 0.0
        self._silence_s = 0.0
        self._clock_s = 0.0
        self._registered: tuple[int, bytes] | None = None
        self._voltage_v = voltage_v
        self._overload_s = 0.0
        self._effort = 0
        self.temperature_c = AMBIENT_C
        """Of the case; settable."""
        self.obstacle_ticks: int | None = None
        """A thing between a gripper's fingers: the motor does not count beyond it; settable."""
        self.watchdog_broken = False
        """True: a motor that does not keep its manual, to try what judges it."""
        self._refresh()

    @property
    def motor_id(self) -> int:
        """The identifier that the motor answers to."""
        return self.memory.get("id")

    @property
    def baud_rate_hz(self) -> int:
        """The only line speed at which the motor understands anything."""
        return ct.BAUD_RATES_HZ[self.memory.get("baud_rate")]

    @property
    def true_angle_rad(self) -> float:
        """The true angle of the wheel, forward positive, without noise. For the bench, never the robot."""
        return self.mounting * self._shaft.angle_rad

    @property
    def true_speed_rad_s(self) -> float:
        """The true speed of the wheel, forward positive."""
        return self.mounting * self._shaft.speed_rad_s

    @property
    def voltage_v(self) -> float:
        """Supply voltage; set it to let the battery sag."""
        return self._voltage_v

    @voltage_v.setter
    def voltage_v(self, value: float) -> None:
        self._voltage_v = value
        self._refresh()

    @property
    def blocked(self) -> bool:
        """True while something holds the wheel."""
        return self._shaft.blocked

    @blocked.setter
    def blocked(self, value: bool) -> None:
        self._shaft.blocked = value

    def seed(self, seed: int) -> None:
        """Restart the motor's random generator (encoder noise)."""
        self._random = random.Random(seed * 1000 + self.motor_id)

    def turn_by_hand(self, angle_rad: float) -> None:
        """Someone turns the wheel, forward positive."""
        self._shaft.angle_rad += self.mounting * angle_rad
        self._refresh()

    def raise_hardware_error(self, bits: int) -> None:
        """A hardware fault: the status shows it, replies carry the alert, and the shutdown item's bits end torque."""
        self.memory.set("hardware_error_status", self.memory.get("hardware_error_status") | bits)
        if self._shut_down:
            self.memory.set("torque_enable", 0)

    def reboot(self) -> None:
        """Reboot instruction or brown-out: RAM is lost, and the position is again within one turn."""
        self.memory.reset_ram()
        self._registered = None
        self._silence_s = 0.0
        self._overload_s = 0.0
        self._forget_turns()

    def clear_turns(self) -> StatusError:
        """Clear instruction: bring the position within one turn; refused in motion."""
        if self.memory.get("moving"):
            return StatusError.RESULT_FAIL
        self._forget_turns()
        return StatusError.NONE

    def _forget_turns(self) -> None:
        self._base_ticks -= math.floor(self._exact_ticks / TICKS_PER_TURN) * TICKS_PER_TURN
        self._refresh()

    def error_field(self, error: StatusError) -> int:
        """The error field of a reply: the number, and the alert bit if the hardware reports a fault."""
        return int(error) | (ALERT if self.memory.get("hardware_error_status") else 0)

    def notice_traffic(self) -> None:
        """Any instruction on the bus counts as communication for the watchdog."""
        self._silence_s = 0.0

    def write(self, address: int, data: bytes) -> StatusError:
        """Carry out a write instruction."""
        error, changes = self.memory.check(address, data)
        if error is not StatusError.NONE:
            return error
        if self._shut_down and any(c.item.name == "torque_enable" and c.value for c in changes):
            return StatusError.RESULT_FAIL
        for change in changes:
            self.memory.set(change.item.name, change.value)
        self._refresh()
        return StatusError.NONE

    def register(self, address: int, data: bytes) -> StatusError:
        """Carry out a reg write instruction: keep the write until the action instruction."""
        error, _ = self.memory.check(address, data)
        if error is StatusError.NONE:
            self._registered = (address, data)
            self.memory.set("registered_instruction", 1)
        return error

    def act(self) -> StatusError:
        """Carry out the registered write."""
        if self._registered is None:
            return StatusError.INSTRUCTION
        address, data = self._registered
        self._registered = None
        self.memory.set("registered_instruction", 0)
        return self.write(address, data)

    def advance(self, dt_s: float) -> None:
        """Let `dt_s` seconds pass: the watchdog counts, the shaft turns, the sensors are read once."""
        before_s = min(dt_s, self._watchdog_left_s())
        self._move(before_s)
        if before_s < dt_s:
            self.memory.set("bus_watchdog", -1)
            self._move(dt_s - before_s)
        self._silence_s += dt_s
        self._clock_s += dt_s
        self._noise_ticks = self._random.gauss(0.0, self._shaft.settings.encoder_noise_ticks)
        self._refresh()
        self._wear(dt_s)

    def _wear(self, dt_s: float) -> None:
        """Heat and overload: what effort does to the motor in the long run."""
        effort = abs(self._effort) / 1000.0
        target_c = AMBIENT_C + HEATING_C * effort * effort
        self.temperature_c += (target_c - self.temperature_c) * (1.0 - math.exp(-dt_s / HEATING_S))
        self._overload_s = self._overload_s + dt_s if effort > OVERLOAD_SHARE else 0.0
        errors = SHUTDOWN_OVERLOAD if self._overload_s >= OVERLOAD_S else 0
        errors |= SHUTDOWN_OVERHEAT if self.temperature_c > self.memory.get("temperature_limit") else 0
        volts = self.memory.get("present_input_voltage")
        if not self.memory.get("min_voltage_limit") <= volts <= self.memory.get("max_voltage_limit"):
            errors |= ERROR_VOLTAGE
        if errors and self.powered:
            self.raise_hardware_error(errors)

    @property
    def _shut_down(self) -> bool:
        return bool(self.memory.get("hardware_error_status") & self.memory.get("shutdown"))

    @property
    def _direction(self) -> int:
        return -1 if self.memory.get("drive_mode") & REVERSE else 1

    @property
    def _exact_ticks(self) -> float:
        return self._base_ticks + self._direction * self._shaft.angle_rad * TICKS_PER_TURN / (2.0 * math.pi)

    @property
    def _no_load_rad_s(self) -> float:
        return NO_LOAD_RAD_S_PER_V * max(self._voltage_v, 0.0)

    def _watchdog_left_s(self) -> float:
        setting = self.memory.get("bus_watchdog")
        if self.watchdog_broken or setting <= 0 or not self.memory.get("torque_enable"):
            return math.inf
        return max(setting * WATCHDOG_UNIT_S - self._silence_s, 0.0)

    def _move(self, dt_s: float) -> None:
        if dt_s <= 0.0:
            return
        if not (self.powered and self.memory.get("torque_enable")):
            self._shaft.coast(dt_s)
            return
        tripped = self.memory.get("bus_watchdog") == -1
        wanted_rad_s = 0.0 if tripped else self._direction * self._wanted_rad_s()
        wanted_rad_s = max(-self._no_load_rad_s, min(self._no_load_rad_s, wanted_rad_s))
        profile = 0 if tripped else self.memory.get("profile_acceleration")
        self._shaft.drive(wanted_rad_s, profile * ACCELERATION_UNIT_RAD_S2, dt_s)
        self._meet(wanted_rad_s)

    def _wanted_rad_s(self) -> float:
        """The speed that the goals ask for, in the motor's own direction."""
        mode = self.memory.get("operating_mode")
        if mode == ct.VELOCITY_CONTROL:
            return self.memory.get("goal_velocity") * VELOCITY_UNIT_RAD_S
        if mode != ct.POSITION_CONTROL:
            return 0.0
        way_rad = (self.memory.get("goal_position") - self._exact_ticks) * 2.0 * math.pi / TICKS_PER_TURN
        profile = self.memory.get("profile_velocity") * VELOCITY_UNIT_RAD_S or self._no_load_rad_s
        most_rad_s = min(profile, self._no_load_rad_s * abs(self.memory.get("goal_pwm")) / FULL_PWM)
        return max(-most_rad_s, min(most_rad_s, POSITION_GAIN_PER_S * way_rad))

    def _meet(self, wanted_rad_s: float) -> None:
        """Stand at the obstacle instead of going past it, held there while it is pressed against."""
        if self.obstacle_ticks is None:
            return
        beyond_ticks = self._exact_ticks - self.obstacle_ticks
        self._shaft.blocked = beyond_ticks >= 0.0 and self._direction * wanted_rad_s > 0.0
        if beyond_ticks > 0.0:
            self._shaft.angle_rad -= self._direction * beyond_ticks * 2.0 * math.pi / TICKS_PER_TURN
            self._shaft.speed_rad_s = 0.0

    def _refresh(self) -> None:
        """Read the sensors into the table."""
        memory, shaft, direction = self.memory, self._shaft, self._direction
        load = self._effort = self._load()
        speed = round(direction * shaft.speed_rad_s / VELOCITY_UNIT_RAD_S)
        position = round(self._exact_ticks + self._noise_ticks) + memory.get("homing_offset")
        memory.set("present_velocity", speed)
        memory.set("present_position", position)
        memory.set("velocity_trajectory", round(direction * shaft.setpoint_rad_s / VELOCITY_UNIT_RAD_S))
        memory.set("position_trajectory", position)
        memory.set("present_load", load)
        memory.set("present_temperature", round(self.temperature_c))
        memory.set("present_pwm", round(FULL_PWM * load / 1000))
        memory.set("present_input_voltage", round((self._voltage_v - SAG_V * abs(load) / 1000.0) * 10.0))
        memory.set("moving", int(abs(speed) > memory.get("moving_threshold")))
        memory.set("realtime_tick", int(self._clock_s * 1000.0) % 32_768)

    @property
    def _most_effort(self) -> float:
        """In units of 0.1 %; in position mode the goal PWM limits it."""
        in_position_mode = self.memory.get("operating_mode") == ct.POSITION_CONTROL
        return 1000.0 * abs(self.memory.get("goal_pwm")) / FULL_PWM if in_position_mode else 1000.0

    def _load(self) -> int:
        """Effort in units of 0.1 %: friction, and what is missing to the wanted speed."""
        shaft = self._shaft
        if not self.memory.get("torque_enable") or self._no_load_rad_s == 0.0:
            return 0
        if shaft.blocked:
            effort = math.copysign(self._most_effort, shaft.setpoint_rad_s) if shaft.setpoint_rad_s else 0.0
        else:
            friction = math.copysign(FRICTION_LOAD, shaft.speed_rad_s) if abs(shaft.speed_rad_s) > 1e-3 else 0.0
            effort = friction + 1000.0 * (shaft.setpoint_rad_s - shaft.speed_rad_s) / self._no_load_rad_s
        return self._direction * round(max(-1000.0, min(1000.0, effort)))


def turtlebot3_pair(left_id: int = 1, right_id: int = 2, baud_rate_hz: int = 1_000_000) -> tuple[FakeMotor, FakeMotor]:
    """The wheel motors of a TurtleBot3: the right one is mounted the other way round and counts in reverse.

    So a positive goal velocity drives either wheel forward, as ROBOTIS's own firmware (OpenCR,
    `turtlebot3_motor_driver.cpp`: one sign for both wheels) expects of motors from its kit.
    """
    left = FakeMotor(left_id, baud_rate_hz=baud_rate_hz)
    return left, FakeMotor(right_id, drive_mode=REVERSE, mounting=-1, baud_rate_hz=baud_rate_hz)
