"""The wheels' driver over the SDK, the pty and the fake motors, while nothing fails."""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import pytest

from hil_fakes.dynamixel.bus import FakeBus
from hil_fakes.dynamixel.motor import FakeMotor
from hil_fakes.dynamixel.virtual import VirtualTime
from hvcpd.errors import DeviceError
from hvcpd.hardware.registers import VELOCITY_UNIT_RAD_S
from hvcpd.hardware.wheels import DynamixelWheels
from hvcpd.ports import STANDSTILL, WheelCommand, WheelReading, Wheels

LIMIT_RAD_S = 265 * VELOCITY_UNIT_RAD_S
PATIENT_S = 20.0
"""Wait for a reply: on the pty every one comes, however busy the machine is."""


@dataclass
class Robot:
    """Fake motors on a pty and the driver, advanced together by one clock."""

    bus: FakeBus
    clock: VirtualTime
    wheels: DynamixelWheels

    def cycle(self, command: WheelCommand) -> WheelReading:
        """One exchange, and then time passes."""
        reading = self.wheels.exchange(command)
        self.clock.advance(0.02)
        return reading

    def run(self, command: WheelCommand, duration_s: float) -> WheelReading:
        """The same command for a while; the last reading."""
        return [self.cycle(command) for _ in range(round(duration_s / 0.02))][-1]


def make_robot(bus: FakeBus) -> Robot:
    clock = VirtualTime()
    clock.follow(bus.advance)
    return Robot(bus, clock, DynamixelWheels(bus.path, timeout_s=PATIENT_S, clock=clock))


@pytest.fixture
def robot(bus: FakeBus) -> Iterator[Robot]:
    made = make_robot(bus)
    made.wheels.open()
    yield made
    made.wheels.close()


def item(bus: FakeBus, motor_id: int, name: str) -> int:
    return bus.motors[motor_id].memory.get(name)


def test_open_makes_the_motors_ready(robot: Robot) -> None:
    wheels: Wheels = robot.wheels
    assert wheels is robot.wheels
    for motor_id in (1, 2):
        state = [item(robot.bus, motor_id, name) for name in ("operating_mode", "torque_enable", "bus_watchdog")]
        assert state == [1, 1, 12]
        assert item(robot.bus, motor_id, "goal_velocity") == 0


def test_an_old_goal_does_not_move_the_robot_at_open(bus: FakeBus) -> None:
    for motor in bus.motors.values():
        motor.memory.set("operating_mode", 1)
        motor.memory.set("goal_velocity", 200)
        motor.memory.set("bus_watchdog", -1)
    wheels = DynamixelWheels(bus.path)
    wheels.open()
    bus.advance(0.4)
    assert [motor.true_angle_rad for motor in bus.motors.values()] == [0.0, 0.0]
    wheels.close()


def test_wheels_turn_as_told_and_forward_is_positive(robot: Robot) -> None:
    reading = robot.run(WheelCommand(3.0, -1.5), 3.0)
    assert (reading.left_rad_s, reading.right_rad_s) == pytest.approx((3.0, -1.5), abs=VELOCITY_UNIT_RAD_S)
    truth = [robot.bus.motors[motor_id].true_angle_rad for motor_id in (1, 2)]
    reading = robot.cycle(STANDSTILL)
    assert (reading.left_rad, reading.right_rad) == pytest.approx(truth, abs=0.005)


@pytest.mark.parametrize(
    ("wanted", "limit_units", "expected"),
    [
        (WheelCommand(20.0, 10.0), 265, (265, 132)),
        (WheelCommand(-20.0, 20.0), 265, (-265, 265)),
        (WheelCommand(3.0, 6.0), 100, (50, 100)),
        (WheelCommand(LIMIT_RAD_S, 0.0), 1023, (265, 0)),
    ],
)
def test_speeds_beyond_the_limit_keep_their_ratio(
    bus: FakeBus, wanted: WheelCommand, limit_units: int, expected: tuple[int, int]
) -> None:
    for motor in bus.motors.values():
        motor.memory.set("velocity_limit", limit_units)
    wheels = DynamixelWheels(bus.path)
    wheels.open()
    wheels.exchange(wanted)
    assert tuple(item(bus, motor_id, "goal_velocity") for motor_id in (1, 2)) == expected
    wheels.close()


def test_a_speed_that_is_no_number_is_our_own_mistake(robot: Robot) -> None:
    with pytest.raises(ValueError, match="finite"):
        robot.wheels.exchange(WheelCommand(math.nan, 0.0))


@pytest.mark.parametrize("speed", [5.0, -5.0])
def test_the_angle_runs_on_over_the_end_of_32_bits(speed: float) -> None:
    start = math.copysign(2**31 - 1000, speed)
    with FakeBus([FakeMotor(1, start_ticks=int(start)), FakeMotor(2, start_ticks=int(start))]) as bus:
        robot = make_robot(bus)
        robot.wheels.open()
        reading = robot.run(WheelCommand(speed, speed), 4.0)
        turned_rad = reading.left_rad - int(start) / 4096 * 2.0 * math.pi
        assert turned_rad == pytest.approx(speed * 4.0, rel=0.05)
        robot.wheels.close()


def test_the_angle_is_the_motors_own_count_so_that_another_process_can_go_on_from_it() -> None:
    with FakeBus([FakeMotor(1), FakeMotor(2)]) as bus:
        robot = make_robot(bus)
        robot.wheels.open()
        robot.run(WheelCommand(3.0, 3.0), 1.0)
        before = robot.run(WheelCommand(0.0, 0.0), 1.0)
        robot.wheels.close()
        again = make_robot(bus)
        again.wheels.open()
        after = again.run(WheelCommand(0.0, 0.0), 0.1)
        again.wheels.close()
    assert before.left_rad > 2.0
    assert (after.left_rad, after.right_rad) == pytest.approx((before.left_rad, before.right_rad), abs=0.01)


def test_close_stops_and_lets_go(robot: Robot) -> None:
    robot.run(WheelCommand(3.0, 3.0), 0.5)
    robot.wheels.close()
    for motor_id in (1, 2):
        assert (item(robot.bus, motor_id, "torque_enable"), item(robot.bus, motor_id, "goal_velocity")) == (0, 0)
    robot.wheels.close()
    with pytest.raises(DeviceError, match="not open"):
        robot.wheels.exchange(STANDSTILL)


def test_a_closed_driver_opens_again(robot: Robot) -> None:
    robot.wheels.close()
    robot.wheels.open()
    assert robot.run(WheelCommand(2.0, 2.0), 1.0).left_rad == pytest.approx(2.0 * 0.88, rel=0.05)


def test_health_tells_voltage_and_load(robot: Robot) -> None:
    robot.bus.motors[2].voltage_v = 11.3
    robot.run(WheelCommand(3.0, 3.0), 0.5)
    left, right = robot.wheels.health()
    assert (left.voltage_v, right.voltage_v) == pytest.approx((12.0, 11.3))
    assert left.torque_on
    assert 0.0 < left.load < 0.2
    assert left.temperature_c == 30
