"""Renews the examples and pictures of README.md and docs/commands.md: `python -m release.readme [--check]`.

A block that begins with "$ " is run as it stands there, in a folder of its own, and its output replaces what is shown.
A line " …" stands for what is left out; a measure of the clock on the wall is shown as "…". The animation and the
pictures of the report, the terminal, the card and the console come from the same mission.
"""

from __future__ import annotations

import argparse
import difflib
import os
import re
import subprocess
import sys
import tempfile
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from hvcpd.errors import EX_FAILURE, EX_OK
from release.animation import draw as draw_animation
from release.shown_mission import ShownMission, read_mission

ROOT = Path(__file__).parents[1]
PAGES = (ROOT / "README.md", ROOT / "docs" / "commands.md")
IMAGES = ROOT / "docs" / "images"
ANIMATION = IMAGES / "mission.svg"
LEFT_OUT = " …"
TIMEOUT_S = 120.0
"""For one command; a mission takes about 10 s."""

_BLOCK = re.compile(r"^```\n(\$ .*?)^```$", re.M | re.S)
_WALL_CLOCK = re.compile(r"of mission time in [\d.]+ s: .* \(seed")
MISSION, STATUS, CHECK = "hvcpctl simulate", "hvcpctl status", "hvcpd --name"


@dataclass(frozen=True)
class Command:
    """A command as it is typed, and the lines that are shown of what it prints."""

    typed: str
    shown: tuple[str, ...]


def blocks(readme: str) -> list[list[Command]]:
    """The blocks of commands in a text of Markdown."""
    return [_commands(found[1]) for found in _BLOCK.finditer(readme)]


def _commands(block: str) -> list[Command]:
    parts = re.split(r"^\$ ", block, flags=re.M)[1:]
    split = [part.rstrip("\n").split("\n") for part in parts]
    return [Command(typed, tuple(lines)) for typed, *lines in split]


def abridged(printed: str, shown: tuple[str, ...]) -> tuple[str, ...]:
    """What a command prints, cut as it was shown: as many lines before LEFT_OUT, and after it, as there were."""
    timeless = _WALL_CLOCK.sub("of mission time in … s: … times faster than real time (seed", printed)
    lines = tuple(timeless.rstrip("\n").split("\n"))
    if not printed:
        return ()
    if LEFT_OUT not in shown:
        return lines
    at = shown.index(LEFT_OUT)
    after = len(shown) - at - 1
    return (*lines[:at], LEFT_OUT, *lines[len(lines) - after :])


class Stage:
    """A folder in which the README's commands are run, as after `make demo`; their mission is kept for the pictures."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._status = 0
        self._mission: ShownMission | None = None
        if not (folder / "etc").exists():
            (folder / "etc").symlink_to(ROOT / "etc")

    @property
    def mission(self) -> ShownMission:
        """The mission that the README's command has run."""
        if self._mission is None:
            self._run(f"{MISSION} --seed 2")
        assert self._mission is not None
        return self._mission

    def shows(self, command: Command) -> tuple[str, ...]:
        """The lines that are to be shown of it now; those that are shown, where this computer cannot tell."""
        if command.typed.startswith(STATUS):
            return self.mission.status_lines()
        if command.typed.startswith("hvcpctl stop"):
            return self.mission.stop_lines()
        if command.typed.startswith(CHECK) and not _is_bare():
            self._status = 69
            return command.shown
        return abridged(self._run(command.typed), command.shown)

    def _run(self, typed: str) -> str:
        report = self.folder / "out" / "demo"
        more = f" --report {report}" if typed.startswith(MISSION) else ""  # for the pictures
        found = subprocess.run(
            ["bash", "-c", f"(exit {self._status}); {typed}{more}"],
            cwd=self.folder,
            env=_environment(),
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            timeout=TIMEOUT_S,
        )
        self._status = found.returncode
        if more:
            self._mission = read_mission(report)
            return found.stdout.partition("\nReport: ")[0]
        return found.stdout


def _environment() -> dict[str, str]:
    """As a newcomer's: the commands of this environment, and no settings of one's own."""
    kept = {name: value for name, value in os.environ.items() if not name.startswith(("HVCPD_", "PULSE_"))}
    path = os.pathsep.join([str(Path(sys.executable).parent), os.environ.get("PATH", os.defpath)])
    return kept | {"PATH": path, "LC_ALL": "C.UTF-8", "COLUMNS": "100", "NO_COLOR": "1"}


def _is_bare() -> bool:
    """Whether `hvcpd --check` says here what it says on a computer without a sound card, motors or robot."""
    ports = [port for kind in ("ttyUSB", "ttyACM", "ttyAMA") for port in Path("/dev").glob(f"{kind}*")]
    service = os.geteuid() == 0 and not Path("/var/lib/hvcpd").exists() and not Path("/etc/hvcpd").exists()
    return service and not ports and not list(Path("/dev/snd").glob("pcm*"))


def renewed(readme: str, stage: Stage) -> str:
    """The text of Markdown, with what its commands print now."""

    def again(found: re.Match[str]) -> str:
        lines = [line for c in _commands(found[1]) for line in (f"$ {c.typed}", *stage.shows(c))]
        return "\n".join(["```", *lines, "```"])

    return _BLOCK.sub(again, readme)


def differences(before: str, now: str, name: str = "before") -> list[str]:
    """What differs, as `diff -u` prints it."""
    lines: Iterable[str] = difflib.unified_diff(before.splitlines(), now.splitlines(), name, "now", lineterm="", n=1)
    return list(lines)


def main() -> int:
    """Renew the pages and the pictures; with --check print what differs, and change nothing."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--check", action="store_true", help="print what differs, and change nothing")
    parser.add_argument("--text", action="store_true", help="leave the pictures as they are")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        stage = Stage(Path(folder))
        before = {page: page.read_text(encoding="utf-8") for page in PAGES}
        now = {page: renewed(text, stage) for page, text in before.items()}
        changed = [line for page in PAGES for line in differences(before[page], now[page], page.name)]
        sys.stdout.writelines(f"{line}\n" for line in changed)
        if options.check:
            return 1 if changed else 0
        for page, text in now.items():
            page.write_text(text, encoding="utf-8")
        return EX_OK if options.text else _draw(stage.mission)


def _draw(mission: ShownMission) -> int:
    ANIMATION.write_text(draw_animation(mission) + "\n", encoding="utf-8")
    sys.stdout.write(f"drawn: {ANIMATION.relative_to(ROOT)}\n")
    from release.pictures import MISSING, draw

    if MISSING:
        sys.stderr.write("the pictures are as they were: apt install chromium chromium-driver to draw them\n")
        return EX_FAILURE
    for path in draw(mission, IMAGES):
        sys.stdout.write(f"drawn: {path.relative_to(ROOT)}\n")
    return EX_OK


if __name__ == "__main__":
    sys.exit(main())
