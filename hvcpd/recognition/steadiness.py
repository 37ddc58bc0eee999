"""What steady noise looks like to the front end, band by band: no spectrum of it, only how its energies spread.

Measured on 40 s of white noise (estimates good to about 1 %) by `tests/recognition/test_steadiness.py`, which
also sees to it that the numbers are those of the front end as it is. Whoever listens needs no generator of noise then.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

PERCENTILE = 20.0
"""Low enough that speech present four fifths of the time leaves the estimate of the noise alone."""


@dataclass(frozen=True)
class SteadyNoise:
    """Statistics of the log energies of steady noise.

    `percentile_ratio`: PERCENTILE of a band's energies over their mean; `mean_log`, `std_log`: mean and standard
    deviation of the natural logarithm of energy over mean energy. All have shape (N_BANDS,).
    """

    percentile_ratio: NDArray[np.float32]
    mean_log: NDArray[np.float32]
    std_log: NDArray[np.float32]


def _bands(values: str) -> NDArray[np.float32]:
    return np.array(values.split(), np.float32)


STEADY_NOISE = SteadyNoise(
    percentile_ratio=_bands(
        """
        0.61560255 0.63100964 0.6297336 0.6319908 0.62599474 0.6359759 0.62998027 0.6313826
        0.6296713 0.62520677 0.635958 0.64546144 0.6402279 0.6408148 0.662098 0.6728716
        0.6843403 0.69484866 0.7186308 0.7215339 0.73438877 0.7427841 0.75529695 0.76258904
        """
    ),
    mean_log=_bands(
        """
        -0.10364801 -0.095379375 -0.09579891 -0.09522833 -0.094281055 -0.0919532 -0.09770598 -0.09638221
        -0.09304002 -0.09432433 -0.093960695 -0.08947321 -0.08988765 -0.0900399 -0.08489609 -0.07487963
        -0.07013873 -0.063157074 -0.055894684 -0.053747833 -0.04954887 -0.04589958 -0.040588636 -0.037748795
        """
    ),
    std_log=_bands(
        """
        0.46536854 0.44441217 0.443741 0.44182032 0.43875745 0.43360594 0.44858345 0.44721404
        0.4398515 0.43961778 0.44057146 0.4304641 0.4282024 0.43097332 0.41937292 0.39080262
        0.37894696 0.3586264 0.33833244 0.33044568 0.31703767 0.30421096 0.28673077 0.27667126
        """
    ),
)
