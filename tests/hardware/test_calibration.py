"""Dimensions found by tape measure: on wheels that differ by 1 %, and with figures that cannot be."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hil_fakes.true_pose import TrueWheels
from hil_fakes.virtual_robot import Kind, VirtualRobot
from hil_fakes.wheel_course import FIGURE_OF_EIGHT, SQUARE, calibrate_by_tape, drive_course
from hvcpd.hardware.calibration import CalibrationError, Measured, calibrated
from hvcpd.hardware.kinematics import BURGER
from hvcpd.ports import WheelCommand

UNEQUAL = TrueWheels(left_radius_m=0.033 * 0.995, right_radius_m=0.033 * 1.005, separation_m=0.162)
"""1 % between the wheels, and the tyres touch the floor 2 mm further apart."""


def test_perfect_measurements_change_nothing() -> None:
    assert calibrated(BURGER, Measured(1.0, 0.0), Measured(0.0, 0.0), Measured(0.0, 0.0)) == BURGER


def test_without_calibration_such_wheels_miss_the_mark() -> None:
    course = drive_course(SQUARE, BURGER, UNEQUAL, seed=1)
    assert course.closing_share > 0.01


@pytest.mark.parametrize("kind", ["dynamixel", pytest.param("opencr", marks=pytest.mark.slow)])
def test_with_calibration_square_and_figure_of_eight_close_within_one_percent(kind: Kind) -> None:
    drive = calibrate_by_tape(BURGER, UNEQUAL, seed=1, kind=kind)
    assert drive.radius_ratio == pytest.approx(1.01005, abs=0.002)
    assert drive.separation_m == pytest.approx(0.162, abs=0.001)
    for course in (SQUARE, FIGURE_OF_EIGHT):
        result = drive_course(course, drive, UNEQUAL, seed=2, kind=kind)
        assert result.closing_share <= 0.01
        assert abs(result.heading_deg) <= 2.0


@pytest.mark.slow
@settings(max_examples=5, deadline=None)
@given(st.floats(0.98, 1.02), st.floats(0.98, 1.02), st.floats(0.155, 0.168))
def test_any_plausible_wheels_are_found_out(left: float, right: float, separation_m: float) -> None:
    truth = TrueWheels(0.033 * left, 0.033 * right, separation_m)
    drive = calibrate_by_tape(BURGER, truth, seed=3)
    assert drive.radius_ratio == pytest.approx(right / left, abs=0.004)
    assert drive.wheel_radius_m == pytest.approx(0.033 * (left + right) / 2, rel=0.006)


@pytest.mark.parametrize(
    "measured",
    [
        (Measured(100.0, 0.0), Measured(0.0, 0.0), Measured(0.0, 0.0)),  # centimetres
        (Measured(1.0, 0.0), Measured(0.9, -0.9), Measured(0.0, 0.0)),
        (Measured(math.nan, 0.0), Measured(0.0, 0.0), Measured(0.0, 0.0)),
    ],
)
def test_what_no_robot_can_have_is_refused(measured: tuple[Measured, Measured, Measured]) -> None:
    with pytest.raises(CalibrationError, match="measure again"):
        calibrated(BURGER, *measured)


def test_unequal_wheels_do_not_go_straight() -> None:
    robot = VirtualRobot(truth=UNEQUAL)
    robot.wheels.open()
    robot.run(WheelCommand(3.0, 3.0), 4.0)
    assert robot.pose.heading_rad > 0.01  # the larger right wheel turns it to the left
