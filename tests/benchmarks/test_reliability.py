"""How sure robots are of strangers, against how often they are right."""

from __future__ import annotations

from benchmarks.judging import reliability
from benchmarks.reliability import LEVELS, Judged, right_where

JUDGED = [
    Judged("here", p, right) for p, right in ((0.99, True), (0.96, False), (0.85, True), (0.85, False), (0.4, True))
]


def test_each_sentence_counts_between_two_levels() -> None:
    told = [*((each.probability, each.right) for each in JUDGED), (1.0, True)]
    assert reliability(told, LEVELS) == [
        *((0.0, 0.3, 0, 0), (0.3, 0.5, 1, 1), (0.5, 0.7, 0, 0), (0.7, 0.8, 0, 0)),
        *((0.8, 0.9, 2, 1), (0.9, 0.95, 0, 0), (0.95, 1.0, 3, 2)),
    ]


def test_right_ones_are_surer_than_all_but_so_many_wrong_ones() -> None:
    assert [right_where(JUDGED, wrong) for wrong in (0, 1, 2)] == [1, 1, 3]
