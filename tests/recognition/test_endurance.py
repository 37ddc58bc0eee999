"""Long streams, gaps and blocks of any size."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hvcpd.recognition.events import Event, Garbled, Recognised
from hvcpd.recognition.stream import CHUNK_FRAMES, CHUNK_SAMPLES, FrameStream
from hvcpd.recognition.template_recogniser import TemplateRecogniser
from tests.recognition.signals import graph, in_noise, sentence, templates

pytestmark = pytest.mark.slow

RATE = 16_000
DAY = 24 * 3600 * RATE
"""Samples; 8.64 million frames."""


def recogniser() -> TemplateRecogniser:
    return TemplateRecogniser(graph(), templates())


def texts(events: list[Event]) -> list[str]:
    return [" ".join(e.words) if isinstance(e, Recognised) else "garbled" for e in events]


def array_bytes(thing: object, seen: set[int]) -> int:
    """Bytes of all numpy arrays that `thing` holds, however deep."""
    if id(thing) in seen:
        return 0
    seen.add(id(thing))
    if isinstance(thing, np.ndarray):
        return thing.nbytes
    if isinstance(thing, dict):
        return sum(array_bytes(part, seen) for part in thing.values())
    if isinstance(thing, list | tuple):
        return sum(array_bytes(part, seen) for part in thing)
    return array_bytes(vars(thing), seen) if hasattr(thing, "__dict__") else 0


def test_memory_does_not_grow_with_time() -> None:
    """The same minute of speech and noise again and again, then a day's gap: no array has grown."""
    parts = [in_noise(sentence(t), 0.5, 1.0, -45.0, seed) for seed, t in enumerate(["hi rob, stop", "rose water rob"])]
    minute = np.concatenate([*parts, in_noise(np.zeros(15 * RATE, np.float32), noise_dbfs=-45.0, seed=7)])
    r = recogniser()
    r.push(minute)
    first = array_bytes(r, set())
    for _ in range(4):
        events = r.push(minute)
        assert "hi rob stop" in texts(events)
    assert array_bytes(r, set()) <= first + 4096, "features at hand differ by a few rows"
    r.lost(DAY)
    r.push(minute)
    assert array_bytes(r, set()) <= first + 4096


def test_a_sentence_after_a_day_is_heard_where_it_was_said() -> None:
    r = recogniser()
    assert r.lost(DAY) == []
    sound = in_noise(sentence("hi bot, water rose"), noise_dbfs=-45.0)
    [event] = r.push(sound)
    fresh = recogniser()
    [expected] = fresh.push(sound)
    assert isinstance(event, Recognised)
    assert isinstance(expected, Recognised)
    assert event.words == expected.words
    assert event.start_sample == expected.start_sample + DAY
    assert [s.end_sample - DAY for s in event.spans] == [s.end_sample for s in expected.spans]
    assert event.confidence == pytest.approx(expected.confidence, abs=1e-6)


@pytest.mark.parametrize("text", ["hi rob, water green", "hi bot, stop"])
@pytest.mark.parametrize("lost", [0, 400, 4_800])
def test_a_gap_garbles_the_utterance_that_it_falls_into(text: str, lost: int) -> None:
    speech = sentence(text)
    sound = in_noise(speech)
    reports = []
    for at in range(RATE + 1600, RATE + len(speech) - 1600, 2400):
        r = recogniser()
        events = r.push(sound[:at]) + r.lost(lost) + r.push(sound[at + lost :]) + r.flush()
        reports.append(texts(events))
        assert set(reports[-1]) <= {"garbled"}, f"a gap at {at - RATE} of {len(speech)}"
        assert all(e.end_sample <= len(sound) for e in events)
    assert sum(bool(report) for report in reports) >= 0.7 * len(reports), "reported, not only ignored"


def test_after_a_gap_everything_is_heard_where_it_was_said() -> None:
    r = recogniser()
    before = in_noise(sentence("hi rob, stop"), noise_dbfs=-50.0)
    after = in_noise(sentence("hi bot, water rose"), noise_dbfs=-50.0, seed=2)
    events = r.push(before) + r.lost(12_345) + r.push(after)
    assert texts(events) == ["hi rob stop", "hi bot water rose"]
    assert events[1].start_sample == pytest.approx(len(before) + 12_345 + RATE, abs=640)


def test_a_sentence_right_after_a_gap_may_be_the_end_of_another() -> None:
    r = recogniser()
    events = r.push(in_noise(sentence("hi rob, water"), 1.0, 0.0)) + r.lost(1600)
    events += r.push(in_noise(sentence("stop"), 0.1, 1.0, seed=2)) + r.flush()
    assert {type(e) for e in events} == {Garbled}


def test_nobody_loses_less_than_nothing() -> None:
    with pytest.raises(ValueError, match="-1"):
        recogniser().lost(-1)


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 3000), st.integers(0, 40_000), st.integers(880, 3000))
def test_lost_sound_is_as_masked_silence(before: int, lost: int, after: int) -> None:
    sound = np.random.default_rng(before).standard_normal(before + after).astype(np.float32) * 0.1
    told, masked = FrameStream(), FrameStream()
    chunks = [*told.push(sound[:before], False), *told.lose(lost), *told.push(sound[before:], False)]
    expected = [*masked.push(sound[:before], False)]
    expected += [*masked.push(np.zeros(lost, np.float32), True), *masked.push(sound[before:], False)]
    assert told.next_frame == masked.next_frame
    by_frame = {c.first_frame: c for c in expected}
    assert all(chunk.first_frame % CHUNK_FRAMES == 0 for chunk in chunks)
    for chunk in chunks:
        same = by_frame.pop(chunk.first_frame)
        assert chunk.masked == same.masked
        assert (chunk.energies == same.energies).all()
    assert all(c.masked for c in by_frame.values()), "only whole chunks of the gap are left out"
    assert (told.rest().energies == masked.rest().energies).all()


def test_a_day_is_lost_in_no_time() -> None:
    stream = FrameStream()
    chunks = list(stream.lose(DAY))
    assert len(chunks) < 6
    assert stream.next_frame * 160 == pytest.approx(DAY, abs=2 * CHUNK_SAMPLES)


@settings(max_examples=6, deadline=None)
@given(st.lists(st.sampled_from([1, 7, 160, 399, 641, 20_000]), min_size=1, max_size=12), st.integers(0, 2000))
def test_blocks_of_any_size_make_no_difference_around_a_gap(sizes: list[int], lost: int) -> None:
    first, second = in_noise(sentence("hi bot, water green"), 0.5, 0.1), in_noise(sentence("hi rob"), 0.6, 0.8, seed=3)
    whole = recogniser()
    expected = whole.push(first) + whole.lost(lost) + whole.push(second)
    r, events = recogniser(), []
    for k, part in enumerate((first, second)):
        at = 0
        for size in sizes:
            events += r.push(part[at : at + size])
            at += size
        events += r.push(part[at:])
        events += r.lost(lost) if k == 0 else []
    assert events == expected


def test_single_samples_and_one_block_of_ten_minutes_give_the_same() -> None:
    sound = in_noise(sentence("stop"), 0.5, 0.5, -50.0)
    one_by_one = recogniser()
    events = [e for i in range(len(sound)) for e in one_by_one.push(sound[i : i + 1])]
    assert texts(events) == ["stop"]
    long = np.zeros(600 * RATE, np.float32)
    long[: len(sound)] = sound
    long[-RATE:] = in_noise(np.zeros(RATE, np.float32), 0.0, 0.0, -30.0)
    assert recogniser().push(long) == events


@pytest.mark.parametrize("damage", ["nan", "inf", "full scale", "direct current", "digital silence"])
def test_hearing_recovers_from_a_second_of_rubbish(damage: str) -> None:
    rubbish = {
        "nan": np.full(RATE, np.nan),
        "inf": np.full(RATE, -np.inf),
        "full scale": np.sign(np.sin(np.arange(RATE) * 0.3)),
        "direct current": np.full(RATE, 0.9),
        "digital silence": np.zeros(RATE),
    }[damage].astype(np.float32)
    noise = in_noise(np.zeros(2 * RATE, np.float32), 0.0, 0.0, -50.0)
    sound = [noise, rubbish, noise, in_noise(sentence("hi rob, water rose"), 0.5, 0.8, -50.0, seed=4)]
    events = recogniser().push(np.concatenate(sound))
    assert [t for t in texts(events) if t != "garbled"] == ["hi rob water rose"]
