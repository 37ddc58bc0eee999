"""Registers of Dynamixel devices over one port, by `dynamixel-sdk`: every failure is a `BusError` with its cause.

Knows Protocol 2.0 devices in general, no motor in particular; the drivers build on it.
"""

from __future__ import annotations

import errno
from collections.abc import Mapping, Sequence
from typing import Any

from dynamixel_sdk import (
    BROADCAST_ID,
    COMM_RX_CORRUPT,
    COMM_RX_TIMEOUT,
    COMM_SUCCESS,
    INST_PING,
    Protocol2PacketHandler,
)

from hvcpd.errors import DeviceError
from hvcpd.hardware.wheels_port import PORT_ERRORS, WaitingPort
from hvcpd.hardware.xl430 import Register

ALERT = 0x80
"""Bit 7 of a reply's error field: the device reports a hardware error (e-Manual, Protocol 2.0)."""

PING_REPLY_SIZE = 14
"""Bytes of the answer to a ping: identifier at 4, model number at 9 and 10, firmware at 11 (e-Manual, "Ping")."""


class BusError(Exception):
    """One exchange on the bus failed; another try may succeed."""


class PortLostError(BusError):
    """The port itself is gone: the adapter was unplugged, or its driver failed."""


class RefusedError(BusError):
    """A device answered, but refused (error number of Protocol 2.0 in the text)."""


class DynamixelBus:
    """One serial line with Protocol 2.0 devices. Blocking; to be used from one thread."""

    def __init__(self, path: str, baud_rate: int, timeout_s: float) -> None:
        self.path = path
        self.baud_rate = baud_rate
        self._port = WaitingPort(path, baud_rate, timeout_s)
        self._protocol = Protocol2PacketHandler()
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
        """Let go of the port."""
        self._port.closePort()

    def ping(self, device_id: int) -> int:
        """The model number that device `device_id` answers. Raises BusError."""
        model, result, error = self._call("ping", device_id)
        self._check(device_id, result, 0)
        self._note(error)
        return int(model)

    def read(self, device_id: int, register: Register) -> int:
        """The value of a register. Raises BusError."""
        return register.decode(self.read_window(device_id, register.address, register.size), register.address)

    def read_window(self, device_id: int, address: int, size: int) -> bytes:
        """`size` bytes from `address` on. Raises BusError."""
        data, result, error = self._call("readTxRx", device_id, address, size)
        self._check(device_id, result, error)
        return self._whole(device_id, data, size)

    def write(self, device_id: int, register: Register, value: int) -> None:
        """Write a register and wait for the device's word that it did. Raises BusError."""
        payload = list(register.encode(value))
        result, error = self._call("writeTxRx", device_id, register.address, register.size, payload)
        self._check(device_id, result, error, register.name)

    def sync_write(self, register: Register, values: Mapping[int, int]) -> None:
        """Write a register of several devices at once, by identifier. Nobody answers. Raises BusError."""
        parameters: list[int] = []
        for device_id, value in values.items():
            parameters += (device_id, *register.encode(value))
        result = self._call("syncWriteTxOnly", register.address, register.size, parameters, len(parameters))
        self._check(None, result, 0)

    def sync_read(self, address: int, size: int, device_ids: Sequence[int]) -> dict[int, bytes]:
        """`size` bytes from `address` on of several devices, by identifier. Raises BusError."""
        self._check(None, self._call("syncReadTx", address, size, list(device_ids), len(device_ids), False), 0)
        windows = {}
        for device_id in device_ids:
            data, result, error = self._call("readRx", device_id, size)
            self._check(device_id, result, error)
            windows[device_id] = self._whole(device_id, data, size)
        return windows

    def drain(self) -> int:
        """Throw away late replies, so that none is taken for the next one; number of bytes. Raises PortLostError."""
        try:
            return self._port.drain()
        except PORT_ERRORS as error:
            raise self._lost(error) from error

    def find(self, search_s: float) -> dict[int, int]:
        """Every device that answers within `search_s`, identifier to model number. Raises BusError.

        Each device waits for its turn, by its identifier (3 ms each in the SDK's reckoning), so a whole search takes
        0.8 s.
        """
        broadcast_ping = [0, 0, 0, 0, BROADCAST_ID, 3, 0, INST_PING, 0, 0]  # the SDK fills in header and CRC
        self._check(None, self._call("txPacket", broadcast_ping), 0)
        self._port.setPacketTimeoutMillis(search_s * 1000.0)
        found: dict[int, int] = {}
        result = COMM_SUCCESS
        while result in (COMM_SUCCESS, COMM_RX_CORRUPT):
            reply, result = self._call("rxPacket", False)
            if result == COMM_SUCCESS and len(reply) >= PING_REPLY_SIZE:
                found[reply[4]] = reply[9] | reply[10] << 8
        return found

    def _call(self, method: str, *arguments: object) -> Any:
        if not self._port.is_open:
            raise PortLostError(f"{self.path} is not open")
        try:
            return getattr(self._protocol, method)(self._port, *arguments)
        except PORT_ERRORS as error:
            raise self._lost(error) from error

    def _lost(self, error: Exception) -> PortLostError:
        self._port.closePort()
        return PortLostError(f"{self.path} is gone ({error}): is the adapter still plugged in?")

    def _whole(self, device_id: int, data: Sequence[int], size: int) -> bytes:
        if len(data) != size:  # a late reply to another request: it has another length
            raise BusError(f"motor {device_id} sent {len(data)} bytes where {size} were asked for")
        return bytes(data)

    def _note(self, error: int) -> None:
        self.alert = self.alert or bool(error & ALERT)

    def _check(self, device_id: int | None, result: int, error: int, what: str = "") -> None:
        who = self.path if device_id is None else f"motor {device_id} on {self.path}"
        if result == COMM_RX_TIMEOUT:
            raise BusError(f"no answer from {who}")
        if result == COMM_RX_CORRUPT:
            raise BusError(f"garbled answer from {who}")
        if result != COMM_SUCCESS:
            raise BusError(f"{who}: {self._protocol.getTxRxResult(result)}")
        self._note(error)
        if error & ~ALERT:
            text = self._protocol.getRxPacketError(error & ~ALERT)
            raise RefusedError(f"{who} refuses {what or 'the request'}: {text}")


def port_remedy(path: str, error: Exception) -> str:
    """What to tell a person when a port does not open."""
    number = getattr(error, "errno", None)
    if number in (errno.ENOENT, errno.ENODEV, errno.ENXIO):
        return f"{path}: no such port. Plug in the U2D2 or OpenCR, or name its port in the configuration"
    if number in (errno.EACCES, errno.EPERM):
        return f"{path}: no permission. Join the group dialout (sudo adduser $USER dialout) and log in again"
    if number in (errno.EBUSY, errno.EAGAIN):
        return (
            f"{path}: the port is in use. Stop the other program "
            "(another hvcpd, or ModemManager: sudo systemctl disable --now ModemManager)"
        )
    return f"{path}: the port does not open ({error}). Check that it is the motors' serial port"
