"""Arrays on pages of their own are zeros of the shape and kind asked for, and can be written to."""

from __future__ import annotations

import numpy as np
import pytest

from hvcpd.recognition.pages import blank


@pytest.mark.parametrize("shape", [(0,), (5,), (3, 4)])
def test_they_are_zeros_until_something_is_written(shape: tuple[int, ...]) -> None:
    array = blank(shape, np.float32)
    assert (array.shape, array.dtype) == (shape, np.float32)
    assert not array.any()
    array[...] = 1.0
    assert array.all()
    assert not blank(shape, np.float32).any()
