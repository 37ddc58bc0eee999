"""Whatever comes from a microphone or a file: nothing raises, nothing is made up, and hearing goes on."""

from __future__ import annotations

import io
import re
import wave
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from hvcpd.errors import AudioFileError
from hvcpd.hardware.soundfile import read_wav
from hvcpd.recognition.events import Event, Recognised
from hvcpd.recognition.template_recogniser import TemplateRecogniser
from hvcpd.recognition.templates import TemplateBank
from tests.recognition.signals import graph, in_noise, sentence, templates, word

pytestmark = pytest.mark.slow

RATE = 16_000
SAID = ("hi", "bot", "water", "rose")
NOISE_DBFS = -50.0


def recogniser() -> TemplateRecogniser:
    return TemplateRecogniser(graph(), templates())


def quiet(seconds: float, seed: int) -> np.ndarray:
    return in_noise(np.zeros(0, np.float32), seconds, 0.0, NOISE_DBFS, seed)


def speech(seed: int = 4) -> np.ndarray:
    return in_noise(sentence("hi bot, water rose"), 0.5, 0.8, NOISE_DBFS, seed)


def recognised(events: list[Event]) -> list[tuple[str, ...]]:
    return [e.words for e in events if isinstance(e, Recognised)]


def rubbish(kind: str, n: int, seed: int) -> np.ndarray:
    """`n` samples that no sane converter gives."""
    rng = np.random.default_rng(seed)
    return {
        "nan": np.full(n, np.nan),
        "infinite": np.where(rng.random(n) < 0.5, np.inf, -np.inf),
        "huge": rng.standard_normal(n) * 1e30,
        "full scale": np.sign(rng.standard_normal(n)),
        "direct current": np.full(n, rng.uniform(-1.0, 1.0)),
        "digital silence": np.zeros(n),
        "clicks": (rng.random(n) < 0.001).astype(float),
        "some nan": np.where(rng.random(n) < 0.1, np.nan, rng.standard_normal(n) * 0.01),
    }[kind].astype(np.float32)


KINDS = ["nan", "infinite", "huge", "full scale", "direct current", "digital silence", "clicks", "some nan"]


@settings(max_examples=16, deadline=None)
@given(st.lists(st.tuples(st.sampled_from(KINDS), st.integers(1, 8000)), min_size=1, max_size=4), st.integers(0, 999))
def test_after_any_rubbish_nothing_was_made_up_and_the_next_sentence_is_heard(
    parts: list[tuple[str, int]], seed: int
) -> None:
    r = recogniser()
    events = r.push(quiet(2.0, 1))
    for kind, n in parts:
        events += r.push(rubbish(kind, n, seed))
    events += r.push(quiet(4.0, 2))  # the noise tracker's memory is 3 s
    assert recognised(events) == []
    assert recognised(r.push(speech())) == [SAID]


@settings(max_examples=12, deadline=None)
@given(st.sampled_from(KINDS), st.integers(500, 6000), st.integers(0, 999), st.integers(0, 24_000))
def test_rubbish_within_a_sentence_never_makes_another_of_it(kind: str, n: int, seed: int, at: int) -> None:
    sound = np.concatenate([quiet(2.0, 1), speech()])
    begin = min(2 * RATE + RATE // 2 + at, len(sound) - n)
    sound[begin : begin + n] = rubbish(kind, n, seed)
    r = recogniser()
    assert set(recognised(r.push(sound) + r.flush())) <= {SAID}


@settings(max_examples=10, deadline=None)
@given(st.floats(0.0, 30.0), st.floats(-0.3, 0.3))
def test_clipping_and_an_offset_never_make_another_sentence(over_db: float, offset: float) -> None:
    """Clipped by up to 30 dB over full scale, on top of an offset; when both are moderate it is heard all the same."""
    loud = np.concatenate([quiet(2.0, 1), speech()]) * np.float32(3.0 * 10.0 ** (over_db / 20.0))
    r = recogniser()
    heard = recognised(r.push(np.clip(loud + np.float32(offset), -1.0, 1.0)) + r.flush())
    assert set(heard) <= {SAID}
    if over_db < 6.0:
        assert heard == [SAID]


@settings(max_examples=6, deadline=None)
@given(st.sampled_from(KINDS), st.lists(st.integers(0, 3000), min_size=1, max_size=20), st.integers(0, 99))
def test_the_size_of_blocks_makes_no_difference_to_rubbish_either(kind: str, sizes: list[int], seed: int) -> None:
    sound = np.concatenate([quiet(1.5, 1), rubbish(kind, 5000, seed), quiet(1.0, 2), speech()])
    whole, parts, at = recogniser(), recogniser(), 0
    events: list[Event] = []
    for size in sizes:
        events += parts.push(sound[at : at + size])
        at += size
    events += parts.push(sound[at:])
    assert events + parts.flush() == whole.push(sound) + whole.flush()


def test_three_minutes_in_one_block_are_as_in_many() -> None:
    """Much longer than anything that the ear keeps."""
    sound = np.tile(np.concatenate([speech(), quiet(57.0, 3)]), 3)
    assert len(sound) > 175 * RATE
    whole, parts = recogniser(), recogniser()
    events = [e for begin in range(0, len(sound), 160_001) for e in parts.push(sound[begin : begin + 160_001])]
    assert whole.push(sound) == events
    assert recognised(events) == [SAID] * 3


def wav(samples: np.ndarray) -> bytes:
    file = io.BytesIO()
    with wave.open(file, "wb") as out:
        out.setnchannels(1)
        out.setsampwidth(2)
        out.setframerate(RATE)
        out.writeframes((samples * 32767).astype("<i2").tobytes())
    return file.getvalue()


WHOLE = wav(np.concatenate([quiet(1.0, 1), speech()]))


@settings(max_examples=25, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.integers(0, len(WHOLE) - 1))
def test_a_truncated_wav_is_refused_with_a_message_that_names_it(tmp_path: Path, size: int) -> None:
    path = tmp_path / "cut.wav"
    path.write_bytes(WHOLE[:size])
    with pytest.raises(AudioFileError, match=f"^{re.escape(str(path))}: "):
        read_wav(path)


@pytest.mark.parametrize("seconds", [1.55, 1.7, 2.0, 2.3, 2.6])
def test_of_a_recording_that_breaks_off_no_more_is_heard_than_was_said(seconds: float, tmp_path: Path) -> None:
    """ "Hi bot" is a whole sentence of the graph, and before the comma's pause it is all that was said."""
    path = tmp_path / "cut.wav"
    path.write_bytes(wav(np.concatenate([quiet(1.0, 1), speech()])[: round(seconds * RATE)]))
    r = recogniser()
    heard = recognised(r.push(read_wav(path)) + r.flush())
    assert heard in ([], [SAID[:2]] if seconds == 2.3 else [])


@pytest.mark.parametrize("short", [("hi",), ("water",), ("hi", "water")])
@pytest.mark.parametrize("length_s", [0.16, 0.1, 0.06, 0.03])
@pytest.mark.parametrize("noise_dbfs", [-60.0, -20.0])
def test_words_shorter_than_the_decoder_looks_ahead_are_heard(
    short: tuple[str, ...], length_s: float, noise_dbfs: float
) -> None:
    """From 17 frames down to 4; the decoder chooses what to follow every 8 frames, for 16 states ahead."""
    voices = templates()
    voices["oak"] |= {name: [word(name, 120.0, length_s)] for name in short}
    frames = [t.length for t in TemplateBank(voices).templates if t.word in short]
    assert max(frames) <= 17
    said = [word(name, 125.0, length_s if name in short else None) for name in SAID]
    said.insert(2, np.zeros(round(0.15 * RATE), np.float32))
    r = TemplateRecogniser(graph(), voices)
    sound = in_noise(np.concatenate(said), noise_dbfs=noise_dbfs)
    assert recognised(r.push(sound) + r.flush()) == [SAID]
