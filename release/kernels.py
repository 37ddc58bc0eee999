"""Takes out of OpenBLAS for arm64 what it has for processors that no Raspberry Pi has.

The library has a table of functions for each of fourteen kinds of processor, and chooses one when it is loaded:
CORTEXA53 on a Raspberry Pi 3, CORTEXA57 on a Pi 4, ARMV8 on a Pi 5 and on what it does not know. The functions for the
eleven others, more than a third of the library, lie behind these in one piece. That piece is not loaded any more, and
where one of their tables was chosen, ARMV8's is now, which every processor can use.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

GENERIC = "gotoblas_ARMV8"
KEPT = frozenset({GENERIC, "gotoblas_CORTEXA53", "gotoblas_CORTEXA57"})
_TABLE = re.compile(r"gotoblas_[A-Z0-9]{5,}")


def _fields(text: str) -> np.dtype[np.void]:
    """Of a structure whose lowest byte comes first."""
    pairs = [field.split(":") for field in text.split()]
    return np.dtype([(name, f"<{kind}") for name, kind in pairs])


_HEADER = _fields("ident:V32 segments:u8 sections:u8 sizes:V8 n_segments:u2 section_size:u2 n_sections:u2 names:u2")
_SEGMENT = _fields("type:u4 flags:u4 offset:u8 address:u8 physical:u8 in_file:u8 in_memory:u8 alignment:u8")
_SECTION = _fields("name:u4 type:u4 flags:u8 address:u8 offset:u8 size:u8 more:V24")
_SYMBOL = _fields("name:u4 kind:u1 other:u1 section:u2 address:u8 size:u8")
_RELOCATION = _fields("place:u8 kind:u8 value:u8")
"""Of ELF-64 (man 5 elf)."""
_LOAD = 1
_SPARE = (6, 0x6474E550)
"""Kinds of segment that a library is loaded without: PHDR, where the list of segments is, and GNU_EH_FRAME, how an
exception of C++ passes through, of which it has none."""
_FUNCTION = 2
_RELATIVE = 1027
"""R_AARCH64_RELATIVE: an address in the library itself (ELF for the Arm 64-bit Architecture, 5.7.12)."""

Records = NDArray[Any]


def without_kernels(library: bytes) -> bytes:
    """The library, as long as it was, that loads no code for other processors; `without_symbols` cuts the gap.

    Raises ValueError for one that is not built in that order.
    """
    whole = np.frombuffer(bytearray(library), np.uint8)
    sections = _sections(whole)
    symbols = _records(whole, _SYMBOL, sections[".symtab"])
    names = _names(whole, sections[".strtab"], symbols["name"])
    tables = {name: symbol for name, symbol in zip(names, symbols, strict=True) if _TABLE.fullmatch(name)}
    if GENERIC not in tables:
        raise ValueError("no OpenBLAS for arm64 that chooses its functions by the processor")
    others = {name: table for name, table in tables.items() if name not in KEPT}
    piece = _piece(symbols, names, {name.removeprefix("gotoblas") for name in others})
    relocations = _records(whole, _RELOCATION, sections[".rela.dyn"])
    relative = relocations["kind"] == _RELATIVE
    _check_unreached(whole, sections[".text"], relocations[relative], piece, others)
    chosen = relative & np.isin(relocations["value"], [table["address"] for table in others.values()])
    relocations["value"][chosen] = tables[GENERIC]["address"]
    _unload(whole, piece)
    return whole.tobytes()


def _records(whole: NDArray[np.uint8], kind: np.dtype[Any], section: Any) -> Records:
    """A section as records, in place."""
    return whole[int(section["offset"]) :][: int(section["size"])].view(kind)


def _sections(whole: NDArray[np.uint8]) -> Mapping[str, Any]:
    (header,) = whole[: _HEADER.itemsize].view(_HEADER)
    table = whole[int(header["sections"]) :][: int(header["n_sections"]) * _SECTION.itemsize].view(_SECTION)
    return dict(zip(_names(whole, table[header["names"]], table["name"]), table, strict=True))


def _names(whole: NDArray[np.uint8], strings: Any, starts: Records) -> Sequence[str]:
    """The texts that begin at these places of a section of strings."""
    text = whole[int(strings["offset"]) :][: int(strings["size"])].tobytes()
    return [text[start : text.index(b"\0", start)].decode() for start in starts.tolist()]


def _piece(symbols: Records, names: Sequence[str], endings: Collection[str]) -> range:
    """The addresses of the functions whose names end so, and of what lies between them."""
    function = symbols["kind"] & 15 == _FUNCTION
    ending = np.array([name[name.rfind("_") :] for name in names])
    wanted = symbols[function & np.isin(ending, list(endings))]
    piece = range(int(wanted["address"].min()), int((wanted["address"] + wanted["size"]).max()))
    kept = function & np.isin(ending, [table.removeprefix("gotoblas") for table in KEPT])
    if _within(symbols["address"][kept], piece).any():
        raise ValueError("OpenBLAS's functions for other processors do not lie in one piece")
    return piece


def _check_unreached(
    whole: NDArray[np.uint8], text: Any, relative: Records, piece: range, others: Mapping[str, Any]
) -> None:
    """Only the tables of other processors refer to the piece: no branch, address or pointer of anything else does."""
    code = _records(whole, np.dtype("<u4"), text).astype(np.int64)
    at = int(text["address"]) + 4 * np.arange(len(code))
    branch = code >> 26 & 31 == 0b00101  # B and BL: signed words in the 26 bits below
    page = code >> 24 & 0b10011111 == 0b10010000  # ADRP: signed pages in bits 5 to 23, and 29 and 30 below them
    reached = np.concatenate(
        [
            at[branch] + 4 * _signed(code[branch], 26),
            (at[page] & ~0xFFF) + (_signed(code[page] >> 5 << 2 | code[page] >> 29 & 3, 21) << 12),
        ]
    )
    source = np.concatenate([at[branch], at[page]])
    pointers = relative["place"][_within(relative["value"], piece)]
    known = [_within(pointers, range(table["address"], table["address"] + table["size"])) for table in others.values()]
    if (_within(reached, piece) & ~_within(source, piece)).any() or not np.any(known, axis=0).all():
        raise ValueError("something else in OpenBLAS needs its functions for other processors")


def _signed(number: NDArray[np.int64], bits: int) -> NDArray[np.int64]:
    """The lowest bits as a number with a sign."""
    return ((number & (1 << bits) - 1) ^ 1 << bits - 1) - (1 << bits - 1)


def _within(addresses: Records, piece: range) -> NDArray[np.bool_]:
    return (addresses >= piece.start) & (addresses < piece.stop)


def _unload(whole: NDArray[np.uint8], piece: range) -> None:
    """Have the segment around the piece loaded as two, without the whole pages of the piece."""
    (header,) = whole[: _HEADER.itemsize].view(_HEADER)
    table = whole[int(header["segments"]) :][: int(header["n_segments"]) * _SEGMENT.itemsize].view(_SEGMENT)
    spare = next(kind for kind in _SPARE if kind in table["type"])
    segments = [segment.copy() for segment in table if segment["type"] != spare]
    loaded = [segment for segment in segments if segment["type"] == _LOAD and segment["address"] <= piece.start]
    before = loaded[-1]
    after = before.copy()
    alignment = int(before["alignment"])
    begin, end = -(-piece.start // alignment) * alignment, piece.stop // alignment * alignment
    for field in ("offset", "address", "physical"):
        after[field] += end - before["address"]
    for field in ("in_file", "in_memory"):
        after[field] -= end - before["address"]
        before[field] = begin - before["address"]
    segments.insert(segments.index(before) + 1, after)
    table[:] = segments
