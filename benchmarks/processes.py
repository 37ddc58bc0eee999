"""The cost of another process, read from /proc (proc(5))."""

from __future__ import annotations

import os
from pathlib import Path

TICKS_HZ = os.sysconf("SC_CLK_TCK")


class Cost:
    """Of the process `pid`, from now on; as text it is memory and load."""

    def __init__(self, pid: int) -> None:
        self._pid = pid
        self._begun = _uptime_s(), self._cpu_s()

    @property
    def passed_s(self) -> float:
        """Since the beginning."""
        return _uptime_s() - self._begun[0]

    def __str__(self) -> str:
        load = (self._cpu_s() - self._begun[1]) / self.passed_s
        return f"{self._rss_mb():.0f} MB RSS, {100.0 * load:.1f} % of one processor"

    def _cpu_s(self) -> float:
        fields = Path(f"/proc/{self._pid}/stat").read_text().rsplit(")", 1)[1].split()
        return (int(fields[11]) + int(fields[12])) / TICKS_HZ  # utime and stime

    def _rss_mb(self) -> float:
        lines = Path(f"/proc/{self._pid}/status").read_text().splitlines()
        return next(float(line.split()[1]) for line in lines if line.startswith("VmRSS")) / 1024.0


def _uptime_s() -> float:
    return float(Path("/proc/uptime").read_text().split()[0])
