"""The OpenCR driver on a stateful controller, most of it on a line in memory and in virtual time."""

from contextlib import suppress

import pytest

from hil_fakes.dynamixel.bus import FakeBus
from hil_fakes.dynamixel.faults import ReplyFault
from hil_fakes.dynamixel.motor import SHUTDOWN_OVERLOAD
from hil_fakes.dynamixel.opencr import BY_NAME, FakeOpenCR
from hil_fakes.virtual_robot import Kind, VirtualRobot
from hvcpd.errors import DeviceError
from hvcpd.hardware import opencr
from hvcpd.hardware.registers import VELOCITY_UNIT_RAD_S, Register
from hvcpd.hardware.wheels_opencr import OpenCRWheels
from hvcpd.ports import STANDSTILL, WheelCommand

AHEAD = WheelCommand(3.0, 3.0)
REGISTERS = [value for value in vars(opencr).values() if isinstance(value, Register)]


@pytest.fixture
def kind() -> Kind:
    return "opencr"


def controller(robot: VirtualRobot) -> FakeOpenCR:
    assert robot.controller is not None
    return robot.controller


@pytest.mark.parametrize("register", REGISTERS, ids=lambda register: register.name)
def test_both_tables_say_the_same(register: Register) -> None:
    item = BY_NAME[register.name.replace(" ", "_")]
    assert (register.address, register.size, register.signed) == (item.address, item.size, item.signed)


def test_it_speaks_the_sdks_bytes_over_a_pty() -> None:
    with FakeBus([FakeOpenCR()]) as bus:
        wheels = OpenCRWheels(bus.path, timeout_s=20.0, clock=lambda: 0.0)
        wheels.open()
        for _ in range(40):
            reading = wheels.exchange(AHEAD)
            bus.advance(0.05)
        wheels.close()
    assert reading.left_rad_s == pytest.approx(3.0, abs=0.1)
    assert reading.left_rad == pytest.approx(3.0 * 1.85, rel=0.05)


def test_wheels_turn_as_told_and_forward_is_positive(robot: VirtualRobot) -> None:
    robot.run(WheelCommand(3.0, -1.5), 1.0)
    before = [motor.true_angle_rad for motor in robot.motors]
    robot.run(WheelCommand(3.0, -1.5), 4.0)
    turned = [motor.true_angle_rad - angle for motor, angle in zip(robot.motors, before, strict=True)]
    assert turned == pytest.approx([12.0, -6.0], rel=0.02)  # although the command words are coarse


def test_a_crawl_below_the_command_words_resolution_still_moves(robot: VirtualRobot) -> None:
    slow_rad_s = 0.003 / 0.033
    reading = robot.run(WheelCommand(slow_rad_s, slow_rad_s), 10.0)
    assert 0.2 * 0.03 < reading.left_rad * 0.033 < 1.1 * 0.03  # in pulses, of which the motors' lag takes its share


def test_no_wheel_is_told_to_go_faster_than_its_motor_may(robot: VirtualRobot) -> None:
    for command in (WheelCommand(20.0, 20.0), WheelCommand(20.0, 5.0), WheelCommand(-20.0, 20.0)):
        robot.run(command, 1.0)
        assert max(abs(motor.memory.get("goal_velocity")) for motor in robot.motors) in range(240, 266)


def test_the_heartbeat_changes_with_every_command(robot: VirtualRobot) -> None:
    beats = []
    for _ in range(5):
        robot.cycle(STANDSTILL)
        beats.append(controller(robot).get("heartbeat"))
    assert len(set(beats)) == 5


def test_silence_stops_the_wheels_after_the_controllers_half_second(robot: VirtualRobot) -> None:
    robot.run(AHEAD, 1.0)
    robot.time.advance(0.55)
    assert [motor.memory.get("goal_velocity") for motor in robot.motors] == [0, 0]
    robot.time.advance(0.2)
    assert robot.fastest_rad_s == 0.0
    robot.run(STANDSTILL, 0.5)
    assert robot.fastest_rad_s == 0.0  # the old command is not taken up again
    assert robot.run(AHEAD, 1.0).left_rad_s == pytest.approx(3.0, abs=0.1)


def test_ramps_that_another_program_left_in_the_motors_do_not_stretch_the_stop() -> None:
    robot = VirtualRobot("opencr", seed=1)
    for motor in robot.motors:
        motor.write(108, (20).to_bytes(4, "little"))  # 7.5 rad/s²: 0.8 s from top speed
    robot.wheels.open()
    robot.run(WheelCommand(6.0, 6.0), 2.0)
    robot.run(STANDSTILL, 0.3)
    assert robot.fastest_rad_s == 0.0


def test_a_motor_that_loses_its_cable_stops_the_other_at_the_second_packet(robot: VirtualRobot) -> None:
    """The controller takes a packet each half second then: first a command of ours, and next the stop."""
    robot.run(AHEAD, 1.0)
    robot.motors[0].powered = False
    dead_s = robot.time.now_s
    while robot.time.now_s < dead_s + 1.25:
        with pytest.raises(DeviceError, match="do not answer"):
            robot.exchange(AHEAD)
        robot.time.advance(0.01)
    assert robot.fastest_rad_s == 0.0


@pytest.mark.parametrize("dead", [0, 1])
@pytest.mark.parametrize("speeds", [(3.0, 3.0), (-3.0, 3.0), (5.0, -2.0)])
def test_a_motor_that_comes_back_takes_no_turns_from_either_wheel(
    robot: VirtualRobot, dead: int, speeds: tuple[float, float]
) -> None:
    command = WheelCommand(*speeds)
    robot.run(command, 4.0)
    robot.motors[dead].powered = False
    for _ in range(20):
        with suppress(DeviceError):
            robot.cycle(command)
    robot.motors[dead].powered = True
    robot.motors[dead].reboot()
    for _ in range(10):
        with suppress(DeviceError):
            reading = robot.cycle(STANDSTILL)
    truth = [motor.true_angle_rad for motor in robot.motors]
    assert [reading.left_rad, reading.right_rad] == pytest.approx(truth, abs=0.1)


def test_debug_mode_is_refused_at_open() -> None:
    robot = VirtualRobot("opencr")
    controller(robot).set("debug_mode", 1)
    with pytest.raises(DeviceError, match="debug mode"):
        robot.wheels.open()


def test_debug_mode_set_while_driving_stops_the_wheels(robot: VirtualRobot) -> None:
    robot.run(AHEAD, 1.0)
    controller(robot).set("debug_mode", 1)
    with pytest.raises(DeviceError, match="debug mode"):
        robot.run(AHEAD, 0.25)
    robot.time.advance(0.25)
    assert robot.fastest_rad_s == 0.0


def test_everything_wrong_is_told_at_once() -> None:
    robot = VirtualRobot("opencr")
    for name, value in (("debug_mode", 1), ("device_status", -1), ("model_information", 2)):
        controller(robot).set(name, value)
    for motor in robot.motors:
        motor.voltage_v = 10.2
    robot.time.advance(0.02)
    with pytest.raises(DeviceError) as caught:
        robot.wheels.open()
    for part in ("debug mode", "no motors", "only 10.2 V", "model 2, not for a Burger"):
        assert part in str(caught.value)


def test_a_silent_controller_has_its_remedy() -> None:
    robot = VirtualRobot("opencr")
    controller(robot).powered = False
    with pytest.raises(DeviceError, match=r"OpenCR \(ID 200\): no answer; is the robot switched on"):
        robot.wheels.open()


@pytest.mark.parametrize("fault", [ReplyFault.DROP, ReplyFault.CORRUPT, ReplyFault.LATE, ReplyFault.DELAY])
@pytest.mark.parametrize("before", [0, 1, 2])
def test_one_bad_reply_is_healed(robot: VirtualRobot, before: int, fault: ReplyFault) -> None:
    robot.run(AHEAD, 0.25)
    robot.line.faults.schedule(*[ReplyFault.NONE] * before, fault)
    robot.cycle(AHEAD)
    assert robot.wheels.faults == 1
    for _ in range(4):
        reading = robot.cycle(AHEAD)
        truth = robot.motors[0].true_angle_rad - 3.0 * 0.05  # a cycle ago
        assert reading.left_rad == pytest.approx(truth, abs=0.15)


def test_a_reset_of_the_controller_is_healed_without_a_jump(robot: VirtualRobot) -> None:
    robot.run(AHEAD, 5.0)
    controller(robot).reboot()
    with pytest.raises(DeviceError, match="no answer"):
        robot.cycle(AHEAD)
    robot.time.advance(2.0)  # it calibrates its gyroscope
    assert robot.fastest_rad_s == 0.0
    before = robot.motors[0].true_angle_rad
    assert robot.cycle(STANDSTILL).left_rad == pytest.approx(before, abs=0.05)
    assert robot.run(AHEAD, 1.0).left_rad_s == pytest.approx(3.0, abs=0.1)


def test_a_motor_that_shuts_down_stops_the_other(robot: VirtualRobot) -> None:
    robot.run(AHEAD, 0.5)
    robot.motors[0].raise_hardware_error(SHUTDOWN_OVERLOAD)
    with pytest.raises(DeviceError, match="torque"):
        robot.run(AHEAD, 0.5)
    robot.time.advance(0.25)
    assert robot.fastest_rad_s == 0.0
    robot.motors[0].reboot()
    with pytest.raises(DeviceError, match="torque"):
        robot.cycle(AHEAD)
    robot.time.advance(0.05)
    assert robot.run(AHEAD, 1.0).left_rad_s == pytest.approx(3.0, abs=0.1)


def test_an_empty_battery_stops_the_wheels(robot: VirtualRobot) -> None:
    robot.run(AHEAD, 0.5)
    for motor in robot.motors:
        motor.voltage_v = 10.4
    with pytest.raises(DeviceError, match="battery is empty"):
        robot.run(AHEAD, 1.5)
    robot.time.advance(0.25)
    assert robot.fastest_rad_s == 0.0


def test_the_stop_at_closing_reaches_the_motors(robot: VirtualRobot) -> None:
    robot.run(AHEAD, 0.5)
    robot.wheels.close()
    robot.time.advance(0.25)
    assert robot.fastest_rad_s == 0.0
    assert [motor.memory.get("torque_enable") for motor in robot.motors] == [0, 0]


def test_effort_and_voltage_come_with_every_reading(robot: VirtualRobot) -> None:
    robot.run(AHEAD, 0.5)
    robot.motors[1].blocked = True
    reading = robot.run(AHEAD, 0.15)
    assert reading.right_effort == 1.0
    assert reading.voltage_v == pytest.approx(12.0, abs=0.5)
    assert reading.left_rad_s == pytest.approx(3.0, abs=2 * VELOCITY_UNIT_RAD_S + 0.2)
