"""What the network hears later is what it would have heard at once."""

from __future__ import annotations

import numpy as np

from hvcpd.recognition.decoder_session import DeferredBuffer
from hvcpd.recognition.frontend import N_BANDS

ENERGIES = np.arange(40 * N_BANDS, dtype=np.float32).reshape(40, N_BANDS)


def test_each_piece_comes_with_what_was_recent_then() -> None:
    deferred = DeferredBuffer()
    for end in range(10, 40, 4):
        deferred.add(ENERGIES[end - 4 : end], ENERGIES[max(end - 12, 0) : end])
    assert deferred.n_frames == 28
    for (piece, recent, left), end in zip(deferred.taken(12), range(10, 40, 4), strict=True):
        assert np.array_equal(piece, ENERGIES[end - 4 : end])
        assert np.array_equal(recent, ENERGIES[max(end - 12, 0) : end])
        assert left == 38 - end
    assert not deferred


def test_the_first_piece_may_be_all_that_was_recent() -> None:
    deferred = DeferredBuffer()
    deferred.add(ENERGIES[:20], ENERGIES[:20])
    [(piece, recent, left)] = deferred.taken(160)
    assert (len(piece), len(recent), left) == (20, 20, 0)


def test_what_is_cleared_is_heard_by_nobody() -> None:
    deferred = DeferredBuffer()
    deferred.add(ENERGIES[:4], ENERGIES[:4])
    deferred.add(ENERGIES[4:8], ENERGIES[:8])
    deferred.clear()
    assert not deferred
    assert deferred.n_frames == 0
