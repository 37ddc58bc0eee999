"""Learning to read: alignment, the joint model, and the files, on an orthography whose rules are known."""

from __future__ import annotations

import random
from itertools import product
from pathlib import Path

import pytest

from benchmarks.pronunciation.__main__ import british_spellings, judge_rules, learn
from benchmarks.pronunciation.align import align
from benchmarks.pronunciation.source import read_cmudict
from hvcpd.synthesis.letter_to_sound import JointModel

ONSETS = {"p": "P", "t": "T", "sh": "SH", "x": "K S", "m": "M", "c": "K", "ph": "F", "l": "L"}
VOWELS = {"a": "AE", "ee": "IY", "o": "AA", "u": "UH"}


def spelled(syllables: tuple[tuple[str, str], ...]) -> tuple[str, tuple[str, ...]]:
    """A word of the made-up language, which stresses the last syllable but one."""
    letters, phones = "", []
    for left, (onset, vowel) in enumerate(reversed(syllables)):
        letters = onset + vowel + letters
        phones = [*ONSETS[onset].split(), VOWELS[vowel] + ("1" if left == 1 else "0"), *phones]
    return letters, tuple(phones)


@pytest.fixture(scope="module")
def words() -> dict[str, tuple[str, ...]]:
    syllables = list(product(ONSETS, VOWELS))
    chooser = random.Random(1)
    return dict(spelled(tuple(chooser.choices(syllables, k=chooser.choice((2, 3))))) for _ in range(1500))


def test_letters_are_aligned_with_their_phones(words: dict[str, tuple[str, ...]]) -> None:
    aligned = align(list(words.items()))
    assert len(aligned) == len(words)
    for (word, said), letters in zip(words.items(), aligned, strict=True):
        assert "".join(letter for letter, _ in letters) == word
        assert tuple(phone for _, phones in letters for phone in phones) == said
    assert {phones for word in aligned for letter, phones in word if letter == "x"} == {("K", "S")}


def test_words_kept_back_are_read(words: dict[str, tuple[str, ...]], tmp_path: Path) -> None:
    kept = sorted(words)[::10]
    learn({word: (said,) for word, said in words.items() if word not in kept}, tmp_path / "model.npz")
    model = JointModel.load(tmp_path / "model.npz")
    assert len(kept) > 100
    assert sum(model.read(word) == words[word] for word in kept) / len(kept) > 0.97


def test_possessives_and_british_spellings_are_judged(capsys: pytest.CaptureFixture[str]) -> None:
    words = {word: (tuple(said.split()),) for word, said in {
        "organize": "AO1 R G AH0 N AY2 Z", "prize": "P R AY1 Z", "rob": "R AA1 B", "bot": "B AA1 T", "gus": "G AH1 S",
    }.items()}  # fmt: skip
    assert british_spellings(words) == {"organise": "organize"}
    read = {
        "rob": "R AA1 B",
        "robs": "R AA1 B S",
        "bot": "B OW1 T",
        "bots": "B AA1 T S",
        "organise": "AO1 R G IH0 N AY2 Z",
    }
    judge_rules(
        words, lambda word: tuple(read[word].split()), {"names": ["rob", "bot", "gus"]}, {"organise": "organize"}
    )
    lines = [line.split("[")[0].split() for line in capsys.readouterr().out.splitlines()]
    assert lines == [
        ["possessives,", "n", "=", "2:"],
        ["exact", "by", "the", "rule", "0.500"],
        ["exact,", "read", "whole", "0.500"],
        ["British", "spellings,", "n", "=", "1:"],
        ["exact,", "read", "whole", "1.000"],
        ["two", "phones", "or", "more", "wrong", "0.000"],
    ]


def test_cmudict_is_read_as_it_is_published(tmp_path: Path) -> None:
    path = tmp_path / "cmudict"
    path.write_bytes(
        b";;; comment\nTEAR  T EH1 R\nTEAR(1)  T IH1 R\nDON'T  D OW1 N T\nA.  EY1\n"
        b"# no word\nd\xe9j\xe0  D EY1\ntear(2) T IH1 R # twice\n"
    )
    assert read_cmudict(path) == {
        "tear": (("T", "EH1", "R"), ("T", "IH1", "R")),
        "don't": (("D", "OW1", "N", "T"),),
    }
