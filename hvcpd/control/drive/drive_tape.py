"""What `hvcpctl drive calibrate` asks of the person with the tape measure."""

from __future__ import annotations

import math
import sys
from typing import TextIO

from hvcpd.errors import ConfigError
from hvcpd.hardware.calibration import Measured

MAX_MEASURED_M = 3.0
"""Runs are 1 m long: beyond three times that it was centimetres or a slip."""


class TapeMeasure:
    """Questions on `out` (standard error by default), answers from `source` (standard input)."""

    def __init__(self, source: TextIO | None = None, out: TextIO | None = None) -> None:
        self._source = source or sys.stdin
        self._out = out or sys.stderr

    def ready(self, name: str) -> None:
        """Have the start marked, and wait until the person says that the robot may drive. Raises ConfigError."""
        self._question(
            f"next: {name}. Mark on the floor the middle between the wheels and the way it faces, step back, "
            "then press Enter: "
        )

    def ask(self, name: str) -> Measured:
        """Where the robot stands after a run; asks until two numbers come. Raises ConfigError when none can."""
        question = f"{name}: where does that middle stand now, from its last mark? metres ahead, metres to the left: "
        while True:
            answer = self._question(question)
            try:
                x_m, y_m = (float(part) for part in answer.replace(",", " ").split())
            except ValueError:
                self._out.write(f"{answer.strip()!r} is not two numbers such as 0.012 -0.034\n")
                continue
            if math.isfinite(x_m) and math.isfinite(y_m) and math.hypot(x_m, y_m) <= MAX_MEASURED_M:
                return Measured(x_m, y_m)
            self._out.write(f"{answer.strip()} is further than {MAX_MEASURED_M:g} m away; give metres\n")

    def _question(self, text: str) -> str:
        self._out.write(text)
        self._out.flush()
        answer = self._source.readline()
        if not answer:
            self._out.write("\n")
            raise ConfigError("drive calibrate: the input has ended; a person must answer, so run it on a terminal")
        return answer
