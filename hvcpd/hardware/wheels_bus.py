"""Registers of Dynamixel devices over one port, by `dynamixel-sdk`: every failure is a `BusError` with its cause.

Knows Protocol 2.0 devices in general, no motor in particular; the drivers build on it.
"""

from __future__ import annotations

import errno
import os
import termios
from collections.abc import Callable, Mapping, Sequence
from typing import Any, TypeVar

from dynamixel_sdk import BROADCAST_ID, COMM_RX_CORRUPT, COMM_SUCCESS, COMM_TX_FAIL, INST_PING

from hvcpd.errors import DeviceError
from hvcpd.hardware.groups import group_of
from hvcpd.hardware.registers import Register
from hvcpd.hardware.wheels_port import PORT_ERRORS, PacketHandler, Port, WaitingPort

ALERT = 0x80
"""Bit 7 of a reply's error field: the device reports a hardware error (e-Manual, Protocol 2.0)."""

STATUS_SIZE = 11
"""Bytes of a status packet without parameters: error at 8, parameters from 9 on (e-Manual, "Status Packet")."""

TIMEOUT_S = 0.034
"""Wait for a reply, beyond its time on the wire; the SDK's own value (two FTDI latencies of 16 ms and 2 ms)."""

PING_PARAMETERS = 3
"""The answer to a ping: model number (2) and firmware (1). No register that we read has three bytes."""

PROBE_SIZE, PROBES = 40, 32
"""A probe reads from address 0 on, as many bytes as no other read of ours, and each of so many in a row another number:
its answer tells that all that came before it is through, even when answers come many requests late."""


MakePort = Callable[[str, int, float], Port]
"""Makes the port under a bus from its path, its speed in baud and the time-out of a reply in s."""


class BusError(Exception):
    """One exchange on the bus failed; another try may succeed."""


class PortLostError(BusError):
    """The port itself is gone: the adapter was unplugged, or its driver failed."""


class RefusedError(BusError):
    """A device answered, but refused (error number of Protocol 2.0 in the text)."""


Answer = TypeVar("Answer")


def twice(attempt: Callable[[], Answer]) -> Answer:
    """Return the result of `attempt`, tried again after a BusError: one lost reply does not mean a missing motor."""
    try:
        return attempt()
    except (PortLostError, RefusedError):
        raise
    except BusError:
        return attempt()


def answer(attempt: Callable[[], Answer]) -> Answer | None:
    """Return the result of `attempt`, as by `twice`; None if nothing answers. Raises PortLostError."""
    try:
        return twice(attempt)
    except PortLostError:
        raise
    except BusError:
        return None


class DynamixelBus:
    """One serial line with Protocol 2.0 devices. Blocking; to be used from one thread."""

    def __init__(self, path: str, baud_rate: int, timeout_s: float, make_port: MakePort = WaitingPort) -> None:
        self.path = path
        self.baud_rate = baud_rate
        self._port = make_port(path, baud_rate, timeout_s)
        self._protocol = PacketHandler()
        self._unsettled: set[int] = set()
        self._probe_number = 0
        self.alert = False
        """True if a device reported a hardware error since this was last set to False."""

    @property
    def is_open(self) -> bool:
        """True between `open` and `close`."""
        return bool(self._port.is_open)

    def open(self) -> None:
        """Open and lock the port. Raises DeviceError with the remedy."""
        try:
            opened = self._port.openPort()
        except PORT_ERRORS as error:
            self._port.closePort()
            raise DeviceError(port_remedy(self.path, error)) from error
        if not opened:
            raise DeviceError(f"{self.path}: {self.baud_rate} baud is not a speed that Dynamixel motors know")

    def close(self) -> None:
        """Close the port."""
        self._port.closePort()

    def ping(self, device_id: int) -> int:
        """The model number that device `device_id` answers. Raises BusError."""
        self._settle(device_id)
        return int.from_bytes(self._ping(device_id)[:2], "little")

    def read(self, device_id: int, register: Register) -> int:
        """The value of a register. Raises BusError."""
        return register.decode(self.read_block(device_id, register.address, register.size), register.address)

    def write(self, device_id: int, register: Register, value: int) -> None:
        """Write a register and wait for the device's word that it did. Raises BusError."""
        self.write_block(device_id, register.address, register.encode(value), register.name)

    def write_block(self, device_id: int, address: int, data: bytes, what: str) -> None:
        """Write `data` from `address` on and wait for the device's word; `what` names it. Raises BusError."""
        self._settle(device_id)
        self.send_block(device_id, address, data)
        self._port.setPacketTimeout(STATUS_SIZE)
        self._receive(device_id, 0, what)

    def send_block(self, device_id: int, address: int, data: bytes) -> None:
        """Write `data` from `address` on and wait for nobody. Raises BusError."""
        self._sent(self._call("writeTxOnly", device_id, address, len(data), list(data)))

    def read_block(self, device_id: int, address: int, size: int) -> bytes:
        """`size` bytes from `address` on of one device. Raises BusError."""
        self._settle(device_id)
        self._sent(self._call("readTx", device_id, address, size))
        return self._receive(device_id, size, f"a read from {address}")

    def sync_write(self, register: Register, values: Mapping[int, int]) -> None:
        """Write a register of several devices at once, by identifier. Nobody answers. Raises BusError."""
        parameters: list[int] = []
        for device_id, value in values.items():
            parameters += (device_id, *register.encode(value))
        self._sent(self._call("syncWriteTxOnly", register.address, register.size, parameters, len(parameters)))

    def sync_read(self, address: int, size: int, device_ids: Sequence[int]) -> dict[int, bytes]:
        """`size` bytes from `address` on of several devices, by identifier. Raises BusError."""
        self._settle(*device_ids)
        self._sent(self._call("syncReadTx", address, size, list(device_ids), len(device_ids), False))
        return {device_id: self._receive(device_id, size, f"a read from {address}") for device_id in device_ids}

    def find(self, search_s: float) -> dict[int, int]:
        """Every device that answers within `search_s`, identifier to model number. Raises BusError.

        Each device waits for its turn, by its identifier (3 ms each in the SDK's reckoning), so a whole search takes
        0.8 s.
        """
        self._send_ping(BROADCAST_ID)
        self._port.setPacketTimeoutMillis(search_s * 1000.0)
        found: dict[int, int] = {}
        result = COMM_SUCCESS
        while result in (COMM_SUCCESS, COMM_RX_CORRUPT):
            packet, result = self._call("rxPacket", False)
            if self._port.overtime():
                break  # not replies any more, but a babbling line
            if result == COMM_SUCCESS and _n_parameters(packet) == PING_PARAMETERS:
                found[packet[4]] = packet[9] | packet[10] << 8
        return found

    def hears(self, device_id: int, listen_s: float) -> bool:
        """Whether a late reply of the device comes within `listen_s`; sends nothing. Raises PortLostError."""
        self._port.setPacketTimeoutMillis(listen_s * 1000.0)
        result = COMM_SUCCESS
        while result in (COMM_SUCCESS, COMM_RX_CORRUPT) and not self._port.overtime():
            packet, result = self._call("rxPacket", False)
            if result == COMM_SUCCESS and packet[4] == device_id:
                return True
        return False

    def _settle(self, *device_ids: int) -> None:
        """After a failure: ask for an answer of a size that no other one has; all late replies come before it."""
        for device_id in device_ids:
            if device_id in self._unsettled:
                self._probe_number = (self._probe_number + 1) % PROBES
                size = PROBE_SIZE + self._probe_number
                self._sent(self._call("readTx", device_id, 0, size))
                self._receive(device_id, size, "a probe")
                self._unsettled.discard(device_id)

    def _ping(self, device_id: int) -> bytes:
        self._send_ping(device_id)
        self._port.setPacketTimeout(STATUS_SIZE + PING_PARAMETERS)
        return self._receive(device_id, PING_PARAMETERS, "a ping")

    def _send_ping(self, device_id: int) -> None:
        packet = [0, 0, 0, 0, device_id, 3, 0, INST_PING, 0, 0]  # the SDK fills in header and CRC
        self._sent(self._call("txPacket", packet))

    def _call(self, method: str, *arguments: object) -> Any:
        """Call the SDK. A vanished port becomes PortLostError."""
        if not self._port.is_open:
            raise PortLostError(f"{self.path} is not open")
        try:
            return getattr(self._protocol, method)(self._port, *arguments)
        except PORT_ERRORS as error:
            raise self._lost(error) from error

    def _sent(self, result: int) -> None:
        if result != COMM_SUCCESS:
            self._port.is_using = False
            hangs = "the device takes no more bytes; does it hang? Press its reset button, or switch it off and on"
            raise BusError(f"{self.path}: {hangs if result == COMM_TX_FAIL else self._protocol.getTxRxResult(result)}")

    def _receive(self, device_id: int, size: int, what: str) -> bytes:
        """The `size` parameters of the device's reply. Replies of others, or of another size, are late ones: skip them.

        (The SDK's own read functions take any reply of the device and cut it, or fill it up with its CRC.)
        """
        while True:
            packet, result = self._call("rxPacket", False)
            if result != COMM_SUCCESS or self._port.overtime():
                raise self._failure(device_id, result)
            if len(packet) < STATUS_SIZE:  # noise with a right CRC
                continue
            error, count = packet[8], _n_parameters(packet)
            if packet[4] == device_id and (count == size or (count == 0 and error & ~ALERT)):
                break
        self.alert = self.alert or bool(error & ALERT)
        if error & ~ALERT:
            text = self._protocol.getRxPacketError(error & ~ALERT)
            raise RefusedError(f"motor {device_id} on {self.path} refuses {what}: {text}")
        return bytes(packet[9 : 9 + size])

    def _failure(self, device_id: int, result: int) -> BusError:
        """Throw away what still comes in, and remember that more may come later."""
        self._unsettled.add(device_id)
        try:
            self._port.drain()
        except PORT_ERRORS as error:
            return self._lost(error)
        text = "garbled answer" if result == COMM_RX_CORRUPT else "no answer"
        return BusError(f"{text} from motor {device_id} on {self.path}")

    def _lost(self, error: Exception) -> PortLostError:
        self._port.closePort()
        return PortLostError(f"{self.path} is gone ({error}): is the adapter still plugged in?")


def _n_parameters(packet: Sequence[int]) -> int:
    """How many parameters a status packet has: its length without instruction, error and CRC."""
    return (packet[5] | packet[6] << 8) - 4


def in_use(error: BaseException | None) -> bool:
    """Whether a port did not open because another program has it."""
    return getattr(error, "errno", None) in (errno.EBUSY, errno.EAGAIN)


def port_remedy(path: str, error: Exception) -> str:
    """The message for a port that does not open, with the remedy."""
    number = getattr(error, "errno", None)
    if number in (errno.ENOENT, errno.ENODEV, errno.ENXIO):
        return f"{path}: no such port. Plug in the U2D2 or OpenCR, or set wheels.port to the right one (auto finds it)"
    if number in (errno.EACCES, errno.EPERM):
        group = group_of(path)
        return f"{path}: no permission. Join the group {group} (sudo usermod -aG {group} $USER) and log in again"
    if in_use(error):
        return (
            f"{path}: the port is in use. Stop the other program "
            "(another hvcpd, or ModemManager: sudo systemctl disable --now ModemManager)"
        )
    if isinstance(error.__context__, termios.error):  # pyserial has its number only as a part of the text
        number = error.__context__.args[0]
    if number == errno.ENOTTY:
        return f"{path}: the port does not open (it is no serial port). Set wheels.port to the motors' (auto finds it)"
    reason = os.strerror(number) if number else error
    return f"{path}: the port does not open ({reason}). Check that it is the motors' serial port"
