"""What was heard in the last seconds, at its place."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hvcpd.ports import Samples
from hvcpd.recognition.stream import STEPS, History, joined, kept


def block(begin: int, end: int) -> Samples:
    """Each sample its own place, in a converter's steps."""
    return np.arange(begin, end, dtype=np.float32) / STEPS


def filled(sizes: list[int], keep: int) -> History:
    """Blocks of these sizes."""
    history, at = History(keep), 0
    for size in sizes:
        history.push(at, block(at, at + size))
        at += size
    return history


@given(sizes=st.lists(st.integers(0, 50), min_size=1, max_size=30), keep=st.integers(0, 300))
def test_so_much_is_kept_and_little_more(sizes: list[int], keep: int) -> None:
    now = sum(sizes)
    sound, _ = filled(sizes, keep).around(0, 0, now)
    assert min(keep, now) <= len(sound) <= keep + max(sizes)
    assert np.array_equal(sound, block(now - len(sound), now))


@given(
    sizes=st.lists(st.integers(1, 50), min_size=1, max_size=30),
    cuts=st.tuples(st.integers(-20, 1000), st.integers(-20, 1000), st.integers(-20, 1000)),
)
def test_what_is_asked_for_is_there_at_its_place(sizes: list[int], cuts: tuple[int, int, int]) -> None:
    begin, middle, end = sorted(cuts)
    sound, lead = filled(sizes, 10_000).around(begin, middle, end)
    wanted = np.arange(max(begin, 0), min(end, sum(sizes)))
    assert set(wanted) <= set(sound * STEPS)
    assert lead == int(np.sum(sound * STEPS < middle))
    assert len(sound) <= len(wanted) + 2 * max(sizes)


@pytest.mark.parametrize(("begin", "middle", "end"), [(0, 10, 40), (10, 25, 40), (15, 35, 40)])
def test_a_gap_is_left_out(begin: int, middle: int, end: int) -> None:
    history = History(100)
    for at in (0, 10, 30):
        history.push(at, block(at, at + 10))
    sound, lead = history.around(begin, middle, end)
    assert not any(20 <= each < 30 for each in sound * STEPS)
    assert lead == int(np.sum(sound * STEPS < middle))


def test_nothing_was_heard_yet() -> None:
    sound, lead = History(100).around(-50, 0, 50)
    assert (len(sound), sound.dtype, lead) == (0, np.float32, 0)


def test_a_converters_steps_are_kept_and_others_to_half_a_step() -> None:
    steps = np.array([-32_768, -1, 0, 1, 32_767], np.int16)
    assert np.array_equal(joined([kept(steps / STEPS)]), steps / STEPS)
    sound = np.linspace(-1.0, 1.0 - 1.0 / STEPS, 999, dtype=np.float32)
    assert np.abs(joined([kept(sound)]) - sound).max() <= 0.5 / STEPS
    assert joined([kept(np.ones(1, np.float32))]) == 1.0 - 1.0 / STEPS
