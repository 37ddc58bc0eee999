"""What a speaker says: level, ends, joints, pitch, length, and that every word whatever gives sound fit to play."""

from __future__ import annotations

import gc
import weakref

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from hvcpd.synthesis.durations import durations_s
from hvcpd.synthesis.leveling import TARGET_LUFS, audible, fade, leveled
from hvcpd.synthesis.lexicon import Lexicon
from hvcpd.synthesis.loudness import loudness_lufs
from hvcpd.synthesis.placement import LEAD_S
from hvcpd.synthesis.speaker import PAUSE_S, Speaker, UnitPosition
from hvcpd.synthesis.voices import VOICES, voice_named
from tests.synthesis.sounds import pitch_hz, rms_db

LEXICON = Lexicon.load()
SENTENCE = (("hi", "bot"), ("i", "am", "rob"), ("i", "will", "water", "the", "yellow", "rose"))
WORDS = ("hi", "stop", "task", "six", "water", "yellow", "violet", "complete", "confirmed", "indigo")


@pytest.fixture(scope="module")
def brook() -> Speaker:
    return Speaker(voice_named("brook"), LEXICON)


def check_playable(sound: Samples) -> None:
    assert sound.dtype == np.float32
    assert sound.ndim == 1
    assert np.isfinite(sound).all()
    assert not len(sound) or float(np.max(np.abs(sound))) <= 10.0 ** (-1.0 / 20.0)


@pytest.mark.slow
@settings(max_examples=60, deadline=None)
@given(word=st.text("abcdefghijklmnopqrstuvwxyz0123456789'", max_size=24), voice=st.sampled_from(VOICES))
def test_any_word_gives_finite_sound_within_full_scale(word: str, voice: object) -> None:
    speaker = Speaker(voice, LEXICON)  # type: ignore[arg-type]
    for position in UnitPosition:
        unit = speaker.unit(word, position)
        check_playable(unit)
        assert (len(unit) > 0) == bool(LEXICON.pronounce(word))


@settings(max_examples=30, deadline=None)
@given(text=st.text(max_size=12))
def test_arbitrary_characters_never_break_the_voice(text: str) -> None:
    check_playable(Speaker(VOICES[0], LEXICON).render([(text, "stop"), (text,)]))


@pytest.mark.parametrize("voice", VOICES, ids=lambda voice: voice.name)
def test_a_sentence_is_playable_and_quiet_at_both_ends(voice: object) -> None:
    sound = Speaker(voice, LEXICON).render(SENTENCE)  # type: ignore[arg-type]
    check_playable(sound)
    edge = SAMPLE_RATE_HZ // 500
    assert rms_db(sound[:edge]) < rms_db(sound) - 30.0
    assert rms_db(sound[-edge:]) < rms_db(sound) - 30.0
    assert abs(float(sound.mean())) < 1e-3


@pytest.mark.parametrize("voice", VOICES, ids=lambda voice: voice.name)
def test_words_and_sentences_are_equally_loud(voice: object) -> None:
    """Within 1 LU of one loudness, by BS.1770; a word as one hears it, without the silence of its joints."""
    speaker = Speaker(voice, LEXICON)  # type: ignore[arg-type]
    units = [speaker.unit(word, UnitPosition.FINAL) for word in WORDS]
    sounds = [unit[slice(*audible(unit))] for unit in units] + [speaker.render(SENTENCE)]
    for sound in sounds:
        assert loudness_lufs(sound) == pytest.approx(TARGET_LUFS, abs=1.0)


@pytest.mark.parametrize("voice", VOICES, ids=lambda voice: voice.name)
def test_a_voice_speaks_at_its_pitch(voice: object) -> None:
    speaker = Speaker(voice, LEXICON)  # type: ignore[arg-type]
    for word in ("all", "am", "road"):
        assert pitch_hz(speaker.unit(word, UnitPosition.MEDIAL)) == pytest.approx(voice.f0_hz, rel=0.2)  # type: ignore[attr-defined]


def test_the_end_of_a_statement_falls(brook: Speaker) -> None:
    """The last voiced part of a final word is lower than that of the same word inside a phrase."""

    def closing(position: UnitPosition) -> float:
        unit = brook.unit("yellow", position)
        end = audible(unit)[1]
        return pitch_hz(unit[end - round(0.12 * SAMPLE_RATE_HZ) : end])

    assert closing(UnitPosition.FINAL) < 0.95 * closing(UnitPosition.MEDIAL)


def test_the_same_words_give_the_same_sound(brook: Speaker) -> None:
    again = Speaker(voice_named("brook"), Lexicon.load()).render(SENTENCE)
    assert np.array_equal(brook.render(SENTENCE), again)


def test_upper_and_lower_case_sound_the_same(brook: Speaker) -> None:
    assert np.array_equal(brook.render([("Rob", "STOP")]), brook.render([("rob", "stop")]))


def test_a_unit_cannot_be_changed_by_its_user(brook: Speaker) -> None:
    with pytest.raises(ValueError, match="read-only"):
        brook.unit("rob", UnitPosition.FINAL)[0] = 1.0


def test_templates_are_the_units_without_the_outer_half_of_their_joints(brook: Speaker) -> None:
    edge = round(LEAD_S * SAMPLE_RATE_HZ)
    medial, final = brook.unit("rose", UnitPosition.MEDIAL), brook.unit("rose", UnitPosition.FINAL)
    found = brook.templates("rose")
    assert any(np.array_equal(medial[edge:-edge], template) for template in found)
    assert any(np.array_equal(final[edge:], template) for template in found)


def test_neighbouring_words_are_joined_without_a_hole(brook: Speaker) -> None:
    """Between two vowels the voice goes on: nowhere inside "I am all" does the level sink by 12 dB."""
    sound = brook.render([("i", "am", "all")])
    begin, end = audible(sound)
    inner = sound[begin + 480 : end - 1600]
    frame = SAMPLE_RATE_HZ // 50
    levels = [rms_db(inner[k : k + frame]) for k in range(0, len(inner) - frame, frame // 2)]
    assert min(levels) > max(levels) - 12.0


def test_words_stand_in_their_order_up_to_the_end(brook: Speaker) -> None:
    sound, placed = brook.render(SENTENCE), brook.placed(SENTENCE)
    starts = [start for start, _ in placed]
    assert len(placed) == sum(map(len, SENTENCE))
    assert starts == sorted(starts)
    assert starts[-1] + len(placed[-1][1]) == len(sound)
    assert rms_db(sound[starts[-1] :]) > -30.0


def test_a_comma_is_a_pause(brook: Speaker) -> None:
    together = brook.render([("rob", "stop")])
    apart = brook.render([("rob",), ("stop",)])
    frame = SAMPLE_RATE_HZ // 100
    levels = np.array([rms_db(apart[k : k + frame]) for k in range(0, len(apart) - frame, frame)])
    loud = np.flatnonzero(levels > levels.max() - 30.0)
    longest = int(np.max(np.diff(loud))) * 0.01
    assert longest == pytest.approx(PAUSE_S, abs=0.06)
    assert len(apart) > len(together) + 0.5 * PAUSE_S * SAMPLE_RATE_HZ


@pytest.mark.parametrize("voice", VOICES, ids=lambda voice: voice.name)
def test_joints_do_not_click(voice: object) -> None:
    """A click is a jump; those around joints are far smaller than the largest inside the units. Without the units' soft
    ends that is so of five voices of eight."""
    speaker = Speaker(voice, LEXICON)  # type: ignore[arg-type]
    jumps = np.abs(np.diff(speaker.render(SENTENCE).astype(float), n=2))
    inside = max(
        float(np.max(np.abs(np.diff(speaker.unit(word, position).astype(float), n=2))))
        for phrase in SENTENCE
        for word in phrase
        for position in UnitPosition
    )
    for start, _ in speaker.placed(SENTENCE):
        near = jumps[max(0, start - 200) : start + 200]
        assert float(np.max(near)) <= 0.6 * inside


def test_durations_follow_klatts_rules() -> None:
    def length(word: str, final: bool) -> dict[str, float]:
        phones = LEXICON.pronounce(word)
        return dict(zip(phones, durations_s(phones, final), strict=True))

    assert length("seed", True)["IY1"] > length("seed", False)["IY1"]
    assert length("meat", False)["IY1"] < length("seed", False)["IY1"]
    assert length("task", False)["S"] < length("sam", False)["S"]
    assert length("yellow", False)["EH1"] < length("bed", False)["EH1"]
    assert all(0.02 < seconds < 0.5 for seconds in length("confirmed", True).values())


def test_a_faster_voice_is_shorter() -> None:
    slow, fast = min(VOICES, key=lambda v: v.rate), max(VOICES, key=lambda v: v.rate)
    lengths = [len(Speaker(voice, LEXICON).unit("indigo", UnitPosition.FINAL)) for voice in (slow, fast)]
    assert lengths[0] > 1.04 * lengths[1]


def test_leveling_takes_out_dc_and_bounds_the_peak() -> None:
    rng = np.random.default_rng(3)
    loud = (0.9 * rng.standard_normal(16000) + 0.3).astype(np.float32)
    out = leveled(loud)
    assert abs(float(out.mean())) < 1e-4
    assert loudness_lufs(out) == pytest.approx(TARGET_LUFS, abs=0.1)
    click = np.zeros(16000, np.float32)
    click[8000] = 0.5
    assert float(np.max(np.abs(leveled(click)))) <= 10.0 ** (-1.5 / 20.0) + 1e-3
    assert not leveled(np.zeros(100, np.float32)).any()


def test_two_fades_overlapped_add_up_to_one() -> None:
    ones = np.ones(4000, np.float32)
    ramp = fade(ones, 0.02)
    count = round(0.02 * SAMPLE_RATE_HZ)
    assert ramp[-count:] + ramp[:count] == pytest.approx(np.ones(count), abs=1e-5)
    assert ramp[count:-count] == pytest.approx(np.ones(4000 - 2 * count))


def test_units_go_with_their_speaker_without_a_collection() -> None:
    speaker = Speaker(VOICES[0], LEXICON)
    unit = weakref.ref(speaker.unit("hi", UnitPosition.FINAL))
    gc.disable()
    try:
        del speaker
        assert unit() is None
    finally:
        gc.enable()
