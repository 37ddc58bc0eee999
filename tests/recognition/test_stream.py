"""Blocks of any size become the same chunks: their frames, and whether they hold anything masked."""

from __future__ import annotations

import tracemalloc

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from hvcpd.ports import SAMPLE_RATE_HZ
from hvcpd.recognition.frontend import HOP_SAMPLES, WINDOW_SAMPLES, energies_of
from hvcpd.recognition.stream import CHUNK_FRAMES, CHUNK_SAMPLES, Chunk, FrameStream

SPAN = (CHUNK_FRAMES - 1) * HOP_SAMPLES + WINDOW_SAMPLES
"""Samples that a chunk is made of."""
BLOCKS = st.lists(st.tuples(st.integers(0, 3 * CHUNK_SAMPLES), st.booleans()), max_size=12)


@settings(max_examples=60, deadline=None)
@given(blocks=BLOCKS)
def test_blocks_of_any_size_make_the_same_chunks(blocks: list[tuple[int, bool]]) -> None:
    sound = np.random.default_rng(1).standard_normal(sum(n for n, _ in blocks)).astype(np.float32) / 10.0
    masked = np.repeat([mask for _, mask in blocks], [n for n, _ in blocks])
    stream = FrameStream()
    found: list[Chunk] = []
    at = 0
    for n, mask in blocks:
        block = sound[at : at + n].copy()
        found += stream.push(block, mask)
        block[:] = np.nan  # whoever hands it out may use it again
        at += n
    starts = range(0, len(sound) - SPAN + 1, CHUNK_SAMPLES)
    assert [chunk.first_frame for chunk in found] == [start // HOP_SAMPLES for start in starts]
    for start, chunk in zip(starts, found, strict=True):
        assert chunk.masked == bool(masked[start : start + SPAN].any())
        assert np.array_equal(chunk.energies, energies_of(sound[start : start + SPAN]))
    rest = stream.rest()
    end = len(found) * CHUNK_SAMPLES
    assert rest.masked == bool(masked[end:].any())
    assert np.array_equal(rest.energies, energies_of(sound[end:]))


def test_the_energies_of_a_long_recording_take_little_memory() -> None:
    """Those of ten minutes took 163 MB, a sixth of a Pi's memory."""
    sound = np.zeros(60 * SAMPLE_RATE_HZ, np.float32)
    tracemalloc.start()
    try:
        energies_of(sound)
        most = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert most < 4e6
