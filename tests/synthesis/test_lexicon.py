"""Pronunciations: the lexicon, the user's own on top, the rules for all other words, and which words are alike."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hvcpd.config.task_file import load_tasks
from hvcpd.config.tasks import default_tasks_path
from hvcpd.errors import ConfigError
from hvcpd.language.forms import FORMS
from hvcpd.language.words import number_words, spoken_words
from hvcpd.synthesis.homographs import Place
from hvcpd.synthesis.inflection import derive, with_ending
from hvcpd.synthesis.letter_to_sound import MODEL_PATH, JointModel, letter_to_sound
from hvcpd.synthesis.lexicon import CMUDICT, Lexicon, Origin, common_words
from hvcpd.synthesis.likeness import name_fault, phone_distance, sounds_alike
from hvcpd.synthesis.phones import ARPABET, is_vowel

LEXICON = Lexicon.load()


def bare(phones: Iterable[str]) -> tuple[str, ...]:
    """Phones without stress."""
    return tuple(phone.rstrip("012") for phone in phones)


PAPER_TABLE = {
    "read": {"R IY1 D", "R EH1 D"},
    "bass": {"B EY1 S", "B AE1 S"},
    "row": {"R OW1", "R AW1"},
    "bow": {"B OW1", "B AW1"},
    "tear": {"T IH1 R", "T EH1 R"},
    "live": {"L IH1 V", "L AY1 V"},
    "wind": {"W IH1 N D", "W AY1 N D"},
    "wound": {"W UW1 N D", "W AW1 N D"},
    "close": {"K L OW1 Z", "K L OW1 S"},
    "excuse": {"IH0 K S K Y UW1 Z", "IH0 K S K Y UW1 S"},
    "polish": {"P AA1 L IH0 SH", "P OW1 L IH0 SH"},
    "lead": {"L IY1 D", "L EH1 D"},
    "dove": {"D AH1 V", "D OW1 V"},
    "graduate": {"G R AE1 JH AH0 W AH0 T", "G R AE1 JH AH0 W EY2 T"},
}


def test_every_word_of_the_phrasebook_and_of_the_default_tasks_is_in_the_lexicon() -> None:
    words = {w for form in FORMS for w in re.findall(r"[a-z]+", re.sub(r"<[^>]*>", " ", form.pattern))}
    words |= {word for number in range(100) for word in number_words(number)}
    repository = load_tasks(default_tasks_path())
    words |= {word for task in repository.tasks for word in task.name.split()}
    words |= {word for name in repository.other_tasks for word in name.split()}
    words |= {"rob", "bot", "plant"}
    assert len(words) > 60
    assert sorted(word for word in words if LEXICON.find(word).origin is not Origin.BUILTIN) == []


def test_our_lexicon_has_no_idle_line_and_every_common_word_is_listed() -> None:
    listed = [word for word, said in LEXICON.entries.items() if said == CMUDICT.look_up(word)]
    idle = [word for word in listed if _without(word).find(word).said == LEXICON.entries[word]]
    assert [word for word in idle if word not in LEXICON.places] == []
    assert len(common_words()) > 1500
    assert [word for word in common_words() if LEXICON.find(word).origin is Origin.LETTERS] == []


def _without(word: str) -> Lexicon:
    return replace(LEXICON, entries={each: said for each, said in LEXICON.entries.items() if each != word})


@pytest.mark.parametrize("number", [1, 5])
def test_units_are_said_from_the_lexicon(number: int) -> None:
    symbols = (
        "mm cm m km mg g kg ml l ms s min h mV V mA mAh Ah W kW Wh kWh dB kB MB GB lb oz ft Hz kHz MHz GHz % ° °C °F "
        "m/s km/h $ € £ cl dl hPa kPa lbs yd yds sec secs mins hr hrs tsp tbsp pcs mph psi TB"
    ).split()
    words = {word for symbol in symbols for word in spoken_words(f"{number} {symbol}")}
    assert len(words) > 35
    assert sorted(word for word in words if LEXICON.find(word).origin is Origin.LETTERS) == []


def test_every_entry_has_one_main_stress_unless_it_is_a_function_word() -> None:
    bad = [
        word
        for word, all_of in LEXICON.entries.items()
        for phones in all_of
        if word not in ("a", "of", "the") and sum(phone.endswith("1") for phone in phones) != 1
    ]
    assert bad == []


@pytest.mark.parametrize("word", PAPER_TABLE)
def test_words_with_two_readings_have_both(word: str) -> None:
    assert {" ".join(phones) for phones in LEXICON.pronunciations(word)} == PAPER_TABLE[word]


@pytest.mark.parametrize(
    ("word", "phones"),
    [
        ("zorg", "Z AO1 R G"),
        ("R2D2", "AA1 R T UW1 D IY1 T UW1"),
        ("C3PO", "S IY1 TH R IY1 P IY1 OW1"),
        ("xkcd", "EH1 K S K EY1 S IY1 D IY1"),
        ("nova7", "N OW1 V AH0 S EH1 V AH0 N"),
        ("gadget", "G AE1 JH AH0 T"),
        ("usb", "Y UW2 EH2 S B IY1"),
        ("dr", "D AA1 K T ER0"),
        ("gps", "JH IY2 P IY2 EH1 S"),
        ("id", "AY2 D IY1"),
        ("wlan", "D AH2 B AH0 L Y UW2 L AE1 N"),
        ("Łukasz", "L UW1 K AH0 SH"),
        ("hydrangea", "HH AY0 D R EY1 N JH AH0"),
        ("costmaps", "K AO1 S T M AE2 P S"),
        ("AI", "EY2 AY1"),
        ("EV", "IY2 V IY1"),
        ("EVs", "IY2 V IY1 Z"),
        ("AMR", "EY2 EH2 M AA1 R"),
        ("re", "R IY1"),
        ("red", "R EH1 D"),
        ("URDF", "Y UW2 AA2 R D IY2 EH1 F"),
        ("SPI", "EH2 S P IY2 AY1"),
        ("RViz", "AA1 R V IH2 Z"),
        ("kilohertz", "K IH1 L AH0 HH ER2 T S"),
        ("gpio", "JH IY2 P IY2 AY2 OW1"),
        ("simulate", "S IH1 M Y AH0 L EY2 T"),
        ("simulating", "S IH1 M Y AH0 L EY2 T IH0 NG"),
        ("manoeuvring", "M AH0 N UW1 V ER0 IH0 NG"),
        ("Maeve", "M EY1 V"),
        ("Aiden", "AY1 D AH0 N"),
        ("Mila", "M IY1 L AH0"),
        ("Isla", "AY1 L AH0"),
        ("Ngozi", "EH0 NG G OW1 Z IY0"),
        ("pdf's", "P IY1 D IY1 EH1 F S"),
        ("KPI", "K EY2 P IY2 AY1"),
        ("putting", "P UH1 T IH0 NG"),
        ("mows", "M OW1 Z"),
        ("sows", "S OW1 Z"),
        ("buffet", "B AH0 F EY1"),
        ("robolina", "R AH0 B AH0 L IY1 N AH0"),
        ("wobbletron", "W AA1 B AH0 L T R AO2 N"),
        ("?!", ""),
    ],
)
def test_names_and_words_are_said_whether_listed_or_not(word: str, phones: str) -> None:
    assert " ".join(LEXICON.pronounce(word)) == phones


@pytest.mark.parametrize(
    ("form", "said"),
    [
        ("rows", ["R OW1 Z", "R AW1 Z"]),
        ("polishes", ["P AA1 L IH0 SH IH0 Z", "P OW1 L IH0 SH IH0 Z"]),
        ("reads", ["R IY1 D Z"]),
        ("wounded", ["W UW1 N D IH0 D"]),
        ("winding", ["W AY1 N D IH0 NG"]),
        ("closed", ["K L OW1 Z D"]),
        ("planned", ["P L AE1 N D"]),
        ("sharing", ["SH EH1 R IH0 NG"]),
        ("Clocks", ["K L AA1 K S"]),
        ("spied", ["S P AY1 D"]),
        ("cpus", ["S IY2 P IY2 Y UW1 Z"]),
        ("apis", ["EY2 P IY2 AY1 Z"]),
        ("this", ["DH IH1 S"]),
        ("axis", ["AE1 K S AH0 S"]),
        ("boss", ["B AA1 S", "B AO1 S"]),
        ("decilitres", ["D EH1 S AH0 L IY2 T ER0 Z"]),
        ("bus", ["B AH1 S"]),
        ("bed", ["B EH1 D"]),
        ("thing", ["TH IH1 NG"]),
        ("hissing", ["HH IH1 S IH0 NG"]),
    ],
)
def test_a_regular_form_is_said_as_its_word(form: str, said: list[str]) -> None:
    assert [" ".join(phones) for phones in LEXICON.pronunciations(form)] == said


@pytest.mark.parametrize(
    ("british", "american"),
    [
        ("litres", "liters"),
        ("organise", "organize"),
        ("analysing", "analyzing"),
        ("modelling", "modeling"),
        ("levelled", "leveled"),
        ("enrol", "enroll"),
        ("fulfilment", "fulfillment"),
        ("skilful", "skillful"),
        ("flavours", "flavors"),
        ("offence", "offense"),
        ("smoulder", "smolder"),
        ("meagre", "meager"),
        ("paediatrics", "pediatrics"),
        ("anaemia", "anemia"),
        ("oestrogen", "estrogen"),
        ("foetus", "fetus"),
    ],
)
def test_a_british_spelling_is_said_as_its_american_one(british: str, american: str) -> None:
    found = LEXICON.find(british)
    assert found.said == LEXICON.pronunciations(american)
    assert found.origin in (Origin.SPELLING, Origin.BUILTIN)


def test_verbs_in_ise_are_said_as_those_in_ize() -> None:
    spelt = {
        word: f"{word[:-3]}ise" for word in ("utilize", "memorize", "optimize", "publicize", "penalize", "stabilize")
    }
    assert {word for word, british in spelt.items() if LEXICON.pronounce(british) != CMUDICT.look_up(word)[0]} == set()


@pytest.mark.parametrize(
    ("form", "stem", "ending"),
    [("publicises", "publicize", "s"), ("synthesises", "synthesize", "s"), ("energiser's", "energizer", "s")],
)
def test_so_are_their_forms(form: str, stem: str, ending: str) -> None:
    assert LEXICON.pronounce(form) == with_ending(LEXICON.pronounce(stem), ending)


@pytest.mark.parametrize("name", ["moana", "sipho", "tendai", "robolina", "gizmox", "aoife", "zorg"])
def test_an_owners_name_stays_as_it_is(name: str) -> None:
    assert LEXICON.pronounce(f"{name}'s") == with_ending(LEXICON.pronounce(name), "s")


def test_of_several_lines_for_one_place_the_first_is_preferred(tmp_path: Path) -> None:
    own = tmp_path / "own.txt"
    own.write_text("wind(verb) W AY1 N D\nwind(verb) W IH1 N D\n")
    assert Lexicon.load(own).pronounce("wind", Place.VERB) == ("W", "AY1", "N", "D")


def test_a_form_is_noun_or_verb_as_its_word_is() -> None:
    assert LEXICON.pronounce("lives", Place.VERB) == ("L", "IH1", "V", "Z")
    assert LEXICON.pronounce("lives", Place.NOUN) == ("L", "AY1", "V", "Z")
    assert LEXICON.pronounce("tears", Place.VERB) == ("T", "EH1", "R", "Z")
    assert set(LEXICON.spoken("winds")) == set(LEXICON.pronunciations("winds"))


def test_forms_of_listed_words_sound_as_the_dictionary_has_them() -> None:
    """Of a sample of common words' forms that it lists, nearly all are derived as they stand there."""
    listed = [
        form for word in common_words() for form in (f"{word}s", f"{word}ed", f"{word}ing") if CMUDICT.look_up(form)
    ]
    derived = {form: found.said[0] for form in listed if (found := derive(form, LEXICON.listed, LEXICON.places))}
    right = sum(bare(said) in {bare(other) for other in LEXICON.pronunciations(form)} for form, said in derived.items())
    assert len(derived) > 800
    assert right / len(derived) > 0.95


@given(st.text(max_size=40))
def test_any_text_has_a_pronunciation_of_known_phones(text: str) -> None:
    phones = LEXICON.pronounce(text)
    assert all(phone.rstrip("012") in ARPABET for phone in phones)
    assert all(phone[-1] in "012" for phone in phones if is_vowel(phone))
    if re.search("[a-z0-9]", text.lower()) and text.lower().isascii():
        assert phones


def test_a_word_of_ten_thousand_letters_is_read_in_proportion() -> None:
    once = letter_to_sound("banana" * 15)
    assert len(letter_to_sound("banana" * 15 * 20)) == 20 * len(once)


@pytest.mark.parametrize("damage", [lambda data: data[:-100], lambda data: data[:5000] + bytes(100) + data[5100:]])
def test_a_damaged_model_of_letters_is_named_with_the_remedy(tmp_path: Path, damage: Callable[[bytes], bytes]) -> None:
    path = tmp_path / "model.npz"
    path.write_bytes(damage(MODEL_PATH.read_bytes()))
    with pytest.raises(ConfigError, match=r"model\.npz: this file of hvcpd is missing or damaged .*install"):
        JointModel.load(path)


def test_an_own_lexicon_goes_first(tmp_path: Path) -> None:
    own = tmp_path / "own.txt"
    own.write_text("# ours\nSiobhan SH AH0 V AO1 N\nrob r ow1 b   # lower case\nrob R AA1 B\n")
    lexicon = Lexicon.load(own)
    assert lexicon.pronounce("siobhan") == ("SH", "AH0", "V", "AO1", "N")
    assert lexicon.pronunciations("Rob") == (("R", "OW1", "B"), ("R", "AA1", "B"))
    assert lexicon.pronounce("bot") == LEXICON.pronounce("bot")


def test_all_faults_of_an_own_lexicon_are_named_with_their_lines(tmp_path: Path) -> None:
    own = tmp_path / "own.txt"
    own.write_text("rob R AA1 B\nbot B QQ T\nmax\nzoe Z OW IY0\nz*e Z IY1\nted T1 EH1 D\n")
    with pytest.raises(ConfigError) as caught:
        Lexicon.load(own)
    text = str(caught.value)
    for line in (2, 3, 4, 5, 6):
        assert f"{own}:{line}: " in text
    assert f"{own}:1: " not in text
    assert "QQ" in text


def test_a_british_phone_of_an_own_lexicon_is_named_as_such(tmp_path: Path) -> None:
    """As `hvcpctl pronounce` shows it with `accent: gb`."""
    own = tmp_path / "own.txt"
    own.write_text("bot B OH1 T\n")
    with pytest.raises(ConfigError, match=r"own\.txt:1: phone 'OH1': write the American pronunciation"):
        Lexicon.load(own, "gb")


@pytest.mark.parametrize(
    ("line", "fault"),
    [
        ("rob R AA3 B", "phone 'AA3': a vowel takes a stress digit 0, 1 or 2"),
        ("rob R aa12 B", "phone 'aa12': a vowel takes a stress digit 0, 1 or 2"),
        ("Żółw Z AA1 L", "'Żółw' is not a word: write 'Zolw', as it is looked up"),
    ],
)
def test_a_fault_of_an_own_lexicon_names_what_to_write(tmp_path: Path, line: str, fault: str) -> None:
    own = tmp_path / "own.txt"
    own.write_text(f"{line}\n")
    with pytest.raises(ConfigError, match=re.escape(fault)):
        Lexicon.load(own)


def test_an_own_lexicon_does_not_change_stop(tmp_path: Path) -> None:
    own = tmp_path / "own.txt"
    own.write_text("stop S T AO1 P\n")
    assert Lexicon.load(own).pronounce("stop") == ("S", "T", "AO1", "P")
    own.write_text("halt HH AO1 L T\nstop HH AO1 L T\n")
    with pytest.raises(ConfigError, match=r"own\.txt:2: 'stop' must stay S T AA1 P or S T AO1 P, "):
        Lexicon.load(own)


@pytest.mark.parametrize("line", ["staff S T AA1 P", "stub(2) s t ao2 p"])
def test_no_other_word_of_an_own_lexicon_sounds_like_stop(tmp_path: Path, line: str) -> None:
    own = tmp_path / "own.txt"
    own.write_text(f"stopped S T AA1 P T\n{line}\n")
    with pytest.raises(ConfigError, match=r"own\.txt:2: '[^']+' would sound like 'stop', and halt every robot"):
        Lexicon.load(own)


@pytest.mark.parametrize("content", [None, b"\xff\xfe\x00rob"])
def test_an_unreadable_lexicon_is_named(tmp_path: Path, content: bytes | None) -> None:
    own = tmp_path / "own.txt"
    if content is not None:
        own.write_bytes(content)
    with pytest.raises(ConfigError, match=r"own\.txt"):
        Lexicon.load(own)


@pytest.mark.parametrize(
    ("a", "b", "alike"),
    [
        ("bot", "bott", True),
        ("bob", "bop", True),
        ("pam", "bam", True),
        ("water the red rose", "water the read rose", True),
        ("rob", "bot", False),
        ("water the red rose", "water the green rose", False),
        ("max", "zoe", False),
    ],
)
def test_alike_is_what_sounds_alike(a: str, b: str, alike: bool) -> None:
    assert sounds_alike(a, b, LEXICON) is alike
    assert sounds_alike(b, a, LEXICON) is alike


@pytest.mark.parametrize("name", ["Kim", "Tim", "Stop", "Ann"])
def test_who_is_refused_is_told_names_that_are_free(name: str) -> None:
    fault = name_fault(name, LEXICON)
    assert fault is not None
    proposed = re.split(", | or ", fault.partition("for example ")[2])
    assert len(set(proposed)) == 3
    assert [name_fault(each, LEXICON) for each in proposed] == [None] * 3


PHONES = st.lists(st.sampled_from(sorted(ARPABET)), max_size=8)


@given(PHONES, PHONES)
def test_the_distance_of_phones_is_a_distance(a: list[str], b: list[str]) -> None:
    assert phone_distance(a, b) == pytest.approx(phone_distance(b, a))
    assert (phone_distance(a, b) == 0.0) == (a == b)
    assert phone_distance(a, b) <= max(len(a), len(b))
