"""The keyword is heard from anybody, at any level and over other talk, within 0.3 s, and words like it are not."""

from __future__ import annotations

from collections import deque
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from hvcpd.recognition.frontend import HOP_SAMPLES, N_BANDS, energies_of
from hvcpd.recognition.keyword.net import (
    DECISION_FRAMES,
    DELAY_FRAMES,
    DILATIONS,
    HOLD_PROBABILITY,
    KERNEL_SIZE,
    KERNEL_SIZES,
    REFRACTORY_FRAMES,
    SMOOTHING_COLUMNS,
    WEIGHTS,
    Detection,
    InputNormaliser,
    KeywordNet,
    KeywordSpotter,
    Posteriors,
    Weights,
    second_highest,
)
from hvcpd.recognition.keyword.verification import ACCEPT_PROBABILITY
from hvcpd.recognition.stream import CHUNK_FRAMES, Chunk, FrameStream
from hvcpd.synthesis.leveling import audible
from hvcpd.synthesis.lexicon import Lexicon
from hvcpd.synthesis.speaker import Speaker
from hvcpd.synthesis.voices import VOICES, Voice, voice_named

SENTENCE = [["hi", "all"], ["i", "am", "rob"], ["task", "three", "complete"], ["i", "will", "complete", "task", "one"]]


@cache
def weights() -> Weights:
    return Weights.load()


def said(phrases: list[list[str]], voice: Voice) -> Samples:
    """Without what is no longer audible at its ends."""
    sound = Speaker(voice, Lexicon.load()).render(phrases)
    begin, end = audible(sound)
    return sound[begin:end]


def at_level(sound: Samples, dbfs: float) -> Samples:
    loud = sound[np.abs(sound) > 0.05 * np.abs(sound).max()]
    return np.asarray(sound * (10.0 ** (dbfs / 20.0) / np.sqrt(np.mean(loud**2))), np.float32)


def heard(sound: Samples, at_s: float = 1.5, rest_s: float = 0.6, noise_dbfs: float = -75.0) -> Samples:
    """With time around it, in a microphone's noise and 16 bits."""
    whole = np.pad(sound, (round(at_s * SAMPLE_RATE_HZ), round(rest_s * SAMPLE_RATE_HZ)))
    noise = np.random.default_rng(1).standard_normal(len(whole)) * 10.0 ** (noise_dbfs / 20.0)
    return np.asarray(np.clip(np.round((whole + noise) * 32767.0) / 32767.0, -1.0, 1.0), np.float32)


def curves(sound: Samples) -> list[tuple[float, Posteriors]]:
    """When the net tells, s, and the probabilities that count then."""
    net, told, probabilities = (
        KeywordNet(weights()),
        [],
        deque([Posteriors(0.0, 0.0)] * SMOOTHING_COLUMNS, SMOOTHING_COLUMNS),
    )
    for k, chunk in enumerate(FrameStream().push(sound, False)):
        probabilities.append(net.posteriors(chunk.energies))
        counts = Posteriors(*map(second_highest, zip(*probabilities, strict=True)))
        told.append((((k + 1) * CHUNK_FRAMES * 160 + 240) / SAMPLE_RATE_HZ, counts))
    return told


def highest(sound: Samples, since_s: float = 0.0, until_s: float = 99.0) -> float:
    """Chance of the word."""
    return max(probabilities.word for at_s, probabilities in curves(sound) if since_s <= at_s <= until_s)


def call(sound: Samples) -> float:
    """Chance of a call, ever."""
    return max(probabilities.call for _, probabilities in curves(sound))


def in_time(word: Samples, at_s: float = 1.5) -> tuple[float, float]:
    """From the word's vowel until 0.3 s after its end."""
    end_s = at_s + len(word) / SAMPLE_RATE_HZ
    return end_s - 0.1, end_s + 0.3


@pytest.mark.parametrize("voice", VOICES, ids=lambda v: v.name)
@pytest.mark.parametrize("words", [["stop"], ["rob", "stop"]])
def test_every_robots_voice_is_heard_within_three_tenths_of_a_second_and_does_not_pass_for_talk(
    voice: Voice, words: list[str]
) -> None:
    sound = at_level(said([words], voice), -30.0)
    assert highest(heard(sound), *in_time(sound)) >= HOLD_PROBABILITY
    assert call(heard(sound)) >= HOLD_PROBABILITY


@pytest.mark.parametrize("dbfs", [-45.0, -20.0, 0.0, 12.0])
def test_it_is_heard_from_faint_to_clipped(dbfs: float) -> None:
    sound = at_level(said([["stop"]], voice_named("wren")), dbfs)
    assert highest(heard(sound), *in_time(sound)) >= HOLD_PROBABILITY
    assert call(heard(sound)) >= HOLD_PROBABILITY


@pytest.mark.parametrize(
    "change", [{"rate": 0.6, "f0_hz": 260.0, "tilt_hz": 6000.0}, {"formant_scale": 1.3}, {"rate": 1.3}]
)
def test_it_is_heard_from_who_calls_from_a_child_and_from_who_is_in_a_hurry(change: dict[str, float]) -> None:
    sound = at_level(said([["stop"]], replace(VOICES[1], **change)), -30.0)
    assert highest(heard(sound), *in_time(sound)) >= HOLD_PROBABILITY


@pytest.mark.parametrize("over_db", [0.0, 6.0, 12.0, 20.0, 30.0])
def test_it_is_heard_over_a_talking_robot(over_db: float) -> None:
    talk = at_level(said(SENTENCE, voice_named("oak")), -35.0)
    word = at_level(said([["stop"]], voice_named("lark")), -35.0 + over_db)
    at = SAMPLE_RATE_HZ
    mixed = talk.copy()
    mixed[at : at + len(word)] += word
    since_s, until_s = in_time(word, 1.5 + at / SAMPLE_RATE_HZ)
    assert highest(heard(mixed), since_s, until_s) >= HOLD_PROBABILITY
    assert highest(heard(talk)) < HOLD_PROBABILITY


@pytest.mark.parametrize("words", ["i have stopped", "top", "shop", "up", "foxtrot", "stock", "move forward"])
def test_what_sounds_like_it_is_not_taken_for_it(words: str) -> None:
    for voice in VOICES[:4]:
        assert call(heard(at_level(said([words.split()], voice), -30.0))) < ACCEPT_PROBABILITY


@settings(max_examples=5, deadline=None)
@given(st.floats(-60.0, 20.0))
def test_the_level_of_the_microphone_does_not_count(gain_db: float) -> None:
    energies = energies_of(heard(at_level(said([["stop"]], VOICES[0]), -30.0)))
    factor = np.float32(10.0 ** (gain_db / 10.0))
    nets = KeywordNet(weights()), KeywordNet(weights())
    chunks = energies[: len(energies) // CHUNK_FRAMES * CHUNK_FRAMES].reshape(-1, CHUNK_FRAMES, N_BANDS)
    plain, gained = (
        [net.posteriors(c * f).word for c in chunks] for net, f in zip(nets, (np.float32(1.0), factor), strict=True)
    )
    if gain_db >= 0.0:  # else the faintest of it falls below the floor of the front end
        np.testing.assert_allclose(gained, plain, atol=1e-3)
    assert max(gained) > HOLD_PROBABILITY


def test_a_chunk_at_a_time_is_what_convolutions_of_the_whole_give() -> None:
    rng = np.random.default_rng(3)
    energies = np.exp(rng.normal(-8.0, 2.0, (50, CHUNK_FRAMES, N_BANDS))).astype(np.float32)
    net = KeywordNet(weights())
    told = [net.posteriors(chunk) for chunk in energies]
    levels = InputNormaliser()
    rows = np.concatenate([levels.normalised(chunk) for chunk in energies]).astype(np.float64)
    steps = [(KERNEL_SIZES[0], 2, 1), (KERNEL_SIZES[1], 2, 1), *((KERNEL_SIZE, 1, gap) for gap in DILATIONS)]
    for number, ((matrix, offsets), (size, step, gap)) in enumerate(zip(weights().layers, steps, strict=True)):
        before = (size - 1) * gap + 1 - step
        padded = np.pad(rows, ((before, 0), (0, 0)))
        ends = range(before + step - 1, len(padded), step)
        seen = np.stack([padded[[end - k * gap for k in range(size - 1, -1, -1)]].ravel() for end in ends])
        found = np.maximum(seen @ matrix + offsets, 0.0)
        rows = found if number < len(KERNEL_SIZES) else rows + found
    logits = weights().slopes * (rows @ weights().out[0] + weights().out[1]) + weights().intercepts
    np.testing.assert_allclose(told, 1.0 / (1.0 + np.exp(-logits)), atol=1e-4)


def test_the_weights_are_small_and_say_where_they_come_from() -> None:
    assert WEIGHTS.stat().st_size <= 220_000
    with np.load(WEIGHTS) as file:
        assert all(part in str(file["notes"]) for part in ("takes", "seed", "validation"))


class Scripted:
    """Posteriors as they come, of the word and of a call."""

    def __init__(self, *probabilities: float | tuple[float, float]) -> None:
        self._probabilities = [Posteriors(*(c if isinstance(c, tuple) else (c, c))) for c in probabilities]

    def posteriors(self, _energies: np.ndarray) -> Posteriors:
        return self._probabilities.pop(0)


def words_of(*probabilities: float | tuple[float, float]) -> list[Detection | None]:
    spotter = KeywordSpotter(Scripted(*probabilities))
    silence = np.full((CHUNK_FRAMES, N_BANDS), 1e-7, np.float32)
    chunks = (Chunk(k * CHUNK_FRAMES, silence, False) for k in range(25, 25 + len(probabilities)))
    return [spotter.push(chunk) for chunk in chunks]


def test_a_word_is_told_when_it_is_possible_and_again_when_it_is_surer() -> None:
    told = words_of(HOLD_PROBABILITY, 0.0, HOLD_PROBABILITY + 0.2, HOLD_PROBABILITY + 0.1, 0.0)
    assert [word is not None for word in told] == [False, False, True, True, False]
    first, surer = told[2:4]
    assert first is not None
    assert surer is not None
    assert first[:2] == surer[:2]
    assert (first.probability, surer.probability) == (HOLD_PROBABILITY, HOLD_PROBABILITY + 0.1)
    assert first.end == (28 * CHUNK_FRAMES - DELAY_FRAMES) * HOP_SAMPLES


def test_that_it_was_a_call_is_told_of_a_word_after_its_end_and_of_nothing_else() -> None:
    wait = [(0.0, 0.0)] * 9
    told = [word for word in words_of((0.9, 0.3), (0.9, 0.3), *wait, (0.0, 0.8), (0.0, 0.8)) if word is not None]
    assert [(word.probability, word.call) for word in told] == [(0.9, 0.3), (0.9, 0.8)]
    assert words_of((0.0, 0.9), (0.0, 0.9)) == [None] * 2
    late = [(0.0, 0.0)] * (DECISION_FRAMES // CHUNK_FRAMES)
    assert words_of((0.9, 0.3), (0.9, 0.3), *late, (0.0, 0.8), (0.0, 0.8))[2:] == [None] * (len(late) + 2)


def test_what_shows_for_one_column_only_is_no_word() -> None:
    assert words_of(1.0, *[0.0] * SMOOTHING_COLUMNS, 1.0, 0.0) == [None] * (SMOOTHING_COLUMNS + 3)


def test_another_word_may_follow_at_once() -> None:
    gap = [0.0] * (REFRACTORY_FRAMES // CHUNK_FRAMES)
    told = [word for word in words_of(0.9, 0.9, *gap, 0.8, 0.8) if word is not None]
    assert len({word.start for word in told}) == 2
