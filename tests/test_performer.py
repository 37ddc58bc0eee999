"""A task's actions on wheels that may not do what they are told."""

from hil_fakes.virtual_robot import PERIOD_S, VirtualRobot
from hvcpd.config.tasks import Action, Forward, GoTo, Place, SayAction, Turn, Wait
from hvcpd.hardware.navigator import Navigator
from hvcpd.performer import Outcome, Performer
from hvcpd.ports import STANDSTILL


def perform(robot: VirtualRobot, *actions: Action) -> tuple[Outcome, list[str]]:
    """Carry out the actions; the outcome, and what was to be said meanwhile."""
    performer, remarks = Performer(Navigator()), []
    robot.wheels.open()
    performer.begin(actions)
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


def test_a_blocked_wheel_fails_the_task() -> None:
    robot = VirtualRobot(seed=1)
    robot.motors[0].blocked = True
    assert perform(robot, Forward(1.0), SayAction("hello")) == (Outcome.FAILED, [])
