"""Writes of a robot's memory to its SD card in an hour of talk, counted at the block device of a separate ext4.

    sudo .venv/bin/python -m benchmarks.daemon.writes [--minutes 20] [--sentence-every 5] [--task-every 60]

The daemon's journal (hvcpd/daemon/journal_service.py) gets a sentence and its speaker every few seconds and the change
of a task every minute, in real time, in an image that is mounted for it: the file system's own pages count too, and
what the kernel puts together before it writes. The log is not in it: that is the system's journal. Nor is a team's key,
whose counters are kept at once.
"""

from __future__ import annotations

import argparse
import asyncio
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from time import monotonic

from hvcpd.config.settings import ControlSettings, Settings
from hvcpd.coordination.actions import SavePeer, SaveTask
from hvcpd.daemon.journal_service import LATER_S, JournalService
from hvcpd.daemon.wiring import wire_up
from hvcpd.language.messages import Claim, TaskByNumber, ToAll, Utterance
from hvcpd.robot.records import HeardRecord, Record

IMAGE_BYTES = 256 << 20
LIKE_A_CARD = ("-b", "4096", "-I", "256", "-E", "lazy_itable_init=0,lazy_journal_init=0")
"""mkfs gives so small a file system pages of 1,024 bytes, a card's 4,096; what it would do later is done at once."""
SECTOR_BYTES = 512
"""Of /sys/block/*/stat, whatever the device's own (Linux, Documentation/block/stat.rst)."""
WRITTEN_BACK_S = 35.0
"""The kernel writes pages back when they are 30 s old (vm.dirty_expire_centisecs)."""
STEP_S = 0.5
TASKS = 5
TEAM = ("Rob", "Bot", "Mia")
"""Who claims and does them in turn; the first is this robot."""
CLAIM = Utterance("Bot", ToAll(), statement=Claim(TaskByNumber(4)))
TEXT = "Hi all, I am Bot, I will complete task four"


@contextmanager
def card() -> Iterator[tuple[Path, Path]]:
    """A mounted file system of its own: its folder, and the file that counts what is written to it."""
    with tempfile.TemporaryDirectory(prefix="hvcpd-writes-") as folder:
        image, mounted = Path(folder) / "card", Path(folder) / "mounted"
        mounted.mkdir()
        image.touch()
        os.truncate(image, IMAGE_BYTES)
        subprocess.run(["mkfs.ext4", "-q", "-F", *LIKE_A_CARD, image], check=True)
        told = subprocess.run(["losetup", "--find", "--show", image], check=True, capture_output=True, text=True)
        device = Path(told.stdout.strip())
        try:
            subprocess.run(["mount", device, mounted], check=True)
            try:
                yield mounted, Path("/sys/block") / device.name / "stat"
            finally:
                subprocess.run(["umount", mounted], check=True)
        finally:
            subprocess.run(["losetup", "--detach", device], check=True)


def written_bytes(stat: Path) -> int:
    """Since the device is there."""
    return int(stat.read_text().split()[6]) * SECTOR_BYTES


def records_at(number: int, now: float, options: argparse.Namespace) -> list[Record]:
    """Of the sentence of that number."""
    records: list[Record] = [
        HeardRecord(now, CLAIM, TEXT, now - 3.0, now, 0.9, 20.0, "rose"),
        SavePeer("Bot", "plant", now),
    ]
    changes, before = (int(n * options.sentence_every / options.task_every) for n in (number, number - 1))
    if changes > before:
        task, done = divmod(changes, 2)
        records.append(SaveTask(1 + task % TASKS, "done" if done else "claimed", TEAM[task % len(TEAM)]))
    return records


async def live(folder: Path, stat: Path, options: argparse.Namespace) -> float:
    """Bytes an hour that reach the device, once the memory is there."""
    runtime = ControlSettings(socket=folder.parent / "rob.sock")  # systemd's folder for it is not on the card
    journal = JournalService(wire_up(Settings(TEAM[0], state_dir=folder / "state", control=runtime)))
    await journal.open()
    await journal.settled()
    os.sync()
    before, began_s, said = written_bytes(stat), monotonic(), 0
    while (now := monotonic() - began_s) < 60.0 * options.minutes:
        due = now >= said * options.sentence_every
        said += due
        journal.write(records_at(said, now, options) if due else (), now)
        await asyncio.sleep(STEP_S)
    await asyncio.sleep(WRITTEN_BACK_S)
    written = written_bytes(stat) - before
    await journal.close()
    return float(written * 60.0 / options.minutes)


def main() -> int:
    """Print the figure."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--minutes", type=float, default=20.0, help=f"several times {LATER_S / 60:g}")
    parser.add_argument("--sentence-every", type=float, default=5.0, metavar="S")
    parser.add_argument("--task-every", type=float, default=60.0, metavar="S")
    options = parser.parse_args()
    if os.geteuid() != 0:
        print("only root can mount a card of its own for it", file=sys.stderr)
        return 1
    with card() as (folder, stat):
        an_hour = asyncio.run(live(folder, stat, options))
    print(f"{an_hour / 1e6:.2f} MB an hour reach the card")
    return 0


if __name__ == "__main__":
    sys.exit(main())
