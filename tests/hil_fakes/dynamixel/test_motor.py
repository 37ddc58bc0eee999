"""The fake motor by itself: physics, chance, faults. No wire."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hil_fakes.dynamixel.control_table import ITEMS
from hil_fakes.dynamixel.motor import REVERSE, SHUTDOWN_OVERLOAD, FakeMotor
from hil_fakes.dynamixel.physics import VELOCITY_UNIT_RAD_S, Shaft, ShaftSettings
from hil_fakes.dynamixel.protocol import ALERT, StatusError

QUIET = ShaftSettings(encoder_noise_ticks=0.0)


def driving(goal: int = 100, **settings: object) -> FakeMotor:
    motor = FakeMotor(shaft=QUIET, **settings)  # type: ignore[arg-type]
    for name, value in (("operating_mode", 1), ("torque_enable", 1)):
        motor.memory.set(name, value)
    assert motor.write(104, goal.to_bytes(4, "little", signed=True)) is StatusError.NONE
    return motor


def test_speed_follows_with_the_stated_time_constant() -> None:
    motor = driving()
    motor.advance(QUIET.time_constant_s)
    assert motor.true_speed_rad_s == pytest.approx(100 * VELOCITY_UNIT_RAD_S * (1 - math.exp(-1)))


@given(st.lists(st.floats(0.001, 0.1), min_size=1, max_size=20))
def test_the_size_of_the_steps_does_not_matter(steps: list[float]) -> None:
    many, one = Shaft(QUIET), Shaft(QUIET)
    for dt_s in steps:
        many.drive(2.0, 0.0, dt_s)
    one.drive(2.0, 0.0, sum(steps))
    assert many.angle_rad == pytest.approx(one.angle_rad)
    assert many.speed_rad_s == pytest.approx(one.speed_rad_s)


def test_readings_at_one_instant_agree_and_a_seed_repeats_them() -> None:
    def readings(seed: int) -> list[int]:
        motor = FakeMotor()
        motor.seed(seed)
        seen = []
        for _ in range(50):
            motor.advance(0.02)
            twice = {motor.memory.read(132, 4)[1] for _ in range(2)}
            assert len(twice) == 1
            seen.append(motor.memory.get("present_position"))
        return seen

    assert readings(1) == readings(1) != readings(2)
    assert len(set(readings(1))) > 1  # the encoder does flicker


@pytest.mark.parametrize(("drive_mode", "mounting", "forward"), [(0, 1, 1), (REVERSE, -1, 1), (0, -1, -1)])
def test_mounting_and_drive_mode_decide_which_way_is_forward(drive_mode: int, mounting: int, forward: int) -> None:
    motor = driving(drive_mode=drive_mode, mounting=mounting)
    motor.advance(1.0)
    assert math.copysign(1, motor.true_angle_rad) == forward
    assert motor.memory.get("present_position") > 0


def test_a_low_battery_limits_the_speed() -> None:
    motor = driving(265, voltage_v=9.0)
    motor.advance(2.0)
    assert motor.true_speed_rad_s == pytest.approx(57.0 / 11.1 * 9.0 * 2 * math.pi / 60, rel=1e-6)
    assert motor.memory.get("present_input_voltage") == 90


def test_profile_acceleration_makes_a_ramp() -> None:
    motor = driving()
    motor.write(108, (10).to_bytes(4, "little"))
    motor.advance(0.1)
    assert motor.memory.get("velocity_trajectory") == pytest.approx(10 * 214.577 / 60 * 0.1 / 0.229, abs=1)


def test_a_blocked_wheel_stands_under_full_load() -> None:
    motor = driving()
    motor.blocked = True
    motor.advance(0.5)
    assert (motor.true_speed_rad_s, motor.memory.get("present_load")) == (0.0, 1000)


def test_an_overload_ends_torque_until_reboot() -> None:
    motor = driving()
    motor.raise_hardware_error(SHUTDOWN_OVERLOAD)
    motor.advance(1.0)
    assert motor.true_speed_rad_s == pytest.approx(0.0, abs=1e-6)
    assert motor.error_field(StatusError.NONE) == ALERT
    assert motor.write(64, b"\x01") is StatusError.RESULT_FAIL
    motor.reboot()
    assert motor.write(64, b"\x01") is StatusError.NONE


def test_the_watchdog_trips_in_the_middle_of_a_long_step() -> None:
    motor = driving()
    motor.memory.set("bus_watchdog", 25)
    motor.advance(10.0)
    assert motor.memory.get("bus_watchdog") == -1
    full = 100 * VELOCITY_UNIT_RAD_S
    lag_s = QUIET.time_constant_s - QUIET.stop_time_constant_s  # starting lags more than stopping
    assert motor.true_angle_rad == pytest.approx(full * (0.5 - lag_s), rel=0.03)


def test_traffic_keeps_the_watchdog_quiet() -> None:
    motor = driving()
    motor.memory.set("bus_watchdog", 25)
    for _ in range(10):
        motor.advance(0.4)
        motor.notice_traffic()
    assert motor.memory.get("bus_watchdog") == 25


def test_a_reboot_forgets_turns_but_not_the_angle_within_one() -> None:
    motor = driving()
    motor.advance(20.0)
    before = motor.memory.get("present_position")
    motor.reboot()
    after = motor.memory.get("present_position")
    assert before > 4096 > after >= 0
    assert (before - after) % 4096 == 0
    assert motor.memory.get("torque_enable") == 0


@given(st.integers(0, 300), st.binary(min_size=1, max_size=12))
def test_no_write_leaves_a_cell_out_of_its_range(address: int, data: bytes) -> None:
    motor = FakeMotor(shaft=QUIET)
    before = [motor.memory.get(item.name) for item in ITEMS]
    error = motor.write(address, data)
    for item, old in zip(ITEMS, before, strict=True):
        value = motor.memory.get(item.name)
        if value != old:
            assert error is StatusError.NONE
            assert item.writable
            assert item.low is None or value >= item.low
            assert item.high is None or value <= item.high
