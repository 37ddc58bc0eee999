"""Speech from games, to train phone nets on."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchmarks.phones.games import drascula, queen_files, steel_sky, written
from benchmarks.phones.recorded import game_part_of, lines_of_games
from benchmarks.phones.transcribed import lines_of, said_once, transcript, words_of
from benchmarks.phones.unpacked import SIGNATURE, unpacked
from hvcpd.hardware.soundfile import write_wav

Step = tuple[bytes, int, int]
"""Bytes as they are, then how many of the last ones are repeated, from how far back."""


class Packer:
    """Writes words of bits, and bytes between them; all three codes have four bits for each value."""

    def __init__(self) -> None:
        self._parts: list[bytearray] = []
        self._left = 0

    def bits(self, value: int, n: int) -> None:
        for k in range(n):
            if self._left == 0:
                self._word, self._left = bytearray(2), 16
                self._parts.append(self._word)
            at = 16 - self._left
            self._word[at // 8] |= (value >> k & 1) << at % 8
            self._left -= 1

    def number(self, value: int) -> None:
        size = value.bit_length()
        self.bits(int(f"{size:04b}"[::-1], 2), 4)
        if size > 1:
            self.bits(value & ~(1 << (size - 1)), size - 1)

    def packed(self, blocks: list[list[Step]], last: bytes) -> tuple[bytes, bytes]:
        """What is packed, and packed; the last block ends with bytes as they are."""
        whole = bytearray()
        self.bits(0, 2)
        for steps in blocks:
            for _ in range(3):
                self.bits(16, 5)
                for _ in range(16):
                    self.bits(4, 4)
            self.bits(len(steps) + 1, 16)
            for as_is, n, back in [*steps, (last, 0, 0)]:
                self.number(len(as_is))
                if as_is:
                    self._parts.append(bytearray(as_is))
                whole += as_is
                if n:
                    back = min(back, len(whole))
                    self.number(back - 1)
                    self.number(n - 2)
                    for _ in range(n):
                        whole.append(whole[-back])
        body = b"".join(self._parts)
        head = SIGNATURE + len(whole).to_bytes(4, "big") + len(body).to_bytes(4, "big") + bytes(5)
        return bytes(whole), head + bytes([len(blocks)]) + body


steps = st.tuples(st.binary(min_size=1, max_size=40), st.integers(2, 60), st.integers(1, 90))


@given(st.lists(st.lists(steps, max_size=5), min_size=1, max_size=3), st.binary(max_size=5))
def test_what_was_packed_is_unpacked(blocks: list[list[Step]], last: bytes) -> None:
    whole, packed = Packer().packed(blocks, last)
    assert unpacked(packed) == whole


def test_damaged_data_is_refused() -> None:
    whole, packed = Packer().packed([[(b"a line of speech", 5, 3)]], b"")
    assert len(whole) == 21
    for damaged in (b"RNC\x02" + packed[4:], packed[:-6], packed[:7] + b"\x16" + packed[8:], packed[:18] + bytes(60)):
        with pytest.raises(ValueError, match=r"damaged|method 1"):
            unpacked(damaged)


def queen_archive(files: dict[str, bytes]) -> bytes:
    table, data, begin = b"", b"", 15 + 21 * len(files)
    for name, content in files.items():
        place = (begin + len(data)).to_bytes(4, "big") + len(content).to_bytes(4, "big")
        table += name.encode().ljust(12, b"\0") + b"\1" + place
        data += content
    return b"QTBLCEM10\0\0\0\1" + len(files).to_bytes(2, "big") + table + data


def test_the_amazon_queens_lines_are_read_without_their_marks(tmp_path: Path) -> None:
    files = {"020001P2.SB": b"sound", "BOB.DOG": b"\0\x10Excuse me Bob.*03I think I'll browse.*14\0&Nice shop.*AB02"}
    (tmp_path / "queen.1c").write_bytes(queen_archive(files))
    assert dict(queen_files((tmp_path / "queen.1c").read_bytes())) == files
    lines = written(tmp_path)
    assert {"Excuse me Bob.", "I think I'll browse.", "Nice shop."} <= set(lines)
    with pytest.raises(ValueError, match="archive"):
        list(queen_files(b"something else"))


def test_speech_in_steel_sky_is_unpacked(tmp_path: Path) -> None:
    whole, packed = Packer().packed([[(bytes([128, 192, 0]), 4, 2)]], b"")
    speech = bytes(22) + packed
    (tmp_path / "sky.dsk").write_bytes(bytes(32) + speech)

    def entry(number: int, begin: int) -> bytes:
        return number.to_bytes(2, "little") + begin.to_bytes(3, "little") + len(speech).to_bytes(3, "little")

    # a place may be counted in bytes, or in stretches of 16
    entries = entry(52345, 32) + entry(52346, 1 << 23 | 2) + entry(60001, 32)
    (tmp_path / "sky.dnr").write_bytes((3).to_bytes(4, "little") + entries)
    found = list(steel_sky(tmp_path))
    assert [name for name, _ in found] == ["523_52345", "523_52346"]
    for _, sound in found:
        assert np.array_equal(sound, np.frombuffer(whole, np.uint8) / np.float32(128) - 1)
        assert sound[:3].tolist() == [0.0, 0.5, -1.0]


def test_drasculas_lines(tmp_path: Path) -> None:
    (tmp_path / "en").mkdir()
    (tmp_path / "en" / "I10.ALS").write_bytes(bytes([128, 255]))
    ((name, sound),) = drascula(tmp_path)
    assert name == "en_I10"
    assert sound.tolist() == [0.0, 127 / 128]


@pytest.mark.parametrize(
    ("heard", "said"),
    [
        ("i give up", "i give up"),
        ("i give up i give up i give", "i give up"),
        ("no no", "no no"),
        ("yes yes yes yes", "yes"),
        ("did you try to stop her did you try", "did you try to stop her"),
        ("are you sure you are", "are you sure you are"),
    ],
)
def test_what_whisper_repeats_is_said_once(heard: str, said: str) -> None:
    assert said_once(heard.split()) == said.split()


def test_words_are_written_as_a_dictionary_has_them() -> None:
    assert words_of("'I don’t CARE,' pre-marriage 'em", {"don't", "'em"}) == "i don't care pre marriage 'em".split()


@pytest.mark.parametrize(
    ("text", "score", "said"),
    [
        ("she went down to the river", -0.1, "she went down to the river"),
        ("she went down to the river", -0.3, ""),
        ("give me 5 of them", -0.1, ""),
        ("oh", -0.1, ""),
    ],
)
def test_what_is_not_sure_is_not_learned_from(text: str, score: float, said: str) -> None:
    assert transcript(text, score, 2.0, [], set()) == said.split()


def test_a_known_line_is_what_was_said() -> None:
    pytest.importorskip("rapidfuzz")
    line = "it might keep out crazies like frank"
    assert transcript("It might keep out crazys like Frank.", -0.5, 2.0, [line], set()) == line.split()


def test_groups_of_lines_are_for_training_or_calibration(tmp_path: Path) -> None:
    parts = [game_part_of(Path(f"queen/{n:02d}_{n:02d}0001P1.wav")) for n in range(100)]
    assert 4 <= parts.count("calibration") <= 20
    assert parts.count("train") == 100 - parts.count("calibration")
    assert game_part_of(Path("queen/joe_030001J1.wav")) == "train"
    assert game_part_of(Path("drascula/en_1.wav")) == "test"
    folder = tmp_path / "games" / "queen"
    folder.mkdir(parents=True)
    (folder / "lines.txt").write_text("Nice shop.\nHi!\n", encoding="utf-8")
    assert lines_of(folder, set()) == ["nice shop"]
    write_wav(folder / "joe_1J1.wav", np.sin(np.arange(16000, dtype=np.float32)))
    (folder / "said.tsv").write_text("joe_1J1\tnice shop\n", encoding="utf-8")
    (line,) = lines_of_games(tmp_path, "train")
    assert (line.words, line.speaker) == (("nice", "shop"), "joe")
    assert lines_of_games(tmp_path, "calibration") == []
