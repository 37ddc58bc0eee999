"""Voices: distinct from each other to a measure, and a robot's own for ever."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hvcpd.ports import SAMPLE_RATE_HZ
from hvcpd.synthesis.lexicon import Lexicon
from hvcpd.synthesis.speaker import Speaker, UnitPosition
from hvcpd.synthesis.voices import VOICES, Voice, voice_for, voice_named
from tests.synthesis.sounds import pitch_hz

LEXICON = Lexicon.load()


def first_formant_hz(voice: Voice) -> float:
    """Where the spectral envelope of the loudest part of "am" peaks, in the band of the first formants."""
    unit = Speaker(voice, LEXICON).unit("am", UnitPosition.MEDIAL).astype(float)
    frame = unit[np.argmax(np.convolve(unit**2, np.ones(1600), "valid")) :][:1600] * np.hanning(1600)
    power = np.abs(np.fft.rfft(frame, 4096)) ** 2
    hz = np.arange(len(power)) * SAMPLE_RATE_HZ / 4096
    band = (hz > 300) & (hz < 1500)
    return float(np.sum(hz[band] * power[band]) / np.sum(power[band]))


def test_every_two_voices_differ_by_a_tenth_in_pitch_or_formants() -> None:
    assert len({voice.name for voice in VOICES}) == len(VOICES) >= 8
    for a, b in combinations(VOICES, 2):
        pitch = max(a.f0_hz, b.f0_hz) / min(a.f0_hz, b.f0_hz)
        formants = max(a.formant_scale, b.formant_scale) / min(a.formant_scale, b.formant_scale)
        assert max(pitch, formants) >= 1.1, (a.name, b.name)


def test_the_difference_can_be_measured_in_the_sound() -> None:
    def measured_hz(voice: Voice) -> float:
        speaker = Speaker(voice, LEXICON)
        return float(np.median([pitch_hz(speaker.unit(w, UnitPosition.MEDIAL)) for w in ("all", "am", "road", "go")]))

    pitches = {voice.name: measured_hz(voice) for voice in VOICES}
    by_pitch = sorted(VOICES, key=lambda v: v.f0_hz)
    measured = [pitches[v.name] for v in by_pitch]
    assert measured == sorted(measured)
    assert measured[-1] > 1.8 * measured[0]
    assert first_formant_hz(voice_named("lark")) > 1.08 * first_formant_hz(voice_named("granite"))


@given(st.text(min_size=1, max_size=20))
def test_a_name_has_one_voice_whatever_its_case(name: str) -> None:
    assert voice_for(name) in VOICES
    assert voice_for(f" {name} ") == voice_for(name)


def test_the_voice_of_a_name_never_changes() -> None:
    """Robots of other releases rely on it: change the sound of a voice, never whose it is."""
    names = "Rob Bot Max Zoe Ada Kim Zorg R2D2".split()
    assert {name: voice_for(name).name for name in names} == {name: voice_for(name.upper()).name for name in names}
    assert voice_for("Rob").name == "brook"
    assert voice_for("Bot").name == "lark"


def test_many_names_use_all_voices() -> None:
    assert len({voice_for(f"robot{k}").name for k in range(60)}) == len(VOICES)


def test_an_unknown_voice_is_an_error() -> None:
    with pytest.raises(KeyError):
        voice_named("thunder")
