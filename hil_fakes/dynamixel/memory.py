"""A motor's control table in memory: which reads and writes it accepts, and with which error it refuses others."""

from __future__ import annotations

from dataclasses import dataclass

from hil_fakes.dynamixel import control_table as ct
from hil_fakes.dynamixel.protocol import StatusError


@dataclass(frozen=True)
class Change:
    """One cell that an accepted write sets."""

    cell: ct.Cell
    value: int


class ControlMemory:
    """The bytes behind the table. Checks a write as a whole before any of it takes effect."""

    def __init__(self) -> None:
        self._bytes = bytearray(ct.TABLE_END)
        for cell in ct.CELLS:
            self.set(cell.name, cell.initial)

    def get(self, name: str) -> int:
        """The value of a cell."""
        cell = ct.BY_NAME[name]
        return int.from_bytes(self._bytes[cell.address : cell.address + cell.size], "little", signed=cell.signed)

    def set(self, name: str, value: int) -> None:
        """Set a cell from inside the motor, whatever its access."""
        cell = ct.BY_NAME[name]
        size = cell.size
        wrapped = value & ((1 << (8 * size)) - 1)
        self._bytes[cell.address : cell.address + size] = wrapped.to_bytes(size, "little")

    def reset_ram(self) -> None:
        """Lose power: RAM cells take their initial values."""
        for cell in ct.CELLS:
            if not cell.in_eeprom:
                self.set(cell.name, cell.initial)

    def read(self, address: int, size: int) -> tuple[StatusError, bytes]:
        """The reply to a read instruction. Gaps between cells read 0, as on the real motor."""
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
            cell = ct.BY_ADDRESS.get(targets[at])
            if cell is None:
                return StatusError.ACCESS, []
            if targets[at : at + cell.size] != list(range(cell.address, cell.address + cell.size)):
                return StatusError.DATA_LENGTH, []
            value = int.from_bytes(data[at : at + cell.size], "little", signed=cell.signed)
            error = self._refusal(cell, value)
            if error is not StatusError.NONE:
                return error, []
            changes.append(Change(cell, value))
            at += cell.size
        return StatusError.NONE, changes

    def _resolve(self, address: int) -> int:
        """Where an address leads: an indirect data cell stands for the byte that its indirect address names."""
        n = address - ct.INDIRECT_DATA_START
        if not 0 <= n < ct.N_INDIRECT:
            return address
        target = self.get(f"indirect_address_{n + 1}")
        return target if target < ct.TABLE_END else address

    def _refusal(self, cell: ct.Cell, value: int) -> StatusError:
        if not cell.writable or (cell.in_eeprom and self.get("torque_enable")):
            return StatusError.ACCESS
        if cell.name in ct.GOALS and self.get("bus_watchdog") == -1:
            return StatusError.DATA_RANGE
        if (cell.low is not None and value < cell.low) or (cell.high is not None and value > cell.high):
            return StatusError.DATA_RANGE
        if cell.name == "operating_mode" and value not in ct.OPERATING_MODES:
            return StatusError.DATA_RANGE
        if cell.name == "goal_velocity" and abs(value) > self.get("velocity_limit"):
            return StatusError.DATA_LIMIT
        if cell.name == "goal_pwm" and abs(value) > self.get("pwm_limit"):
            return StatusError.DATA_LIMIT
        return StatusError.NONE
