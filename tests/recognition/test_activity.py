"""Signs of speech, and what is one no longer."""

from __future__ import annotations

import numpy as np
import pytest

from hvcpd.recognition.frontend import N_BANDS, Energies
from hvcpd.recognition.noise import STEADY_MEAN_LOG
from hvcpd.recognition.shared_front_end import LONG_FRAMES, VoiceActivityDetector

NOISE = np.full(N_BANDS, 1e-6, np.float32)


def _frames(n: int, level: float) -> Energies:
    """As steady as the mean of noise, `level` times as loud."""
    return np.tile(level * NOISE * np.exp(STEADY_MEAN_LOG), (n, 1)).astype(np.float32)


@pytest.mark.parametrize("explained", [False, True])
def test_what_is_explained_is_a_sign_of_nothing_else(explained: bool) -> None:
    detector = VoiceActivityDetector()
    for _ in range(LONG_FRAMES // 4):
        detector.push(_frames(4, 20.0), NOISE)
    detector.push(_frames(4, 1.0), NOISE)
    if explained:
        detector.account_for(4)
    detector.push(_frames(4, 1.0), NOISE)
    assert detector.possible_speech is not explained


def test_whoever_goes_on_after_it_is_noticed() -> None:
    detector = VoiceActivityDetector()
    for _ in range(LONG_FRAMES // 4):
        detector.push(_frames(4, 20.0), NOISE)
    detector.account_for(0)
    for _ in range(2):
        detector.push(_frames(4, 20.0), NOISE)
    assert detector.possible_speech
