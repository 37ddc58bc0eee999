"""A small net that tells the sounds of English apart, whoever says them: convolutions in time over mel bands.

Trained by connectionist temporal classification (A. Graves, S. Fernandez, F. Gomez & J. Schmidhuber, ICML 2006) on
synthetic speech alone (`benchmarks/phones`): between two sounds it says that there is none.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from hvcpd.people.cepstra import Bands
from hvcpd.people.stored import stored

Logs = NDArray[np.float32]
Chances = NDArray[np.float32]
"""Logarithms of the chance of each of PHONES, and last of none of them, shape (frames, len(PHONES) + 1)."""

PHONES = tuple(
    "AA AE AH AO AW AY B CH D DH EH ER EY F G HH IH IY JH K L M N NG OW OY P R S SH T TH UH UW V W Y Z ZH".split()
)
"""ARPAbet without stress; the net's outputs, after that for none of them."""

LOUD_NATS = 5.8
"""25 dB: frames that are no farther below the loudest tell the voice's and the microphone's mean."""


def centred(logs: Bands) -> Logs:
    """Logarithms of band energies, shape (frames, N_BANDS), less their mean where it is loud."""
    if not len(logs):
        return np.zeros(logs.shape, np.float32)
    level = logs.max(axis=1)
    loud = np.sort(level)[-max(len(level) // 8, 1) :].mean()
    return np.asarray(logs - logs[level > loud - LOUD_NATS].mean(axis=0), np.float32)


FRAME_SAMPLES = 320
"""Two of the bands' frames make one of the net's."""
APART = (1, 1, 2, 3, 4, 6)
"""How far apart the frames are that each layer sees."""
GAP_COST = 1.5
"""Of a frame without a sound, natural logarithm: a net so trained is surer of them than of sounds, and short words were
left out. Of 195 sentences of other synthetic voices than those trained on 191 are right, with 0.5 189."""
HALVES = 1
"""The layer that leaves out every other frame; those after it add to what they are given."""


@cache
def _weights() -> dict[str, NDArray[np.float32]]:
    return {name: np.asarray(values, np.float32) for name, values in stored("phones.npz").items()}


@dataclass(frozen=True, eq=False)
class Sounds:
    """What the net makes of a piece: `chances`, and `inside`, shape (frames, its width), what its last layer but that
    of the chances holds: alike where the same is said in the same way."""

    chances: Chances
    inside: Logs


def sounds_of(logs: Logs) -> Sounds:
    """Of `centred` logarithms, shape (frames, N_BANDS): half as many frames, rounded up."""
    weights, sound = _weights(), logs
    for number, apart in enumerate(APART):
        step = 2 if number == HALVES else 1
        found = _layer(sound, weights[f"weights{number}"], weights[f"bias{number}"], apart, step)
        sound = found if number <= HALVES else sound + found
    logits = sound @ weights["weights_out"] + weights["bias_out"]
    logits[:, -1] -= GAP_COST
    logits -= logits.max(axis=1, keepdims=True)
    return Sounds(np.asarray(logits - np.log(np.exp(logits).sum(axis=1, keepdims=True)), np.float32), sound)


def _layer(sound: Logs, weights: Logs, bias: Logs, apart: int, step: int) -> Logs:
    """What is above 0 of the weighted sums, `weights` of shape (size, inputs, outputs), in silence at both ends."""
    reach = (len(weights) - 1) // 2 * apart
    padded = np.pad(sound, ((reach, reach), (0, 0)))
    n = len(sound)
    total = bias + sum(padded[k * apart : k * apart + n : step] @ each for k, each in enumerate(weights))
    return np.asarray(np.maximum(total, 0.0), np.float32)
