"""The driver on a bad line: it heals what it can, says what it cannot, and the wheels stop."""

from contextlib import suppress

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from hil_fakes.dynamixel.faults import ReplyFault
from hil_fakes.dynamixel.motor import SHUTDOWN_OVERLOAD
from hvcpd.errors import DeviceError
from hvcpd.ports import STANDSTILL, WheelCommand
from tests.hardware.conftest import Robot, faulty_robot

pytestmark = pytest.mark.slow

AHEAD = WheelCommand(3.0, 3.0)


def goal(robot: Robot, motor_id: int) -> int:
    """The speed that a motor was told, in its units."""
    return robot.bus.motors[motor_id].memory.get("goal_velocity")


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
def test_one_bad_reply_is_healed(faulty: Robot, before: int, fault: ReplyFault) -> None:
    faulty.run(AHEAD, 0.2)
    faulty.bus.faults.schedule(*[ReplyFault.NONE] * before, fault)
    reading = faulty.cycle(AHEAD)
    assert faulty.wheels.faults == 1
    assert reading.left_rad == pytest.approx(faulty.bus.motors[1].true_angle_rad, abs=0.08)


@pytest.mark.parametrize("lost", [2, 8])
def test_to_let_go_is_said_again_to_a_motor_that_has_not_answered(lost: int, faulty: Robot) -> None:
    faulty.run(AHEAD, 0.2)
    faulty.bus.faults.schedule(*[ReplyFault.DROP] * lost, ReplyFault.NONE, ReplyFault.DROP)
    faulty.wheels.close()
    assert faulty.bus.faults.pending == 0


def test_noise_on_the_line_costs_nothing(faulty: Robot) -> None:
    faulty.bus.faults.schedule(*[ReplyFault.NOISE] * 20)
    faulty.run(AHEAD, 0.2)
    assert faulty.wheels.faults == 0


@settings(max_examples=15, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(st.lists(st.sampled_from(list(ReplyFault)), max_size=6))
def test_no_schedule_of_faults_gives_a_wrong_reading(faults: list[ReplyFault]) -> None:
    with faulty_robot(seed=2) as robot:
        robot.run(AHEAD, 0.1)
        robot.bus.faults.schedule(*faults)
        for _ in range(5):
            try:
                reading = robot.wheels.exchange(AHEAD)
            except DeviceError:
                continue
            after = [robot.bus.motors[motor_id].true_angle_rad for motor_id in (1, 2)]
            assert (reading.left_rad, reading.right_rad) == pytest.approx(after, abs=0.02)
            robot.wait(0.02)


def test_a_silent_motor_is_an_error_and_stops_the_other(faulty: Robot) -> None:
    faulty.run(AHEAD, 0.5)
    faulty.bus.motors[2].powered = False
    with pytest.raises(DeviceError, match="no answer from motor 2"):
        faulty.wheels.exchange(AHEAD)
    assert goal(faulty, 1) == 0


def test_a_pause_longer_than_the_lease_stops_the_wheels_and_is_healed(faulty: Robot) -> None:
    faulty.run(AHEAD, 0.5)
    faulty.wait(1.0)
    assert [motor.memory.get("bus_watchdog") for motor in faulty.bus.motors.values()] == [-1, -1]
    assert faulty.bus.motors[1].true_speed_rad_s == pytest.approx(0.0, abs=0.05)
    faulty.wheels.exchange(STANDSTILL)
    faulty.wait(0.2)
    assert faulty.bus.motors[1].true_speed_rad_s == pytest.approx(0.0, abs=0.05)  # the old goal is not taken up
    assert faulty.run(AHEAD, 1.0).left_rad_s == pytest.approx(3.0, abs=0.05)


def test_a_trip_that_no_clock_saw_is_found_within_half_a_second(faulty: Robot) -> None:
    faulty.run(AHEAD, 0.5)
    faulty.bus.line.advance(1.0)  # the motors waited, the driver's clock did not notice
    assert faulty.run(AHEAD, 1.0).left_rad_s == pytest.approx(3.0, abs=0.05)


def test_a_brown_out_is_healed_without_a_jump_of_the_angle(faulty: Robot) -> None:
    faulty.run(AHEAD, 5.0)
    faulty.bus.motors[1].reboot()
    before = faulty.bus.motors[1].true_angle_rad
    reading = faulty.run(AHEAD, 0.04)
    assert reading.left_rad == pytest.approx(before, abs=0.1)
    reading = faulty.run(AHEAD, 2.0)
    assert reading.left_rad == pytest.approx(faulty.bus.motors[1].true_angle_rad, abs=0.1)
    assert reading.left_rad_s == pytest.approx(3.0, abs=0.05)


def test_a_hardware_error_stops_both_wheels_and_is_named(faulty: Robot) -> None:
    faulty.run(AHEAD, 0.2)
    faulty.bus.motors[2].raise_hardware_error(SHUTDOWN_OVERLOAD)
    with pytest.raises(DeviceError, match="motor 2 reports a hardware error: overload"):
        faulty.cycle(AHEAD)
    assert goal(faulty, 1) == 0


def test_unplugging_is_an_error_and_replugging_heals_without_a_jump(faulty: Robot) -> None:
    faulty.run(AHEAD, 1.0)
    faulty.bus.unplug()
    with pytest.raises(DeviceError):
        faulty.wheels.exchange(AHEAD)
    with pytest.raises(DeviceError, match="no such port"):
        faulty.wheels.exchange(AHEAD)
    faulty.wait(1.0)
    assert faulty.bus.motors[1].true_speed_rad_s == pytest.approx(0.0, abs=0.05)
    stood = faulty.bus.motors[1].true_angle_rad
    faulty.bus.replug()
    assert faulty.wheels.exchange(STANDSTILL).left_rad == pytest.approx(stood, abs=0.005)
    assert faulty.run(AHEAD, 1.0).left_rad_s == pytest.approx(3.0, abs=0.05)


def test_what_the_wheels_turned_while_unplugged_is_counted(faulty: Robot) -> None:
    faulty.run(WheelCommand(6.0, 6.0), 1.0)
    faulty.bus.unplug()
    faulty.wait(0.8)  # three quarters of a turn more until the watchdog trips and the wheels stand
    faulty.bus.replug()
    with suppress(DeviceError):  # the old port is gone: an error, or healed at once
        faulty.wheels.exchange(STANDSTILL)
    reading = faulty.wheels.exchange(STANDSTILL)
    assert reading.left_rad == pytest.approx(faulty.bus.motors[1].true_angle_rad, abs=0.01)


def test_every_reading_tells_voltage_and_efforts(faulty: Robot) -> None:
    faulty.bus.motors[1].voltage_v = 11.4
    faulty.run(AHEAD, 0.6)
    faulty.bus.motors[2].blocked = True
    reading = faulty.run(AHEAD, 0.06)
    assert reading.voltage_v == pytest.approx(11.4)
    assert 0.0 < reading.left_effort < 0.2
    assert reading.right_effort == 1.0


def test_a_dip_of_the_voltage_is_no_empty_battery(faulty: Robot) -> None:
    faulty.run(AHEAD, 0.2)
    faulty.bus.motors[1].voltage_v = 10.4
    faulty.run(AHEAD, 0.9)
    faulty.bus.motors[1].voltage_v = 11.9
    assert faulty.run(AHEAD, 1.5).left_rad_s == pytest.approx(3.0, abs=0.05)


def test_an_empty_battery_stops_the_wheels_until_it_is_charged(faulty: Robot) -> None:
    faulty.run(AHEAD, 0.2)
    for motor in faulty.bus.motors.values():
        motor.voltage_v = 10.4
    with pytest.raises(DeviceError, match=r"battery is empty: 10.4 V"):
        faulty.run(AHEAD, 1.1)
    assert goal(faulty, 2) == 0
    faulty.wait(0.25)
    for voltage_v in (10.4, 11.2):  # at rest it rises a little, which does not count
        faulty.bus.motors[1].voltage_v = faulty.bus.motors[2].voltage_v = voltage_v
        with pytest.raises(DeviceError, match="battery"):
            faulty.cycle(AHEAD)
        assert faulty.bus.motors[1].true_speed_rad_s == pytest.approx(0.0, abs=0.01)
    faulty.bus.motors[1].voltage_v = faulty.bus.motors[2].voltage_v = 12.0
    faulty.cycle(AHEAD)
    assert faulty.run(AHEAD, 1.0).left_rad_s == pytest.approx(3.0, abs=0.05)


@pytest.mark.parametrize("cycles", range(4))
def test_a_brown_out_at_any_cycle_is_no_jump_and_stops_the_other_wheel(faulty: Robot, cycles: int) -> None:
    faulty.run(AHEAD, 5.0 + 0.02 * cycles)
    faulty.bus.motors[1].reboot()
    reading = faulty.run(AHEAD, 0.1)
    assert reading.left_rad == pytest.approx(faulty.bus.motors[1].true_angle_rad, abs=0.1)
    assert faulty.run(AHEAD, 1.0).left_rad_s == pytest.approx(3.0, abs=0.05)


def test_close_never_raises_on_a_vanished_port(faulty: Robot) -> None:
    faulty.bus.unplug()
    faulty.wheels.close()
