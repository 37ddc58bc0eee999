"""A sound card's own gains, set through ALSA's `amixer`."""

from __future__ import annotations

import re
from dataclasses import dataclass

from hvcpd.control.doctor.diagnosis import RunCommand

CAPTURE = ("Mic", "Capture", "Input Gain", "ADC")
"""Names of the controls of common cards (USB audio class, bcm2835, HiFiBerry, HDA), the likeliest first."""


def card_of(device_name: str) -> str | None:
    """ALSA's name for the mixer of a PortAudio device, such as "hw:1" of "USB Audio: - (hw:1,0)"; asound.conf may name
    that of "default". None for a sound server's device."""
    found = re.search(r"\((hw:\d+),\d+\)", device_name)
    return found[1] if found else "default" if device_name == "default" else None


@dataclass(frozen=True)
class Control:
    """One simple control of a card; `run` starts a command, as `diagnosis.run_command`."""

    run: RunCommand
    card: str
    name: str

    def gain_db(self) -> float | None:
        """The setting in dB; None if it is not given in dB."""
        output = self.run(("amixer", "-D", self.card, "sget", self.name))
        found = re.search(r"\[(-?[\d.]+)dB\]", output or "")
        return float(found[1]) if found else None

    def set_gain_db(self, gain_db: float) -> float | None:
        """Set it as closely as the card can; returns the setting."""
        self.run(("amixer", "-q", "-D", self.card, "sset", self.name, "--", f"{gain_db:.1f}dB"))
        return self.gain_db()


def capture_control(run: RunCommand, device_name: str) -> Control | None:
    """The control of the microphone's gain on the card of a PortAudio device; None without `amixer` or such a
    control."""
    if (card := card_of(device_name)) is None:
        return None
    there = re.findall(r"Simple mixer control '([^']+)'", run(("amixer", "-D", card, "scontrols")) or "")
    return next((Control(run, card, name) for name in CAPTURE if name in there), None)
