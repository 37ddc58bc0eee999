"""What makes a sentence sure."""

from __future__ import annotations

from dataclasses import replace

import pytest

from hvcpd.recognition.decoder import TracedWord
from hvcpd.recognition.decoder_session import Sentence, confidence_features

STEPS = (TracedWord(0, 0, 30, -24.0, 20.0), TracedWord(1, 30, 70, -30.0, 9.0), TracedWord(2, 70, 110, -36.0, 30.0))
GOOD = Sentence(STEPS, "oak", (0.1, 0.15, 0.1), -90.0, 0.0, (36.0, 48.0, 48.0), (1.0, 1.1, 0.95), False)


def chance(sentence: Sentence) -> float:
    return confidence_features(sentence).probability


def test_a_sentence_that_fits_is_sure() -> None:
    assert chance(GOOD) > 0.9


@pytest.mark.parametrize(
    "worse",
    [
        replace(GOOD, deficits=(0.1, 1.2, 0.1)),
        replace(GOOD, duration_ratios=(1.0, 5.0, 1.0)),
        replace(GOOD, duration_ratios=(1.0, 0.6, 1.0)),
        replace(GOOD, steps=tuple(replace(s, cost=s.cost / 9) for s in STEPS), cost=-10.0),
        replace(GOOD, steps=(replace(STEPS[0], margin=0.1), *STEPS[1:])),
    ],
    ids=["foreign word", "drawled word", "hurried word", "hardly better than the filler", "close rival"],
)
def test_what_speaks_against_a_sentence_makes_it_less_sure(worse: Sentence) -> None:
    assert chance(worse) < chance(GOOD) - 0.01


def test_near_the_noise_the_very_words_are_as_sure_as_they_can_be_there() -> None:
    """A third of the gain is as good where the very word would gain a third, and not where it would gain all."""
    faint = replace(GOOD, steps=tuple(replace(s, cost=s.cost / 3) for s in STEPS), cost=GOOD.cost / 3)
    there = replace(faint, expected_gains=tuple(p / 3 for p in GOOD.expected_gains))
    assert chance(there) > 0.75 > chance(faint)


def test_only_the_doubtful_word_is_doubtful() -> None:
    doubtful = replace(GOOD, deficits=(0.1, 1.2, 0.1))
    chances = [confidence_features(doubtful, k).probability for k in range(3)]
    assert chances[1] < 0.3 < 0.9 < min(chances[0], chances[2])


@pytest.mark.parametrize("cost", [0.0, -1e-3, -1e6, 1e6])
def test_a_chance_is_a_chance_whatever_it_cost(cost: float) -> None:
    odd = replace(
        GOOD,
        cost=cost,
        steps=(TracedWord(0, 0, 1, cost, -5.0),),
        deficits=(99.0,),
        expected_gains=(0.01,),
        duration_ratios=(9.0,),
    )
    assert 0.0 <= chance(odd) <= 1.0
