"""The doctor's checks of the board: power supply, 32 or 64 bits, and programs that have its sound cards open."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from pathlib import Path

from hvcpd.control.doctor.diagnosis import Machine, fine, note, wrong
from hvcpd.daemon.preflight import Finding

UNDERVOLTAGE, CAPPED, THROTTLED, SOFT_LIMIT = (1 << bit for bit in range(4))
"""Bits of the firmware's word, which `vcgencmd get_throttled` prints; the same bits 16 places higher mean "since the
start". Raspberry Pi documentation, "vcgencmd", get_throttled."""
SINCE_START = 16
DESKTOP_SOUND = frozenset({"pipewire", "pipewire-pulse", "pulseaudio", "wireplumber"})
"""Sound servers of a desktop session, which keep a card for the user who is logged in."""
NARROW = {"armhf": "aarch64", "i386": "x86_64"}
"""Debian's 32-bit architectures, and the 64-bit kernel that they also run under."""


def look_at_board(machine: Machine) -> Iterator[Finding]:
    """All checks of a Raspberry Pi; on other computers those that apply."""
    yield from _look_at_supply(machine)
    yield from _look_at_width(machine)
    yield from _look_at_overlays(machine)
    yield from look_at_owners(machine)


def _look_at_supply(machine: Machine) -> Iterator[Finding]:
    """By the firmware's word or, where this user may not ask it, by the kernel's file, which soon forgets."""
    found = re.search(r"throttled=0x([0-9a-f]+)", machine.run(("vcgencmd", "get_throttled")) or "")
    try:
        word = int(found[1] if found else machine.throttled.read_text(encoding="ascii"), 16)
    except (OSError, ValueError):
        return
    now, since = word, word >> SINCE_START
    if now & UNDERVOLTAGE:
        yield wrong("supply", "the voltage is too low now: a stronger supply, a thicker and shorter cable", word=word)
    elif since & UNDERVOLTAGE:
        text = "the voltage has been too low since the start: a stronger supply, a thicker cable"
        yield note("supply", text, word=word)
    elif now & (CAPPED | THROTTLED | SOFT_LIMIT):
        yield note("supply", "the processor is hot and slowed down; cool it", word=word)
    elif since & (CAPPED | THROTTLED | SOFT_LIMIT):
        yield note("supply", "the processor has been hot and was slowed down since the start; cool it", word=word)
    elif found:
        yield fine("supply", "the voltage has not been too low since the start", word=word)
    else:
        text = "the voltage is not too low now; `sudo vcgencmd get_throttled` prints 0x0 if it never was"
        yield fine("supply", text, word=word)


def _look_at_width(machine: Machine) -> Iterator[Finding]:
    kernel, system = (
        (machine.run(command) or "").strip() for command in (("uname", "-m"), ("dpkg", "--print-architecture"))
    )
    if system in NARROW and kernel == NARROW[system]:
        text = f"the kernel has 64 bits and the system 32 ({system}): libraries for 64 bits do not run in it"
        yield wrong("system", f"{text}; write Raspberry Pi OS (64-bit) to the card")


def _look_at_overlays(machine: Machine) -> Iterator[Finding]:
    """Whether there is a card that can record and, on a Raspberry Pi without one, which overlays its start asks for."""
    if list(machine.proc.glob("asound/card*/pcm*c")):
        return
    try:
        lines = machine.boot.read_text(encoding="utf-8", errors="replace").splitlines()
    except OSError:
        return
    asked = [line.strip() for line in lines if re.match(r"\s*dtoverlay=(?!vc4-|dwc|disable-|miniuart)", line)]
    there = f"has {', '.join(asked)}: look at `sudo dmesg`, reseat the board" if asked else "has none"
    text = "no card can record: plug in a USB microphone; for one on the header, its maker names the dtoverlay= line"
    yield wrong("overlay", f"{text} of {machine.boot}, which {there}; then reboot the Pi")


def look_at_owners(machine: Machine) -> Iterator[Finding]:
    """The other programs that have sound cards open now."""
    for (pid, name), cards in sorted(_owners(machine.proc).items()):
        text = f"{name} (process {pid}) has {', '.join(sorted(cards))}"
        if name.startswith("hvcpd"):
            yield fine("cards", text)
        elif name in DESKTOP_SOUND:
            remedy = "log that user out, or run the robot there: `systemctl --user enable --now hvcpd`"
            yield note("cards", f"{text} for the user who is logged in: {remedy}")
        else:
            yield wrong("cards", f"{text}: end it, a card is one program's at a time")


def _owners(proc: Path) -> Mapping[tuple[int, str], set[str]]:
    """The cards that each process, by number and name, has open, by the kernel's name, which does not depend on the
    order in which they were found. What has ended meanwhile is left out."""
    owners: dict[tuple[int, str], set[str]] = {}
    for path in sorted(proc.glob("asound/card*/pcm*/sub*/status")):
        try:
            thread = _field(path, r"owner_pid\s*:")
            pid = _field(proc / thread / "status", "Tgid:")
            owner = int(pid), _field(proc / pid / "status", "Name:")
            card = (path.parents[2] / "id").read_text(encoding="utf-8", errors="replace").strip()
        except OSError:
            continue
        owners.setdefault(owner, set()).add(card)
    return owners


def _field(path: Path, name: str) -> str:
    """The text after a name at the beginning of a line. Raises OSError, also without it."""
    found = re.search(rf"^{name}\s*(.+)", path.read_text(encoding="utf-8", errors="replace"), re.MULTILINE)
    if found is None:
        raise FileNotFoundError(path)
    return found[1]
