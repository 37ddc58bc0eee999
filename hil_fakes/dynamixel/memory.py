"""A motor's control table in memory: which reads and writes it accepts, and with which error it refuses others."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from hil_fakes.dynamixel import control_table as ct
from hil_fakes.dynamixel.protocol import StatusError


@dataclass(frozen=True)
class Change:
    """One item that an accepted write sets."""

    item: ct.Item
    value: int


class ItemTable:
    """The bytes of a device's control table, first all zero, and the values of its items in them."""

    def __init__(self, items: Mapping[str, ct.Item], size: int) -> None:
        self._items = items
        self._bytes = bytearray(size)

    def get(self, name: str) -> int:
        """The value of an item."""
        item = self._items[name]
        return int.from_bytes(self._bytes[item.address : item.address + item.size], "little", signed=item.signed)

    def set(self, name: str, value: int) -> None:
        """Set an item from inside the device, whatever its access."""
        item = self._items[name]
        wrapped = value & ((1 << (8 * item.size)) - 1)
        self._bytes[item.address : item.address + item.size] = wrapped.to_bytes(item.size, "little")


class ControlMemory(ItemTable):
    """A motor's table. Checks a write as a whole before any of it takes effect."""

    def __init__(self) -> None:
        super().__init__(ct.BY_NAME, ct.TABLE_END)
        for item in ct.ITEMS:
            self.set(item.name, item.initial)

    def reset_ram(self) -> None:
        """Lose power: RAM items take their initial values."""
        for item in ct.ITEMS:
            if not item.in_eeprom:
                self.set(item.name, item.initial)

    def read(self, address: int, size: int) -> tuple[StatusError, bytes]:
        """The reply to a read instruction. Gaps between items read 0, as on the real motor."""
        if size == 0 or address + size > ct.TABLE_END:
            return StatusError.ACCESS, b""
        if address + size <= ct.INDIRECT_DATA_START:
            return StatusError.NONE, bytes(self._bytes[address : address + size])
        return StatusError.NONE, bytes(self._bytes[self._resolve(a)] for a in range(address, address + size))

    def check(self, address: int, data: bytes) -> tuple[StatusError, list[Change]]:
        """The changes of a write instruction, or the error that refuses it."""
        if not data or address + len(data) > ct.TABLE_END:
            return StatusError.ACCESS, []
        changes: list[Change] = []
        targets = [self._resolve(a) for a in range(address, address + len(data))]
        at = 0
        while at < len(data):
            item = ct.BY_ADDRESS.get(targets[at])
            if item is None:
                return StatusError.ACCESS, []
            if targets[at : at + item.size] != list(range(item.address, item.address + item.size)):
                return StatusError.DATA_LENGTH, []
            value = int.from_bytes(data[at : at + item.size], "little", signed=item.signed)
            error = self._refusal(item, value)
            if error is not StatusError.NONE:
                return error, []
            changes.append(Change(item, value))
            at += item.size
        return StatusError.NONE, changes

    def _resolve(self, address: int) -> int:
        """Where an address leads: an indirect data item stands for the byte that its indirect address names."""
        n = address - ct.INDIRECT_DATA_START
        if not 0 <= n < ct.N_INDIRECT:
            return address
        target = self.get(f"indirect_address_{n + 1}")
        return target if target < ct.TABLE_END else address

    def _refusal(self, item: ct.Item, value: int) -> StatusError:
        if not item.writable or (item.in_eeprom and self.get("torque_enable")):
            return StatusError.ACCESS
        if item.name in ct.GOALS and self.get("bus_watchdog") == -1:
            return StatusError.DATA_RANGE
        if (item.low is not None and value < item.low) or (item.high is not None and value > item.high):
            return StatusError.DATA_RANGE
        if item.name == "operating_mode" and value not in ct.OPERATING_MODES:
            return StatusError.DATA_RANGE
        if item.name == "goal_velocity" and abs(value) > self.get("velocity_limit"):
            return StatusError.DATA_LIMIT
        if item.name == "goal_pwm" and abs(value) > self.get("pwm_limit"):
            return StatusError.DATA_LIMIT
        return StatusError.NONE
