"""Any bytes from the line: no crash, no hang, and never another value than the motor's.

WHEELS_FUZZ_EXAMPLES=20000 gives each test so many examples instead of the few of every day.
"""

import os
from collections.abc import Sequence
from contextlib import suppress

import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from hil_fakes.dynamixel.faults import ReplyFault
from hil_fakes.dynamixel.line import Line
from hil_fakes.dynamixel.motor import turtlebot3_pair
from hil_fakes.dynamixel.opencr import FakeOpenCR
from hil_fakes.dynamixel.protocol import Instruction, encode, encode_status
from hil_fakes.dynamixel.virtual import VirtualPort, VirtualTime
from hil_fakes.virtual_robot import Kind, VirtualRobot
from hvcpd.errors import DeviceError
from hvcpd.hardware import registers
from hvcpd.hardware.wheels_bus import BusError, DynamixelBus
from hvcpd.ports import WheelCommand

AHEAD = WheelCommand(3.0, 3.0)
LIMIT_S = 5.0
"""Of virtual time for one exchange, whatever comes; three tries and a handshake take less than 1.5 s."""


def examples(usual: int) -> int:
    """How many examples a test has."""
    return int(os.environ.get("WHEELS_FUZZ_EXAMPLES", usual))


status_packets = st.builds(
    encode_status, st.sampled_from([1, 2, 7, 200, 254]), st.integers(0, 255), st.binary(max_size=24)
)
short_packets = st.builds(encode, st.sampled_from([1, 2]), st.sampled_from([b"\x55", b"\x55\x00"]))
SIZES = (1, 2, 4)
"""Of the registers that are read here."""


def is_no_answer(piece: bytes) -> bool:
    """Whether this is not just what motor 1 would answer to a read: that nobody could tell from the true answer."""
    return not any(len(piece) == len(encode_status(1, 0, bytes(n))) and piece[4] == 1 for n in SIZES)


pieces = st.one_of(
    st.binary(max_size=30),
    st.lists(st.sampled_from([0xFF, 0xFD, 0x00, 0x55, 0x01]), max_size=20).map(bytes),
    st.tuples(status_packets, st.integers(0, 40)).map(lambda cut: cut[0][: cut[1]]).filter(is_no_answer),
)
"""What a line may bring that no device of ours has sent with a right CRC and a fitting size."""


class DirtyPort(VirtualPort):
    """Brings other bytes before, and instead of, what the devices send."""

    script: Sequence[bytes] = ()
    _at = 0

    def writePort(self, packet: Sequence[int]) -> int:
        if self._at < len(self.script):
            self._inbox += self.script[self._at]
            self._at += 1
        return super().writePort(packet)


def dirty_bus(script: Sequence[bytes]) -> tuple[DynamixelBus, VirtualTime]:
    line, time = Line(turtlebot3_pair(), 1), VirtualTime()

    def make_port(_path: str, baud_rate: int, timeout_s: float) -> DirtyPort:
        port = DirtyPort(line, time, baud_rate, timeout_s)
        port.script = script
        return port

    bus = DynamixelBus("dirty", 1_000_000, 0.034, make_port)
    bus.open()
    return bus, time


@settings(max_examples=examples(150), deadline=None)
@example([encode(1, b"\x55")])
@given(st.lists(pieces | short_packets, max_size=8))
def test_a_read_is_right_or_fails_whatever_comes_before(script: list[bytes]) -> None:
    bus, time = dirty_bus(script)
    known = ((registers.PRESENT_INPUT_VOLTAGE, 120), (registers.VELOCITY_LIMIT, 265), (registers.TORQUE_ENABLE, 0))
    for register, value in known:
        start_s = time.now_s
        with suppress(BusError):
            assert bus.read(1, register) == value
        assert time.now_s - start_s < LIMIT_S


@settings(max_examples=examples(60), deadline=None)
@given(st.sampled_from(["dynamixel", "opencr"]), st.lists(st.binary(max_size=60), max_size=12))
def test_no_bytes_crash_or_hang_the_driver(kind: Kind, noise: list[bytes]) -> None:
    robot = VirtualRobot(kind, seed=1)
    robot.wheels.open()
    robot.run(AHEAD, 0.1)
    for piece in noise:
        robot.port.inject(piece)
        robot.line.faults.schedule(ReplyFault.NOISE)
        start_s = robot.time.now_s
        before = robot.motors[0].true_angle_rad
        try:
            reading = robot.exchange(AHEAD)
            assert reading.left_rad == pytest.approx(before, abs=0.5)
        except DeviceError:
            pass
        assert robot.time.now_s - start_s < LIMIT_S
        robot.time.advance(0.05)
    robot.wheels.close()


@settings(max_examples=examples(100), deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(st.sampled_from([*Instruction, 0x55, 0x00, 0xFF]), st.sampled_from([1, 2, 200, 254]), st.binary(max_size=40))
def test_no_packet_crashes_a_device_or_makes_a_wheel_turn_without_torque(
    instruction: int, device_id: int, parameters: bytes
) -> None:
    motors, controller = turtlebot3_pair(), FakeOpenCR()
    line = Line([*motors, controller], 1)
    line.hear(encode(device_id, bytes((instruction,)) + parameters), 1_000_000)
    line.advance(0.1)
    for motor in motors:
        assert motor.memory.get("torque_enable") or motor.true_angle_rad == 0.0


@settings(max_examples=examples(100), deadline=None)
@given(st.lists(st.binary(max_size=200), max_size=5))
def test_devices_survive_any_bytes_and_still_answer(chunks: list[bytes]) -> None:
    line = Line([*turtlebot3_pair(), FakeOpenCR()], 1)
    for chunk in chunks:
        line.hear(chunk, 1_000_000)
        line.advance(0.01)
    ping = encode(1, bytes((Instruction.PING,)))
    answers = b"".join(line.hear(ping, 1_000_000) for _ in range(150))  # a header in the noise may swallow the first
    assert encode_status(1, 0, b"\x24\x04\x2d") in answers
