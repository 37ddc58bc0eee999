"""A task's actions on wheels that may not do what they are told."""

import pytest

from hil_fakes.virtual_robot import PERIOD_S, VirtualRobot
from hvcpd.config.tasks import Action, Dock, Forward, GoTo, Place, SayAction, Turn, Wait
from hvcpd.hardware.goals import GoalNavigator
from hvcpd.hardware.kinematics import wrap_angle
from hvcpd.hardware.navigator import Navigator
from hvcpd.ports import STANDSTILL, PlaceGoal, Pose, WheelReading
from hvcpd.robot.performer import Outcome, Performer
from hvcpd.robot.records import StuckRecord


def perform(robot: VirtualRobot, *actions: Action, performer: Performer | None = None) -> tuple[Outcome, list[str]]:
    """Carry out the actions, of task 3; the outcome, and what was to be said meanwhile."""
    performer, remarks = performer or Performer(Navigator(), Pose(0.0, 0.0)), []
    robot.wheels.open()
    performer.begin(actions, 3)
    reading = robot.cycle(STANDSTILL)
    while performer.busy and robot.time.now_s < 60.0:
        progress = performer.step(robot.odometry.pose, robot.time.now_s, reading)
        remarks += [progress.remark] if progress.remark else []
        reading = robot.cycle(progress.wheels, PERIOD_S)
    robot.time.advance(0.3)
    assert robot.fastest_rad_s == 0.0
    return progress.outcome, remarks


def test_actions_are_carried_out_in_order() -> None:
    robot = VirtualRobot(seed=1)
    actions = (GoTo(Place(0.3, 0.1)), SayAction("hello"), Wait(0.5), Turn(90.0), Forward(-0.1))
    assert perform(robot, *actions) == (Outcome.DONE, ["hello"])
    assert abs(robot.pose.x_m - 0.3) < 0.15


def test_of_several_remarks_in_a_row_each_is_made() -> None:
    """Only the last of them was."""
    said = tuple(map(SayAction, ("hello", "the door is open", "come in")))
    assert perform(VirtualRobot(seed=1), *said) == (Outcome.DONE, ["hello", "the door is open", "come in"])


def test_docking_leads_back_to_the_start_and_its_heading() -> None:
    robot = VirtualRobot(seed=1)
    start = robot.pose
    assert perform(robot, Forward(0.4), Turn(120.0), Forward(0.2), Dock()) == (Outcome.DONE, [])
    assert (robot.pose.x_m, robot.pose.y_m) == pytest.approx((start.x_m, start.y_m), abs=0.05)
    assert wrap_angle(robot.pose.heading_rad - start.heading_rad) == pytest.approx(0.0, abs=0.1)


def test_a_blocked_wheel_fails_the_task_and_the_reason_is_kept() -> None:
    """It was known, and nobody learned of it: "task three failed" was all that log and transcript had."""
    robot, performer = VirtualRobot(seed=1), Performer(Navigator(), Pose(0.0, 0.0))
    robot.motors[0].blocked = True
    assert perform(robot, Forward(1.0), SayAction("hello"), performer=performer) == (Outcome.FAILED, [])
    (record,) = performer.take_records(9.0)
    assert isinstance(record, StuckRecord)
    assert (record.at_s, record.task) == (9.0, 3)
    assert record.note.startswith("driving failed: a wheel is blocked")
    assert performer.take_records(10.0) == []


@pytest.mark.parametrize("rest_s", [0.05, 2.0, 30.0])
@pytest.mark.parametrize("action", [GoTo(Place(0.6, 0.2)), Turn(180.0), Forward(0.5), Wait(3.0)])
def test_a_rest_halts_at_once_and_costs_nothing_but_its_time(action: Action, rest_s: float) -> None:
    robot, performer = VirtualRobot(seed=1), Performer(Navigator(), Pose(0.0, 0.0))
    robot.wheels.open()
    performer.begin((action,))
    reading = robot.cycle(STANDSTILL)
    rested, wheels, ramp = 0, STANDSTILL, []
    began_s = robot.time.now_s
    while performer.busy:
        if robot.time.now_s - began_s >= 1.5 and rested * PERIOD_S < rest_s:
            performer.rest(robot.time.now_s)
            reading = robot.cycle(STANDSTILL, PERIOD_S)
            rested += 1
            assert rested * PERIOD_S < 0.5 or robot.fastest_rad_s == 0.0
            continue
        progress = performer.step(robot.odometry.pose, robot.time.now_s, reading)
        ramp += [progress.wheels] if rested else []
        wheels = progress.wheels
        reading = robot.cycle(wheels, PERIOD_S)
    assert progress.outcome is Outcome.DONE
    assert abs(ramp[0].left_rad_s) < 0.7  # 0.25 m/s² and 3 rad/s² for one period, at the wheel's rim
    if isinstance(action, Wait):
        assert robot.time.now_s - began_s == pytest.approx(action.duration_s + rested * PERIOD_S, abs=3 * PERIOD_S)


def test_a_plan_begun_in_a_rest_waits_for_its_end() -> None:
    performer, pose = Performer(Navigator(), Pose(0.0, 0.0)), Pose(0.0, 0.0)
    performer.begin((Wait(1.0),))
    performer.rest(50.0)
    assert performer.step(pose, 50.5, None).outcome is Outcome.GOING_ON
    performer.rest(60.0)
    assert performer.step(pose, 60.9, None).outcome is Outcome.GOING_ON
    assert performer.step(pose, 61.1, None).outcome is Outcome.DONE


def test_where_somebody_else_finds_the_way_a_place_is_a_goal_and_the_rest_goes_on_by_itself() -> None:
    navigator = GoalNavigator()
    performer, here, reading = Performer(navigator, Pose(0.0, 0.0)), Pose(0.0, 0.0), WheelReading(0.0, 0.0)
    performer.begin((GoTo(Place(3.0, 4.0)), Wait(0.5), GoTo(Place(1.0, 1.0))))
    assert performer.step(here, 0.0, reading).wheels == STANDSTILL
    assert navigator.goal == PlaceGoal(1, 3.0, 4.0)
    performer.rest(0.1)
    assert navigator.goal is None
    performer.step(here, 0.2, reading)
    navigator.tell(2, arrived=True)
    performer.step(here, 0.3, reading)
    assert navigator.goal is None
    performer.step(here, 1.0, reading)
    assert navigator.goal == PlaceGoal(3, 1.0, 1.0)
    navigator.tell(3, arrived=False, reason="a wall")
    assert performer.step(here, 1.1, reading).outcome is Outcome.FAILED
    assert navigator.goal is None
