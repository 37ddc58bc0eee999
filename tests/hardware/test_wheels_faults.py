"""The driver on a bad line: it heals what it can, says what it cannot, and the wheels stop."""

from contextlib import suppress

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from hil_fakes.dynamixel.bus import FakeBus
from hil_fakes.dynamixel.faults import ReplyFault
from hil_fakes.dynamixel.motor import SHUTDOWN_OVERLOAD, turtlebot3_pair
from hvcpd.errors import DeviceError
from hvcpd.ports import STANDSTILL, WheelCommand
from tests.hardware.conftest import HASTY, Robot, make_robot

pytestmark = pytest.mark.slow

AHEAD = WheelCommand(3.0, 3.0)


@pytest.mark.parametrize(
    ("before", "fault"),
    [
        (0, ReplyFault.DROP),
        (1, ReplyFault.DROP),
        (0, ReplyFault.CORRUPT),
        (1, ReplyFault.CORRUPT),
        (1, ReplyFault.LATE),
    ],
)
def test_one_bad_reply_is_healed(hasty: Robot, before: int, fault: ReplyFault) -> None:
    hasty.run(AHEAD, 0.2)
    hasty.bus.faults.schedule(*[ReplyFault.NONE] * before, fault)
    reading = hasty.cycle(AHEAD)
    assert hasty.wheels.faults == 1
    assert reading.left_rad == pytest.approx(hasty.bus.motors[1].true_angle_rad, abs=0.08)


def test_noise_on_the_line_costs_nothing(hasty: Robot) -> None:
    hasty.bus.faults.schedule(*[ReplyFault.NOISE] * 20)
    hasty.run(AHEAD, 0.2)
    assert hasty.wheels.faults == 0


@settings(max_examples=15, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(st.lists(st.sampled_from(list(ReplyFault)), max_size=6))
def test_no_schedule_of_faults_gives_a_wrong_reading(faults: list[ReplyFault]) -> None:
    with FakeBus(turtlebot3_pair(), seed=2) as bus:
        robot = make_robot(bus, HASTY)
        robot.wheels.open()
        robot.run(AHEAD, 0.1)
        bus.faults.schedule(*faults)
        for _ in range(5):
            before = [bus.motors[motor_id].true_angle_rad for motor_id in (1, 2)]
            try:
                reading = robot.cycle(AHEAD)
            except DeviceError:
                continue
            assert (reading.left_rad, reading.right_rad) == pytest.approx(before, abs=0.02)
        robot.wheels.close()


def test_a_silent_motor_is_an_error_and_stops_the_other(hasty: Robot) -> None:
    hasty.run(AHEAD, 0.5)
    hasty.bus.motors[2].powered = False
    with pytest.raises(DeviceError, match="no answer from motor 2"):
        hasty.wheels.exchange(AHEAD)
    assert hasty.bus.wait_until(lambda: hasty.bus.motors[1].memory.get("goal_velocity") == 0)


def test_a_pause_longer_than_the_lease_stops_the_wheels_and_is_healed(robot: Robot) -> None:
    robot.run(AHEAD, 0.5)
    robot.wait(1.0)
    assert [motor.memory.get("bus_watchdog") for motor in robot.bus.motors.values()] == [-1, -1]
    assert robot.bus.motors[1].true_speed_rad_s == pytest.approx(0.0, abs=0.05)
    robot.wheels.exchange(STANDSTILL)
    robot.wait(0.2)
    assert robot.bus.motors[1].true_speed_rad_s == pytest.approx(0.0, abs=0.05)  # the old goal is not taken up
    assert robot.run(AHEAD, 1.0).left_rad_s == pytest.approx(3.0, abs=0.05)


def test_a_trip_that_no_clock_saw_is_found_within_half_a_second(robot: Robot) -> None:
    robot.run(AHEAD, 0.5)
    robot.bus.advance(1.0)  # the motors waited, the driver's clock did not notice
    assert robot.run(AHEAD, 1.0).left_rad_s == pytest.approx(3.0, abs=0.05)


def test_a_brown_out_is_healed_without_a_jump_of_the_angle(robot: Robot) -> None:
    robot.run(AHEAD, 5.0)
    robot.bus.motors[1].reboot()
    before = robot.bus.motors[1].true_angle_rad
    reading = robot.run(AHEAD, 0.04)
    assert reading.left_rad == pytest.approx(before, abs=0.1)
    reading = robot.run(AHEAD, 2.0)
    assert reading.left_rad == pytest.approx(robot.bus.motors[1].true_angle_rad, abs=0.1)
    assert reading.left_rad_s == pytest.approx(3.0, abs=0.05)


def test_a_hardware_error_stops_both_wheels_and_is_named(robot: Robot) -> None:
    robot.run(AHEAD, 0.2)
    robot.bus.motors[2].raise_hardware_error(SHUTDOWN_OVERLOAD)
    with pytest.raises(DeviceError, match="motor 2 reports a hardware error: overload"):
        robot.cycle(AHEAD)
    assert robot.bus.wait_until(lambda: robot.bus.motors[1].memory.get("goal_velocity") == 0)


def test_unplugging_is_an_error_and_replugging_heals_without_a_jump(hasty: Robot) -> None:
    hasty.run(AHEAD, 1.0)
    hasty.bus.unplug()
    with pytest.raises(DeviceError):
        hasty.wheels.exchange(AHEAD)
    with pytest.raises(DeviceError, match="no such port"):
        hasty.wheels.exchange(AHEAD)
    hasty.wait(1.0)
    assert hasty.bus.motors[1].true_speed_rad_s == pytest.approx(0.0, abs=0.05)
    stood = hasty.bus.motors[1].true_angle_rad
    hasty.bus.replug()
    assert hasty.wheels.exchange(STANDSTILL).left_rad == pytest.approx(stood, abs=0.005)
    assert hasty.run(AHEAD, 1.0).left_rad_s == pytest.approx(3.0, abs=0.05)


def test_what_the_wheels_turned_while_unplugged_is_counted(hasty: Robot) -> None:
    hasty.run(WheelCommand(6.0, 6.0), 1.0)
    hasty.bus.unplug()
    hasty.wait(0.8)  # three quarters of a turn more until the watchdog trips and the wheels stand
    hasty.bus.replug()
    with suppress(DeviceError):  # the old port is gone: an error, or healed at once
        hasty.wheels.exchange(STANDSTILL)
    reading = hasty.wheels.exchange(STANDSTILL)
    assert reading.left_rad == pytest.approx(hasty.bus.motors[1].true_angle_rad, abs=0.01)


def test_every_reading_tells_voltage_and_efforts(robot: Robot) -> None:
    robot.bus.motors[1].voltage_v = 11.4
    robot.run(AHEAD, 0.6)
    robot.bus.motors[2].blocked = True
    reading = robot.run(AHEAD, 0.06)
    assert reading.voltage_v == pytest.approx(11.4)
    assert 0.0 < reading.left_effort < 0.2
    assert reading.right_effort == 1.0


def test_a_dip_of_the_voltage_is_no_empty_battery(robot: Robot) -> None:
    robot.run(AHEAD, 0.2)
    robot.bus.motors[1].voltage_v = 10.4
    robot.run(AHEAD, 0.9)
    robot.bus.motors[1].voltage_v = 11.9
    assert robot.run(AHEAD, 1.5).left_rad_s == pytest.approx(3.0, abs=0.05)


def test_an_empty_battery_stops_the_wheels_until_it_is_charged(robot: Robot) -> None:
    robot.run(AHEAD, 0.2)
    for motor in robot.bus.motors.values():
        motor.voltage_v = 10.4
    with pytest.raises(DeviceError, match=r"battery is empty: 10.4 V"):
        robot.run(AHEAD, 1.1)
    assert robot.bus.wait_until(lambda: robot.bus.motors[2].memory.get("goal_velocity") == 0)
    robot.wait(0.25)
    for voltage_v in (10.4, 11.2):  # at rest it rises a little, which does not count
        robot.bus.motors[1].voltage_v = robot.bus.motors[2].voltage_v = voltage_v
        with pytest.raises(DeviceError, match="battery"):
            robot.cycle(AHEAD)
        assert robot.bus.motors[1].true_speed_rad_s == pytest.approx(0.0, abs=0.01)
    robot.bus.motors[1].voltage_v = robot.bus.motors[2].voltage_v = 12.0
    robot.cycle(AHEAD)
    assert robot.run(AHEAD, 1.0).left_rad_s == pytest.approx(3.0, abs=0.05)


@pytest.mark.parametrize("cycles", range(4))
def test_a_brown_out_at_any_cycle_is_no_jump_and_stops_the_other_wheel(robot: Robot, cycles: int) -> None:
    robot.run(AHEAD, 5.0 + 0.02 * cycles)
    robot.bus.motors[1].reboot()
    reading = robot.run(AHEAD, 0.1)
    assert reading.left_rad == pytest.approx(robot.bus.motors[1].true_angle_rad, abs=0.1)
    assert robot.run(AHEAD, 1.0).left_rad_s == pytest.approx(3.0, abs=0.05)


def test_close_never_raises_on_a_vanished_port(hasty: Robot) -> None:
    hasty.bus.unplug()
    hasty.wheels.close()
