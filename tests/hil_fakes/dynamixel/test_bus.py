"""The fake's wire: speed, power, plugs, faults and fuzz, seen through the unmodified SDK or a bare serial port."""

import termios
import threading
from pathlib import Path

import pytest
import serial
from dynamixel_sdk import COMM_RX_CORRUPT, COMM_RX_TIMEOUT, COMM_SUCCESS, GroupSyncRead, PacketHandler
from hypothesis import given, settings
from hypothesis import strategies as st

from hil_fakes.dynamixel.bus import FakeBus
from hil_fakes.dynamixel.contract import Rig
from hil_fakes.dynamixel.dispatch import respond
from hil_fakes.dynamixel.faults import ReplyFault
from hil_fakes.dynamixel.motor import FakeMotor, turtlebot3_pair
from hil_fakes.dynamixel.protocol import Packet, PacketReader
from hil_fakes.dynamixel.pump import RealTimePump
from tests.hil_fakes.dynamixel.conftest import PatientPort
from tests.processes import python


def test_broadcast_ping_finds_both(rig: Rig) -> None:
    assert rig.protocol.broadcastPing(rig.port) == ({1: [1060, 45], 2: [1060, 45]}, COMM_SUCCESS)


def test_fast_sync_read_gives_what_sync_read_gives(rig: Rig) -> None:
    reader = GroupSyncRead(rig.port, rig.protocol, 132, 4)
    reader.addParam(1)
    reader.addParam(2)
    assert reader.txRxPacket() == COMM_SUCCESS
    slow = [reader.getData(motor_id, 132, 4) for motor_id in (1, 2)]
    assert reader.fastSyncRead() == COMM_SUCCESS
    assert [reader.getData(motor_id, 132, 4) for motor_id in (1, 2)] == slow


def test_a_wrong_speed_meets_silence(bus: FakeBus, rig: Rig) -> None:
    rig.port.setBaudRate(57_600)
    assert rig.protocol.ping(rig.port, 1)[1] == COMM_RX_TIMEOUT


def test_a_motor_without_power_is_silent(bus: FakeBus, rig: Rig) -> None:
    bus.motors[2].powered = False
    assert rig.protocol.ping(rig.port, 1)[1] == COMM_SUCCESS
    assert rig.protocol.ping(rig.port, 2)[1] == COMM_RX_TIMEOUT


def test_a_motor_answers_to_its_new_id(bus: FakeBus, rig: Rig) -> None:
    assert rig.write(2, 7, 1, 9) == (COMM_SUCCESS, 0)
    assert rig.protocol.ping(rig.port, 9)[:2] == (1060, COMM_SUCCESS)


def test_stuffed_replies_arrive_whole(bus: FakeBus, rig: Rig) -> None:
    bus.motors[1].memory.set("present_position", int.from_bytes(b"\xff\xff\xfd\x00", "little"))
    assert rig.read(1, 132, 4) == 0x00FDFFFF


@pytest.mark.parametrize(
    ("fault", "result"), [(ReplyFault.DROP, COMM_RX_TIMEOUT), (ReplyFault.CORRUPT, COMM_RX_CORRUPT)]
)
def test_faults_befall_one_reply_each(bus: FakeBus, rig: Rig, fault: ReplyFault, result: int) -> None:
    bus.faults.schedule(fault)
    assert rig.protocol.ping(rig.port, 1)[1] == result
    assert rig.protocol.ping(rig.port, 1)[1] == COMM_SUCCESS


def test_noise_before_a_reply_is_skipped(bus: FakeBus, rig: Rig) -> None:
    bus.faults.schedule(ReplyFault.NOISE)
    assert rig.read(1, 144, 2) == 120


def test_unplugging_is_an_error_and_replugging_heals(bus: FakeBus, rig: Rig) -> None:
    bus.unplug()
    with pytest.raises((serial.SerialException, OSError, termios.error)):
        rig.protocol.ping(rig.port, 1)
    rig.port.closePort()
    bus.replug()
    port = PatientPort(bus.path)
    assert port.setBaudRate(1_000_000)
    assert rig.protocol.ping(port, 1)[1] == COMM_SUCCESS
    port.closePort()


def test_a_port_of_a_fake_that_was_killed_is_replaced(tmp_path: Path) -> None:
    port = tmp_path / "motors"
    port.symlink_to("/dev/pts/no-more")
    with FakeBus(turtlebot3_pair(), path=port):
        assert port.exists()
    assert not port.is_symlink()


def test_two_motors_may_not_share_an_id() -> None:
    with pytest.raises(ValueError, match="identifier"):
        FakeBus([FakeMotor(1), FakeMotor(1)])


def test_closing_twice_is_no_error() -> None:
    bus = FakeBus([FakeMotor(1)])
    bus.close()
    bus.close()


@settings(max_examples=200)
@given(st.integers(0, 255), st.integers(0, 255), st.binary(max_size=30))
def test_no_instruction_crashes_a_motor(motor_id: int, instruction: int, parameters: bytes) -> None:
    motors = {motor.motor_id: motor for motor in turtlebot3_pair()}
    wire = b"".join(respond(motors, Packet(motor_id, instruction, parameters)))
    assert PacketReader().feed(wire) == []  # replies only, no instructions
    for motor in motors.values():
        motor.advance(0.02)


def test_the_wire_survives_noise(bus: FakeBus, rig: Rig) -> None:
    for seed in range(50):
        rig.port.writePort(bytes((seed * k * k + 255 - seed) & 0xFF for k in range(40)) + b"\xff\xff\xfd")
    rig.port.writePort(bytes(2000))
    assert rig.protocol.ping(rig.port, 1)[1] == COMM_SUCCESS


def test_the_pump_advances_by_the_real_clock() -> None:
    steps: list[float] = []
    enough = threading.Event()

    def advance(dt_s: float) -> None:
        steps.append(dt_s)
        if len(steps) >= 3:
            enough.set()

    with RealTimePump(advance, period_s=0.001):
        assert enough.wait(5.0)
    assert all(0.0 < dt_s < 5.0 for dt_s in steps)


def test_the_fake_as_a_process_serves_until_it_is_told_to_end() -> None:
    with python("-m", "hil_fakes.dynamixel", "dynamixel") as process:
        assert process.stdout is not None
        port = PatientPort(process.stdout.readline().strip())
        port.setBaudRate(1_000_000)
        answers = (PacketHandler(2.0).ping(port, 1)[:2] for _ in range(20))
        assert (1060, COMM_SUCCESS) in answers
        port.closePort()
        process.terminate()
        assert process.wait(30) == 0
