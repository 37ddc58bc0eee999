"""The processor's temperature."""

from __future__ import annotations

from pathlib import Path

THERMAL = Path("/sys/class/thermal/thermal_zone0/temp")
"""In thousandths of a degree Celsius (kernel documentation, "Generic Thermal Sysfs driver")."""


def processor_temperature_c(path: Path = THERMAL) -> float | None:
    """The processor's temperature, degrees Celsius; None if the platform does not report it."""
    try:
        return int(path.read_text(encoding="ascii")) / 1000.0
    except (OSError, ValueError):
        return None
