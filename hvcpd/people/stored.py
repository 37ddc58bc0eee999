"""The arrays that come with this folder, which take memory only while they are used.

A robot needs the nets of phones, 3.3 MB, when somebody speaks whom it does not understand; while nobody does, they are
in the system's file cache alone.
"""

from __future__ import annotations

import math
import mmap
import struct
import zipfile
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

NAME_LENGTHS = 26
"""Where a member's header in a zip file has the lengths of its name and of an extra field, which follow in 4 bytes."""

_mapped: list[mmap.mmap] = []


def stored(name: str) -> dict[str, NDArray[Any]]:
    """The arrays in a file of this folder, by name, as `numpy.savez` wrote them, to be read only. Raises ValueError if
    they are compressed."""
    with Path(__file__).with_name(name).open("rb") as file, zipfile.ZipFile(file) as archive:
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


def rest() -> None:
    """Take no memory until the arrays are used again."""
    for pages in _mapped:
        pages.madvise(mmap.MADV_DONTNEED)
