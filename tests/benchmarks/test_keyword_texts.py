"""Made-up words teach which sounds make the keyword, and neither the keyword nor what the net is tested with."""

from __future__ import annotations

import random

from benchmarks.keyword.texts import made_up, near_part_of
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
