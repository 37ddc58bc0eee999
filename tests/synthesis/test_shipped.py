"""Units that come with the package: what was built is found, and what is stale or damaged is made anew."""

from __future__ import annotations

import json
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

from hvcpd.ports import Samples
from hvcpd.synthesis.lexicon import Lexicon
from hvcpd.synthesis.shipped import INDEX, STEPS, ShippedUnits, from_steps, in_steps
from hvcpd.synthesis.speaker import Speaker
from hvcpd.synthesis.unit_cache import UnitCache
from hvcpd.synthesis.voices import VOICES
from release.words import default_words, write_words

WORDS = ("rob", "read", "stop")
""" "Read" has two pronunciations."""


@pytest.fixture(scope="module")
def shipped(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("shipped")
    assert write_words(WORDS, folder) == sum(path.stat().st_size for path in folder.iterdir())
    return folder


def refuse() -> Samples:
    raise AssertionError("it was to be found")


def test_every_word_is_found_in_every_voice_to_the_bit(shipped: Path) -> None:
    found = ShippedUnits(shipped)
    lexicon = Lexicon.load()
    for voice in VOICES:
        units = [unit for word in WORDS for unit in Speaker(voice, lexicon).keyed(word)]
        assert len(units) == 8, "of one word two pronunciations, before another word and before a pause"
        for key, unit in units:
            there = found.get(key)
            assert there is not None
            assert np.array_equal(there, unit)


def test_a_cold_cache_is_filled_without_rendering(shipped: Path, tmp_path: Path) -> None:
    lexicon = Lexicon.load()
    warm = Speaker(VOICES[0], lexicon, UnitCache(tmp_path, ShippedUnits(shipped)))
    cold = Speaker(VOICES[0], lexicon)
    for template, rendered in zip(warm.templates("rob"), cold.templates("rob"), strict=True):
        assert np.array_equal(template, rendered)
    content = (lexicon.pronounce("rob"), VOICES[0], "medial", 1.0)
    UnitCache(tmp_path, ShippedUnits(tmp_path / "none")).get(content, refuse)  # it is kept, and read from there


def test_threads_that_read_at_once_find_each_its_own(shipped: Path) -> None:
    """On a disk that cannot be written nothing is kept, and the robot's threads read all words from the package."""
    found = ShippedUnits(shipped)
    units = dict(unit for word in WORDS for unit in Speaker(VOICES[0], Lexicon.load()).keyed(word))

    def wrong(key: str) -> int:
        again = [found.get(key) for _ in range(200)]
        return sum(each is None or not np.array_equal(each, units[key]) for each in again)

    with ThreadPoolExecutor(4) as threads:
        assert sum(threads.map(wrong, units)) == 0


def test_other_names_and_pitches_are_rendered(shipped: Path, tmp_path: Path) -> None:
    found = ShippedUnits(shipped)
    speaker = Speaker(VOICES[0], Lexicon.load())
    assert all(found.get(key) is None for key, _ in (*speaker.keyed("zelda"), *speaker.keyed("rob", 1.03)))


def test_another_synthesizer_finds_none_of_them(shipped: Path, tmp_path: Path) -> None:
    index = json.loads((shipped / INDEX).read_text())
    stale = {voice: [("0" * 32, length) for _, length in units] for voice, units in index.items()}
    (tmp_path / INDEX).write_text(json.dumps(stale))
    key, _ = next(Speaker(VOICES[0], Lexicon.load()).keyed("rob"))
    assert ShippedUnits(tmp_path).get(key) is None


@pytest.mark.parametrize("index", [None, "", "[]", "{", '{"oak": 3}', '{"oak": [["%s", 4000]]}'])
@pytest.mark.parametrize("sound", [None, b"", b"no FLAC at all"])
def test_damaged_files_are_none(index: str | None, sound: bytes | None, tmp_path: Path) -> None:
    key, _ = next(Speaker(VOICES[0], Lexicon.load()).keyed("rob"))
    if index is not None:
        (tmp_path / INDEX).write_text(index.replace("%s", key))
    if sound is not None:
        (tmp_path / "oak.flac").write_bytes(sound)
    assert ShippedUnits(tmp_path).get(key) is None


def test_a_file_that_is_too_short_is_none(shipped: Path, tmp_path: Path) -> None:
    index = json.loads((shipped / INDEX).read_text())
    (tmp_path / INDEX).write_text(json.dumps({"oak": [*index["oak"], ["f" * 32, 100]]}))
    (tmp_path / "oak.flac").write_bytes((shipped / "oak.flac").read_bytes())
    units = ShippedUnits(tmp_path)
    assert units.get("f" * 32) is None
    units.forget()
    assert units.get(index["oak"][0][0]) is not None, "what is asked for again is read again"


def test_steps_are_lossless_for_what_is_in_steps() -> None:
    sound = from_steps(in_steps(np.linspace(-1.5, 1.5, 999, dtype=np.float32)))
    assert np.array_equal(from_steps(in_steps(sound)), sound)
    assert in_steps(np.array([9.0, -9.0], np.float32)).tolist() == [32_767, -32_768]


def test_a_sound_in_steps_is_off_by_half_a_step_at_most() -> None:
    sound = np.asarray(np.random.default_rng(1).uniform(-1.9, 1.9, (3, 500)), np.float32)
    again = from_steps(in_steps(sound))
    assert (again.dtype, again.shape) == (np.float32, sound.shape)
    assert again == pytest.approx(sound, abs=0.5 / float(STEPS) + 1e-7)


def test_the_noise_of_steps_is_60_db_below_the_speech() -> None:
    lexicon = Lexicon.load()
    for voice in VOICES:
        for word in WORDS:
            for _, unit in Speaker(voice, lexicon).keyed(word):
                assert np.sqrt(12 * np.mean(unit.astype(np.float64) ** 2)) * STEPS >= 1_000


def test_the_default_words_are_what_two_robots_say() -> None:
    assert {"hi", "rob", "bot", "stop", "confirmed", "rose"} <= set(default_words())
