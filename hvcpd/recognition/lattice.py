"""Word lattice: the word ends that paths have passed, to which the decoder's tokens point.

A token is the number of a record, or, when negative, the beginning of a sentence: -1 - frame. When nearly all records
are used, the decoder forgets all paths.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hvcpd.recognition.arrays import blank

CAPACITY = 1 << 17
"""Records: about ten a frame while somebody speaks, so two minutes; 3 MB, if ever a path lives that long."""
PAUSE = -1
"""Stands for the instance in the record of a pause's end."""

Tokens = NDArray[np.int32]
Costs = NDArray[np.float32]


@dataclass(frozen=True)
class Step:
    """A word on the traced path: its instance, its first frame, the frame after its last, and its cost.

    `margin`: the extra cost of another word at the same place.
    """

    instance: int
    start_frame: int
    end_frame: int
    cost: float
    margin: float


def token_of_start(frame: int) -> int:
    """The token of a sentence that begins at `frame`."""
    return -1 - frame


class Lattice:
    """Records of word ends and pauses."""

    def __init__(self) -> None:
        self._instance = blank((CAPACITY,), np.int32)
        self._token = blank((CAPACITY,), np.int32)
        self._cost = blank((CAPACITY,), np.float32)
        self._rival = blank((CAPACITY,), np.float32)
        self._frame = blank((CAPACITY,), np.int32)
        self._count = 0

    def clear(self) -> None:
        """Forget all records: no path is left that points to one."""
        self._count = 0

    def add(self, frame: int, instance: NDArray[np.intp] | int, token: Tokens, cost: Costs, rival: Costs) -> Tokens:
        """Store records of paths that end a word (or a pause) with `frame`; return their tokens."""
        numbers = (np.arange(self._count, self._count + len(token)) % CAPACITY).astype(np.int32)
        self._count += len(token)
        self._instance[numbers] = instance
        self._token[numbers] = token
        self._cost[numbers] = cost
        self._rival[numbers] = rival
        self._frame[numbers] = frame
        return numbers

    def frame_of(self, token: Tokens) -> Tokens:
        """The last frame of the word or pause that each record ends."""
        frames: Tokens = np.where(token < 0, -2 - token, self._frame[np.maximum(token, 0)])
        return frames

    @property
    def is_full(self) -> bool:
        """Whether few records are left."""
        return self._count > CAPACITY * 7 // 8

    def trace(self, token: int) -> list[Step]:
        """The words of the path that ends in `token`, first to last."""
        steps: list[Step] = []
        while token >= 0:
            before = int(self._token[token])
            if self._instance[token] != PAUSE:
                start_frame = int(self.frame_of(np.array([before], np.int32))[0]) + 1
                cost = float(self._cost[token])
                before_cost = float(self._cost[before]) if before >= 0 else 0.0
                margin = float(self._rival[token]) - cost
                end_frame = int(self._frame[token]) + 1
                steps.append(Step(int(self._instance[token]), start_frame, end_frame, cost - before_cost, margin))
            token = before
        return steps[::-1]
