"""Functions of NumPy that take less memory here: unique numbers, quantiles, large arrays of zeros, and nets' weights.

NumPy's own functions for the first two load its masked arrays, which keep 2 MB of memory for good.
"""

from __future__ import annotations

import math
import mmap
import struct
import zipfile
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import DTypeLike, NDArray

from hvcpd.errors import reading_own


def unique(numbers: NDArray[np.intp]) -> NDArray[np.intp]:
    """Each of some numbers, 0 or more, once, in ascending order, shape (n,); as `numpy.unique`."""
    ordered = np.sort(numbers, axis=None, kind="stable")
    return ordered[first_occurrences(ordered)]


def first_occurrences(ordered: NDArray[np.intp]) -> NDArray[np.intp]:
    """Where each of some numbers, 0 or more and in ascending order, comes first, shape (n,)."""
    return np.flatnonzero(np.diff(ordered, prepend=-1))


def quantile(values: NDArray[np.floating[Any]], share: float) -> float:
    """The value below which a share, 0 to 1, of all values lies, one or more, none NaN; as `numpy.quantile`."""
    ordered = np.sort(values, axis=None)
    place = (len(ordered) - 1) * share
    before = int(place)
    low, high = ordered[before], ordered[min(before + 1, len(ordered) - 1)]
    weight = place - before
    return float(high - (high - low) * (1 - weight) if weight >= 0.5 else low + (high - low) * weight)


def lazy_zeros(shape: tuple[int, ...], dtype: DTypeLike) -> NDArray[Any]:
    """Zeros, on pages of their own, which take memory only where something was written to them.

    `numpy.zeros` has such pages only where the heap has no gap as large; in a gap it writes to all of it: 2 MB of
    a listening robot, for the back pointers and the scorer (six daemons, 68.0 to 69.0 MB instead of 70.1 to 70.8).
    """
    size = np.dtype(dtype).itemsize * math.prod(shape)
    pages = mmap.mmap(-1, max(size, 1), mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS)
    return np.frombuffer(pages, dtype, math.prod(shape)).reshape(shape)


NAME_LENGTHS = 26
"""Where a member's header in a zip file has the lengths of its name and of an extra field, which follow in 4 bytes."""

_mapped: list[mmap.mmap] = []


def mapped_arrays(path: Path) -> dict[str, NDArray[Any]]:
    """The arrays in a file that `numpy.savez` wrote, by name, memory-mapped and read-only. Raises ConfigError
    where it is missing or damaged. The phone nets, 3.3 MB, are needed only while somebody speaks whom the first pass
    does not understand; otherwise they are in the system's file cache alone."""
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
