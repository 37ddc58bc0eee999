"""The driver on a bad line: it heals what it can, says what it cannot, and the wheels stop."""

from contextlib import suppress

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from hil_fakes.dynamixel.faults import ReplyFault
from hil_fakes.dynamixel.motor import SHUTDOWN_OVERLOAD
from hil_fakes.virtual_robot import VirtualRobot
from hvcpd.errors import DeviceError
from hvcpd.ports import STANDSTILL, WheelCommand, WheelReading

pytestmark = pytest.mark.slow

AHEAD = WheelCommand(3.0, 3.0)


def run(robot: VirtualRobot, command: WheelCommand, duration_s: float) -> WheelReading:
    """The same command every 20 ms; the last reading."""
    return [robot.cycle(command, 0.02) for _ in range(round(duration_s / 0.02))][-1]


def goal(robot: VirtualRobot, motor: int) -> int:
    """The speed that a motor was told, in its units."""
    return robot.motors[motor].memory.get("goal_velocity")


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
def test_one_bad_reply_is_healed(robot: VirtualRobot, before: int, fault: ReplyFault) -> None:
    run(robot, AHEAD, 0.2)
    robot.line.faults.schedule(*[ReplyFault.NONE] * before, fault)
    reading = robot.cycle(AHEAD, 0.02)
    assert robot.wheels.faults == 1
    assert reading.left_rad == pytest.approx(robot.motors[0].true_angle_rad, abs=0.08)


@pytest.mark.parametrize("lost", [2, 8])
def test_to_let_go_is_said_again_to_a_motor_that_has_not_answered(lost: int, robot: VirtualRobot) -> None:
    run(robot, AHEAD, 0.2)
    robot.line.faults.schedule(*[ReplyFault.DROP] * lost, ReplyFault.NONE, ReplyFault.DROP)
    robot.wheels.close()
    assert robot.line.faults.pending == 0


def test_noise_on_the_line_costs_nothing(robot: VirtualRobot) -> None:
    robot.line.faults.schedule(*[ReplyFault.NOISE] * 20)
    run(robot, AHEAD, 0.2)
    assert robot.wheels.faults == 0


@settings(max_examples=15, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(st.lists(st.sampled_from(list(ReplyFault)), max_size=6))
def test_no_schedule_of_faults_gives_a_wrong_reading(faults: list[ReplyFault]) -> None:
    robot = VirtualRobot(seed=2)
    robot.wheels.open()
    run(robot, AHEAD, 0.1)
    robot.line.faults.schedule(*faults)
    for _ in range(5):
        try:
            reading = robot.wheels.exchange(AHEAD)
        except DeviceError:
            continue
        after = [motor.true_angle_rad for motor in robot.motors]
        assert (reading.left_rad, reading.right_rad) == pytest.approx(after, abs=0.02)
        robot.time.advance(0.02)
    robot.wheels.close()


def test_a_silent_motor_is_an_error_and_stops_the_other(robot: VirtualRobot) -> None:
    run(robot, AHEAD, 0.5)
    robot.motors[1].powered = False
    with pytest.raises(DeviceError, match="no answer from motor 2"):
        robot.wheels.exchange(AHEAD)
    assert goal(robot, 0) == 0


def test_a_pause_longer_than_the_lease_stops_the_wheels_and_is_healed(robot: VirtualRobot) -> None:
    run(robot, AHEAD, 0.5)
    robot.time.advance(1.0)
    assert [motor.memory.get("bus_watchdog") for motor in robot.motors] == [-1, -1]
    assert robot.motors[0].true_speed_rad_s == pytest.approx(0.0, abs=0.05)
    robot.wheels.exchange(STANDSTILL)
    robot.time.advance(0.2)
    assert robot.motors[0].true_speed_rad_s == pytest.approx(0.0, abs=0.05)  # the old goal is not taken up
    assert run(robot, AHEAD, 1.0).left_rad_s == pytest.approx(3.0, abs=0.05)


def test_a_trip_that_no_clock_saw_is_found_within_half_a_second(robot: VirtualRobot) -> None:
    run(robot, AHEAD, 0.5)
    robot.line.advance(1.0)  # the motors waited, the driver's clock did not notice
    assert run(robot, AHEAD, 1.0).left_rad_s == pytest.approx(3.0, abs=0.05)


def test_a_brown_out_is_healed_without_a_jump_of_the_angle(robot: VirtualRobot) -> None:
    run(robot, AHEAD, 5.0)
    robot.motors[0].reboot()
    before = robot.motors[0].true_angle_rad
    reading = run(robot, AHEAD, 0.04)
    assert reading.left_rad == pytest.approx(before, abs=0.1)
    reading = run(robot, AHEAD, 2.0)
    assert reading.left_rad == pytest.approx(robot.motors[0].true_angle_rad, abs=0.1)
    assert reading.left_rad_s == pytest.approx(3.0, abs=0.05)


def test_a_hardware_error_stops_both_wheels_and_is_named(robot: VirtualRobot) -> None:
    run(robot, AHEAD, 0.2)
    robot.motors[1].raise_hardware_error(SHUTDOWN_OVERLOAD)
    with pytest.raises(DeviceError, match="motor 2 reports a hardware error: overload"):
        robot.cycle(AHEAD, 0.02)
    assert goal(robot, 0) == 0


def test_unplugging_is_an_error_and_replugging_heals_without_a_jump(robot: VirtualRobot) -> None:
    run(robot, AHEAD, 1.0)
    robot.port.plugged = False
    with pytest.raises(DeviceError):
        robot.wheels.exchange(AHEAD)
    with pytest.raises(DeviceError, match="no such port"):
        robot.wheels.exchange(AHEAD)
    robot.time.advance(1.0)
    assert robot.motors[0].true_speed_rad_s == pytest.approx(0.0, abs=0.05)
    stood = robot.motors[0].true_angle_rad
    robot.port.plugged = True
    assert robot.wheels.exchange(STANDSTILL).left_rad == pytest.approx(stood, abs=0.005)
    assert run(robot, AHEAD, 1.0).left_rad_s == pytest.approx(3.0, abs=0.05)


def test_what_the_wheels_turned_while_unplugged_is_counted(robot: VirtualRobot) -> None:
    run(robot, WheelCommand(6.0, 6.0), 1.0)
    robot.port.plugged = False
    robot.time.advance(0.8)  # three quarters of a turn more until the watchdog trips and the wheels stand
    robot.port.plugged = True
    with suppress(DeviceError):  # the old port is gone: an error, or healed at once
        robot.wheels.exchange(STANDSTILL)
    reading = robot.wheels.exchange(STANDSTILL)
    assert reading.left_rad == pytest.approx(robot.motors[0].true_angle_rad, abs=0.01)


def test_every_reading_tells_voltage_and_efforts(robot: VirtualRobot) -> None:
    robot.motors[0].voltage_v = 11.4
    run(robot, AHEAD, 0.6)
    robot.motors[1].blocked = True
    reading = run(robot, AHEAD, 0.06)
    assert reading.voltage_v == pytest.approx(11.4)
    assert 0.0 < reading.left_effort < 0.2
    assert reading.right_effort == 1.0


def test_a_dip_of_the_voltage_is_no_empty_battery(robot: VirtualRobot) -> None:
    run(robot, AHEAD, 0.2)
    robot.motors[0].voltage_v = 10.4
    run(robot, AHEAD, 0.9)
    robot.motors[0].voltage_v = 11.9
    assert run(robot, AHEAD, 1.5).left_rad_s == pytest.approx(3.0, abs=0.05)


def test_an_empty_battery_stops_the_wheels_until_it_is_charged(robot: VirtualRobot) -> None:
    run(robot, AHEAD, 0.2)
    for motor in robot.motors:
        motor.voltage_v = 10.4
    with pytest.raises(DeviceError, match=r"battery is empty: 10.4 V"):
        run(robot, AHEAD, 1.1)
    assert goal(robot, 1) == 0
    robot.time.advance(0.25)
    for voltage_v in (10.4, 11.2):  # at rest it rises a little, which does not count
        robot.motors[0].voltage_v = robot.motors[1].voltage_v = voltage_v
        with pytest.raises(DeviceError, match="battery"):
            robot.cycle(AHEAD, 0.02)
        assert robot.motors[0].true_speed_rad_s == pytest.approx(0.0, abs=0.01)
    robot.motors[0].voltage_v = robot.motors[1].voltage_v = 12.0
    robot.cycle(AHEAD, 0.02)
    assert run(robot, AHEAD, 1.0).left_rad_s == pytest.approx(3.0, abs=0.05)


@pytest.mark.parametrize("cycles", range(4))
def test_a_brown_out_at_any_cycle_is_no_jump_and_stops_the_other_wheel(robot: VirtualRobot, cycles: int) -> None:
    run(robot, AHEAD, 5.0 + 0.02 * cycles)
    robot.motors[0].reboot()
    reading = run(robot, AHEAD, 0.1)
    assert reading.left_rad == pytest.approx(robot.motors[0].true_angle_rad, abs=0.1)
    assert run(robot, AHEAD, 1.0).left_rad_s == pytest.approx(3.0, abs=0.05)


def test_close_never_raises_on_a_vanished_port(robot: VirtualRobot) -> None:
    robot.port.plugged = False
    robot.wheels.close()
