"""The numbers of steady noise are those that the front end gives."""

from __future__ import annotations

import numpy as np
import pytest

from hvcpd.recognition.frontend import HOP_SAMPLES, energies_of
from hvcpd.recognition.steadiness import PERCENTILE, STEADY_NOISE


def test_steady_noise_is_as_measured() -> None:
    energies = energies_of(np.random.default_rng(1).standard_normal(4000 * HOP_SAMPLES).astype(np.float32))
    mean = energies.mean(axis=0)
    logs = np.log(energies / mean)
    ratio = np.percentile(energies, PERCENTILE, axis=0) / mean
    assert STEADY_NOISE.percentile_ratio == pytest.approx(ratio, rel=1e-5)
    assert STEADY_NOISE.mean_log == pytest.approx(logs.mean(axis=0), rel=1e-4)
    assert STEADY_NOISE.std_log == pytest.approx(logs.std(axis=0), rel=1e-5)
