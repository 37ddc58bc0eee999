"""British pronunciations: by Wells's lexical sets, over the whole dictionary, and as they sound."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from hvcpd.synthesis.allophones import FLAP, allophone
from hvcpd.synthesis.homographs import Place
from hvcpd.synthesis.lexicon import Lexicon, Origin, common_words
from hvcpd.synthesis.phones import ARPABET, PHONES, is_vowel
from hvcpd.synthesis.speaker import Speaker, UnitPosition
from hvcpd.synthesis.unit_cache import UnitCache
from hvcpd.synthesis.voices import VOICES

US, GB = Lexicon.load(), Lexicon.load(accent="gb")


@pytest.mark.parametrize(
    ("words", "phones"),
    [
        ("bot", "B OH1 T"),  # LOT
        ("stop", "S T OH1 P"),
        ("watch", "W OH1 CH"),
        ("palm", "P AA1 M"),  # PALM
        ("father", "F AA1 DH AH0"),
        ("dog", "D OH1 G"),  # CLOTH
        ("office", "OH1 F IH0 S"),
        ("call", "K AO:1 L"),  # THOUGHT
        ("task", "T AA1 S K"),  # BATH
        ("half", "HH AA1 F"),
        ("can't", "K AA1 N T"),
        ("plant", "P L AA1 N T"),
        ("forecast", "F AO:1 K AA2 S T"),
        ("can", "K AE1 N"),  # TRAP
        ("classic", "K L AE1 S IH0 K"),
        ("passenger", "P AE1 S AH0 N JH AH0"),
        ("rose", "R AXW1 Z"),  # GOAT
        ("yellow", "Y EH1 L AXW0"),
        ("turn", "T AX:1 N"),  # NURSE
        ("nourish", "N AH1 R IH0 SH"),
        ("start", "S T AA1 T"),  # START
        ("four", "F AO:1"),  # NORTH and FORCE
        ("story", "S T AO:1 R IY0"),
        ("orange", "OH1 R AH0 N JH"),
        ("sorry", "S OH1 R IY0"),
        ("here", "HH IA1"),  # NEAR
        ("zero", "Z IA1 R AXW0"),
        ("mirror", "M IH1 R AH0"),
        ("there", "DH EH:1"),  # SQUARE
        ("sharing", "SH EH:1 R IH0 NG"),
        ("carry", "K AE1 R IY0"),
        ("caramel", "K AE1 R AH0 M AH0 L"),
        ("guarantee", "G AE2 R AH0 N T IY1"),
        ("quarry", "K W OH1 R IY0"),
        ("warranty", "W OH1 R AH0 N T IY0"),
        ("warring", "W AO:1 R IH0 NG"),
        ("buoys", "B OY1 Z"),
        ("squirrel", "S K W IH1 R AH0 L"),
        ("syrup", "S IH1 R AH0 P"),
        ("very", "V EH1 R IY0"),
        ("sure", "SH AO:1"),  # CURE
        ("metres", "M IY1 TT AH0 Z"),  # lettER, and no tap
        ("water", "W AO:1 TT AH0"),
        ("watering", "W AO:1 TT AH0 R IH0 NG"),
        ("fire", "F AY1 AH0"),
        ("new", "N Y UW1"),  # yod
        ("noon", "N UW1 N"),
        ("library", "L AY1 B R AH0 R IY0"),
        ("strawberries", "S T R AO:1 B AH0 R IY0 Z"),
        ("mobile", "M AXW1 B AY2 L"),
        ("basket", "B AA1 S K IH0 T"),
        ("tomatoes", "T AH0 M AA1 TT AXW0 Z"),  # single words
        ("z3", "Z IY1 TH R IY1"),
        ("r2d2", "AA1 T UW1 D IY1 T UW1"),  # digits are words
        ("luna2", "L UW1 N AH0 T UW1"),
        ("24", "T W EH1 N T IY0 F AO:1"),
        ("three", "TH R IY1"),  # no difference
    ],
)
def test_words_are_said_as_in_southern_england(words: str, phones: str) -> None:
    assert " ".join(GB.pronounce(words)) == phones


def test_the_place_in_the_phrase_tells_in_both_accents() -> None:
    assert GB.pronounce("record", Place.VERB) == ("R", "IH0", "K", "AO:1", "D")
    assert GB.pronounce("close", Place.NOUN) == ("K", "L", "AXW1", "S")


def test_a_users_own_word_goes_through_the_rules_too(tmp_path: Path) -> None:
    own = tmp_path / "own.txt"
    own.write_text("tomato T AH0 M EY1 T OW0\nzorg Z AO1 R G\n")
    lexicon = Lexicon.load(own, "gb")
    assert lexicon.pronounce("zorg") == ("Z", "AO:1", "G")
    assert lexicon.pronounce("tomato") == ("T", "AH0", "M", "EY1", "TT", "AXW0")
    assert lexicon.find("tomato").origin is Origin.OWN


def test_no_word_keeps_an_r_that_no_vowel_follows_nor_a_tap_nor_an_american_vowel() -> None:
    for word in (*common_words(), "arrr", "rrr", "zyx", "aeiou", "r2d2", "x"):
        phones = GB.pronounce(word)
        bases = [phone.rstrip("012") for phone in phones]
        assert set(bases) <= set(PHONES) - {"OW", "ER", "AO"}, word
        assert all(is_vowel(after) for phone, after in pairwise([*bases, "T"]) if phone == "R"), word
        assert all(allophone(phones, number) is not FLAP for number in range(len(phones))), word
        assert any(map(is_vowel, phones)), word


def test_people_are_heard_by_the_same_phones_in_both_accents() -> None:
    """The net that hears people knows these alone."""
    for word in ("water", "task", "four", "tomato"):
        assert GB.sounds(word) == US.sounds(word)
        assert {phone for said in GB.sounds(word) for phone in said} <= ARPABET


def test_both_accents_share_the_units_of_words_that_they_say_alike_and_no_others(tmp_path: Path) -> None:
    keys = [
        {key for word in ("three", "water") for key, _ in Speaker(VOICES[0], lexicon, UnitCache(tmp_path)).keyed(word)}
        for lexicon in (US, GB)
    ]
    assert len(keys[0]) == len(keys[1]) == 4
    assert len(keys[0] & keys[1]) == 2


@pytest.mark.parametrize("voice", [VOICES[0], VOICES[5]], ids=lambda voice: voice.name)
def test_british_words_sound_otherwise_and_are_fit_to_play(voice: object) -> None:
    american, british = (Speaker(voice, lexicon) for lexicon in (US, GB))  # type: ignore[arg-type]
    for word in ("bot", "task", "rose", "turn", "four", "here", "there", "water"):
        unit = british.unit(word, UnitPosition.FINAL)
        assert np.isfinite(unit).all()
        assert 0.1 < float(np.abs(unit).max()) < 1.0
        other = american.unit(word, UnitPosition.FINAL)
        assert unit.shape != other.shape or not np.allclose(unit, other, atol=0.01), word
