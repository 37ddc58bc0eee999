"""Order statistics are NumPy's, to the bit; hearing loads no masked arrays for them; large arrays are zeros, too."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest

from hvcpd.recognition.arrays import lazy_zeros, quantile, unique

LOADED = """
import sys
import numpy as np
from hvcpd.language.graph import graph_of
from hvcpd.people.bands import estimated_noise
from hvcpd.people.phones import CtcSearch
from hvcpd.recognition.channel.estimation import WhitenedSound
from hvcpd.recognition.templates import TemplateBank

sound = np.sin(np.arange(32_000, dtype=np.float32) ** 1.5)
estimated_noise(sound, 16_000)
CtcSearch(graph_of(("stop",)), lambda word: [("S", "T", "AA", "P")])
WhitenedSound(sound, sound[:8_000])
bank = TemplateBank({"voice": {"stop": [sound]}})
bank.compose(np.arange(20), np.ones(24, np.float32), 1.0)
print("numpy.ma" in sys.modules)
"""


@pytest.mark.parametrize("kind", [np.float32, np.float64])
def test_as_numpy_has_them(kind: type[np.float32 | np.float64]) -> None:
    rng = np.random.default_rng(1)
    for n in (1, 2, 3, 4, 5, 10, 99, 1000, 4001):
        values = (rng.standard_normal((2, n)) ** 2 * 1e-3).astype(kind)
        for some in (values, values[0]):
            for share in (0.0, 0.1, 0.3, 0.5, 0.77, 0.95, 1.0):
                assert quantile(some, share) == float(np.quantile(some, share))


def test_distinct() -> None:
    numbers = np.random.default_rng(2).integers(0, 50, (5, 40))
    assert np.array_equal(unique(numbers), np.unique(numbers))
    assert len(unique(numbers[:, :0])) == 0


def test_hearing_loads_no_masked_arrays() -> None:
    out = subprocess.run([sys.executable, "-c", LOADED], check=True, capture_output=True, text=True).stdout
    assert out == "False\n"


@pytest.mark.parametrize("shape", [(0,), (5,), (3, 4)])
def test_they_are_zeros_until_something_is_written(shape: tuple[int, ...]) -> None:
    array = lazy_zeros(shape, np.float32)
    assert (array.shape, array.dtype) == (shape, np.float32)
    assert not array.any()
    array[...] = 1.0
    assert array.all()
    assert not lazy_zeros(shape, np.float32).any()
