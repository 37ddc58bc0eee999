"""How the weights of nets are stored, as whole numbers with a scale for each output; and the mean of two nets."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Pairs = list[tuple[NDArray[np.float32], NDArray[np.float32]]]
"""Of each layer a matrix, shape (inputs, outputs), and offsets."""
MOST = 31
"""The largest weight of a phone net as it is stored: six bits, which pack into three quarters of the space of eight."""


def in_bytes(weights: NDArray[np.floating], most: int = 127) -> tuple[NDArray[np.int8], NDArray[np.float32]]:
    """Weights, shape (..., outputs), as bytes of -`most` to `most`, and the scale of each output, shape (outputs,)."""
    scale = np.maximum(np.abs(weights).reshape(-1, weights.shape[-1]).max(axis=0), 1e-9) / most
    return np.round(weights / scale).astype(np.int8), scale.astype(np.float32)


def stored(name: str, weights: np.ndarray, bias: np.ndarray) -> dict[str, np.ndarray]:
    """The arrays of one layer in a phone net's file, whose names end in `name`."""
    whole, scale = in_bytes(weights, MOST)
    return {f"weights{name}": whole, f"scale{name}": scale, f"bias{name}": bias.astype(np.float32)}


def averaged(first: Pairs, second: Pairs, share: float) -> Pairs:
    """The mean of two nets of the same layers, with that share of the first one."""
    return [
        (share * was + (1.0 - share) * now, share * was_off + (1.0 - share) * off)
        for (was, was_off), (now, off) in zip(first, second, strict=True)
    ]
