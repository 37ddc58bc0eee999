"""Takes out of a shared library what only debuggers read, where strip cannot.

auditwheel's patchelf puts new segments behind the symbol table; strip would move those off the page boundaries, and no
loader takes them. Here whole pages between the segments are cut out, and the list of sections, which no loader reads.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator

_HEADER = struct.Struct("<16s2HI3QI6H")
_SEGMENT = struct.Struct("<2I6Q")
"""ELF-64 of a computer whose lowest byte comes first (man 5 elf)."""
_MAGIC = b"\x7fELF\x02\x01"
_LOAD = 1
_SEGMENTS_AT, _SECTIONS_AT, _SEGMENT_BYTES, _N_SEGMENTS, _N_SECTIONS, _SECTION_NAMES = 5, 6, 9, 10, 12, 13
_TYPE, _OFFSET, _FILE_BYTES, _ALIGNMENT = 0, 2, 5, 7


def without_symbols(library: bytes) -> bytes:
    """The library without its symbol table and sections. Raises ValueError for what is no such library."""
    if not library.startswith(_MAGIC):
        raise ValueError("no 64-bit little-endian ELF file")
    header = list(_HEADER.unpack_from(library))
    table = range(header[_SEGMENTS_AT], header[_SEGMENTS_AT] + header[_N_SEGMENTS] * _SEGMENT.size, _SEGMENT.size)
    segments = [list(_SEGMENT.unpack_from(library, at)) for at in table]
    kept = list(_kept([segment for segment in segments if segment[_TYPE] == _LOAD]))
    header[_SECTIONS_AT] = header[_N_SECTIONS] = header[_SECTION_NAMES] = 0
    whole = bytearray(library)
    _HEADER.pack_into(whole, 0, *header)
    for at, segment in zip(table, segments, strict=True):
        segment[_OFFSET] -= _cut_before(segment[_OFFSET], kept)
        _SEGMENT.pack_into(whole, at, *segment)
    return b"".join(whole[part.start : part.stop] for part in kept)


def _kept(loaded: list[list[int]]) -> Iterator[range]:
    """The parts of the file that stay. Each gap is cut by a multiple of the alignment: a segment's place in the file
    and its address must agree to a page."""
    alignment = max(segment[_ALIGNMENT] for segment in loaded)
    begin = end = 0
    for segment in sorted(loaded, key=lambda segment: segment[_OFFSET]):
        gap = (segment[_OFFSET] - end) // alignment * alignment
        if gap > 0:
            yield range(begin, segment[_OFFSET] - gap)
            begin = segment[_OFFSET]
        end = max(end, segment[_OFFSET] + segment[_FILE_BYTES])
    yield range(begin, end)


def _cut_before(offset: int, kept: list[range]) -> int:
    """Number of bytes that are cut out before a place in the file."""
    before = [part for part in kept if part.start <= offset]
    return before[-1].start - sum(len(part) for part in before[:-1])
