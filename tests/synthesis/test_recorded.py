"""A voice of recorded words: joined like the synthesizer's own, and honest about what it lacks."""

from __future__ import annotations

import numpy as np
import pytest

from hvcpd.errors import PhraseError
from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from hvcpd.synthesis.articulation import controls_for
from hvcpd.synthesis.frames import FRAME_S, frame_table
from hvcpd.synthesis.leveling import TARGET_LUFS, audible
from hvcpd.synthesis.lexicon import Lexicon
from hvcpd.synthesis.loudness import loudness_lufs
from hvcpd.synthesis.placement import LEAD_S
from hvcpd.synthesis.recorded import RecordedSpeaker, prepared
from hvcpd.synthesis.speaker import Speaker, UnitPosition
from hvcpd.synthesis.voices import voice_named

LEXICON = Lexicon.load()
OAK = voice_named("oak")


def recording(word: str, level: float, silence_s: float = 0.4) -> Samples:
    """A word as somebody records it: at some level, between silences, over a little DC."""
    gap = np.zeros(round(silence_s * SAMPLE_RATE_HZ), np.float32)
    unit = Speaker(OAK, LEXICON).unit(word, UnitPosition.FINAL)
    return (np.concatenate([gap, level * unit, gap]) + np.float32(0.001)).astype(np.float32)


def test_words_of_any_level_are_brought_to_one_and_their_silence_is_cut() -> None:
    for word, level in (("stop", 0.1), ("rob", 1.5)):
        unit = prepared(recording(word, level))
        begin, end = audible(unit)
        assert loudness_lufs(unit[begin:end]) == pytest.approx(TARGET_LUFS, abs=0.5)
        assert begin == pytest.approx(LEAD_S * SAMPLE_RATE_HZ, abs=0.021 * SAMPLE_RATE_HZ)
        assert len(unit) < len(recording(word, level)) - 0.6 * SAMPLE_RATE_HZ


def test_a_sentence_is_made_of_the_recordings() -> None:
    speaker = RecordedSpeaker({"Rob": recording("rob", 0.3), "stop": recording("stop", 0.9)}, LEXICON)
    sentence = [("rob",), ("STOP",)]
    sound, (_, (start, unit)) = speaker.render(sentence), speaker.placed(sentence)
    assert loudness_lufs(sound) == pytest.approx(TARGET_LUFS, abs=1.0)
    assert np.array_equal(unit, speaker.unit("stop", UnitPosition.FINAL))
    heard = sound[start : start + len(unit)]
    assert np.corrcoef(heard, unit)[0, 1] > 0.9999


def test_what_is_missing_or_silent_is_told() -> None:
    speaker = RecordedSpeaker({"rob": recording("rob", 0.3), "stop": np.zeros(9000, np.float32)}, LEXICON)
    assert speaker.missing(["Rob", "stop", "bot", "BOT"]) == ["bot", "stop"]
    with pytest.raises(PhraseError, match=r"bot\.wav"):
        speaker.render([("bot",)])


@pytest.mark.parametrize("sound", [np.zeros(0), np.full(2000, np.nan), np.array([0.5])])
def test_strange_recordings_do_no_harm(sound: np.ndarray) -> None:
    unit = prepared(sound.astype(np.float32))
    assert np.isfinite(unit).all()
    assert float(np.max(np.abs(unit), initial=0.0)) <= 10.0 ** (-1.0 / 20.0)


def test_the_frames_are_the_controls() -> None:
    controls = controls_for(LEXICON.pronounce("task"), OAK, final=True)
    columns, table = frame_table(controls)
    assert table.shape == (len(np.arange(0.0, controls.duration_s, FRAME_S)), len(columns))
    assert np.isfinite(table).all()
    at = dict(zip(columns, table.T, strict=True))
    assert np.diff(at["t"]) == pytest.approx(FRAME_S)
    assert np.array_equal(at["F2"], controls.formants_hz[1].at(at["t"]))
    assert at["AF"].max() == max(max(event.values) for event in controls.frications) or at["AF"].max() > -10.0
    assert (at["AF"] == -99.0).any()
