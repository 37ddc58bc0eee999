"""The sentence that explains most of a sound, whatever channel it came through."""

from __future__ import annotations

import random
from collections.abc import Sequence
from dataclasses import replace
from itertools import product
from pathlib import Path

import numpy as np
import pytest

from hvcpd.assembly.make import make_waveform_books
from hvcpd.assembly.sound import make_phrasebook, make_sound
from hvcpd.config.task_file import load_tasks
from hvcpd.config.tasks import default_tasks_path
from hvcpd.language.graph import Arc, WordGraph, lengths_of
from hvcpd.language.phrasebook import Phrasebook
from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from hvcpd.recognition.channel.estimation import WhitenedSound
from hvcpd.recognition.channel.path import RenderedVoice, may_have, thirds_of
from hvcpd.recognition.channel.recogniser import LEAST_WORD_FIT, ChannelRecogniser, worst_fit
from hvcpd.recognition.channel.search import ROBOT_SCORE, ChannelSearch, ChannelSegment
from tests.recognition.hisses import BOOKS, GRAPH, Book, scene, spoken, through_a_room

NAMES = ("Rob", "Bot")
AT = 20_000
Team = tuple[Phrasebook, Sequence[RenderedVoice]]


@pytest.fixture(scope="module")
def team(units: Path) -> Team:
    tasks = load_tasks(default_tasks_path())
    book = make_phrasebook(NAMES, ("alpha",), replace(tasks, tasks=tasks.tasks[:2], other_tasks=()))
    return book, make_waveform_books(book, NAMES, make_sound(None, units))[: len(NAMES)]  # at their usual rate


def sentence(book: Phrasebook, units: Path, seed: int) -> tuple[tuple[str, ...], Samples]:
    """A random one, through a room, a loudspeaker that has 300 Hz to 4.5 kHz, and by a clock 300 ppm off."""
    utterance = book.sample(random.Random(seed))
    phrases = book.phrases(utterance)
    said = make_sound(None, units).speaker_of(utterance.speaker or "Rob").render(phrases)
    heard = through_a_room(said, seed)
    spectrum = np.fft.rfft(heard, len(heard) + 4000)
    hz = np.fft.rfftfreq(len(heard) + 4000, 1 / SAMPLE_RATE_HZ)
    limited = np.fft.irfft(np.where((hz < 300.0) | (hz > 4500.0), 0.0, spectrum))[: len(heard)]
    off = np.interp(np.arange(0, len(limited) - 1, 1 + 3e-4), np.arange(len(limited)), limited)
    return tuple(w for phrase in phrases for w in phrase), np.asarray(off / np.sqrt(np.mean(off**2)), np.float32)


def test_a_sentence_is_found_at_0_db_through_a_room_by_another_clock(team: Team, units: Path) -> None:
    book, books = team
    words, heard = sentence(book, units, 5)
    sound = scene(AT + len(heard) + 12_000, (AT, heard), noise=1.0)
    sentences = ChannelSearch(book.robots_graph, books)
    weighted = WhitenedSound(sound[8000:], sound[:8000])
    best = sentences.paths(weighted)[0]
    assert best.words == words
    assert sentences.is_whole(best)
    assert best.score > ROBOT_SCORE
    assert worst_fit(weighted, best) > LEAST_WORD_FIT
    assert abs(best.starts[0] + best.delay - (AT - 8000)) < 160


def test_of_a_sentence_cut_off_in_the_middle_nothing_is_told(team: Team, units: Path) -> None:
    book, books = team
    words, heard = sentence(book, units, 5)
    sound = scene(AT + len(heard) // 2 + 12_000, (AT, heard[: len(heard) // 2]), noise=0.5)
    look = ChannelRecogniser(book.robots_graph, books).search(ChannelSegment(sound, 0, AT))
    assert (look.sentences, look.robot) == ((), True)
    assert len(words) > 4


SEARCH = ChannelSearch(GRAPH, tuple(BOOKS.values()))
SENTENCES = ["hi rob, water rose", "hi bot, stop", "all, who is here", "who is here", "hi rob", "stop"]


def weighted(sound: Samples) -> WhitenedSound:
    return WhitenedSound(sound[8000:], sound[:8000])


@pytest.mark.parametrize(("text", "voice"), list(zip(SENTENCES, 3 * list(BOOKS), strict=True)))
def test_each_sentence_is_found_at_its_place_in_its_voice(text: str, voice: str) -> None:
    heard = through_a_room(spoken(text, voice), len(text))
    sound = weighted(scene(AT + len(heard) + 9000, (AT, heard), noise=1.0))
    found = SEARCH.paths(sound)
    best = found[0]
    assert (" ".join(best.words), best.book.voice) == (text.replace(",", ""), voice)
    assert SEARCH.is_whole(best)
    assert abs(best.starts[0] + best.delay - (AT - 8000)) <= 32
    assert worst_fit(sound, best) > 0.8
    assert [path.score for path in found] == sorted((path.score for path in found), reverse=True)
    # What is heard of it by the response is nearly all that there is beside the noise.
    there = np.zeros(sound.n, np.float32)
    there[AT - 8000 : AT - 8000 + len(heard)] = 0.05 * heard
    assert np.linalg.norm(best.received(sound.n) - there) < 0.5 * np.linalg.norm(there)


def test_words_are_sought_only_at_pitches_that_a_sentence_of_some_length_may_have() -> None:
    every = [thirds_of(n) for n in range(1, 40)]
    for n in range(1, 6):
        for thirds in product((0, 1, 2), repeat=n):
            for lengths in (1, 2, 0b1010, 1 << 5, (1 << 40) - 1):
                there = (sentence for sentence in every if lengths >> max(len(sentence) - n, 0) & 1)
                expected = any(len(each) >= n and each[:n] == thirds for each in there)
                assert may_have(thirds, lengths) == expected


def test_after_how_many_words_a_sentence_may_end_is_known_at_every_node() -> None:
    lengths = lengths_of(GRAPH)
    assert lengths[GRAPH.start] == sum({1 << len(text.split()) for text in SENTENCES})
    assert all(lengths[node] & 1 for node in GRAPH.finals)
    assert all((1 << length.bit_length()) <= 1 << 5 for length in lengths)
    loop = replace(GRAPH, arcs=(*GRAPH.arcs, Arc(next(iter(GRAPH.finals)), GRAPH.start, "and")))
    assert lengths_of(loop)[GRAPH.start].bit_length() > 20


@pytest.mark.parametrize("at", [AT, AT + 30_000])
@pytest.mark.parametrize("text", ["hi rob, water rose", "all, who is here"])
def test_a_sentence_is_found_wherever_it_is(text: str, at: int) -> None:
    heard = through_a_room(spoken(text), 1)
    sound = weighted(scene(at + len(heard) + 9000, (at, heard), noise=1.0))
    assert SEARCH.paths(sound)[0].words == tuple(text.replace(",", "").split())


def test_sentences_with_a_greeting_are_found_as_among_all() -> None:
    heard = through_a_room(spoken("hi rob, water rose"), 1)
    sound = weighted(scene(AT + len(heard) + 9000, (AT, heard), noise=1.0))
    greeted, all_paths = SEARCH.paths(sound, greeted=True), SEARCH.paths(sound)
    assert {path.words[0] for path in greeted} == {"hi"}
    assert {path.words[0] for path in all_paths} > {"hi"}
    assert greeted[0].words == all_paths[0].words == ("hi", "rob", "water", "rose")
    assert greeted[0].score == pytest.approx(all_paths[0].score)


def test_the_late_echoes_that_a_sentence_leaves_are_no_reason_to_seek_another() -> None:
    direct = through_a_room(spoken("hi rob, water rose"), 1)
    heard = np.pad(direct, (0, 8000))
    for number in range(1, 6):  # echoes after 94 ms and more: no response of 32 ms explains them
        at = 1500 * number
        heard[at : at + len(direct)] += 0.5 ** (number + 1) * direct
    sound = scene(AT + len(heard) + 9000, (AT, heard), noise=0.03)
    best = SEARCH.paths(weighted(sound))[0]
    left = np.concatenate([sound[:8000], sound[8000:] - best.received(len(sound) - 8000)])
    assert SEARCH.paths(weighted(left), reported=[best]) == []
    other = through_a_room(spoken("hi bot, stop", "willow"), 2)
    left[AT + 3000 : AT + 3000 + len(other)] += 0.02 * other
    assert SEARCH.paths(weighted(left), reported=[best])[0].words == ("hi", "bot", "stop")


def test_a_word_that_was_not_said_does_not_fit() -> None:
    lily = replace(GRAPH, arcs=tuple(arc for arc in GRAPH.arcs if arc.word != "rose"))
    heard = through_a_room(spoken("hi rob, water rose"), 1)
    sound = weighted(scene(AT + len(heard) + 9000, (AT, heard), noise=0.5))
    search = ChannelSearch(lily, tuple(BOOKS.values()))
    wrong = [path for path in search.paths(sound) if path.words == ("hi", "rob", "water", "lily")]
    assert all(worst_fit(sound, path) < LEAST_WORD_FIT for path in wrong)
    right = [path for path in search.paths(sound) if path.words == ("hi", "rob", "water")]
    assert max(worst_fit(sound, path) for path in right) > 0.8


@pytest.mark.parametrize("seed", range(2))
def test_nothing_is_sure_in_noise(seed: int) -> None:
    sound = weighted(scene(40_000, seed=seed))
    assert all(path.score < ROBOT_SCORE for path in SEARCH.paths(sound))


@pytest.mark.parametrize("seed", range(2))
def test_nothing_is_sure_in_a_voice_that_nobody_has(seed: int) -> None:
    stranger = type(BOOKS["oak"])(f"elm {seed}")
    heard = through_a_room(spoken("hi rob, water rose", book=stranger), seed)
    sound = weighted(scene(AT + len(heard) + 9000, (AT, heard)))
    assert all(path.score < ROBOT_SCORE for path in SEARCH.paths(sound))


@pytest.mark.parametrize("others", [frozenset[str](), frozenset({"bot"})])
def test_after_i_am_no_voice_says_the_name_of_a_robot_with_another(others: frozenset[str]) -> None:
    graph = WordGraph(
        4, (Arc(0, 1, "i"), Arc(1, 2, "am"), Arc(2, 3, "rob"), Arc(2, 3, "bot")), 0, frozenset({3}), frozenset()
    )
    book = Book("oak", others)
    heard = through_a_room(spoken("i am bot", book=book), 3)
    found = ChannelSearch(graph, [book]).paths(weighted(scene(AT + len(heard) + 9000, (AT, heard))))
    assert (("i", "am", "bot") in {path.words for path in found}) == (not others)


def test_each_voice_knows_all_names_of_robots_with_others_and_the_listeners_own(team: Team, units: Path) -> None:
    book, _ = team
    sound = make_sound(None, units)
    assert [each.others for each in make_waveform_books(book, ("Bot",), sound)] == 2 * [{"rob"}]
    alike = replace(sound, voices=dict.fromkeys(("rob", "bot"), sound.voice_of("Rob")))
    assert [each.others for each in make_waveform_books(book, NAMES, alike)] == 2 * [set()]
