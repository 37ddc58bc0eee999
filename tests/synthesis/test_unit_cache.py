"""Rendered units on disk: found again, never trusted blindly, never a reason to fall silent."""

from __future__ import annotations

import ast
import os
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from hvcpd.ports import Samples
from hvcpd.synthesis import unit_cache
from hvcpd.synthesis.lexicon import Lexicon
from hvcpd.synthesis.speaker import UNITS_KEPT, Speaker, UnitPosition
from hvcpd.synthesis.unit_cache import DAY_S, KEPT_S, SUFFIX, UnitCache, without_prose
from hvcpd.synthesis.voices import voice_named
from tests.full_disk import no_new_bytes

SOURCES = sorted(Path(unit_cache.__file__).parent.glob("*.py"))
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
    assert len(list(tmp_path.glob(f"*{SUFFIX}"))) == 3


def flipped(data: bytes) -> bytes:
    """One bit in the midst of it is another."""
    middle = len(data) // 2
    return data[:middle] + bytes([data[middle] ^ 1]) + data[middle + 1 :]


@pytest.mark.parametrize(
    "spoil",
    [
        lambda data: b"",
        lambda data: b"not a unit at all",
        lambda data: data[:-40],
        lambda data: data[:-1],
        flipped,
        lambda data: bytes(len(data)),
        lambda data: data[:4],
    ],
    ids=["empty", "garbage", "cut", "cut in a sample", "a bit", "zeros, as after a loss of power", "no samples"],
)
def test_a_spoilt_file_is_made_anew(tmp_path: Path, spoil: Callable[[bytes], bytes]) -> None:
    maker = Maker()
    cache = UnitCache(tmp_path)
    cache.get("rob", maker)
    (path,) = tmp_path.glob(f"*{SUFFIX}")
    good = path.read_bytes()
    path.write_bytes(spoil(good))
    assert np.array_equal(cache.get("rob", maker), UNIT)
    assert maker.made == 2
    assert path.read_bytes() == good


def test_a_folder_that_cannot_be_made_does_not_silence_the_robot(tmp_path: Path) -> None:
    """A file stands where the folder should be, which even root cannot write into."""
    blocked = tmp_path / "units"
    blocked.write_text("in the way")
    maker = Maker()
    cache = UnitCache(blocked)
    assert np.array_equal(cache.get("rob", maker), UNIT)
    assert np.array_equal(cache.get("rob", maker), UNIT)
    assert maker.made == 2


def test_a_full_disk_neither_silences_the_robot_nor_is_littered(tmp_path: Path) -> None:
    cache = UnitCache(tmp_path)
    with no_new_bytes():
        assert np.array_equal(cache.get("rob", Maker()), UNIT)
    assert list(tmp_path.iterdir()) == []
    assert isinstance(cache.fault, OSError)


def test_a_speaker_sounds_the_same_with_and_without_a_cache(tmp_path: Path) -> None:
    voice, lexicon = voice_named("lark"), Lexicon.load()
    sentence = [("hi", "rob"), ("stop",)]
    plain = Speaker(voice, lexicon).render(sentence)
    for _ in range(2):
        assert np.array_equal(Speaker(voice, lexicon, UnitCache(tmp_path)).render(sentence), plain)
    assert len(list(tmp_path.glob(f"*{SUFFIX}"))) == 3


class Reads(UnitCache):
    """Has every unit, and counts how often it is read."""

    def __init__(self, folder: Path) -> None:
        super().__init__(folder)
        self.read = 0

    def get(self, content: object, make: Callable[[], Samples]) -> Samples:
        self.read += 1
        return UNIT.copy()


def test_of_what_is_on_disk_only_the_last_is_kept_in_memory(tmp_path: Path) -> None:
    """Or a robot that talks all day keeps every unit that it can say."""
    cache = Reads(tmp_path)
    speaker = Speaker(voice_named("lark"), Lexicon.load(), cache)
    words = [*"abcdefghijklmnopqrstuvwxyz", *(first + second for first in "bdgk" for second in ("ay", "ee", "o", "ow"))]
    for _ in range(2):
        speaker.unit("rob", UnitPosition.FINAL)
    assert cache.read == 1
    for word in words:
        for position in UnitPosition:
            speaker.unit(word, position)
    assert cache.read > UNITS_KEPT + 1
    before = cache.read
    speaker.unit(words[-1], UnitPosition.FINAL)
    assert cache.read == before
    speaker.unit("rob", UnitPosition.FINAL)
    assert cache.read == before + 1


def test_what_nobody_needs_any_more_is_deleted_after_a_month(tmp_path: Path) -> None:
    maker = Maker()
    for content in ("old", "needed", "recent"):
        UnitCache(tmp_path).get(content, maker)
    (old, needed, recent) = sorted(tmp_path.glob(f"*{SUFFIX}"), key=lambda path: path.stat().st_mtime_ns)
    stranger = tmp_path / "notes.txt"
    left_over = [tmp_path / "broken.part", tmp_path / "of_an_older_version.npy"]
    for path in (stranger, *left_over):
        path.touch()
    now_s = recent.stat().st_mtime
    for path in (old, needed, stranger, *left_over):
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


def tree_of(source: str) -> str:
    """The syntax tree of a module without its docstrings and other lone constants."""
    tree = ast.parse(source)
    for node in ast.walk(tree):
        if isinstance(body := getattr(node, "body", None), list):
            body[:] = [
                each for each in body if not (isinstance(each, ast.Expr) and isinstance(each.value, ast.Constant))
            ]
    return ast.dump(tree)


@pytest.mark.parametrize("path", SOURCES, ids=lambda path: path.stem)
def test_a_program_without_prose_is_the_same_program(path: Path) -> None:
    """So that no change of the sound goes unnoticed, for each source as it stands."""
    source = path.read_text(encoding="utf-8")
    assert tree_of(without_prose(source)) == tree_of(source)
    assert len(without_prose(source)) < len(source)


def test_prose_does_not_count_and_all_else_does() -> None:
    source = '"""Words.\n\nMore: "quoted", # not a comment.\n"""\nA = 1  # why\n\n# of B\nB = "x # y"\n"""Of B."""\n'
    other = '"""Other words."""\nA = 1\nB = "x # y"\n\n"""Another."""\n'
    assert without_prose(source) == without_prose(other)
    for before, after in (("A = 1", "A = 2"), ("x # y", "x # z"), ("B =", "C =")):
        assert without_prose(source.replace(before, after)) != without_prose(source)
