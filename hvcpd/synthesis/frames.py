"""The synthesizer's controls as a table, one row a frame: to look at, to plot, or to feed to another synthesizer."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hvcpd.synthesis.klatt import Controls
from hvcpd.synthesis.phones import OFF_DB

FRAME_S = 0.005
"""Klatt's frame (1980), s."""


def frame_table(controls: Controls) -> tuple[tuple[str, ...], NDArray[np.float64]]:
    """Names of the columns and the table, shape (frames, columns): time in s, then Klatt's parameters by his names.

    F0, F1 to F3, FNZ and FNP in Hz, B1 to B3 in Hz, AV, AH and AF in dB relative to a vowel (off is -99), TL, the
    corner of the source's low-pass, in Hz.
    """
    times = np.arange(0.0, controls.duration_s, FRAME_S)
    frication = np.full(len(times), OFF_DB)
    for event in controls.frications:
        inside = (times >= event.times_s[0]) & (times <= event.times_s[-1])
        frication[inside] = np.maximum(frication[inside], event.at(times[inside]))
    columns = {
        "t": times,
        "F0": controls.f0_hz.at(times),
        **{f"F{k}": track.at(times) for k, track in enumerate(controls.formants_hz, start=1)},
        **{f"B{k}": track.at(times) for k, track in enumerate(controls.bandwidths_hz, start=1)},
        "FNZ": controls.nasal_zero_hz.at(times),
        "FNP": np.full(len(times), controls.nasal_pole_hz),
        "AV": controls.voicing_db.at(times),
        "AH": controls.aspiration_db.at(times),
        "AF": frication,
        "TL": controls.tilt_hz.at(times),
    }
    return tuple(columns), np.column_stack(list(columns.values()))
