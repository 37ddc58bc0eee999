"""Fitted weights: one reviewed file, `fitted.json`, which `make fit` writes; memory-mapped arrays of nets; and logistic
regression."""

from __future__ import annotations

import json
import math
import mmap
import struct
import zipfile
from collections.abc import Iterable
from functools import cache
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from hvcpd.errors import reading_own

LEAST_PROBABILITY = 1e-4
"""Smallest probability of an event, and of its opposite: no recogniser is more certain."""


def fitted(section: str) -> dict[str, Any]:
    """The weights of one model: `fitted` (the date), `by`, `data` and `score` document their origin. Raises KeyError if
    there is no such model."""
    return _file()[section]


def logistic(logit: float) -> float:
    """The probability with these log odds."""
    return 1.0 / (1.0 + math.exp(-max(logit, -700.0)))


def fitted_probability(section: str, features: Iterable[float]) -> float:
    """The probability by a model of logistic regression: its log odds are the bias and the weighted sum of the
    features, in the order of the weights. Raises KeyError as `fitted`."""
    model = fitted(section)
    return logistic(model["bias"] + sum(w * x for w, x in zip(model["weights"].values(), features, strict=True)))


def logit(probability: float) -> float:
    """The log odds of a probability, which counts as LEAST_PROBABILITY away from 0 and 1 at least."""
    probability = min(max(probability, LEAST_PROBABILITY), 1.0 - LEAST_PROBABILITY)
    return math.log(probability / (1.0 - probability))


@cache
def _file() -> dict[str, dict[str, Any]]:
    path = Path(__file__).with_name("fitted.json")
    with reading_own(path):
        sections: dict[str, dict[str, Any]] = json.loads(path.read_text("utf-8"))
    return sections


NAME_LENGTHS = 26
"""Where a member's header in a zip file has the lengths of its name and of an extra field, which follow in 4 bytes."""

_mapped: list[mmap.mmap] = []


def mapped_arrays(path: Path) -> dict[str, NDArray[Any]]:
    """The arrays in a file that `numpy.savez` wrote, by name, memory-mapped and read-only. Raises ValueError if they
    are compressed. The phone nets, 3.3 MB, are needed only while somebody speaks whom the first pass does not
    understand; otherwise they are in the system's file cache alone."""
    with reading_own(path), path.open("rb") as file, zipfile.ZipFile(file) as archive:
        pages = mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ)
        _mapped.append(pages)
        members = archive.infolist()
        return {each.filename.removesuffix(".npy"): _array(file, pages, each.header_offset) for each in members}


def _array(file: BinaryIO, pages: mmap.mmap, header: int) -> NDArray[Any]:
    file.seek(header + NAME_LENGTHS)
    file.seek(sum(struct.unpack("<HH", file.read(4))), 1)
    np.lib.format.read_magic(file)
    shape, by_columns, dtype = np.lib.format.read_array_header_1_0(file)
    flat = np.frombuffer(pages, dtype, math.prod(shape), file.tell())
    return flat.reshape(shape, order="F" if by_columns else "C")


def release_pages() -> None:
    """Release the memory of mapped arrays until they are used again."""
    for pages in _mapped:
        pages.madvise(mmap.MADV_DONTNEED)
