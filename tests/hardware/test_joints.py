"""A joint on the wheels' line: it turns, meets things, is stopped, and its motor's faults cost the wheels nothing."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import pytest

from hil_fakes.dynamixel.faults import ReplyFault
from hil_fakes.dynamixel.line import Line
from hil_fakes.dynamixel.motor import JOINT, FakeMotor, turtlebot3_pair
from hil_fakes.dynamixel.virtual import VirtualPort, VirtualTime
from hvcpd.config.skill_settings import JointSettings
from hvcpd.errors import DeviceError
from hvcpd.hardware.joints import AGAIN_S, Joint
from hvcpd.hardware.wheels import DynamixelWheels
from hvcpd.hardware.wheels_bus import MakePort
from hvcpd.ports import STANDSTILL, WheelCommand

CYCLE_S = 0.05


@dataclass
class Bench:
    """Two wheels and a joint on one line, in virtual time."""

    time: VirtualTime
    line: Line
    wheels: DynamixelWheels
    joint: Joint
    make_port: MakePort

    @property
    def motor(self) -> FakeMotor:
        return self.line.motors[3]

    def run(self, duration_s: float, command: WheelCommand = STANDSTILL) -> None:
        for _ in range(round(duration_s / CYCLE_S)):
            self.wheels.exchange(command)
            self.time.advance(CYCLE_S)

    def item(self, name: str) -> int:
        return self.motor.memory.get(name)


def bench(joint_motor: FakeMotor | None = None, opened: bool = True, **settings: Any) -> Bench:
    motor = joint_motor or FakeMotor(3, start_ticks=2048, shaft=JOINT)
    line, clock = Line((*turtlebot3_pair(), motor), 1), VirtualTime()
    joint = Joint(JointSettings(3, **settings), clock)
    joints: Sequence[Joint] = (joint,)

    def make_port(_path: str, baud_rate: int, timeout_s: float) -> VirtualPort:
        return VirtualPort(line, clock, baud_rate, timeout_s)

    wheels = DynamixelWheels("virtual", clock=clock, make_port=make_port, joints=joints)
    made = Bench(clock, line, wheels, joint, make_port)
    if opened:
        made.wheels.open()
    return made


@pytest.mark.parametrize("reverse", [False, True])
def test_it_turns_to_its_angle_as_fast_as_it_may_while_the_wheels_turn(reverse: bool) -> None:
    robot = bench(reverse=reverse)
    number = robot.joint.turn(60.0)
    robot.run(0.5, WheelCommand(3.0, 3.0))
    assert not robot.joint.state.there  # 90 degrees a second
    robot.run(0.7, WheelCommand(3.0, 3.0))
    state = robot.joint.state
    assert (state.goal, state.there, state.blocked, state.fault) == (number, True, False, None)
    assert state.angle_deg == pytest.approx(60.0, abs=2.0)
    assert (robot.item("present_position") > 2048) is not reverse
    assert robot.line.motors[1].true_speed_rad_s == pytest.approx(3.0, abs=0.1)
    with pytest.raises(ValueError, match="100° is beyond -90 to 90°"):
        robot.joint.turn(100.0)


def test_nothing_moves_when_the_wheels_are_opened_and_an_old_goal_is_forgotten() -> None:
    motor = FakeMotor(3, start_ticks=1000, shaft=JOINT)
    motor.memory.set("goal_position", 3000)
    robot = bench(motor)
    robot.run(1.0)
    assert robot.item("torque_enable") == 0
    robot.joint.turn(0.0)
    robot.run(0.05)
    assert abs(robot.item("present_position") - 1000) < 200


def test_a_gripper_that_meets_a_book_is_blocked_and_presses_as_hard_as_it_may() -> None:
    robot = bench(effort=0.3)
    robot.motor.obstacle_ticks = 2400
    robot.joint.turn(60.0)
    robot.run(1.5)
    state = robot.joint.state
    assert (state.blocked, state.there) == (True, False)
    assert state.load == pytest.approx(0.3, abs=0.01)
    robot.run(5.0)  # no overload: it may hold the book for long
    assert robot.item("torque_enable") == 1
    robot.joint.turn(-10.0)
    robot.run(2.0)
    assert robot.joint.state.there


@pytest.mark.parametrize(("stopped", "torque"), [("hold", 1), ("release", 0)])
def test_a_stop_leaves_it_where_it_is_with_its_torque_as_declared(stopped: str, torque: int) -> None:
    robot = bench(stopped=stopped)
    robot.joint.turn(80.0)
    robot.run(0.5)
    robot.joint.stop()
    robot.run(0.1)
    place = robot.item("present_position")
    robot.run(2.0)
    assert abs(robot.item("present_position") - place) < 150
    assert robot.item("torque_enable") == torque
    robot.wheels.close()
    assert robot.item("torque_enable") == torque


def test_it_stands_when_nobody_talks_any_more_and_moves_again_when_it_is_told_anew() -> None:
    robot = bench()
    robot.joint.turn(80.0)
    robot.run(0.3)
    robot.time.advance(1.0)
    place = robot.item("present_position")
    assert robot.item("bus_watchdog") == -1
    assert place < 2048 + 80 / 0.088
    robot.run(0.05)
    assert "heard nothing" in (robot.joint.state.fault or "")
    robot.run(1.0)
    assert abs(robot.item("present_position") - place) < 20
    robot.joint.turn(80.0)
    robot.run(1.5)
    assert robot.joint.state.there


def test_a_watchdog_that_tripped_between_two_calls_costs_nothing() -> None:
    """A motor whose watchdog has tripped refuses goals; the next call failed."""
    robot = bench()
    robot.joint.turn(30.0)
    robot.run(1.0)
    robot.time.advance(1.0)
    assert robot.item("bus_watchdog") == -1
    robot.joint.turn(-30.0)
    robot.run(1.5)
    assert (robot.joint.state.there, robot.joint.state.fault) == (True, None)


def test_a_joint_that_is_missing_is_told_at_the_start_and_later_costs_the_wheels_little() -> None:
    motor = FakeMotor(3, start_ticks=2048, shaft=JOINT)
    motor.powered = False
    robot = bench(motor, opened=False)
    with pytest.raises(DeviceError, match=r"joint \(ID 3\): no answer; plug it into the wheels' line"):
        robot.wheels.open()
    motor.powered = True
    robot.wheels.open()
    motor.powered = False
    robot.joint.turn(10.0)
    robot.run(AGAIN_S * 3, WheelCommand(3.0, 3.0))
    assert "does not answer" in (robot.joint.state.fault or "")
    assert robot.line.motors[1].true_speed_rad_s == pytest.approx(3.0, abs=0.1)
    motor.powered = True
    robot.joint.turn(20.0)
    robot.run(AGAIN_S + 1.0)
    assert robot.joint.state.there


def test_to_let_go_is_said_again_to_a_joint_that_has_not_answered() -> None:
    robot = bench(stopped="release")
    robot.joint.turn(80.0)
    robot.run(0.3)
    wheels = [ReplyFault.NONE, ReplyFault.NONE]
    robot.line.faults.schedule(*wheels, *[ReplyFault.DROP] * 8)
    robot.wheels.close()
    assert robot.line.faults.pending == 0


@pytest.mark.parametrize(("stopped", "torque"), [("hold", 1), ("release", 0)])
def test_a_joint_that_hears_and_is_not_heard_is_stopped_all_the_same(stopped: str, torque: int) -> None:
    """It went on to its goal: the wheels' words keep its watchdog quiet."""
    robot = bench(stopped=stopped)
    robot.joint.turn(80.0)
    robot.run(0.3)
    robot.motor.memory.set("status_return_level", 0)  # it carries out what it is told, and answers nothing
    robot.run(0.15)
    assert "does not answer" in (robot.joint.state.fault or "")
    robot.run(0.6)
    place = robot.item("present_position")
    assert robot.item("torque_enable") == torque
    robot.run(2.0)
    assert abs(robot.item("present_position") - place) < 20
    assert place < 2048 + 60 / 0.088


def test_an_overload_is_told_and_a_lost_reply_heals() -> None:
    robot = bench()
    robot.joint.turn(50.0)
    robot.run(0.2)
    robot.line.faults.schedule(ReplyFault.NONE, ReplyFault.NONE, ReplyFault.DROP)
    robot.run(1.5)
    assert robot.joint.state.there
    robot.motor.raise_hardware_error(1 << 5)
    robot.run(0.2)
    assert robot.joint.state.fault == "its motor reports a hardware error: overload; switch it off and on"
