"""What was heard in the last seconds, at its place."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hvcpd.ports import Samples
from hvcpd.recognition.stream import (
    HISTORY_SAMPLES,
    INT16_SCALE,
    LONGEST_SENTENCE,
    MAX_WAIT,
    NOISE_LEAD,
    History,
    to_int16,
)

KEEP = 100
Sizes = st.lists(st.integers(0, 150), min_size=1, max_size=30)


def block(begin: int, end: int) -> Samples:
    """Each sample its own place, in a converter's steps."""
    return np.arange(begin, end, dtype=np.float32) / INT16_SCALE


def filled(*blocks: tuple[str, int]) -> History:
    """Blocks of these sizes: "heard", "own" or "lost"."""
    history, at = History(KEEP), 0
    for kind, size in blocks:
        if kind == "lost":
            history.lose(size)
        else:
            history.push(block(at, at + size), masked=kind == "own")
        at += size
    return history


def heard(*sizes: int) -> History:
    return filled(*(("heard", size) for size in sizes))


@given(sizes=Sizes)
def test_the_last_samples_are_kept_whatever_the_blocks(sizes: list[int]) -> None:
    history, now = heard(*sizes), sum(sizes)
    assert (history.begin, history.end) == (max(now - KEEP, 0), now)
    assert np.array_equal(history.unmasked(0, 0, now)[0], block(history.begin, now))


@given(sizes=Sizes, at=st.integers(-20, 500), n=st.integers(0, 200))
def test_what_is_too_old_is_missing_and_what_is_still_to_come_is_silent(sizes: list[int], at: int, n: int) -> None:
    history = heard(*sizes)
    sound = history.between(at, at + n)
    if at < history.begin:
        assert sound is None
        return
    assert sound is not None
    assert (sound.shape, sound.dtype) == ((n,), np.float32)
    known = max(min(at + n, history.end) - at, 0)
    assert np.array_equal(sound[:known], block(at, at + known))
    assert not sound[known:].any()


@given(
    blocks=st.lists(st.tuples(st.sampled_from(("heard", "own", "lost")), st.integers(0, 150)), max_size=30),
    cuts=st.tuples(*[st.integers(-20, 1000)] * 3),
)
def test_around_is_what_others_said_in_order(blocks: list[tuple[str, int]], cuts: tuple[int, int, int]) -> None:
    begin, middle, end = sorted(cuts)
    history = filled(*blocks)
    kinds = [kind for kind, size in blocks for _ in range(size)]
    places = [at for at in range(max(begin, history.begin), min(end, history.end)) if kinds[at] == "heard"]
    sound, lead = history.unmasked(begin, middle, end)
    assert [round(float(each * INT16_SCALE)) for each in sound] == places
    assert lead == sum(at < middle for at in places)


def test_the_own_voice_is_between_two_samples_and_lost_sound_is_silent() -> None:
    history = filled(("heard", 10), ("own", 10), ("lost", 10), ("heard", 10))
    sound = history.between(0, 40)
    assert sound is not None
    assert np.array_equal(sound, np.concatenate([block(0, 20), np.zeros(10), block(30, 40)]))


@pytest.mark.parametrize("n", [KEEP, 10 * KEEP + 7])
def test_a_loss_longer_than_all_that_is_kept_leaves_nothing_once_more_is_heard(n: int) -> None:
    history = filled(("heard", 30), ("lost", n))
    assert np.array_equal(history.unmasked(0, 0, 30 + n)[0], block(0, 30))
    history.push(block(30 + n, 35 + n), masked=False)
    assert history.end == 35 + n
    assert history.between(29, 31) is None
    assert np.array_equal(history.unmasked(0, 0, history.end)[0], block(30 + n, 35 + n))


def test_nothing_was_heard_yet() -> None:
    sound, lead = History(KEEP).unmasked(-50, 0, 50)
    assert (len(sound), sound.dtype, lead) == (0, np.float32, 0)


def test_it_is_long_enough_for_all_who_look_back() -> None:
    assert NOISE_LEAD + 2 * LONGEST_SENTENCE + 2 * MAX_WAIT <= HISTORY_SAMPLES


def test_a_converters_steps_are_kept_and_others_to_half_a_step() -> None:
    steps = np.array([-32_768, -1, 0, 1, 32_767], np.int16)
    assert np.array_equal(to_int16(steps / INT16_SCALE), steps)
    sound = np.linspace(-1.0, 1.0 - 1.0 / INT16_SCALE, 999, dtype=np.float32)
    assert np.abs(to_int16(sound) / INT16_SCALE - sound).max() <= 0.5 / INT16_SCALE
    assert to_int16(np.ones(1, np.float32)) == INT16_SCALE - 1


def test_a_history_of_ages_goes_on_as_ever() -> None:
    """`numpy.put` wraps around by one subtraction after the other: after a month that took longer than the sound."""
    history = History()
    history.lose(10**15)
    history.push(np.full(400, 0.5, np.float32), masked=False)
    assert history.end == 10**15 + 400
    np.testing.assert_array_equal(history.between(history.end - 400, history.end), np.full(400, 0.5, np.float32))
