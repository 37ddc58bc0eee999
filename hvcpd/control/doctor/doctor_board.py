"""The doctor's checks of the board: power supply, 32 or 64 bits, and programs that have its sound cards open."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from hvcpd.control.doctor.diagnosis import Diagnosis, RunCommand, fine, note, run_command, wrong

UNDERVOLTAGE, CAPPED, THROTTLED, SOFT_LIMIT = (1 << bit for bit in range(4))
"""Bits of the firmware's word, which `vcgencmd get_throttled` prints; the same bits 16 places higher mean "since the
start". Raspberry Pi documentation, "vcgencmd", get_throttled."""
SINCE_START = 16
DESKTOP_SOUND = frozenset({"pipewire", "pipewire-pulse", "pulseaudio", "wireplumber"})
"""Sound servers of a desktop session, which keep a card for the user who is logged in."""
NARROW = {"armhf": "aarch64", "i386": "x86_64"}
"""Debian's 32-bit architectures, and the 64-bit kernel that they also run under."""


@dataclass(frozen=True)
class Board:
    """The folders and commands that the doctor reads; tests pass others."""

    throttled: Path = Path("/sys/devices/platform/soc/soc:firmware/get_throttled")
    boot: Path = Path("/boot/firmware/config.txt")
    proc: Path = Path("/proc")
    run: RunCommand = run_command


def look_at_board(board: Board) -> Iterator[Diagnosis]:
    """All checks of a Raspberry Pi; on other computers those that apply."""
    yield from _look_at_supply(board)
    yield from _look_at_width(board)
    yield from _look_at_overlays(board)
    yield from look_at_owners(board)


def _look_at_supply(board: Board) -> Iterator[Diagnosis]:
    try:
        word = int(board.throttled.read_text(encoding="ascii"), 16)
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
    else:
        yield fine("supply", "the voltage has not been too low since the start", word=word)


def _look_at_width(board: Board) -> Iterator[Diagnosis]:
    machine, system = (
        (board.run(command) or "").strip() for command in (("uname", "-m"), ("dpkg", "--print-architecture"))
    )
    if system in NARROW and machine == NARROW[system]:
        text = f"the kernel has 64 bits and the system 32 ({system}): libraries for 64 bits do not run in it"
        yield wrong("system", f"{text}; write Raspberry Pi OS (64-bit) to the card")


def _look_at_overlays(board: Board) -> Iterator[Diagnosis]:
    """Whether there is a card that can record and, on a Raspberry Pi without one, which overlays its start asks for."""
    if list(board.proc.glob("asound/card*/pcm*c")):
        return
    try:
        lines = board.boot.read_text(encoding="utf-8", errors="replace").splitlines()
    except OSError:
        return
    wanted = [line.strip() for line in lines if re.match(r"\s*dtoverlay=(?!vc4-|dwc|disable-|miniuart)", line)]
    if wanted:
        text = f"{board.boot} asks for {', '.join(wanted)}, and no card that can record came of it"
        yield wrong("overlay", f"{text}: look at `sudo dmesg`, reseat the board, reboot the Pi")
    else:
        text = f"no card can record, and {board.boot} has no dtoverlay= for one"
        yield wrong("overlay", f"{text}: plug in a USB microphone, or add the line that the sound board's maker names")


def look_at_owners(board: Board) -> Iterator[Diagnosis]:
    """The other programs that have sound cards open now."""
    for pid, cards in sorted(_owners(board.proc).items()):
        try:
            name = (board.proc / str(pid) / "comm").read_text(encoding="utf-8", errors="replace").strip()
        except OSError:
            continue  # it has ended meanwhile
        text = f"{name} (process {pid}) has {', '.join(sorted(cards))}"
        if name.startswith("hvcpd"):
            yield fine("cards", text)
        elif name in DESKTOP_SOUND:
            remedy = "log that user out, or run the robot there: `systemctl --user enable --now hvcpd`"
            yield note("cards", f"{text} for the user who is logged in: {remedy}")
        else:
            yield wrong("cards", f"{text}: end it, a card is one program's at a time")


def _owners(proc: Path) -> Mapping[int, set[str]]:
    """The cards that each process has open, by the kernel's name, which does not depend on the order in which they were
    found."""
    owners: dict[int, set[str]] = {}
    for path in sorted(proc.glob("asound/card*/pcm*/sub*/status")):
        try:
            found = re.search(r"owner_pid\s*:\s*(\d+)", path.read_text(encoding="ascii", errors="replace"))
            card = path.parents[2]
            name = (card / "id").read_text(encoding="utf-8", errors="replace").strip()
        except OSError:
            continue
        if found is not None:
            owners.setdefault(int(found[1]), set()).add(name)
    return owners
