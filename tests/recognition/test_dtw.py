"""One column of dynamic time warping, cell by cell.

The sequences are those of the worked example in M. Müller, "Fundamentals of Music Processing" (Springer 2015), chapter
3: X = (1, 3, 9, 2, 1) and Y = (2, 0, 0, 8, 7, 2) with the distance |x - y|, whose accumulated cost matrix is printed
there. Its steps are (1, 0), (0, 1) and (1, 1); ours are asymmetric, because every frame of the input counts once:
with the template X along the states and the input Y along the columns they are (0, 1) stay, (1, 1) next, (2, 1) skip.
So one naive implementation, straight from the recursion and with the step set as a parameter, is first held against the
book's matrix with the book's steps, and then `dtw_column` against it with ours; the matrix of the latter was also
worked out by hand, and is written out below.
"""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from hvcpd.recognition.decoder import UNREACHABLE, StepCosts, dtw_column

X = np.array([1, 3, 9, 2, 1], float)
Y = np.array([2, 0, 0, 8, 7, 2], float)
INF = float("inf")

BOOK_STEPS = {(1, 0): 0.0, (0, 1): 0.0, (1, 1): 0.0}
BOOK_MATRIX = [
    [1, 2, 3, 10, 16, 17],
    [2, 4, 5, 8, 12, 13],
    [9, 11, 13, 6, 8, 15],
    [9, 11, 13, 12, 11, 8],
    [10, 10, 11, 18, 17, 9],
]
OUR_MATRIX = [
    [1, 2, 3, 10, 16, 17],
    [1, 4, 5, 8, 12, 13],
    [INF, 10, 11, 4, 6, 13],
    [INF, 3, 5, 11, 9, 6],
    [INF, INF, 4, 11, 10, 7],
]
"""Stay, next and skip free of charge; the first frame of the input meets the first or the second state."""


def naive(distances: np.ndarray, steps: dict[tuple[int, int], float], starts: dict[int, float]) -> np.ndarray:
    """Accumulated costs, shape (states, frames): each cell its distance and the cheapest step into it."""
    total = np.full(distances.shape, INF)
    for frame in range(distances.shape[1]):
        for state in range(distances.shape[0]):
            ways = [starts[state]] if frame == 0 and state in starts else []
            for (up, along), cost in steps.items():
                if state >= up and frame >= along:
                    ways.append(total[state - up, frame - along] + cost)
            total[state, frame] = distances[state, frame] + min(ways, default=INF)
    return total


def ours(distances: np.ndarray, steps: StepCosts) -> np.ndarray:
    """The same from `dtw_column`; two states stand ahead, and sentences enter at the second of them."""
    n_states, n_frames = distances.shape
    cost = np.full(n_states + 2, UNREACHABLE, np.float32)
    cost[1] = 0.0
    columns = []
    for frame in range(n_frames):
        padded = np.zeros(n_states + 2, np.float32)
        padded[2:] = distances[:, frame]
        out = np.full_like(cost, UNREACHABLE)
        dtw_column(cost, padded, steps, out)
        columns.append(np.where(out[2:] < UNREACHABLE / 2, out[2:], INF))
        cost = out
        cost[:2] = UNREACHABLE
    return np.stack(columns, axis=1)


def our_steps(steps: StepCosts) -> dict[tuple[int, int], float]:
    return {(0, 1): steps.stay, (1, 1): 0.0, (2, 1): steps.skip}


def test_the_naive_recursion_gives_the_books_matrix() -> None:
    got = naive(np.abs(X[:, None] - Y), BOOK_STEPS, {0: 0.0})
    assert got.tolist() == BOOK_MATRIX
    assert got[-1, -1] == 9.0


def test_every_cell_of_the_worked_example() -> None:
    distances = np.abs(X[:, None] - Y)
    free = StepCosts(stay=0.0, skip=0.0)
    assert ours(distances, free).tolist() == OUR_MATRIX
    assert naive(distances, our_steps(free), {0: 0.0, 1: 0.0}).tolist() == OUR_MATRIX


def test_the_masks_tell_which_step_was_taken() -> None:
    """Frame 4 of the example (y = 8): state 3 (x = 9) is best reached by a skip or a step, not by staying."""
    previous = np.array([UNREACHABLE, UNREACHABLE, 3, 5, 11, 5, 4], np.float32)
    distances = np.array([0, 0, 7, 5, 1, 6, 7], np.float32)
    out = np.zeros_like(previous)
    advanced, skipped = dtw_column(previous, distances, StepCosts(stay=0.0, skip=0.0), out)
    assert out[2:].tolist() == [10, 8, 4, 11, 11]
    assert skipped.tolist() == [False, False, True, False, False]
    assert advanced.tolist() == [False, True, True, False, False], "a skip overrides"


@settings(max_examples=60, deadline=None)
@given(
    hnp.arrays(np.float32, st.tuples(st.integers(1, 9), st.integers(1, 9)), elements=st.floats(-4, 8, width=16)),
    st.sampled_from([0.0, 0.25, 1.5]),
    st.sampled_from([0.0, 0.25, 1.5]),
)
def test_any_matrix_agrees_with_the_naive_recursion(distances: np.ndarray, stay: float, skip: float) -> None:
    steps = StepCosts(stay=stay, skip=skip)
    expected = naive(distances.astype(float), our_steps(steps), {0: 0.0, 1: skip})
    assert ours(distances, steps) == pytest.approx(expected, abs=1e-3)
