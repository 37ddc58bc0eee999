"""The natural voice: the network says what its publisher's runtime says, and its words fit the eight voices."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from hvcpd.ports import SAMPLE_RATE_HZ
from hvcpd.synthesis.acoustic_net import WEIGHTS, AcousticNet, shared_net
from hvcpd.synthesis.leveling import TARGET_LUFS
from hvcpd.synthesis.lexicon import Lexicon
from hvcpd.synthesis.loudness import loudness_lufs
from hvcpd.synthesis.natural import AFTER, BEFORE, indices, unaccented
from hvcpd.synthesis.phones import ARPABET, is_vowel
from hvcpd.synthesis.speaker import Speaker, UnitPosition
from hvcpd.synthesis.vocoder import Colour, pulses, sound_of
from hvcpd.synthesis.voices import VOICES, Voice, voice_named
from tests.synthesis.sounds import pitch_hz

LEXICON = Lexicon.load()

HI_BOT = [0, 50, 156, 25, 16, 44, 156, 69, 62, 3, 0]
""" "Hi Bot," in the network's alphabet."""


def natural(name: str) -> Voice:
    return replace(voice_named(name), natural=True)


def test_the_network_says_what_onnxruntime_says() -> None:
    """Reference: hibari-tts 0.2.1 under onnxruntime, whose activations have 8 bits."""
    said = shared_net().acoustics(HI_BOT)
    assert int(said.frames.sum()) == 100
    voiced = said.f0_hz > 60.0
    assert np.median(said.f0_hz[voiced]) == pytest.approx(228.0, rel=0.02)
    parts = shared_net().spectra(said.hidden, np.arange(601))
    assert [float(part.mean()) for part in parts] == pytest.approx([-6.45, 0.01, -13.22, -6.11, -0.07], abs=0.1)


def test_rounding_moves_no_sample_that_could_be_heard() -> None:
    """Another machine adds in another order: what it says differs from this one as float32 does from float64."""
    with np.load(WEIGHTS) as file:
        exact = AcousticNet({name: file[name] for name in file.files}, precise="")
    phonemes = [0, *indices(LEXICON.pronounce("completing")), 16, *indices(LEXICON.pronounce("battery")), 4, 0]
    sounds = []
    for net in (shared_net(), exact):
        said = net.acoustics(phonemes)
        sounds.append(sound_of(net, said.hidden, 0.4 * said.f0_hz, Colour(), seed=1).astype(np.float64))
    difference_db = 10.0 * np.log10(np.sum(np.square(sounds[0] - sounds[1])) / np.sum(np.square(sounds[1])))
    assert difference_db < -90.0


def test_a_word_sounds_the_same_where_nothing_else_is_decoded() -> None:
    """Within the 10 frames on either side with which it is cut out."""
    word = indices(LEXICON.pronounce("completing"))
    phonemes = [0, *BEFORE, *word, *AFTER, 0]
    here = slice(1 + len(BEFORE), 1 + len(BEFORE) + len(word))
    whole, part = shared_net().acoustics(phonemes), shared_net().acoustics(phonemes, wanted=here)
    ends = np.cumsum(whole.frames)
    near = slice(int((ends - whole.frames)[here][0]) - 10, int(ends[here][-1]) + 10)
    difference = np.linalg.norm(whole.hidden[near] - part.hidden[near]) / np.linalg.norm(whole.hidden[near])
    assert 20.0 * np.log10(difference) < -75.0
    assert not part.hidden[-10:].any(), "what was not wanted is not worked out"


def test_every_phone_has_a_sign_in_the_networks_alphabet() -> None:
    for phone in ARPABET:
        assert all(0 < index < 178 for index in indices([phone + "1"] if is_vowel(phone) else [phone]))
    with pytest.raises(KeyError):
        indices(["XX"])


def test_t_between_vowels_is_a_flap_and_a_vowel_without_stress_is_reduced() -> None:
    assert indices(["W", "AO1", "T", "ER0"]) == [65, 156, 76, 36, 83, 123]
    assert indices(["AH0", "B", "AH1", "V"]) == [83, 44, 156, 138, 64]


def test_only_words_without_an_accent_of_their_own_lose_it() -> None:
    assert unaccented("I", ("AY1",)) == ("AY0",)
    assert unaccented("stop", ("S", "T", "AA1", "P")) == ("S", "T", "AA1", "P")


def test_pulses_have_one_height_at_all_harmonics_and_none_without_voice() -> None:
    train = pulses(np.full(80, 100.0, dtype=np.float32))
    levels = np.abs(np.fft.rfft(train))[100:7_900:100] / (len(train) / 2)
    np.testing.assert_allclose(levels, 1.0, atol=1e-3)
    assert not pulses(np.zeros(8, dtype=np.float32)).any()


def test_a_shorter_tract_has_higher_formants_at_the_same_pitch() -> None:
    """The centre of the band of the first formant of "all"."""

    def centre_hz(scale: float) -> float:
        speaker = Speaker(replace(natural("oak"), formant_scale=scale), LEXICON)
        power = np.abs(np.fft.rfft(speaker.unit("all", UnitPosition.FINAL), SAMPLE_RATE_HZ)) ** 2
        return float(np.sum(np.arange(300, 1_500) * power[300:1_500]) / np.sum(power[300:1_500]))

    assert centre_hz(1.18) > 1.08 * centre_hz(0.94)


@pytest.mark.parametrize("name", ["granite", "wren"])
def test_a_voice_has_its_pitch_and_level(name: str) -> None:
    speaker = Speaker(natural(name), LEXICON)
    unit = speaker.unit("all", UnitPosition.FINAL)
    assert pitch_hz(unit) == pytest.approx(speaker.voice.f0_hz, rel=0.2)
    assert loudness_lufs(speaker.render([["water", "the", "rose"]])) == pytest.approx(TARGET_LUFS, abs=1.0)
    assert 0.2 < len(unit) / SAMPLE_RATE_HZ < 0.7


@pytest.mark.parametrize(("name", "word"), [("granite", "battery"), ("oak", "zoe")])
def test_a_low_voice_is_low_in_each_position(name: str, word: str) -> None:
    """The recorded talker has no sound as low as its first harmonic, and says words inside a phrase higher."""
    speaker = Speaker(natural(name), LEXICON)
    for position in UnitPosition:
        assert pitch_hz(speaker.unit(word, position)) == pytest.approx(speaker.voice.f0_hz, rel=0.15)


def test_who_knows_the_voice_knows_each_sample() -> None:
    mine, theirs = Speaker(natural("oak"), LEXICON), Speaker(natural("oak"), LEXICON)
    sentence = [["hi", "zorg"], ["stop"]]
    assert np.array_equal(mine.render(sentence), theirs.render(sentence))


def test_a_natural_unit_is_filed_beside_the_formant_one() -> None:
    keys = [{key for key, _ in Speaker(voice, LEXICON).keyed("rob")} for voice in (VOICES[0], natural("oak"))]
    assert len(keys[0] | keys[1]) == 4
