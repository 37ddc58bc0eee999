"""What makes a sentence sure."""

from __future__ import annotations

from dataclasses import replace

import pytest

from hvcpd.recognition.decoder import TracedWord
from hvcpd.recognition.decoder_session import Sentence, SentenceWord, confidence_features

WORDS = (
    SentenceWord("hi", TracedWord(0, 0, 30, -24.0, 20.0), 0.1, 36.0, 1.0),
    SentenceWord("rob", TracedWord(1, 30, 70, -30.0, 9.0), 0.15, 48.0, 1.1),
    SentenceWord("stop", TracedWord(2, 70, 110, -36.0, 30.0), 0.1, 48.0, 0.95),
)
GOOD = Sentence(WORDS, "oak", -90.0, 0.0)


def with_word(number: int, **changes: float) -> Sentence:
    """The sentence with one word changed."""
    words = [replace(word, **changes) if k == number else word for k, word in enumerate(WORDS)]
    return replace(GOOD, words=tuple(words))


def fainter(word: SentenceWord, by: float) -> SentenceWord:
    return replace(word, step=replace(word.step, cost=word.step.cost / by))


def chance(sentence: Sentence) -> float:
    return confidence_features(sentence).probability


def test_a_sentence_that_fits_is_sure() -> None:
    assert chance(GOOD) > 0.9


@pytest.mark.parametrize(
    "worse",
    [
        with_word(1, deficit=1.2),
        with_word(1, duration_ratio=5.0),
        with_word(1, duration_ratio=0.6),
        replace(GOOD, words=tuple(fainter(word, 9) for word in WORDS), cost=-10.0),
        replace(GOOD, words=(replace(WORDS[0], step=replace(WORDS[0].step, margin=0.1)), *WORDS[1:])),
    ],
    ids=["foreign word", "drawled word", "hurried word", "hardly better than the filler", "close rival"],
)
def test_what_speaks_against_a_sentence_makes_it_less_sure(worse: Sentence) -> None:
    assert chance(worse) < chance(GOOD) - 0.01


def test_near_the_noise_the_very_words_are_as_sure_as_they_can_be_there() -> None:
    """A third of the gain is as good where the very word would gain a third, and not where it would gain all."""
    faint = replace(GOOD, words=tuple(fainter(word, 3) for word in WORDS), cost=GOOD.cost / 3)
    there = replace(faint, words=tuple(replace(word, expected_gain=word.expected_gain / 3) for word in faint.words))
    assert chance(there) > 0.75 > chance(faint)


def test_only_the_doubtful_word_is_doubtful() -> None:
    doubtful = with_word(1, deficit=1.2)
    chances = [confidence_features(doubtful, word).probability for word in doubtful.words]
    assert chances[1] < 0.3 < 0.9 < min(chances[0], chances[2])


@pytest.mark.parametrize("cost", [0.0, -1e-3, -1e6, 1e6])
def test_a_chance_is_a_chance_whatever_it_cost(cost: float) -> None:
    word = SentenceWord("hi", TracedWord(0, 0, 1, cost, -5.0), 99.0, 0.01, 9.0)
    odd = replace(GOOD, cost=cost, words=(word,))
    assert 0.0 <= chance(odd) <= 1.0
