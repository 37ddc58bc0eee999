"""How phones are made beside their neighbours, seen in the controls and in the sound."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from hvcpd.ports import SAMPLE_RATE_HZ
from hvcpd.synthesis.allophones import allophone
from hvcpd.synthesis.articulation import controls_for
from hvcpd.synthesis.durations import durations_s
from hvcpd.synthesis.lexicon import Lexicon
from hvcpd.synthesis.phones import PHONES, Kind
from hvcpd.synthesis.placement import LEAD_S, place
from hvcpd.synthesis.speaker import Speaker, UnitPosition
from hvcpd.synthesis.voices import VOICES, voice_named
from tests.synthesis.sounds import rms_db

LEXICON = Lexicon.load()
OAK = voice_named("oak")


def phones(text: str) -> list[str]:
    return text.split()


def test_t_between_vowels_is_tapped_but_not_before_a_stressed_one() -> None:
    tapped = allophone(phones("W AO1 T ER0"), 2)
    full = allophone(phones("AH0 T AE1 K"), 1)
    assert tapped.voiced
    assert not full.voiced
    assert tapped.inherent_s < 0.6 * full.inherent_s
    assert tapped.aspiration_s == 0.0 < full.aspiration_s


def test_stops_lose_their_breath_after_s() -> None:
    assert allophone(phones("S T AA1 P"), 1).aspiration_s < 0.5 * allophone(phones("T AA1 P"), 0).aspiration_s


def test_velars_are_fronted_before_front_vowels() -> None:
    key, caught = allophone(phones("K IY1"), 0), allophone(phones("K AO1 T"), 0)
    assert key.target_hz[1] > caught.target_hz[1] + 500.0
    assert key.bands[0].centre_hz > caught.bands[0].centre_hz + 500.0


@pytest.mark.parametrize("word", ["water", "stop", "indigo", "hi", "confirmed", "six"])
@pytest.mark.parametrize("final", [False, True])
def test_phones_follow_each_other_without_gap_or_overlap(word: str, final: bool) -> None:
    placed = place(LEXICON.pronounce(word), 1.0, final)
    assert placed[0].start_s == LEAD_S
    for before, after in pairwise(placed):
        assert after.start_s == pytest.approx(before.end_s, abs=1e-9)
    for item in placed:
        assert item.start_s < item.release_s <= item.end_s + 1e-9


@pytest.mark.parametrize("voice", VOICES, ids=lambda voice: voice.name)
@pytest.mark.parametrize("name", sorted(PHONES))
def test_each_phone_alone_has_finite_controls_in_range(name: str, voice: object) -> None:
    said = name if PHONES[name].kind is not Kind.VOWEL or name == "AX" else f"{name}1"
    if name == "AX":
        said = "AH0"
    controls = controls_for([said], voice, final=True)  # type: ignore[arg-type]
    times = np.arange(0.0, controls.duration_s, 0.005)
    for track in (*controls.formants_hz, *controls.bandwidths_hz, controls.f0_hz, controls.tilt_hz):
        values = track.at(times)
        assert np.isfinite(values).all()
        assert values.min() > 20.0
        assert values.max() < 0.5 * SAMPLE_RATE_HZ
    for earlier, later in pairwise(controls.formants_hz):
        assert (earlier.at(times) < later.at(times)).all()


@pytest.mark.parametrize("stop", ["P", "T", "K"])
def test_a_voiceless_stop_is_strong_only_where_it_begins_a_stressed_syllable(stop: str) -> None:
    strong = [allophone(phones(said), 0) for said in (f"{stop} AE1 N", f"{stop} R AE1 N")]
    weak = [allophone(phones(said), number) for said, number in ((f"S {stop} AE1 N", 1), (f"{stop} AH0 N AE1 N", 0))]
    for one in strong:
        assert all(one.noise_db > other.noise_db and one.aspiration_db > other.aspiration_db for other in weak)
        assert all(one.aspiration_s > other.aspiration_s for other in weak)


def test_h_is_breath_before_the_vowel() -> None:
    """The first 60 ms of "hi" carry no voice: little below 300 Hz beside what is above, and far below the vowel."""
    unit = Speaker(OAK, LEXICON).unit("hi", UnitPosition.FINAL)
    start = round((LEAD_S + 0.01) * SAMPLE_RATE_HZ)
    breath, vowel = unit[start : start + 800], unit[start + 2400 : start + 3200]
    power = np.abs(np.fft.rfft(breath * np.hanning(800))) ** 2
    assert power[:15].sum() < 0.2 * power[15:].sum()
    assert -25.0 < rms_db(breath) - rms_db(vowel) < -8.0


def test_the_voice_comes_in_softly_before_an_h_ends() -> None:
    said = phones("HH AY1")
    end_s = place(said, OAK.rate, final=False)[0].end_s
    early, late, vowel = controls_for(said, OAK, final=False).voicing_db.at(np.array([-0.06, -0.02, 0.02]) + end_s)
    assert early < -40.0
    assert early + 20.0 < late < vowel - 6.0


def test_a_diphthong_moves_and_a_vowel_stands() -> None:
    for name, least_hz in (("AY1", 400.0), ("OY1", 600.0), ("AA1", 0.0)):
        track = controls_for([name], OAK, final=True).formants_hz[1]
        placed = place([name], OAK.rate, final=True)[0]
        moved = float(track.at(np.array([placed.end_s]))[0] - track.at(np.array([placed.start_s]))[0])
        assert moved == pytest.approx(0.0, abs=1.0) if not least_hz else moved > least_hz


def test_vowels_beside_nasals_are_nasal_there_and_nowhere_else() -> None:
    """The nasal zero leaves the pole in the second half of "am" and stays there in "ab"."""

    def distance_hz(word: str) -> np.ndarray:
        controls = controls_for(phones(word), OAK, final=True)
        vowel = place(phones(word), OAK.rate, final=True)[0]
        times = np.linspace(vowel.start_s + 0.01, vowel.end_s - 0.005, 20)
        return np.abs(controls.nasal_zero_hz.at(times) - controls.nasal_pole_hz)

    assert np.max(distance_hz("AE1 B")) < 1.0
    nasal = distance_hz("AE1 M")
    assert np.max(nasal[:8]) < 1.0
    assert nasal[-1] > 60.0
    assert (np.diff(nasal) >= 0.0).all()


@pytest.mark.parametrize(("labial", "alveolar"), [("M", "N"), ("B", "D"), ("P", "T")])
def test_lips_pull_the_second_formant_down_and_the_tongue_does_not(labial: str, alveolar: str) -> None:
    def end_hz(consonant: str) -> float:
        said = phones(f"IY1 {consonant}")
        vowel = place(said, OAK.rate, final=True)[0]
        return float(controls_for(said, OAK, final=True).formants_hz[1].at(np.array([vowel.end_s]))[0])

    assert end_hz(labial) < end_hz(alveolar) - 100.0


@pytest.mark.parametrize("word", ["B AA1 T", "T AE1 S K", "S T AA1 P"])
def test_a_voiceless_stop_is_released_and_breathes_at_the_end(word: str) -> None:
    controls = controls_for(phones(word), OAK, final=True)
    last = place(phones(word), OAK.rate, final=True)[-1]
    breath = controls.aspiration_db.at(np.array([last.end_s + 0.02, last.end_s + 0.1]))
    assert breath[0] > -20.0
    assert breath[1] < -60.0
    assert max(event.times_s[-1] for event in controls.frications) > last.release_s + 0.03


def test_what_closes_a_vowel_matters_most_before_a_pause() -> None:
    """ "Bed" against "bet": the vowel's ratio is larger before a pause than inside a phrase (Klatt's rule 9)."""

    def ratio(final: bool) -> float:
        return durations_s(phones("B EH1 D"), final)[1] / durations_s(phones("B EH1 T"), final)[1]

    assert ratio(final=True) > ratio(final=False) + 0.1 > 1.1


def test_a_words_last_stop_breathes_less_before_another_word() -> None:
    """Or "task eight" is heard as "cascade"."""
    medial, final = (place(phones("T AE1 S K"), OAK.rate, final=end)[-1].phone for end in (False, True))
    assert medial.aspiration_s < 0.5 * final.aspiration_s


def test_breath_leaves_a_vowel_without_stress_its_voice() -> None:
    """In "taken" the schwa has 40 ms of voice at least, after the breath of the K."""
    said = phones("T EY1 K AH0 N")
    schwa = place(said, OAK.rate, final=False)[3]
    times = np.arange(schwa.start_s, schwa.end_s, 0.001)
    assert np.sum(controls_for(said, OAK, final=False).voicing_db.at(times) > -12.0) >= 40


def test_before_a_pause_the_voice_sinks_and_turns_to_breath() -> None:
    said = phones("F R IY1")
    inside, end = (controls_for(said, OAK, final=final) for final in (False, True))
    last_s = np.array([place(said, OAK.rate, final=True)[-1].end_s])
    assert end.voicing_db.at(last_s)[0] < inside.voicing_db.at(last_s)[0] - 4.0
    assert end.voiced_hz.at(last_s)[0] < inside.voiced_hz.at(last_s)[0] - 400.0


def test_every_unit_has_random_numbers_of_its_own() -> None:
    seeds = {
        controls_for(phones(word), voice, final).noise_seed
        for word in ("R AA1 B", "B AA1 T")
        for voice in VOICES
        for final in (False, True)
    }
    assert len(seeds) == 2 * len(VOICES) * 2


def test_the_vowel_of_four_is_closer_than_that_of_call() -> None:
    """Said with the vowel of "call", "four" was heard as "far"."""
    four, call = (allophone(phones(said), 1) for said in ("F AO1 R", "K AO1 L"))
    assert four.target_hz[0] < call.target_hz[0] - 80.0
    assert four.target_hz[1] < call.target_hz[1]
