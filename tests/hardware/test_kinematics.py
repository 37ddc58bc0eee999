"""Odometry and wheel speeds: arithmetic on paper, and properties."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hvcpd.hardware.kinematics import (
    BURGER,
    RESTARTED_M,
    Odometry,
    Twist,
    advance_pose,
    compose,
    frame_between,
    twist_of,
    wheel_command,
    wrap_angle,
)
from hvcpd.ports import Pose, WheelReading

angles = st.floats(-50.0, 50.0)
LIMIT_M_S = BURGER.max_wheel_rad_s * BURGER.wheel_radius_m


def test_straight_on_one_turn_of_the_wheels() -> None:
    pose = advance_pose(Pose(1.0, 2.0, math.pi / 2), 2 * math.pi, 2 * math.pi)
    assert (pose.x_m, pose.y_m) == pytest.approx((1.0, 2.0 + 2 * math.pi * 0.033))


def test_a_quarter_turn_on_the_spot() -> None:
    wheel_rad = math.pi / 2 * 0.080 / 0.033  # each wheel runs a quarter of a circle of 8 cm
    pose = advance_pose(Pose(0.0, 0.0), -wheel_rad, wheel_rad)
    assert (pose.x_m, pose.y_m, pose.heading_rad) == pytest.approx((0.0, 0.0, math.pi / 2))


def test_a_circle_in_small_steps_closes() -> None:
    odometry = Odometry(Pose(0.0, 0.0))
    radius_m, steps = 0.5, 400
    left = 2 * math.pi * (radius_m - 0.08) / 0.033
    right = 2 * math.pi * (radius_m + 0.08) / 0.033
    for k in range(steps + 1):
        pose = odometry.update(WheelReading(left * k / steps, right * k / steps))
    assert (pose.x_m, pose.y_m) == pytest.approx((0.0, 0.0), abs=1e-4)


@given(angles, angles)
def test_the_first_reading_moves_nothing(left: float, right: float) -> None:
    start = Pose(1.0, -2.0, 0.5)
    assert Odometry(start).update(WheelReading(left, right)) == start


@given(angles, angles, st.floats(-3.0, 3.0))
def test_going_back_the_same_way_returns(left: float, right: float, heading: float) -> None:
    there = advance_pose(Pose(0.0, 0.0, heading), left, right)
    back = advance_pose(there, -left, -right)
    assert (back.x_m, back.y_m) == pytest.approx((0.0, 0.0), abs=1e-9)
    assert wrap_angle(back.heading_rad - heading) == pytest.approx(0.0, abs=1e-9)


@given(st.floats(-1000.0, 1000.0))
def test_wrapping_keeps_the_direction(angle: float) -> None:
    wrapped = wrap_angle(angle)
    assert -math.pi < wrapped <= math.pi
    assert math.cos(wrapped - angle) == pytest.approx(1.0)


@given(st.floats(-0.1, 0.1), st.floats(-1.0, 1.0))
def test_wheel_speeds_within_the_limit_make_the_wanted_motion(linear: float, angular: float) -> None:
    twist = twist_of(wheel_command(Twist(linear, angular)))
    assert (twist.linear_m_s, twist.angular_rad_s) == pytest.approx((linear, angular), abs=1e-12)


@given(st.floats(-5.0, 5.0), st.floats(-50.0, 50.0))
def test_no_wheel_exceeds_its_limit_and_the_turn_is_kept(linear: float, angular: float) -> None:
    command = wheel_command(Twist(linear, angular))
    assert max(abs(command.left_rad_s), abs(command.right_rad_s)) <= BURGER.max_wheel_rad_s + 1e-9
    possible = min(max(angular, -LIMIT_M_S / 0.08), LIMIT_M_S / 0.08)
    assert twist_of(command).angular_rad_s == pytest.approx(possible)


def test_what_the_wheels_turned_while_nobody_read_them_is_added() -> None:
    odometry = Odometry(Pose(1.0, 2.0, math.pi / 2.0), last=WheelReading(100.0, -50.0))
    odometry.update(WheelReading(103.0, -47.0))
    assert (odometry.pose.x_m, odometry.pose.y_m) == pytest.approx((1.0, 2.0 + 3.0 * 0.033))


@pytest.mark.parametrize("left_rad", [0.2, 120.0])
def test_motors_that_lost_count_leave_the_pose_as_it_was_kept(left_rad: float) -> None:
    odometry = Odometry(Pose(1.0, 2.0), last=WheelReading(100.0, -50.0))
    odometry.update(WheelReading(left_rad, 0.1))
    assert odometry.pose == Pose(1.0, 2.0)
    odometry.update(WheelReading(left_rad + 1.0, 1.1))
    assert odometry.pose.x_m == pytest.approx(1.033)


def told(x_m: float, y_m: float, heading_rad: float = 0.0) -> WheelReading:
    return WheelReading(0.0, 0.0, pose=Pose(x_m, y_m, heading_rad))


def as_numbers(pose: Pose) -> tuple[float, float, float, float]:
    return pose.x_m, pose.y_m, math.cos(pose.heading_rad), math.sin(pose.heading_rad)


poses = st.builds(Pose, st.floats(-9.0, 9.0), st.floats(-9.0, 9.0), st.floats(-3.1, 3.1))


@given(poses, poses)
def test_a_frame_brings_there_to_here(here: Pose, there: Pose) -> None:
    assert as_numbers(compose(frame_between(here, there), there)) == pytest.approx(as_numbers(here), abs=1e-9)


def test_the_word_of_a_base_counts_from_where_the_robot_was() -> None:
    odometry = Odometry(Pose(1.0, 2.0, math.pi / 2))
    assert as_numbers(odometry.update(told(5.0, 5.0))) == pytest.approx(as_numbers(Pose(1.0, 2.0, math.pi / 2)))
    assert as_numbers(odometry.update(told(5.3, 5.0))) == pytest.approx(as_numbers(Pose(1.0, 2.3, math.pi / 2)))
    assert as_numbers(odometry.update(told(5.3, 5.2, 0.1))) == pytest.approx(
        as_numbers(Pose(0.8, 2.3, math.pi / 2 + 0.1))
    )


def test_a_base_that_begins_a_new_account_moves_nothing() -> None:
    odometry = Odometry(Pose(0.0, 0.0))
    odometry.update(told(0.0, 0.0))
    before = odometry.update(told(RESTARTED_M - 0.01, 0.0))
    assert before.x_m == pytest.approx(RESTARTED_M - 0.01)
    assert odometry.update(told(-0.1, 0.0)) == before
    assert odometry.update(told(0.0, 0.0)).x_m == pytest.approx(before.x_m + 0.1)


@pytest.mark.parametrize("there", [Pose(0.3, 0.2, math.pi / 2), Pose(0.0, 0.0, math.pi), Pose(0.4, 0.0, 0.0)])
def test_a_base_that_begins_a_new_account_near_its_first_origin_moves_nothing(there: Pose) -> None:
    odometry = Odometry(Pose(1.0, 2.0, 0.0))
    odometry.update(told(0.0, 0.0))
    for k in range(1, 41):
        before = odometry.update(told(there.x_m * k / 40, there.y_m * k / 40, there.heading_rad * k / 40))
    assert as_numbers(odometry.update(told(0.0, 0.0))) == pytest.approx(as_numbers(before))
    ahead = compose(before, Pose(0.1, 0.0, 0.0))
    assert as_numbers(odometry.update(told(0.1, 0.0))) == pytest.approx(as_numbers(ahead))


def test_a_base_may_drive_through_its_origin() -> None:
    odometry = Odometry(Pose(1.0, 2.0, 0.0))
    odometry.update(told(0.0, 0.0))
    odometry.update(told(0.07, 0.0, 0.5))
    assert odometry.update(told(0.0, 0.0)) == Pose(1.0, 2.0, 0.0)
