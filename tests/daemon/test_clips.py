"""Clips of what was not understood: none unless asked for, the right stretch, and never too many."""

from __future__ import annotations

import asyncio
from datetime import datetime, timedelta
from pathlib import Path

import numpy as np
import pytest
from structlog.testing import capture_logs

from hvcpd.config.settings import ClipSettings
from hvcpd.daemon.clips import KEPT_S, Clips
from hvcpd.hardware.soundfile import read_wav
from hvcpd.ports import SAMPLE_RATE_HZ
from hvcpd.robot.records import GarbledRecord

BLOCK = 400
BLOCK_S = BLOCK / SAMPLE_RATE_HZ


class Recorder:
    """Clips fed with sound whose level tells its second: 0.01 in the first, 0.02 in the next."""

    def __init__(self, settings: ClipSettings) -> None:
        self.settings = settings
        self._wall = datetime(2026, 11, 21)
        self.clips = Clips(lambda: self.settings, "Rob", self._tick)
        self.blocks = 0

    def _tick(self) -> datetime:
        self._wall += timedelta(milliseconds=1)
        return self._wall

    def live(self, seconds: float, *records: GarbledRecord) -> None:
        """Sound for so long, with what is known at its end."""
        count = round(seconds / BLOCK_S)
        for number in range(count):
            level = 0.01 * (1 + int(self.blocks * BLOCK_S))
            self.blocks += 1
            last = records if number == count - 1 else ()
            self.clips.take(np.full(BLOCK, level, np.float32), self.blocks * BLOCK_S, last)


def names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir()) if folder.exists() else []


async def test_nothing_is_recorded_unless_asked_for() -> None:
    recorder = Recorder(ClipSettings())
    recorder.live(3.0, GarbledRecord(3.0, 1.0, 2.0))
    await recorder.clips.close()
    assert recorder.clips.kept_s == 0.0, "nor kept in memory"


async def test_a_clip_holds_the_speech_and_what_stands_around_it(tmp_path: Path) -> None:
    recorder = Recorder(ClipSettings(tmp_path / "clips"))
    recorder.live(6.0, GarbledRecord(6.0, 3.0, 4.0))
    await recorder.clips.close()
    (name,) = names(tmp_path / "clips")
    assert name.startswith("garbled-rob-2026")
    sound = read_wav(tmp_path / "clips" / name)
    assert len(sound) / SAMPLE_RATE_HZ == pytest.approx(1.7, abs=2 * BLOCK_S)
    assert sound[0] == pytest.approx(0.03, abs=1e-3)
    assert sound[-1] == pytest.approx(0.05, abs=1e-3)
    assert (tmp_path / "clips" / name).stat().st_mode & 0o777 == 0o640


def test_memory_is_bounded() -> None:
    recorder = Recorder(ClipSettings(Path("nowhere")))
    recorder.live(3 * KEPT_S)
    assert recorder.clips.kept_s <= KEPT_S + BLOCK_S


def test_nothing_is_kept_of_the_time_without_a_card() -> None:
    """Each block without sound stayed, ten a second, beside the last sound: a gigabyte in two weeks."""
    recorder = Recorder(ClipSettings(Path("nowhere")))
    recorder.live(3.0)
    recorder.clips.take(np.zeros(0, np.float32), 3.0 + 2.0 * KEPT_S, ())
    assert recorder.clips.kept_s == 0.0


@pytest.mark.parametrize("settings", [ClipSettings(keep=3), ClipSettings(keep_mb=0.17)])
async def test_the_oldest_go_and_other_files_stay(settings: ClipSettings, tmp_path: Path) -> None:
    folder = tmp_path / "clips"
    folder.mkdir()
    (folder / "aaa.wav").write_text("mine")
    recorder = Recorder(ClipSettings(folder, settings.keep, settings.keep_mb))
    made = []
    for number in range(6):
        recorder.live(3.0, GarbledRecord(0.0, 3.0 * number + 1.0, 3.0 * number + 2.0))
        await recorder.clips.close()
        made.append(max(name for name in names(folder) if name != "aaa.wav"))
    assert names(folder) == ["aaa.wav", *made[-3:]]


async def test_a_new_clip_stays_though_the_clock_was_ahead_when_the_others_were_made(tmp_path: Path) -> None:
    ahead = [f"garbled-rob-20270101T00000{number}.000000.wav" for number in range(3)]
    for name in ahead:
        (tmp_path / name).write_bytes(b"x")
    recorder = Recorder(ClipSettings(folder=tmp_path, keep=3))
    recorder.live(3.0, GarbledRecord(3.0, 1.0, 2.0), GarbledRecord(3.0, 1.5, 2.5))
    await recorder.clips.close()
    kept = names(tmp_path)
    assert [name[:16] for name in kept[:2]] == ["garbled-rob-2026"] * 2
    assert kept[2:] == ahead[2:]


async def test_a_reload_begins_and_ends_it(tmp_path: Path) -> None:
    recorder = Recorder(ClipSettings())
    recorder.live(2.0)
    recorder.settings = ClipSettings(tmp_path)
    recorder.live(2.0, GarbledRecord(4.0, 3.0, 3.5))
    await recorder.clips.close()
    recorder.settings = ClipSettings()
    recorder.live(2.0, GarbledRecord(6.0, 5.0, 5.5))
    await recorder.clips.close()
    assert len(names(tmp_path)) == 1


async def test_a_clip_that_somebody_else_deletes_meanwhile_costs_no_other(tmp_path: Path) -> None:
    (tmp_path / "garbled-rob-20260101T000000.000000.wav").symlink_to("gone")  # listed, but not there
    recorder = Recorder(ClipSettings(tmp_path))
    with capture_logs() as logs:
        recorder.live(2.0, GarbledRecord(2.0, 1.0, 1.5))
        await recorder.clips.close()
    assert [line["event"] for line in logs] == ["clip kept"]
    assert len(names(tmp_path)) == 2


async def test_a_folder_that_cannot_be_made_is_told(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    recorder = Recorder(ClipSettings(tmp_path / "file" / "clips"))
    with capture_logs() as logs:
        recorder.live(2.0, GarbledRecord(2.0, 1.0, 1.5))
        await recorder.clips.close()
    assert [line["event"] for line in logs] == ["clip not kept"]
    for _ in range(20):
        recorder.live(0.1, GarbledRecord(2.0, 1.0, 1.5))
    assert len(asyncio.all_tasks()) < 10, "a slow disk makes no queue"
    await recorder.clips.close()
