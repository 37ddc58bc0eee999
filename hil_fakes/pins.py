"""Fake pins of a Raspberry Pi, shared by processes: a folder with a file for each, as the kernel keeps a line's level.

    GPIOZERO_PIN_FACTORY=files FAKE_PINS=/tmp/pins hvcpctl skills …

has gpiozero use them, in that process and in those that it starts. A pin that a process holds is busy for all others;
one whose holder is killed keeps its level, as a Pi's lines do, and is free.
"""

from __future__ import annotations

import fcntl
import os
import time
from pathlib import Path
from typing import Any

from gpiozero.exc import BadPinFactory, PinInvalidPin
from gpiozero.pins.mock import MockFactory, MockPin

FOLDER_VARIABLE = "FAKE_PINS"


class FilePin(MockPin):  # type: ignore[misc]
    """One line; one file holds its level, and another every change of it."""

    def __init__(self, factory: Any, info: Any) -> None:
        self._folder = folder = factory.folder
        folder.mkdir(parents=True, exist_ok=True)
        self._number = number = str(info.name).removeprefix("GPIO")
        self._log = (folder / f"{number}.log").open("a")
        try:
            fcntl.flock(self._log, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            self._log.close()
            raise PinInvalidPin(f"GPIO{number} busy") from None
        super().__init__(factory, info)
        self._level: bool | None = None

    def close(self) -> None:
        """Let go of the line; its level stays."""
        self._log.close()

    def _get_state(self) -> Any:
        """An input is at the level that `drive` gave it, or else where its pull resistor has it."""
        told = self._folder / f"{self._number}.level"
        if self.function == "input" and told.exists():
            return told.read_text() == "1"
        return super()._get_state()

    def _change_state(self, value: bool) -> bool:
        changed = bool(super()._change_state(value))
        if self.function == "output" and value != self._level:
            self._level = value
            self._log.write(f"{time.monotonic():.6f} {int(value)}\n")
            self._log.flush()
        return changed

    def _set_state(self, value: float) -> None:
        super()._set_state(value)
        self._change_state(bool(value))


class FilePins(MockFactory):  # type: ignore[misc]
    """gpiozero's factory of the name "files". Raises BadPinFactory where nothing names their folder."""

    def __init__(self, folder: Path | None = None) -> None:
        super().__init__(pin_class=FilePin)
        named = folder or os.environ.get(FOLDER_VARIABLE)
        if not named:
            raise BadPinFactory(f"the fake pins have no folder; set {FOLDER_VARIABLE}=FOLDER")
        self.folder = Path(named)
