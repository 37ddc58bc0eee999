"""Whether all of a sentence was heard, and whether it is the end of a longer one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from hvcpd.ports import Samples
from hvcpd.recognition.channel.estimation import WhitenedSound, channel_responses
from hvcpd.recognition.channel.path import Path
from hvcpd.recognition.channel.recogniser import LEAST_WORD_FIT, is_preceded, worst_fit
from hvcpd.recognition.channel.search import ChannelSearch, ChannelSegment
from tests.recognition.hisses import BOOKS, GRAPH, fresh, scene, spoken, through_a_room
from tests.recognition.way import response

SEARCH = ChannelSearch(GRAPH, tuple(BOOKS.values()))
AT = 24_000


def heard(text: str, voice: str = "oak") -> Samples:
    return through_a_room(spoken(text, voice), 1)


def found(sound: Samples, words: str) -> tuple[WhitenedSound, Path]:
    """The path of these words that explains most."""
    weighted = WhitenedSound(sound[8000:], sound[:8000])
    paths = SEARCH.paths(weighted)
    return weighted, next(path for path in paths if path.words == tuple(words.split()) and SEARCH.is_whole(path))


@pytest.mark.parametrize("share", [1.0, 0.5])
def test_of_the_last_word_its_end_must_have_been_heard(share: float) -> None:
    whole = heard("who is here")
    n = len(spoken("who is here"))
    cut = whole.copy()
    cut[round(n - (1.0 - share) * len(spoken("here"))) :] *= float(share == 1.0)
    sound = scene(AT + len(whole) + 9000, (AT, cut), noise=0.3)
    weighted, path = found(sound, "who is here")
    assert (worst_fit(weighted, path) >= LEAST_WORD_FIT) == (share == 1.0)


def test_the_end_of_a_longer_sentence_is_not_told() -> None:
    whole = heard("all, who is here")
    begins = len(heard("all,")) // 2  # half of the first word is lost
    sound = scene(AT + len(whole) + 9000, (AT, np.where(np.arange(len(whole)) < begins, 0.0, whole)), noise=0.3)
    look = fresh().search(ChannelSegment(sound, 0, AT))
    assert all(sentence.words[0] == "all" for sentence in look.sentences)
    alone = scene(AT + len(whole) + 9000, (AT, heard("who is here")), noise=0.3)
    assert [each.words for each in fresh().search(ChannelSegment(alone, 0, AT)).sentences] == [("who", "is", "here")]


def test_what_goes_before_counts_only_in_the_same_voice() -> None:
    whole = spoken("all, who is here")
    n = len(spoken("all,"))
    search = ChannelSearch(replace(GRAPH, arcs=tuple(a for a in GRAPH.arcs if a.word != "all")), tuple(BOOKS.values()))
    for voice in BOOKS:
        said = np.concatenate([spoken("all,", voice), whole[n:]])
        sound = scene(AT + len(said) + 9000, (AT, through_a_room(said, 1)), noise=0.3)
        weighted = WhitenedSound(sound[8000:], sound[:8000])
        paths = search.paths(weighted)
        path = next(path for path in paths if path.words == ("who", "is", "here") and path.book.voice == "oak")
        assert is_preceded(weighted, path, GRAPH.words) == (voice == "oak")


def test_a_soft_word_before_a_sentence_makes_it_the_end_of_a_longer_one() -> None:
    """ "I will move back five metres", of which "will" explained 78 variances and was not heard, was an order once."""
    whole = spoken("all, who is here")
    n = len(spoken("all,"))
    search = ChannelSearch(replace(GRAPH, arcs=tuple(a for a in GRAPH.arcs if a.word != "all")), tuple(BOOKS.values()))
    for gain, preceded in ((0.0, False), (0.24, True)):
        said = np.concatenate([gain * whole[:n], whole[n:]])
        sound = scene(AT + len(said) + 9000, (AT, through_a_room(said, 1)), noise=2.0)
        weighted = WhitenedSound(sound[8000:], sound[:8000])
        path = next(path for path in search.paths(weighted) if path.words == ("who", "is", "here"))
        assert is_preceded(weighted, path, GRAPH.words) == preceded


def test_a_sentence_is_surer_than_what_is_left_where_it_is_not_known() -> None:
    whole = heard("hi rob, water rose")
    sound = scene(AT + len(whole) + 9000, (AT, whole), noise=0.3)
    weighted = WhitenedSound(sound[8000:], sound[:8000])
    paths = SEARCH.paths(weighted)
    words = ("hi", "rob", "water", "rose")
    right = fresh().evidence(weighted, paths)
    wrong = fresh().evidence(weighted, [path for path in paths if path.words != words])
    assert right is not None
    assert wrong is not None
    assert right.path.words == words
    assert right.confidence > 0.95 > 0.8 > wrong.confidence


def test_responses_solved_together_are_those_solved_alone() -> None:
    rng = np.random.default_rng(3)
    signals = rng.standard_normal((5, 4000)).astype(np.float32) * np.array([[0.01], [0.1], [1], [10], [0]], np.float32)
    spectra = np.abs(np.fft.rfft(signals, 8192)) ** 2
    own = np.fft.irfft(spectra)[:, :128].astype(np.float32)
    across = (own[:, ::-1] + 0.1 * rng.standard_normal((5, 128))).astype(np.float32)
    together = channel_responses(own, across, 64)
    for row, single, other in zip(together, own, across, strict=True):
        near = 1e-3 * max(float(np.abs(row).max()), 1e-9)
        np.testing.assert_allclose(row, response(single, other, 64), rtol=0.02, atol=near)
