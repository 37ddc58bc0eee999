"""The sentence whose phones fit best."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hvcpd.language.graph import Arc, WordGraph
from hvcpd.people.phones import PHONES, CtcSearch

SAID = {"see": [("S", "IY")], "as": [("AE", "Z"), ("AH", "Z")], "zoos": [("Z", "UW", "Z")], "is": [("IH", "Z")]}
ARCS = (Arc(0, 1, "see"), Arc(0, 1, "as"), Arc(1, 2, "zoos"), Arc(1, 2, "is"), Arc(0, 2, "is"))
GRAPH = WordGraph(3, ARCS, 0, frozenset((2,)), frozenset())
NONE = len(PHONES)


def search() -> CtcSearch:
    return CtcSearch(GRAPH, SAID.__getitem__)


def loss(search: CtcSearch, log_posteriors: np.ndarray, *words: str) -> float:
    fit = search.fit(log_posteriors, words)
    assert fit is not None
    return fit.loss


def sentences() -> list[tuple[tuple[str, ...], list[int]]]:
    """All of the network's, as phones."""
    two = itertools.product(("see", "as"), ("zoos", "is"))
    return [
        (words, [PHONES.index(phone) for said in way for phone in said])
        for words in [*two, ("is",)]
        for way in itertools.product(*(SAID[word] for word in words))
    ]


def best_path(log_posteriors: np.ndarray, phones: list[int]) -> float:
    """The best row of frames that is these phones once repeats and then gaps are left out, by trying all."""
    symbols = sorted({*phones, NONE})
    scores = [-np.inf]
    for row in itertools.product(symbols, repeat=len(log_posteriors)):
        merged = [s for s, _ in itertools.groupby(row)]
        if [s for s in merged if s != NONE] == phones:
            scores.append(sum(log_posteriors[t, s] for t, s in enumerate(row)))
    return max(scores)


@settings(max_examples=12, deadline=None)
@given(st.integers(0, 10_000), st.integers(2, 6))
def test_it_is_the_best_of_all_paths(seed: int, n: int) -> None:
    log_posteriors = np.log(np.random.default_rng(seed).dirichlet(np.full(NONE + 1, 0.3), n) + 1e-9).astype(np.float32)
    losses: dict[tuple[str, ...], float] = {}
    for words, phones in sentences():
        # A word's last phone and the next word's first may be one, as they are when people speak.
        lost = float(log_posteriors.max(axis=1).sum()) - best_path(log_posteriors, phones)
        losses[words] = min(lost, losses.get(words, np.inf))
    found = search().best(log_posteriors)
    least = min(losses.values())
    if not np.isfinite(least):
        assert found is None
    else:
        assert found is not None
        assert found.loss <= least + 1e-3
        assert abs(loss(search(), log_posteriors, *found.words) - found.loss) < 1e-3


def heard(*phones: str) -> np.ndarray:
    """LogPosteriors of sounds that were clearly heard, a frame each; "" for none."""
    log_posteriors = np.full((len(phones), NONE + 1), -8.0, np.float32)
    for frame, phone in enumerate(phones):
        log_posteriors[frame, PHONES.index(phone) if phone else NONE] = -0.01
    return log_posteriors


def test_words_and_their_frames_are_found() -> None:
    found = search().best(heard("", "S", "", "IY", "IY", "", "", "IH", "Z", ""))
    assert found is not None
    assert found.words == ("see", "is")
    assert found.spans == ((1, 5), (7, 9))
    assert found.loss < 1e-3


def test_a_phone_said_twice_needs_a_gap() -> None:
    twice = loss(search(), heard("Z", "UW", "Z"), "zoos")
    assert twice < 1e-3
    graph = WordGraph(2, (Arc(0, 1, "zz"),), 0, frozenset((1,)), frozenset())
    doubled = CtcSearch(graph, lambda word: [("Z", "Z")])
    assert loss(doubled, heard("Z", "", "Z"), "zz") < 1e-3
    assert loss(doubled, heard("Z", "Z", "Z"), "zz") > 5.0


def test_too_little_sound_has_no_sentence() -> None:
    assert search().best(heard("Z")) is None
    assert search().best(np.zeros((0, NONE + 1), np.float32)) is None
    assert search().fit(heard("Z"), ("zoos",)) is None


def test_the_rival_is_the_best_of_all_others() -> None:
    sounds = heard("", "S", "", "IY", "", "IH", "Z", "")
    rival = search().best(sounds, without="is")
    assert rival is not None
    assert rival.words == ("see", "zoos")
    best = search().best(sounds)
    assert best is not None
    assert rival.loss > best.loss + 5.0
    # "is" alone is a sentence of the network; without the other words, it is what is left.
    assert search().best(heard("IH", "Z"), without="is") is None


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 10_000), st.integers(3, 9))
def test_the_least_loss_of_another_sentence_is_that_of_the_best_of_all_others(seed: int, n: int) -> None:
    log_posteriors = np.log(np.random.default_rng(seed).dirichlet(np.full(NONE + 1, 0.3), n) + 1e-9).astype(np.float32)
    fits, best = {words: search().fit(log_posteriors, words) for words, _ in sentences()}, search().best(log_posteriors)
    assert best is not None
    for words in fits:
        others = [fit.loss for other, fit in fits.items() if other != words and fit is not None]
        least = search().least_other_loss(log_posteriors, best, words)
        assert least == pytest.approx(min(others, default=np.inf), abs=1e-3)


def test_the_word_that_was_not_said_loses_most() -> None:
    sounds = heard("S", "IY", "", "IH", "Z", "", "T", "")
    sentence = search().fit(sounds, ("see", "zoos"))
    assert sentence is not None
    said, other = search().word_losses(sounds, sentence)
    assert said < 0.1 < 1.0 < other
    assert search().n_phones("zoos") == 3
