"""Back pointers: the word ends that paths have passed, to which the decoder's tokens point.

A token is the number of a record, or, when negative, the start of a sentence: -1 - frame. When nearly all records are
used, the decoder forgets all paths.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hvcpd.recognition.arrays import lazy_zeros

CAPACITY = 1 << 17
"""Number of records: about ten a frame while somebody speaks, so two minutes; 3 MB if a path ever lives that long."""
PAUSE = -1
"""The instance in the record of a pause."""
_RECORD = np.dtype([("frame", "i4"), ("instance", "i4"), ("token", "i4"), ("cost", "f4"), ("rival", "f4")])

Tokens = NDArray[np.int32]
Costs = NDArray[np.float32]


@dataclass(frozen=True)
class TracedWord:
    """A word of a traced path: its instance, its first frame, the frame after its last, its cost, and the `margin`, the
    extra cost of the best other word in the same place."""

    instance: int
    start_frame: int
    end_frame: int
    cost: float
    margin: float


def start_token(frame: int) -> int:
    """The token of a sentence that begins at `frame`."""
    return -1 - frame


class BackPointers:
    """Records of word ends and pauses."""

    def __init__(self) -> None:
        self._records = lazy_zeros((CAPACITY,), _RECORD)
        self._count = 0

    def clear(self) -> None:
        """Forget all records: no path is left that points to one."""
        self._count = 0

    def add(self, frame: int, instance: NDArray[np.intp] | int, token: Tokens, cost: Costs, rival: Costs) -> Tokens:
        """Store records of paths that end a word (or a pause) with `frame`; return their tokens."""
        numbers = np.arange(self._count, self._count + len(token), dtype=np.int32) % CAPACITY
        self._count += len(token)
        new = np.empty(len(token), _RECORD)
        new["frame"], new["instance"], new["token"], new["cost"], new["rival"] = frame, instance, token, cost, rival
        self._records[numbers] = new
        return numbers

    def frame_of(self, token: Tokens) -> Tokens:
        """The last frame of the word or pause that each record ends."""
        frames: Tokens = np.where(token < 0, -2 - token, self._records["frame"][np.maximum(token, 0)])
        return frames

    @property
    def is_full(self) -> bool:
        """Whether few records are left."""
        return self._count > CAPACITY * 7 // 8

    def trace(self, token: int) -> list[TracedWord]:
        """The words of the path that ends in `token`, first to last."""
        steps: list[TracedWord] = []
        while token >= 0:
            record = self._records[token]
            before = int(record["token"])
            if record["instance"] != PAUSE:
                start_frame = int(self.frame_of(np.array([before], np.int32))[0]) + 1
                cost = float(record["cost"])
                before_cost = float(self._records["cost"][before]) if before >= 0 else 0.0
                margin = float(record["rival"]) - cost
                end_frame = int(record["frame"]) + 1
                steps.append(TracedWord(int(record["instance"]), start_frame, end_frame, cost - before_cost, margin))
            token = before
        return steps[::-1]
