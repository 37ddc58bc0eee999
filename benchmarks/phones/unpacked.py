"""Data packed by Rob Northen's compressor (ProPack, method 1), as games of the 1990s were.

After a head of 18 bytes come blocks. Each has three Huffman codes, of how many bytes are copied as they are, of how far
back and how long the stretch is that is repeated after them, and then these in turn. Bits are read from words of two
bytes, the lowest first; bytes to be copied lie between these words.
"""

from __future__ import annotations

SIGNATURE = b"RNC\x01"

Codes = dict[tuple[int, int], int]
"""Values by (length in bits, bits)."""


class _Bits:
    def __init__(self, data: bytes) -> None:
        self._data, self._at = data, 18
        self._held = self._word()
        self._n = 16
        self.value_of(2)

    def _word(self) -> int:
        return int.from_bytes(self._data[self._at : self._at + 2], "little")

    def value_of(self, n: int) -> int:
        """The next n bits."""
        value = self._held & ((1 << n) - 1)
        self._held >>= n
        self._n -= n
        if self._n < 16:
            self._at += 2
            self._held |= self._word() << self._n
            self._n += 16
        return value

    def copied(self, n: int) -> bytes:
        """The next n bytes; the word that was read ahead of them comes after them."""
        found = self._data[self._at : self._at + n]
        self._at += n
        self._n -= 16
        self._held = self._held & ((1 << self._n) - 1) | self._word() << self._n
        self._n += 16
        return found

    def codes(self) -> Codes:
        """A Huffman code, whose codes are numbered in order of their lengths; they are read from the last bit on."""
        lengths = [self.value_of(4) for _ in range(self.value_of(5))]
        found, code = Codes(), 0
        for length in range(1, 17):
            for value, its in enumerate(lengths):
                if its == length:
                    bits = code >> (16 - length)
                    found[length, int(f"{bits:0{length}b}"[::-1], 2)] = value
                    code += 1 << (16 - length)
        return found

    def number(self, codes: Codes) -> int:
        """A number: how many bits it has is coded, the first of which is 1."""
        for (length, bits), value in codes.items():
            if self._held & ((1 << length) - 1) == bits:
                self.value_of(length)
                return value if value < 2 else 1 << (value - 1) | self.value_of(value - 1)
        raise ValueError("damaged: no such code")


def unpacked(data: bytes) -> bytes:
    """What was packed. Raises ValueError if the data is damaged, or not of this kind."""
    if not data.startswith(SIGNATURE):
        raise ValueError("not packed by method 1")
    whole = int.from_bytes(data[4:8], "big")
    out, bits = bytearray(), _Bits(data)
    for _ in range(data[17]):
        as_is, back, long = bits.codes(), bits.codes(), bits.codes()
        for left in range(bits.value_of(16), 0, -1):
            if n := bits.number(as_is):
                out += bits.copied(n)
            if left > 1:
                begin = len(out) - bits.number(back) - 1
                n = bits.number(long) + 2
                if begin < 0 or len(out) > whole:
                    raise ValueError("damaged: repeats what was not there")
                stretch = out[begin : begin + n]
                out += (stretch * (n // len(stretch) + 1))[:n]
    if len(out) != whole:
        raise ValueError(f"damaged: {len(out)} instead of {whole} bytes")
    return bytes(out)
