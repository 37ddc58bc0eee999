"""PNG pictures of 8 bits a pixel with a palette (ISO/IEC 15948), with numpy and zlib alone."""

from __future__ import annotations

import struct
import zlib

import numpy as np
from numpy.typing import NDArray

MAGIC = b"\x89PNG\r\n\x1a\n"
_INDEXED = 3

MAGMA = "000004 180f3e 451077 721f81 9f2f7f cd4071 f1605d fd9567 fec98d fcfdbf".split()
"""Ten of the stops of the colour map "magma" (van der Walt & Smith 2015, CC0): evenly rising in lightness, legible to
the colour-blind and in grey print."""


def magma(levels: int) -> NDArray[np.uint8]:
    """The colour map in `levels` steps: shape (levels, 3), RGB, uint8."""
    stops = np.array([[int(stop[i : i + 2], 16) for i in (0, 2, 4)] for stop in MAGMA], dtype=np.float64)
    at = np.linspace(0.0, len(stops) - 1.0, levels)
    channels = [np.interp(at, np.arange(len(stops)), stops[:, c]) for c in range(3)]
    return np.rint(np.stack(channels, axis=1)).astype(np.uint8)


def encode_png(pixels: NDArray[np.uint8], palette: NDArray[np.uint8]) -> bytes:
    """A picture: `pixels`, shape (height, width), are rows of `palette`, shape (k, 3), RGB. ValueError if empty."""
    height, width = pixels.shape
    if height == 0 or width == 0 or not 0 < len(palette) <= 256 or int(pixels.max()) >= len(palette):
        raise ValueError(f"no picture of {width} × {height} pixels with {len(palette)} colours")
    rows = np.zeros((height, width + 1), dtype=np.uint8)  # each row after its filter's number, 0: none
    rows[:, 1:] = pixels
    header = struct.pack(">IIBBBBB", width, height, 8, _INDEXED, 0, 0, 0)
    chunks = [
        (b"IHDR", header),
        (b"PLTE", palette.tobytes()),
        (b"IDAT", zlib.compress(rows.tobytes(), 9)),
        (b"IEND", b""),
    ]
    return MAGIC + b"".join(_chunk(kind, data) for kind, data in chunks)


def _chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
