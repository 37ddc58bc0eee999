"""Intervals against published values, pivotal distances against curves that are known."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hvcpd.evaluation.plots import distance_ticks
from hvcpd.evaluation.statistics import Step, pivot, wilson


@pytest.mark.parametrize(
    ("right", "n", "low", "high"),
    [
        (20, 20, 0.839, 1.0),
        (10, 20, 0.299, 0.701),
        (0, 10, 0.0, 0.278),
        (0, 0, 0.0, 1.0),
        (81, 263, 0.2553, 0.3662),  # R. G. Newcombe, Statistics in Medicine 17 (1998), table I, method 3
        (15, 148, 0.0624, 0.1605),
        (0, 20, 0.0, 0.1611),
        (1, 29, 0.0061, 0.1718),
    ],
)
def test_wilson_intervals_are_those_of_the_literature(right: int, n: int, low: float, high: float) -> None:
    assert wilson(right, n) == pytest.approx((low, high), abs=0.001)


def curve(at_m: float, slope: float, n: int) -> list[Step]:
    """As many successes as a logistic curve in log distance has, to a whole number."""
    distances = np.geomspace(0.3, 20.0, 25)
    return [Step(float(d), round(n / (1.0 + (d / at_m) ** slope)), n) for d in distances]


@settings(max_examples=25)
@given(st.floats(0.6, 10.0), st.floats(1.0, 12.0))
def test_a_known_curve_is_found_again(at_m: float, slope: float) -> None:
    found = pivot(curve(at_m, slope, 1000))
    assert found.at == pytest.approx(at_m, rel=0.03)
    assert found.low <= found.at <= found.high
    assert found.sign == ""


def test_more_trials_narrow_the_interval() -> None:
    few, many = (pivot(curve(2.0, 4.0, n)) for n in (20, 200))
    ratio = math.log(few.high / few.low) / math.log(many.high / many.low)
    assert ratio == pytest.approx(math.sqrt(10.0), rel=0.15)


def test_intervals_hold_the_truth_19_times_of_20() -> None:
    rng = np.random.default_rng(3)
    distances, n = [0.5, 1.0, 1.5, 2.0, 3.0, 4.0], 100
    held = 0
    for _ in range(150):
        steps = [Step(d, int(rng.binomial(n, 1.0 / (1.0 + (d / 1.7) ** 5.0))), n) for d in distances]
        found = pivot(steps)
        held += found.low <= 1.7 <= found.high
    low, high = wilson(held, 150)
    assert low <= 0.95 <= high


def test_a_cliff_lies_between_its_two_steps() -> None:
    found = pivot([Step(d, 20 if d < 1.25 else 0, 20) for d in (1.0, 1.1, 1.2, 1.3, 1.4)])
    assert 1.2 < found.at < 1.3
    assert 1.15 < found.low < found.high < 1.35


@pytest.mark.parametrize(("right", "sign", "text"), [(20, ">", "> "), (0, "<", "< ")])
def test_where_all_succeed_or_fail_only_a_bound_is_told(right: int, sign: str, text: str) -> None:
    found = pivot([Step(d, right, 20) for d in (1.0, 2.0, 4.0)])
    assert found.sign == sign
    assert found.text().startswith(text)
    assert (found.at >= 4.0) if sign == ">" else (found.at <= 1.0)


def test_a_bound_is_no_nearer_to_what_was_tried_than_its_interval() -> None:
    once, often = (pivot([Step(d, n, n) for d in (180.0, 400.0)]) for n in (1, 20))
    assert once.text() == "? m (these trials do not tell)"
    assert not once.bounded
    assert (often.sign, often.at) == (">", often.low)
    assert often.low > 400.0
    few = pivot([Step(d, 0, 2) for d in (1.0, 2.0)])
    assert (few.sign, few.at) == ("<", few.high)
    assert few.high > 1.0


def test_an_interval_that_goes_on_beyond_what_was_tried_has_no_end() -> None:
    far = pivot([Step(4.0, 4, 4), Step(8.0, 3, 4), Step(12.0, 2, 4)])
    assert math.isinf(far.high)
    assert far.text() == f"{far.at:.2f} m (95 %: {far.low:.2f} m and more)"
    near = pivot([Step(4.0, 2, 4), Step(8.0, 1, 4), Step(12.0, 0, 4)])
    assert near.low == 0.0
    assert near.text().endswith(" m and less)")


def test_who_understands_half_at_every_distance_has_no_pivotal_distance() -> None:
    flat = pivot([Step(d, n, 20) for d, n in ((0.6, 11), (1.2, 13), (2.0, 10), (4.0, 12), (8.0, 8), (14.0, 10))])
    assert not flat.bounded


def test_one_distance_is_not_enough() -> None:
    with pytest.raises(ValueError, match="two distances"):
        pivot([Step(1.0, 3, 20)])


@pytest.mark.parametrize(
    ("distances", "ticks"),
    [((0.6, 1.2, 20.0), [1, 2, 5, 10, 20]), ((180.0, 400.0), [180, 400]), ((2030.0, 2800.0), [2030, 2800])],
)
def test_an_axis_of_distances_has_at_least_two_ticks(distances: tuple[float, ...], ticks: list[float]) -> None:
    assert distance_ticks(distances) == ticks
