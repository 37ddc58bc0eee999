"""Filters of the simulation against scipy's."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

from hil_fakes.filters import one_pole


@pytest.mark.parametrize("pole", [0.0, 0.57, 0.99765])
@pytest.mark.parametrize("n", [0, 1, 7, 4000])
def test_one_pole_is_the_recursion(n: int, pole: float) -> None:
    x = np.random.default_rng(n).standard_normal(n)
    wanted = lfilter([1.0], [1.0, -pole], x, zi=[pole * 0.3])[0] if n else x
    np.testing.assert_allclose(one_pole(x, pole, before=0.3), wanted, atol=1e-12)


def test_blocks_one_after_the_other_are_the_whole() -> None:
    x = np.random.default_rng(1).standard_normal(1000)
    first = one_pole(x[:300], 0.9)
    np.testing.assert_allclose(np.concatenate([first, one_pole(x[300:], 0.9, float(first[-1]))]), one_pole(x, 0.9))
