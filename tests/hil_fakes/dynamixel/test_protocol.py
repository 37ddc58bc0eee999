"""The fake's codec against the manual's examples, against the SDK's arithmetic, and against noise."""

import pytest
from dynamixel_sdk import Protocol2PacketHandler
from hypothesis import example, given
from hypothesis import strategies as st

from hil_fakes.dynamixel.protocol import (
    Instruction,
    Packet,
    PacketReader,
    crc16,
    encode,
    encode_status,
    stuff,
    unstuff,
)
from hvcpd.hardware.wheels_port import PacketHandler

SDK = Protocol2PacketHandler()

# e-Manual, Protocol 2.0, "Instruction Details": what is sent, and what it means.
INSTRUCTIONS = {
    "fffffd00 01 0300 01 194e": Packet(1, Instruction.PING),
    "fffffd00 01 0700 02 84000400 1d15": Packet(1, Instruction.READ, bytes.fromhex("84000400")),
    "fffffd00 01 0900 03 740000020000 ca89": Packet(1, Instruction.WRITE, bytes.fromhex("740000020000")),
    "fffffd00 01 0300 05 02ce": Packet(1, Instruction.ACTION),
    "fffffd00 01 0300 08 2f4e": Packet(1, Instruction.REBOOT),
    "fffffd00 fe 0900 82 840004000102 cefa": Packet(254, Instruction.SYNC_READ, bytes.fromhex("840004000102")),
    "fffffd00 fe 0d00 92 01900002000292000100 1a05": Packet(
        254, Instruction.BULK_READ, bytes.fromhex("01900002000292000100")
    ),
}

bodies = st.binary(max_size=60) | st.lists(st.sampled_from([0xFF, 0xFD, 0x00, 0x7F]), max_size=60).map(bytes)
instructions = st.builds(Packet, st.integers(0, 252), st.sampled_from(list(Instruction)).map(int), bodies)


@pytest.mark.parametrize("wire", INSTRUCTIONS)
def test_manual_examples_of_instructions(wire: str) -> None:
    packet = INSTRUCTIONS[wire]
    assert PacketReader().feed(bytes.fromhex(wire)) == [packet]
    assert encode(packet.motor_id, bytes((packet.instruction,)) + packet.parameters) == bytes.fromhex(wire)


def test_manual_examples_of_replies() -> None:
    assert encode_status(1, 0, bytes.fromhex("060426")) == bytes.fromhex("fffffd00010700550006042665 5d")
    assert encode_status(2, 0, bytes.fromhex("1f080000")) == bytes.fromhex("fffffd00020800 55001f080000 babe")


@given(st.binary(max_size=80))
def test_crc_is_the_sdks(data: bytes) -> None:
    assert crc16(data) == SDK.updateCRC(0, data, len(data))


@given(bodies)
def test_stuffing_is_undone_and_leaves_no_header(body: bytes) -> None:
    stuffed = stuff(body)
    assert unstuff(stuffed) == body
    assert b"\xff\xff\xfd\x00" not in stuffed + b"\x00"


def read_status(handler: Protocol2PacketHandler, wire: bytes) -> tuple[int, int, bytes]:
    plain = handler.removeStuffing(list(wire))
    length = plain[5] | plain[6] << 8
    return plain[4], plain[8], bytes(plain[9 : 7 + length - 2])


@given(st.integers(0, 252), st.integers(0, 255), bodies.filter(lambda data: data.count(b"\xff\xff\xfd") <= 1))
def test_the_sdk_reads_our_replies(motor_id: int, error: int, data: bytes) -> None:
    if data.count(b"\xff\xff\xfd") and b"\xfd" in data.partition(b"\xff\xff\xfd")[2]:
        return  # the SDK may lose a byte behind a stuffed one; see the next test
    assert read_status(SDK, encode_status(motor_id, error, data)) == (motor_id, error, data)


@example(1, 0, b"\xff\xff\xfd\xff\xfd\xfd")
@given(st.integers(0, 252), st.integers(0, 255), bodies)
def test_our_handler_reads_every_reply(motor_id: int, error: int, data: bytes) -> None:
    assert read_status(PacketHandler(), encode_status(motor_id, error, data)) == (motor_id, error, data)


def test_the_sdk_still_loses_a_byte_so_our_handler_is_needed() -> None:
    data = b"\xff\xff\xfd\xff\xfd\xfd"
    assert read_status(SDK, encode_status(1, 0, data)) != (1, 0, data)


@given(st.lists(instructions, max_size=5), st.integers(1, 40))
def test_packets_come_out_of_any_portions(packets: list[Packet], portion: int) -> None:
    wire = b"".join(encode(p.motor_id, bytes((p.instruction,)) + p.parameters) for p in packets)
    reader = PacketReader()
    heard = [p for at in range(0, len(wire), portion) for p in reader.feed(wire[at : at + portion])]
    assert heard == packets
    assert (reader.crc_errors, reader.noise_bytes) == (0, 0)


@given(instructions, st.binary(max_size=40).filter(lambda noise: b"\xff" not in noise))
def test_a_packet_is_found_behind_noise(packet: Packet, noise: bytes) -> None:
    wire = encode(packet.motor_id, bytes((packet.instruction,)) + packet.parameters)
    assert PacketReader().feed(noise + wire) == [packet]


@given(instructions, st.data())
def test_one_flipped_bit_is_never_taken_for_an_instruction(packet: Packet, data: st.DataObject) -> None:
    wire = bytearray(encode(packet.motor_id, bytes((packet.instruction,)) + packet.parameters))
    at = data.draw(st.integers(0, len(wire) * 8 - 1))
    wire[at // 8] ^= 1 << (at % 8)
    assert packet not in PacketReader().feed(bytes(wire))


@given(st.lists(st.binary(max_size=50), max_size=10))
def test_any_bytes_are_survived(chunks: list[bytes]) -> None:
    reader = PacketReader()
    for chunk in chunks:
        reader.feed(chunk)
    assert reader.noise_bytes <= sum(map(len, chunks))
