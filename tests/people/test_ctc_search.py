"""The sentence whose phones fit best."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hvcpd.language.graph import Arc, WordGraph
from hvcpd.people.phones import ANY_PHONE, ANY_PHONE_COST, PHONES, CtcSearch, word_loop

SAID: dict[str, list[tuple[str, ...]]] = {
    "see": [("S", "IY")],
    "as": [("AE", "Z"), ("AH", "Z")],
    "zoos": [("Z", "UW", "Z")],
    "is": [("IH", "Z")],
}
PRONOUNCED = {**SAID, "sea": SAID["see"]}
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


def path_scores(log_posteriors: np.ndarray, phones: list[int]) -> list[float]:
    """The score of each row of frames that is these phones once repeats and then gaps are left out, by trying all."""
    symbols = sorted({*phones, NONE})
    scores = []
    for row in itertools.product(symbols, repeat=len(log_posteriors)):
        merged = [s for s, _ in itertools.groupby(row)]
        if [s for s in merged if s != NONE] == phones:
            scores.append(sum(log_posteriors[t, s] for t, s in enumerate(row)))
    return scores


@settings(max_examples=12, deadline=None)
@given(st.integers(0, 10_000), st.integers(2, 6))
def test_it_is_the_best_of_all_paths(seed: int, n: int) -> None:
    log_posteriors = np.log(np.random.default_rng(seed).dirichlet(np.full(NONE + 1, 0.3), n) + 1e-9).astype(np.float32)
    losses: dict[tuple[str, ...], float] = {}
    for words, phones in sentences():
        # A word's last phone and the next word's first may be one, as they are when people speak.
        lost = float(log_posteriors.max(axis=1).sum()) - max(path_scores(log_posteriors, phones), default=-np.inf)
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


@settings(max_examples=12, deadline=None)
@given(st.integers(0, 10_000), st.integers(2, 6))
def test_the_likelihood_is_the_sum_over_all_paths(seed: int, n: int) -> None:
    log_posteriors = np.log(np.random.default_rng(seed).dirichlet(np.full(NONE + 1, 0.3), n) + 1e-9).astype(np.float32)
    arcs = (Arc(0, 1, "see"), Arc(1, 2, "zoos"), Arc(1, 2, "is"), Arc(0, 2, "is"))
    network = CtcSearch(WordGraph(3, arcs, 0, frozenset((2,)), frozenset()), SAID.__getitem__)
    likelihoods = {
        words: sum(np.exp(score) for score in path_scores(log_posteriors, phones))
        for words, phones in sentences()
        if "as" not in words
    }
    for words, likelihood in likelihoods.items():
        assert np.exp(network.log_likelihood_of(log_posteriors, words)) == pytest.approx(likelihood, rel=1e-4)
    two = likelihoods["see", "zoos"] + likelihoods["is",]
    assert np.exp(network.log_likelihood_of(log_posteriors, ("see", "zoos"), ("is",))) == pytest.approx(two, rel=1e-4)
    whole = sum(likelihoods.values())
    assert np.exp(network.log_likelihood(log_posteriors)) == pytest.approx(whole, rel=1e-4)
    begun = whole + sum(np.exp(path_scores(log_posteriors, [PHONES.index(p) for p in ("S", "IY")])))
    begun += np.exp(log_posteriors[:, NONE].sum())  # nothing is the beginning of any sentence
    assert np.exp(network.log_likelihood(log_posteriors, beginnings=True)) == pytest.approx(begun, rel=1e-4)
    without = likelihoods["see", "zoos"]
    assert np.exp(network.log_likelihood(log_posteriors, without="is")) == pytest.approx(without, rel=1e-4)


def test_long_silence_does_not_vanish() -> None:
    """Probabilities of 3,000 frames are too small for a floating point number."""
    sounds = np.concatenate([np.full((3000, NONE + 1), -4.0, np.float32), heard("IH", "Z")])
    assert search().log_likelihood_of(sounds, ("is",)) > -13_000.0


def test_too_little_sound_has_no_likelihood() -> None:
    assert search().log_likelihood(heard("Z")) == -np.inf
    assert search().log_likelihood(np.zeros((0, NONE + 1), np.float32)) == -np.inf


def test_other_talk_is_any_words_at_a_cost_each() -> None:
    sounds = heard("Z", "UW", "Z", "", "S", "IY", "")
    assert search().log_likelihood(sounds) < -10.0
    free, costly = (word_loop(("zoos", "see", "sea"), PRONOUNCED.__getitem__, cost) for cost in (0.0, 3.0))
    assert free.log_likelihood(sounds) > -0.2
    assert free.log_likelihood(sounds) - costly.log_likelihood(sounds) == pytest.approx(6.0, abs=0.1)


def test_phones_of_a_word_are_counted_in_its_shortest_form() -> None:
    assert search().n_phones("zoos") == 3


def test_any_phone_stands_for_whichever_is_heard_and_costs_as_much_as_it_says() -> None:
    graph = WordGraph(2, (Arc(0, 1, "see"), Arc(0, 1, "who")), 0, frozenset((1,)), frozenset())
    heard = np.full((6, NONE + 1), -20.0, np.float32)
    for frame, phone in enumerate(("S", "", "IY", "", "", "")):
        heard[frame, PHONES.index(phone) if phone else NONE] = 0.0
    said = {**SAID, "who": [(ANY_PHONE,) * n for n in (2, 3)]}
    for cost, best in ((0.5, "see"), (-2.0 * ANY_PHONE_COST - 0.5, "who")):
        search = CtcSearch(graph, said.__getitem__, {"who": cost})
        found = search.best(heard)
        assert found is not None
        assert found.words == (best,)
        others = search.log_likelihood_of(heard, ["see"]) - search.log_likelihood_of(heard, ["who"])
        assert others == pytest.approx(2.0 * ANY_PHONE_COST + cost, abs=0.01)
    assert search.instead_of("see") == {"see", "who"}
    assert search.instead_of("what") == frozenset()


@pytest.mark.parametrize(("said", "n_phones"), [("S S IY IY", 2), ("S AE T IY", 4), ("S S AE AE T T IY IY", 4)])
def test_any_phone_is_one_phone_however_long_it_lasts(said: str, n_phones: int) -> None:
    """One that changed from frame to frame was a whole sentence: the name of somebody whom nobody knows."""
    heard = np.full((len(said.split()), NONE + 1), -20.0, np.float32)
    for frame, phone in enumerate(said.split()):
        heard[frame, PHONES.index(phone)] = 0.0
    graph = WordGraph(2, (Arc(0, 1, "who"),), 0, frozenset((1,)), frozenset())
    for n in range(2, 6):
        search = CtcSearch(graph, {"who": [(ANY_PHONE,) * n]}.__getitem__)
        found = search.best(heard)
        if n > len(heard):
            assert found is None
            continue
        assert found is not None
        fits = found.loss == pytest.approx(n * ANY_PHONE_COST, abs=0.01)
        assert fits == (n >= n_phones), (n, found.loss)
        if n < n_phones:
            assert found.loss > 10.0
