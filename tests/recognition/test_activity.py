"""Signs of speech, and what is one no longer."""

from __future__ import annotations

import numpy as np
import pytest

from hvcpd.recognition.activity import LONG_FRAMES, ActivityDetector, SegmentTracker
from hvcpd.recognition.events import Garbled
from hvcpd.recognition.frontend import HOP_SAMPLES, N_BANDS, Energies
from hvcpd.recognition.noise import STEADY_NOISE

NOISE = np.full(N_BANDS, 1e-6, np.float32)


def _frames(n: int, level: float) -> Energies:
    """As steady as the mean of noise, `level` times as loud."""
    return np.tile(level * NOISE * np.exp(STEADY_NOISE.mean_log), (n, 1)).astype(np.float32)


@pytest.mark.parametrize("explained", [False, True])
def test_what_is_explained_is_a_sign_of_nothing_else(explained: bool) -> None:
    detector = ActivityDetector()
    for _ in range(LONG_FRAMES // 4):
        detector.push(_frames(4, 20.0), NOISE)
    detector.push(_frames(4, 1.0), NOISE)
    if explained:
        detector.account_for(4)
    detector.push(_frames(4, 1.0), NOISE)
    assert detector.alert is not explained


def test_whoever_goes_on_after_it_is_noticed() -> None:
    detector = ActivityDetector()
    for _ in range(LONG_FRAMES // 4):
        detector.push(_frames(4, 20.0), NOISE)
    detector.account_for(0)
    for _ in range(2):
        detector.push(_frames(4, 20.0), NOISE)
    assert detector.alert


def test_a_comma_s_pause_does_not_cut_a_sentence_in_two() -> None:
    """Neural voices pause for up to 0.64 s after a greeting; a sentence was heard in two, the first part reported as a
    whole."""
    tracker, found = SegmentTracker(), []
    syllables = _frames(60, 1.0) * np.tile([20.0, 200.0], 30)[:, None].astype(np.float32)
    for frame in range(0, 360, 4):
        speaks = frame < 60 or 124 <= frame < 184
        tracker.push(frame, syllables[frame % 60 : frame % 60 + 4], speaks)
        found += [event for event in (tracker.ended(frame, False),) if event is not None]
    assert found == [Garbled(0, 184 * HOP_SAMPLES)]
