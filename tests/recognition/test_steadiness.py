"""The statistics of steady noise are those of the front end as it is."""

from __future__ import annotations

from dataclasses import asdict

import numpy as np
import pytest

from hvcpd.recognition.frontend import HOP_SAMPLES, energies_of
from hvcpd.recognition.steadiness import STEADY_NOISE, measured


def test_steady_noise_is_as_measured() -> None:
    found = measured(energies_of(np.random.default_rng(1).standard_normal(4000 * HOP_SAMPLES).astype(np.float32)))
    for name, values in asdict(found).items():
        assert getattr(STEADY_NOISE, name) == pytest.approx(values, rel=1e-4)
