"""Sentences heard by their waveform, and nothing else taken for one."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.signal import resample

from hvcpd.language.graph import Arc, WordGraph
from hvcpd.ports import Samples
from hvcpd.recognition.coherent import CoherentListener
from hvcpd.recognition.paths import Coherent, Said
from tests.recognition.hisses import BOOKS, GRAPH, PAUSE, Book, spoken
from tests.recognition.way import Way

CHUNK = 640


def stream(sounds: Sequence[Samples], snr_db: float, seed: int = 1) -> Samples:
    """The sounds in white noise, with a second and more of it before and after each."""
    parts: list[Samples] = [np.zeros(32_000, np.float32)]
    for sound in sounds:
        parts += [sound, np.zeros(20_000, np.float32)]
    clean = np.concatenate(parts)
    clean = np.pad(clean, (0, -len(clean) % CHUNK))
    noise = np.random.default_rng(seed).standard_normal(len(clean)) * 0.1 * 10.0 ** (-snr_db / 20.0)
    return np.asarray(clean + noise, np.float32)


def heard(
    sound: Samples, listener: CoherentListener | None = None, first: int = 0, speech: bool = True
) -> list[Coherent]:
    listener = listener or CoherentListener(GRAPH, tuple(BOOKS.values()))
    found = []
    for at in range(0, len(sound) // CHUNK * CHUNK, CHUNK):
        found += listener.push(first + at, sound[at : at + CHUNK], speech)
    return found


def texts(found: Sequence[Coherent]) -> list[str]:
    return [" ".join(word.word for word in sentence.words) for sentence in found]


@pytest.mark.parametrize("snr_db", [10.0, 0.0, -10.0, -15.0])
@pytest.mark.parametrize("voice", sorted(BOOKS))
def test_sentences_are_heard_in_noise_that_drowns_them(snr_db: float, voice: str) -> None:
    said = ["hi rob, water lily", "hi bot, stop", "hi bot, water rose", "hi rob"]
    found = heard(stream([spoken(text, voice) for text in said], snr_db))
    assert texts(found) == [text.replace(",", "") for text in said]
    assert all(sentence.sure and sentence.voice == voice for sentence in found)


def test_words_are_told_where_they_are() -> None:
    [sentence] = heard(stream([spoken("hi rob, water rose")], 0.0))
    assert sentence.words[0].start == pytest.approx(32_000, abs=2)
    assert sentence.words[-1].end == pytest.approx(32_000 + len(spoken("hi rob, water rose")), abs=4)
    assert all(a.start < b.start for a, b in zip(sentence.words, sentence.words[1:], strict=False))


@pytest.mark.parametrize("ppm", [-300, 300])
def test_the_speakers_clock_may_be_another(ppm: int) -> None:
    sound = spoken("hi rob, water rose")
    moved = np.asarray(resample(sound, round(len(sound) * (1 + ppm * 1e-6))), np.float32)
    assert texts(heard(stream([moved], -5.0))) == ["hi rob water rose"]


def test_a_sentence_is_told_soon_after_its_end() -> None:
    sound = stream([spoken("hi rob, water rose"), spoken("hi rob")], 0.0)
    ends = [32_000 + len(spoken("hi rob, water rose"))]
    ends.append(ends[0] + 20_000 + len(spoken("hi rob")))
    found = []
    listener = CoherentListener(GRAPH, tuple(BOOKS.values()))
    for at in range(0, len(sound), CHUNK):
        found += [(at + CHUNK, sentence) for sentence in listener.push(at, sound[at : at + CHUNK], True)]
    told = [at - end for (at, _), end in zip(found, ends, strict=True)]
    assert told[0] <= 2 * CHUNK  # nothing can follow
    assert told[1] <= 0.45 * 16_000  # "hi rob, water ..." could


def test_silence_noise_and_strange_talk_are_no_sentence() -> None:
    strange = [spoken(text, "willow")[::-1].copy() for text in ("hi rob, water lily", "hi bot, stop")]
    assert heard(stream([], 0.0)) == []
    assert heard(stream(strange, 10.0)) == []
    assert heard(np.zeros(64_000, np.float32)) == []


def test_half_a_sentence_is_none() -> None:
    sound = spoken("hi rob, water rose")
    rose = len(BOOKS["oak"].said("rose", 2)[1].samples)
    assert heard(stream([sound[: -rose - 1000]], 0.0)) == []


def test_a_sentence_that_goes_on_with_a_spoilt_word_is_not_sure() -> None:
    whole, cut = spoken("hi rob, water rose"), spoken("hi rob")
    spoilt = whole.copy()
    spoilt[len(cut) + PAUSE + 3600 :] = (
        np.random.default_rng(8).standard_normal(len(whole) - len(cut) - PAUSE - 3600) / 20
    )
    found = heard(stream([spoilt], 10.0))
    assert all(not sentence.sure for sentence in found)
    assert texts(heard(stream([cut], 10.0))) == ["hi rob"]


def test_a_sentence_is_not_taken_for_its_end() -> None:
    """ "stop" alone is a sentence too, and has another pitch there, except where "all" only precedes it."""
    assert texts(heard(stream([spoken("hi bot, stop"), spoken("all, stop"), spoken("stop")], 0.0))) == [
        "hi bot stop",
        "all stop",
        "stop",
    ]


def test_a_faint_sentence_does_not_end_what_another_voice_has_begun() -> None:
    first, second = spoken("hi rob", "oak"), spoken("hi bot, water lily", "willow")
    both = np.pad(first, (0, len(second) - 4000))
    both[len(first) - 4000 :] += second
    assert texts(heard(stream([both], -14.0))) == ["hi rob", "hi bot water lily"]


def test_a_first_word_that_went_unnoticed_is_found_in_the_end() -> None:
    """The listener knows its noise only when the first word is half over."""
    sound = stream([spoken("all, who is here")], 5.0)[32_000 - 1600 :]
    sound[:1600] = np.random.default_rng(5).standard_normal(1600) * 0.05
    assert texts(heard(sound)) == ["all who is here"]
    assert texts(heard(stream([spoken("who is here")], 5.0))) == ["who is here"]


@pytest.mark.parametrize("text", ["stop", "who is here", "all, stop"])
def test_what_begins_without_a_greeting_is_noticed_where_nobody_seems_to_speak(text: str) -> None:
    assert texts(heard(stream([spoken(text)], -3.0), speech=False)) == [text.replace(",", "")]


def test_two_words_that_sound_alike_are_not_sure() -> None:
    class Twins(Book):
        def said(self, word: str, third: int) -> Sequence[Said]:
            return super().said("rose" if word == "lily" else word, third)

    [sentence] = heard(stream([spoken("hi rob, water rose")], 0.0), CoherentListener(GRAPH, (Twins("oak"),)))
    assert not sentence.sure
    assert min(word.probability for word in sentence.words) < 0.5


def test_what_follows_tells_two_words_that_sound_alike_apart() -> None:
    """ "water" and "all" sound the same here, but after "all" no lily is named."""
    graph = WordGraph(
        n_nodes=6,
        arcs=(Arc(0, 1, "hi"), Arc(1, 2, "water"), Arc(1, 4, "all"), Arc(2, 3, "lily"), Arc(4, 5, "stop")),
        start=0,
        finals=frozenset({3, 5}),
        pauses=frozenset(),
    )

    class Twins(Book):
        def said(self, word: str, third: int) -> Sequence[Said]:
            return super().said("water" if word == "all" else word, third)

    book = Twins("oak")
    found = heard(
        stream([spoken(text, book=book) for text in ("hi water lily", "hi all stop")], 0.0),
        CoherentListener(graph, (book,)),
    )
    assert texts(found) == ["hi water lily", "hi all stop"]
    assert all(sentence.sure for sentence in found)


@pytest.mark.parametrize("said", ["lily", "rose"])
def test_a_word_that_is_not_over_may_be_the_right_one(said: str) -> None:
    """ "lily" resembles the beginning of "rose", which is longer and so is compared later."""

    class Alike(Book):
        def said(self, word: str, third: int) -> Sequence[Said]:
            ways = super().said(word, third)
            if word != "rose":
                return ways
            longer = []
            for way, short in zip(ways, super().said("lily", third), strict=True):
                sound = np.concatenate([way.samples, way.samples[:4000]])
                sound[: len(short.samples)] = 0.7 * short.samples + 0.3 * sound[: len(short.samples)]
                longer.append(Way(sound, way.final, way.lead, way.advance + 4000))
            return longer

    book = Alike("oak")
    found = heard(stream([spoken(f"hi rob, water {said}", book=book)], 20.0), CoherentListener(GRAPH, (book,)))
    assert texts(found) == [f"hi rob water {said}"]


def test_what_was_before_a_gap_does_not_count() -> None:
    sound = stream([spoken("hi rob, water rose")], 0.0)
    listener = CoherentListener(GRAPH, tuple(BOOKS.values()))
    cut = 38_400
    assert heard(sound[:cut], listener) == []
    assert heard(sound[cut:], listener, first=cut + 16_000) == []


def test_it_hears_nothing_until_it_is_prepared() -> None:
    books = {"oak": Book("oak")}
    listener = CoherentListener(GRAPH, tuple(books.values()), ready=False)
    sound = stream([spoken("hi rob")], 0.0)
    assert heard(sound, listener) == []
    listener.prepare(lambda: False)
    assert not books["oak"].prepared
    assert heard(sound, listener) == []
    listener.prepare(lambda: True)
    assert texts(heard(sound, listener)) == ["hi rob"]


def test_memory_is_given_back_when_nobody_speaks() -> None:
    books = {"oak": Book("oak")}
    listener = CoherentListener(GRAPH, tuple(books.values()))
    sound = stream([spoken("hi rob")], 0.0)
    heard(sound, listener)
    quiet = stream([np.zeros(200_000, np.float32)], 0.0, seed=2)
    for at in range(0, len(quiet), CHUNK):
        listener.push(len(sound) + at, quiet[at : at + CHUNK], False)
    assert books["oak"].forgot == 1


@given(st.integers(0, 2**31), st.floats(-20.0, 5.0))
@settings(max_examples=3, deadline=None)
def test_what_is_told_was_said(seed: int, snr_db: float) -> None:
    said = ["hi rob, water lily", "hi bot, stop"]
    found = heard(stream([spoken(text) for text in said], snr_db, seed))
    assert {text for text, each in zip(texts(found), found, strict=True) if each.sure} <= {
        "hi rob water lily",
        "hi bot stop",
    }
