"""Rendered units on disk: found again, never trusted blindly, never a reason to fall silent."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest

from hvcpd.ports import Samples
from hvcpd.synthesis.lexicon import Lexicon
from hvcpd.synthesis.speaker import Speaker
from hvcpd.synthesis.unit_cache import DAY_S, KEPT_S, UnitCache
from hvcpd.synthesis.voices import voice_named

UNIT = np.linspace(-0.5, 0.5, 100, dtype=np.float32)


class Maker:
    """Makes the unit and counts how often it was asked."""

    def __init__(self) -> None:
        self.made = 0

    def __call__(self) -> Samples:
        self.made += 1
        return UNIT.copy()


def test_a_unit_is_made_once(tmp_path: Path) -> None:
    maker = Maker()
    for _ in range(3):
        assert np.array_equal(UnitCache(tmp_path / "units").get(("rob", 1.0), maker), UNIT)
    assert maker.made == 1


def test_other_content_is_another_unit(tmp_path: Path) -> None:
    maker = Maker()
    cache = UnitCache(tmp_path)
    for content in (("rob", 1.0), ("rob", 1.06), ("bot", 1.0)):
        cache.get(content, maker)
    assert maker.made == 3
    assert len(list(tmp_path.glob("*.npy"))) == 3


@pytest.mark.parametrize(
    "spoil",
    [
        lambda path: path.write_bytes(b""),
        lambda path: path.write_bytes(b"not a unit at all"),
        lambda path: path.write_bytes(path.read_bytes()[:-40]),
        lambda path: np.save(path, UNIT.astype(np.float64)),
        lambda path: np.save(path, UNIT.reshape(10, 10)),
        lambda path: np.save(path, np.full(100, np.nan, np.float32)),
        lambda path: np.save(path, np.array([{"a": 1}], dtype=object), allow_pickle=True),
    ],
    ids=["empty", "garbage", "cut", "float64", "two axes", "nan", "pickle"],
)
def test_a_spoilt_file_is_made_anew(tmp_path: Path, spoil: object) -> None:
    maker = Maker()
    cache = UnitCache(tmp_path)
    cache.get("rob", maker)
    (path,) = tmp_path.glob("*.npy")
    spoil(path)  # type: ignore[operator]
    assert np.array_equal(cache.get("rob", maker), UNIT)
    assert maker.made == 2
    assert np.array_equal(np.load(path), UNIT)


def test_a_folder_that_cannot_be_made_does_not_silence_the_robot(tmp_path: Path) -> None:
    """A file stands where the folder should be, which even root cannot write into."""
    blocked = tmp_path / "units"
    blocked.write_text("in the way")
    maker = Maker()
    cache = UnitCache(blocked)
    assert np.array_equal(cache.get("rob", maker), UNIT)
    assert np.array_equal(cache.get("rob", maker), UNIT)
    assert maker.made == 2


def test_a_speaker_sounds_the_same_with_and_without_a_cache(tmp_path: Path) -> None:
    voice, lexicon = voice_named("lark"), Lexicon.load()
    sentence = [("hi", "rob"), ("stop",)]
    plain = Speaker(voice, lexicon).render(sentence)
    for _ in range(2):
        assert np.array_equal(Speaker(voice, lexicon, UnitCache(tmp_path)).render(sentence), plain)
    assert len(list(tmp_path.glob("*.npy"))) == 3


def test_what_nobody_needs_any_more_is_deleted_after_a_month(tmp_path: Path) -> None:
    maker = Maker()
    for content in ("old", "needed", "recent"):
        UnitCache(tmp_path).get(content, maker)
    (old, needed, recent) = sorted(tmp_path.glob("*.npy"), key=lambda path: path.stat().st_mtime_ns)
    stranger, partial = tmp_path / "notes.txt", tmp_path / "broken.part"
    for path in (stranger, partial):
        path.touch()
    now_s = recent.stat().st_mtime
    for path in (old, needed, stranger, partial):
        os.utime(path, (now_s - KEPT_S - 1.0,) * 2)
    cache = UnitCache(tmp_path)
    cache.get("needed", maker)
    cache.tidy(now_s)
    assert sorted(tmp_path.iterdir()) == sorted([needed, recent, stranger])
    assert needed.stat().st_mtime > now_s - DAY_S
    assert np.array_equal(cache.get("old", maker), UNIT)


def test_a_folder_that_is_not_there_needs_no_tidying(tmp_path: Path) -> None:
    UnitCache(tmp_path / "units").tidy(0.0)
    assert not (tmp_path / "units").exists()
