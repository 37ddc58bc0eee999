"""Keys from keys: HKDF with SHA-256 (Krawczyk & Eronen, RFC 5869)."""

from __future__ import annotations

import hmac

HASH = "sha256"
HASH_BYTES = 32
MAX_BYTES = 255 * HASH_BYTES
"""The longest output (RFC 5869, section 2.3)."""


def extract(salt: bytes, secret: bytes) -> bytes:
    """The pseudorandom key of a secret, 32 bytes; an empty salt is one of zeros."""
    return hmac.digest(salt or bytes(HASH_BYTES), secret, HASH)


def expand(pseudorandom_key: bytes, info: bytes, length: int) -> bytes:
    """`length` bytes for the purpose `info`. Raises ValueError for more than MAX_BYTES."""
    if not 0 <= length <= MAX_BYTES:
        raise ValueError(f"HKDF gives up to {MAX_BYTES} bytes, not {length}")
    block, out = b"", b""
    counter = 0
    while len(out) < length:
        counter += 1
        block = hmac.digest(pseudorandom_key, block + info + bytes((counter,)), HASH)
        out += block
    return out[:length]
