"""A sound card's own gains, set through ALSA's `amixer`."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

from hvcpd.control.doctor.diagnosis import RunCommand

CAPTURE = ("Mic", "Capture", "Input Gain", "ADC")
"""Names of the controls of common cards (USB audio class, bcm2835, HiFiBerry, HDA), the likeliest first."""


@dataclass(frozen=True)
class Control:
    """One simple control of a card."""

    card: str
    name: str


def card_of(device_name: str) -> str | None:
    """ALSA's name for the mixer of a PortAudio device, such as "hw:1" of "USB Audio: - (hw:1,0)"; asound.conf may name
    that of "default". None for a sound server's device."""
    found = re.search(r"\((hw:\d+),\d+\)", device_name)
    return found[1] if found else "default" if device_name == "default" else None


class Mixer:
    """`run` starts a command, as `diagnosis.run_command`."""

    def __init__(self, run: RunCommand) -> None:
        self._run = run

    def find(self, device_name: str, names: Sequence[str]) -> Control | None:
        """The card's control of the first of these names that it has; None without `amixer` or such a control."""
        card = card_of(device_name)
        listed = self._run(("amixer", "-D", card, "scontrols")) if card is not None else None
        there = re.findall(r"Simple mixer control '([^']+)'", listed or "")
        name = next((name for name in names if name in there), None)
        return Control(card, name) if card is not None and name is not None else None

    def gain_db(self, control: Control) -> float | None:
        """The setting in dB; None if it is not given in dB."""
        output = self._run(("amixer", "-D", control.card, "sget", control.name))
        found = re.search(r"\[(-?[\d.]+)dB\]", output or "")
        return float(found[1]) if found else None

    def set_gain_db(self, control: Control, gain_db: float) -> float | None:
        """Set it as closely as the card can; returns the setting."""
        self._run(("amixer", "-q", "-D", control.card, "sset", control.name, "--", f"{gain_db:.1f}dB"))
        return self.gain_db(control)
