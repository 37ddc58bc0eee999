"""The packed dictionary: what is packed is found, nothing else is."""

from __future__ import annotations

import pickle
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hvcpd.errors import ConfigError
from hvcpd.synthesis.dictionary import BLOCK_WORDS, Dictionary, pack
from hvcpd.synthesis.lexicon import CMUDICT, DICTIONARY_PATH, Lexicon
from hvcpd.synthesis.phones import ARPABET, is_vowel

SYMBOLS = sorted(f"{p}{s}" for p in ARPABET for s in (("0", "1", "2") if is_vowel(p) else ("",)))
WORDS = st.text("abz'09", min_size=1, max_size=45)
SAID = st.lists(st.lists(st.sampled_from(SYMBOLS), min_size=1, max_size=6).map(tuple), min_size=1, max_size=3).map(
    tuple
)


@settings(max_examples=30)
@given(st.dictionaries(WORDS, SAID, max_size=40), st.lists(WORDS, max_size=20))
def test_every_packed_word_is_found_and_no_other(
    words: dict[str, tuple[tuple[str, ...], ...]], others: list[str]
) -> None:
    with TemporaryDirectory() as folder:
        path = Path(folder) / "words.bin"
        path.write_bytes(pack(words))
        dictionary = Dictionary(path)
        for word in (*words, *others):
            assert dictionary.look_up(word) == words.get(word, ())


def test_words_beyond_one_block_are_found(tmp_path: Path) -> None:
    words = {f"w{number}": ((SYMBOLS[number % len(SYMBOLS)],),) for number in range(3 * BLOCK_WORDS + 1)}
    (tmp_path / "words.bin").write_bytes(pack(words))
    dictionary = Dictionary(tmp_path / "words.bin")
    assert all(dictionary.look_up(word) == said for word, said in words.items())


def test_cmudict_is_small_and_whole() -> None:
    assert DICTIONARY_PATH.stat().st_size < 1_000_000
    assert CMUDICT.look_up("zurich") == (("Z", "UH1", "R", "IH0", "K"),)
    assert CMUDICT.look_up("tear") == (("T", "EH1", "R"), ("T", "IH1", "R"))
    assert CMUDICT.look_up("") == CMUDICT.look_up("~") == CMUDICT.look_up("zzzzz") == ()


def test_another_process_may_get_a_lexicon() -> None:
    """The evaluation hands its robots to workers."""
    lexicon = pickle.loads(pickle.dumps(Lexicon.load()))
    assert lexicon.pronounce("zurich") == ("Z", "UH1", "R", "IH0", "K")


def test_another_file_is_no_dictionary(tmp_path: Path) -> None:
    path = tmp_path / "words.bin"
    path.write_bytes(b"zurich Z UH1 R IH0 K")
    with pytest.raises(ConfigError, match="not a packed dictionary"):
        Dictionary(path).look_up("zurich")


@pytest.mark.parametrize("where", [0, 9, 20, -40, -1])
@pytest.mark.parametrize("cut", [True, False])
def test_a_damaged_dictionary_is_named_with_the_remedy(tmp_path: Path, where: int, cut: bool) -> None:
    path = tmp_path / "words.bin"
    data = bytearray(pack({f"w{number}": (("AA1", "B"),) for number in range(BLOCK_WORDS)}))
    data[where] ^= 0xFF
    path.write_bytes(data[:where] if cut else data)
    with pytest.raises(ConfigError, match=r"words\.bin: this file of hvcpd is missing or damaged .*install"):
        Dictionary(path).look_up("w7")


def test_a_missing_dictionary_is_named_with_the_remedy(tmp_path: Path) -> None:
    with pytest.raises(
        ConfigError, match=r"nothing\.bin: this file of hvcpd is missing or damaged \(No such file or directory\): "
    ):
        Dictionary(tmp_path / "nothing.bin").look_up("w7")
