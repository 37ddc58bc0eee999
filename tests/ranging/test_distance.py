"""The distance from two intervals, whatever the clocks, and the digits in which the second is told."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hvcpd.language.range_messages import measured
from hvcpd.ranging.arrival import Arrival
from hvcpd.ranging.distance import FARTHEST_M, SOUND_SPEED_M_S, STILL, TICKS, distance, interval_ticks

OWN_WAY_M = 0.1
SAMPLES_A_M = 16_000 / SOUND_SPEED_M_S
skews = st.floats(-1e-4, 1e-4)


def heard(at: float, skew: float, offset: float, clear: float = 30.0) -> Arrival:
    """What arrives at the air's sample `at`, by a microphone's clock."""
    return Arrival((at + offset) * (1.0 + skew), skew, clear, 1.0)


def exchange(distance_m: float, gap: float, skew_a: float, skew_b: float) -> tuple[Arrival, Arrival, int]:
    """A asks at the air's sample 0; B answers `gap` samples after it heard that."""
    way, own = distance_m * SAMPLES_A_M, OWN_WAY_M * SAMPLES_A_M
    said_b = way + gap
    question_b, own_b = heard(way, skew_b, 5e5), heard(said_b + own, skew_b, 5e5)
    own_a, answer_a = heard(own, skew_a, 1e4), heard(said_b + way, skew_a, 1e4)
    return own_a, answer_a, interval_ticks(question_b, own_b, OWN_WAY_M)


@given(st.floats(0.3, FARTHEST_M - 1.0), st.floats(20_000, 200_000), skews, skews)
def test_the_distance_comes_out_whatever_the_clocks_and_the_pause(
    distance_m: float, gap: float, skew_a: float, skew_b: float
) -> None:
    found = distance(*exchange(distance_m, gap, skew_a, skew_b), OWN_WAY_M)
    assert found is not None
    assert found.sure
    # Half a tick is half a centimetre; 100 ppm of the way itself is not corrected.
    assert found.distance_m == pytest.approx(distance_m, abs=0.006 + 1.1e-4 * distance_m)


@given(st.integers(0, TICKS - 1))
def test_four_digits_tell_every_interval(ticks: int) -> None:
    assert measured(ticks).ticks == ticks


def test_more_than_four_digits_cannot_be_told() -> None:
    with pytest.raises(ValueError, match="10000"):
        measured(TICKS)


def test_a_misheard_digit_that_fits_no_distance_is_no_distance() -> None:
    own, answer, ticks = exchange(3.0, 60_000.0, 0.0, 0.0)
    assert distance(own, answer, (ticks + 5_000) % TICKS, OWN_WAY_M) is None


def test_a_moving_robot_a_faint_voice_and_louder_echoes_are_unsure() -> None:
    own, answer, ticks = exchange(3.0, 60_000.0, 0.0, 0.0)
    moving = Arrival(answer.at, 2.0 * STILL, answer.clear, 1.0)
    faint = Arrival(answer.at, 0.0, 6.0, 1.0)
    hidden, forerun = Arrival(answer.at, 0.0, 30.0, 0.6), Arrival(answer.at, 0.0, 30.0, 1.5, 0.6)
    for doubtful in (moving, faint, hidden, forerun):
        found = distance(own, doubtful, ticks, OWN_WAY_M)
        assert found is None or not found.sure
