"""Words that are written one way and said two: which is said where, and how that is explained and heard."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hvcpd.errors import ConfigError
from hvcpd.synthesis.explain import explain, respelled
from hvcpd.synthesis.homographs import Place, place_in
from hvcpd.synthesis.lexicon import Lexicon
from hvcpd.synthesis.phones import ARPABET, is_vowel
from hvcpd.synthesis.speaker import Speaker, UnitPosition
from hvcpd.synthesis.voices import VOICES

LEXICON = Lexicon.load()


@pytest.mark.parametrize(
    ("phrase", "word", "phones"),
    [
        ("wind the clock", "wind", "W AY1 N D"),
        ("i will wind the clock", "wind", "W AY1 N D"),
        ("i cannot wind the clock", "wind", "W AY1 N D"),
        ("measure the wind", "wind", "W IH1 N D"),
        ("wind", "wind", "W IH1 N D"),
        ("lead the robots", "lead", "L IY1 D"),
        ("carry the lead pipe", "lead", "L EH1 D"),
        ("carry the old lead", "lead", "L EH1 D"),
        ("close the door", "close", "K L OW1 Z"),
        ("i have read it", "read", "R EH1 D"),
        ("read the meter", "read", "R IY1 D"),
        ("i have wound it", "wound", "W AW1 N D"),
        ("clean the wound", "wound", "W UW1 N D"),
        ("tear the paper", "tear", "T EH1 R"),
        ("dry the tear", "tear", "T IH1 R"),
        ("graduate", "graduate", "G R AE1 JH AH0 W AH0 T"),
        ("record the wind", "record", "R IH0 K AO1 R D"),
        ("bring our records", "records", "R EH1 K ER0 D Z"),
        ("i read the meter", "read", "R IY1 D"),
        ("it was read twice", "read", "R EH1 D"),
        ("the power is live", "live", "L AY1 V"),
        ("i live in leeds", "live", "L IH1 V"),
        ("present my present", "present", "P R IY0 Z EH1 N T"),
        ("give them our present", "present", "P R EH1 Z AH0 N T"),
        ("separate the parts", "separate", "S EH1 P ER0 EY2 T"),
        ("use the separate tray", "separate", "S EH1 P ER0 IH0 T"),
        ("the sign of use", "use", "Y UW1 S"),
        ("can use it", "use", "Y UW1 Z"),
        ("i am close", "close", "K L OW1 S"),
        ("it's close", "close", "K L OW1 S"),
        ("it is not live", "live", "L AY1 V"),
        ("is it live", "live", "L AY1 V"),
        ("is rob close", "close", "K L OW1 S"),
        ("have you read it", "read", "R EH1 D"),
        ("have never read it", "read", "R EH1 D"),
        ("has rob read it", "read", "R EH1 D"),
        ("will you present it", "present", "P R IY0 Z EH1 N T"),
        ("now present it", "present", "P R IY0 Z EH1 N T"),
        ("it winds up", "winds", "W AY1 N D Z"),
        ("the robot records our wind", "records", "R IH0 K AO1 R D Z"),
        ("rob and bot present the rose", "present", "P R IY0 Z EH1 N T"),
        ("stay close to the wall", "close", "K L OW1 S"),
        ("come close", "close", "K L OW1 S"),
        ("come close the door", "close", "K L OW1 Z"),
        ("keep them separate", "separate", "S EH1 P ER0 IH0 T"),
        ("keep records", "records", "R EH1 K ER0 D Z"),
        ("make use of it", "use", "Y UW1 S"),
        ("it has many uses", "uses", "Y UW1 S IH0 Z"),
        ("not perfect", "perfect", "P ER1 F IH2 K T"),
        ("not read", "read", "R EH1 D"),
        ("lead is heavy", "lead", "L EH1 D"),
        ("i am content", "content", "K AH0 N T EH1 N T"),
        ("check the content", "content", "K AA1 N T EH0 N T"),
        ("the red led is on", "led", "EH2 L IY2 D IY1"),
        ("rob has led the team", "led", "L EH1 D"),
        ("check leds", "leds", "EH2 L IY2 D IY1 Z"),
        ("leds blink", "leds", "EH2 L IY2 D IY1 Z"),
        ("the robots use water", "use", "Y UW1 Z"),
        ("will the robots use water", "use", "Y UW1 Z"),
        ("these plants live in shade", "live", "L IH1 V"),
        ("two doors close at nine", "close", "K L OW1 Z"),
        ("keep the bins separate", "separate", "S EH1 P ER0 IH0 T"),
        ("are the doors close", "close", "K L OW1 S"),
        ("the robot moves close to it", "close", "K L OW1 S"),
        ("the shop closes", "closes", "K L OW1 Z IH0 Z"),
        ("check the battery leads", "leads", "L IY1 D Z"),
        ("the robot separates glass", "separates", "S EH1 P ER0 EY2 T S"),
        ("carry the glass lead", "lead", "L EH1 D"),
    ],
)
def test_the_place_in_the_phrase_picks_the_pronunciation(phrase: str, word: str, phones: str) -> None:
    words = phrase.split()
    number = words.index(word)
    assert " ".join(LEXICON.pronounce(word, place_in(words, number))) == phones
    (used,) = [known for known in explain(words, number, LEXICON, LEXICON) if known.used]
    assert " ".join(used.phones) == phones
    assert used.source in ("built-in lexicon", "a regular form of a listed word")


@given(
    st.lists(st.sampled_from("the a will have to wind lead rob task one not read it".split()), min_size=1, max_size=8)
)
def test_every_place_has_a_word_and_exactly_one_pronunciation_is_used(words: list[str]) -> None:
    for number in range(len(words)):
        assert place_in(words, number) in (None, *Place)
        assert sum(known.used for known in explain(words, number, LEXICON, LEXICON)) == 1


def test_both_pronunciations_sound_and_are_listened_for() -> None:
    speaker = Speaker(VOICES[0], LEXICON)
    verb = speaker.unit("wind", UnitPosition.FINAL, place=Place.VERB)
    noun = speaker.unit("wind", UnitPosition.FINAL, place=Place.NOUN)
    assert len(verb) != len(noun) or not np.array_equal(verb, noun)
    assert len(speaker.templates("wind")) == 2 * len(speaker.templates("water")) == 4
    (_, first), _, (_, last) = speaker.placed([("wind", "the", "wind")])
    assert len(first) != len(last)


def test_an_own_entry_stands_over_all_places_and_the_explanation_tells_what_it_replaces(tmp_path: Path) -> None:
    own = tmp_path / "own.txt"
    own.write_text("wind W AY1 N D\nlead(verb) L EH1 D\nlead(noun) L IY1 D\n")
    lexicon = Lexicon.load(own)
    for place in (None, *Place):
        assert lexicon.pronounce("wind", place) == ("W", "AY1", "N", "D")
    assert lexicon.pronounce("lead", Place.NOUN) == ("L", "IY1", "D")
    known = explain(["wind"], 0, lexicon, LEXICON)
    assert [(k.source, k.used) for k in known] == [("your lexicon", True), ("built-in lexicon", False)]
    assert lexicon.own == {"wind", "lead"}


def test_an_unknown_place_is_a_fault(tmp_path: Path) -> None:
    own = tmp_path / "own.txt"
    own.write_text("wind(2) W AY1 N D\nwind(adverb) W AY1 N D\nwind(verb W AY1 N D\n")
    with pytest.raises(ConfigError) as caught:
        Lexicon.load(own)
    assert f"{own}:1:" not in str(caught.value)
    assert f"{own}:2:" in str(caught.value)
    assert f"{own}:3:" in str(caught.value)


@pytest.mark.parametrize(
    ("word", "source"),
    [("zorg", "letter to sound"), ("42", "read as a number"), ("water", "built-in lexicon")],
)
def test_the_source_is_told(word: str, source: str) -> None:
    assert [known.source for known in explain([word], 0, LEXICON, LEXICON)] == [source]


def test_numbers_are_read_as_numbers_and_long_ones_digit_by_digit() -> None:
    assert LEXICON.pronounce("21") == LEXICON.pronounce("twenty") + LEXICON.pronounce("one")
    assert LEXICON.pronounce("0") == LEXICON.pronounce("zero")
    assert " ".join(LEXICON.pronounce("007")) == "Z IH1 R OW0 Z IH1 R OW0 S EH1 V AH0 N"
    assert len(LEXICON.pronounce("12345")) == sum(len(LEXICON.pronounce(d)) for d in "12345")


@pytest.mark.parametrize(
    ("phones", "text"),
    [
        ("R IY1 D", "reed"),
        ("P AA1 L IH0 SH", "PAH-lish"),
        ("IH0 K S K Y UW1 Z", "ik-SKYOOZ"),
        ("W AO1 T ER0", "WAW-ter"),
        ("G R AE1 JH AH0 W AH0 T", "GRA-juh-wuht"),
    ],
)
def test_respelling(phones: str, text: str) -> None:
    assert respelled(phones.split()) == text


VOWELS = st.sampled_from(sorted(f"{p}{d}" for p in ARPABET if is_vowel(p) for d in "012"))
CONSONANTS = st.sampled_from(sorted(p for p in ARPABET if not is_vowel(p)))


@given(st.lists(st.one_of(VOWELS, CONSONANTS), max_size=12))
def test_respelling_keeps_every_phone(phones: list[str]) -> None:
    parts = respelled(phones).split("-")
    assert len(parts) == max(1, sum(map(is_vowel, phones)))
    assert "".join(parts).lower() == "".join(respelled([p]) for p in phones).lower()
