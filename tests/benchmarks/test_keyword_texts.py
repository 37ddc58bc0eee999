"""Made-up words teach which sounds make the keyword, and neither the keyword nor what the net is tested with."""

from __future__ import annotations

import random

from benchmarks.keyword.texts import between_robots, made_up, near_part_of, rosters
from hvcpd.language.spelling import CODE_WORDS
from hvcpd.synthesis.letter_to_sound import letter_to_sound

KNOWN = {"staff": ("S", "T", "AE", "F"), "stoop": ("S", "T", "UW", "P"), "shop": ("SH", "AA", "P")}


def test_made_up_words_hold_no_word_kept_for_tests_and_no_accents_keyword() -> None:
    assert [near_part_of(word) for word in KNOWN] == ["test", "test", "train"]
    chooser = random.Random(4)
    words = {made_up(chooser, KNOWN, [(word,) for word in KNOWN]) for _ in range(400)}
    sounds = [" ".join(phone.rstrip("012") for phone in letter_to_sound(word)) for word in words]
    assert len(words) > 200
    assert sum("S T" in sound for sound in sounds) > len(sounds) / 4
    for barred in ("S T AE F", "S T UW P", "S T AA P", "S T AE P", "S T AO R P"):
        assert not any(barred in sound for sound in sounds)


def test_robots_sentences_are_of_many_names_and_teams_and_some_have_seals() -> None:
    chooser = random.Random(5)
    books = rosters(chooser)
    sentences = [between_robots(chooser, books) for _ in range(600)]
    assert len({phrases[1][-1] for phrases in sentences if phrases[0][0] == "hi" and len(phrases) > 1}) > 80
    assert any("member" in phrase and "kitchen" in phrase for phrases in sentences for phrase in phrases)
    sealed = [phrases for phrases in sentences if len(phrases[-1]) == 4 and set(phrases[-1]) <= set(CODE_WORDS)]
    assert 150 < len(sealed) < 330
