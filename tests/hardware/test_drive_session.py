"""Driving by hand, in virtual time."""

from hil_fakes.dynamixel.motor import SHUTDOWN_OVERLOAD
from hil_fakes.virtual_robot import VirtualRobot
from hvcpd.hardware.drive_session import DriveSession
from hvcpd.hardware.motion import Forward, MotionState


def test_a_failed_motion_tells_what_the_wheels_said_last() -> None:
    robot = VirtualRobot("opencr")
    session = DriveSession(robot.wheels, robot.time, robot.time.advance)
    robot.wheels.open()
    robot.motors[0].raise_hardware_error(SHUTDOWN_OVERLOAD)
    assert session.carry_out(Forward(0.2), lambda _moment: None) is MotionState.FAILED
    assert session.reason.startswith("the wheels have not answered for 4 s; ")
    assert "a motor has shut itself down" in session.reason
