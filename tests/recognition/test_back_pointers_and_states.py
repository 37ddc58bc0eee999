"""What the decoder's tokens point to, and which states it follows."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hvcpd.recognition.decoder import CAPACITY, PAUSE, BackPointers
from hvcpd.recognition.network import PADDING, ActiveStates, Network
from hvcpd.recognition.templates import TemplateBank
from tests.recognition.signals import graph, templates

N_RUNGS = 3
NET = Network(graph(), TemplateBank(templates()).templates)


def one(value: float, kind: type = np.float32) -> np.ndarray:
    return np.array([value], kind)


@pytest.mark.parametrize("frame", [0, 1, 8_640_000])
def test_a_negative_token_is_the_beginning_of_a_sentence(frame: int) -> None:
    token = one(-1 - frame, np.int32)
    assert BackPointers().frame_of(token)[0] == frame - 1
    assert BackPointers().trace(int(token[0])) == []


@settings(max_examples=50, deadline=None)
@given(
    st.integers(0, 8_640_000),
    st.lists(st.tuples(st.integers(1, 60), st.booleans(), st.floats(-20, 5)), min_size=1, max_size=9),
)
def test_a_path_is_traced_as_it_was_recorded(begin: int, parts: list[tuple[int, bool, float]]) -> None:
    back_pointers = BackPointers()
    token, frame, total = one(-1 - begin, np.int32), begin - 1, 0.0
    said = []
    for number, (length, is_pause, cost) in enumerate(parts):
        start, frame, total = frame + 1, frame + length, total + cost
        instance = PAUSE if is_pause else number
        token = back_pointers.add(frame, instance, token, one(total), one(total + 2.0))
        if not is_pause:
            said.append((number, start, frame + 1, cost))
    steps = back_pointers.trace(int(token[0]))
    assert [(s.instance, s.start_frame, s.end_frame) for s in steps] == [s[:3] for s in said]
    assert [s.cost for s in steps] == pytest.approx([s[3] for s in said], abs=1e-3)
    assert [s.margin for s in steps] == pytest.approx([2.0] * len(steps), abs=1e-3)
    assert back_pointers.frame_of(token)[0] == frame


def test_it_is_full_before_a_record_is_overwritten() -> None:
    back_pointers = BackPointers()
    n = 1 << 12
    tokens = []
    while not back_pointers.is_full:
        starts = np.full(n, -1 - len(tokens), np.int32)
        tokens.append(back_pointers.add(len(tokens), 0, starts, np.zeros(n, np.float32), np.zeros(n, np.float32)))
    assert 0.85 * CAPACITY < n * len(tokens) < 0.95 * CAPACITY
    assert all((back_pointers.frame_of(each) == frame).all() for frame, each in enumerate(tokens))
    back_pointers.clear()
    assert not back_pointers.is_full


def test_more_records_at_once_than_are_left_overwrite_the_oldest() -> None:
    """Whether it is full is asked every few frames only; between them it raised ValueError."""
    back_pointers = BackPointers()
    for n in (CAPACITY - 1, 3):
        starts = np.full(n, -1 - n, np.int32)
        tokens = back_pointers.add(n, 0, starts, np.zeros(n, np.float32), np.zeros(n, np.float32))
    assert tokens.tolist() == [CAPACITY - 1, 0, 1]
    assert (back_pointers.frame_of(tokens) == 3).all()
    assert back_pointers.is_full


@st.composite
def layouts(draw: st.DrawFn) -> ActiveStates:
    """Some stretches of the test network."""
    pairs = sorted(draw(st.sets(st.integers(0, N_RUNGS * NET.n_instances - 1), max_size=12)))
    length = [int(NET.length[p % NET.n_instances]) for p in pairs]
    low = [draw(st.integers(0, n - 1)) for n in length]
    high = [draw(st.integers(at + 1, n)) for at, n in zip(low, length, strict=True)]
    return ActiveStates.of(NET, N_RUNGS, *(np.array(a, np.intp) for a in (pairs, low, high)))


@settings(max_examples=80, deadline=None)
@given(layouts())
def test_every_state_is_where_it_belongs(layout: ActiveStates) -> None:
    sizes = layout.high - layout.low + PADDING
    assert layout.n_states == sizes.sum()
    assert (np.diff(layout.key) > 0).all()
    assert layout.hypothesis_begins[0] == 0
    assert layout.hypothesis_begins[-1] == layout.n_states
    for k, pair in enumerate(layout.pair):
        hypothesis, instance = divmod(int(pair), NET.n_instances)
        states = np.arange(layout.begin[k], layout.begin[k] + sizes[k])
        assert layout.hypothesis_begins[hypothesis] <= states[0]
        assert states[-1] < layout.hypothesis_begins[hypothesis + 1]
        frames = np.maximum(np.arange(layout.low[k] - PADDING, layout.high[k]), 0)
        assert (layout.row[states] == NET.first_row[instance] + frames).all()


@settings(max_examples=80, deadline=None)
@given(layouts())
def test_open_pairs_have_an_entry_and_ending_pairs_an_end(layout: ActiveStates) -> None:
    opened, ending = layout.low == 0, layout.high == NET.length[layout.pair % NET.n_instances]
    hypothesis, instance = np.divmod(layout.pair, NET.n_instances)
    assert (layout.entry == layout.begin[opened] + PADDING - 1).all()
    assert (layout.source == (hypothesis * NET.n_nodes + NET.source_node[instance])[opened]).all()
    assert (layout.row[layout.last] == (NET.first_row[instance] + NET.length[instance] - 1)[ending]).all()
    assert (layout.target == (hypothesis * NET.n_nodes + NET.target_node[instance])[ending]).all()
    assert (layout.end_instance == instance[ending]).all()


@settings(max_examples=80, deadline=None)
@given(layouts(), layouts())
def test_states_that_two_layouts_share_are_found_and_no_others(old: ActiveStates, new: ActiveStates) -> None:
    were, are = old.shared_with(new)
    assert (old.key[were] == new.key[are]).all()
    assert (old.row[were] == new.row[are]).all()
    assert set(new.key[~are]).isdisjoint(old.key)
