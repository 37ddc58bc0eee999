"""Templates as they arrive from across a room."""

from __future__ import annotations

import numpy as np
import pytest

from hvcpd.ports import SAMPLE_RATE_HZ
from hvcpd.recognition.frontend import HOP_SAMPLES, N_BANDS
from hvcpd.recognition.templates import ROOM_RT60_S, reverberated


@pytest.mark.parametrize("n_frames", [1, 2, 7, 60, 777])
def test_each_frame_holds_what_the_earlier_ones_have_left(n_frames: int) -> None:
    """By the definition, frame by frame, in double precision."""
    energies = np.random.default_rng(n_frames).random((n_frames, N_BANDS)).astype(np.float32) ** 4
    left = 10.0 ** (-6.0 * HOP_SAMPLES / SAMPLE_RATE_HZ / ROOM_RT60_S)
    sound = np.zeros(N_BANDS)
    for arrived, found in zip(energies, reverberated(energies), strict=True):
        sound = left * sound + (1 - left) * arrived
        assert np.allclose(found, sound, rtol=1e-5, atol=0.0)
