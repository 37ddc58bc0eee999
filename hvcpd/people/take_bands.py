"""Takes of enrolled people's words as the net of phones hears them (`phones`), though only energies are kept of them.

The net's mel bands are not those of the front end, in which takes are kept, but near: linear regression of the
logarithms of the one on those of the other, made by `benchmarks/take_bands.py` of synthetic speech.
"""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray

from hvcpd.people.cepstra import Bands, completed, mask_of
from hvcpd.people.stored import stored
from hvcpd.recognition.frontend import ENERGY_FLOOR, Energies


def masked_logs(energies: Energies, silence: int = 0) -> Bands:
    """Logarithms of a take's energies, shape (frames, N_BANDS of the front end), with so many frames of silence before
    and after it, nothing being fainter than what counts for the net."""
    mask = mask_of(energies) + float(ENERGY_FLOOR)
    return np.asarray(np.log(np.pad(energies, ((silence, silence), (0, 0))) + mask))


@cache
def _regression() -> NDArray[np.float64]:
    """Shape (1 + the front end's N_BANDS, the net's), the constants first."""
    return np.asarray(stored("take_bands.npz")["weights"], np.float64)


def heard_alone(energies: Energies, silence: int) -> Bands:
    """Logarithms of the net's bands, shape (silence + frames + silence, N_BANDS), of a take in silence."""
    weights = _regression()
    logs = weights[0] + masked_logs(energies, silence) @ weights[1:]
    return completed(logs, np.exp(logs))
