"""A team key as a number with a checksum, to be written down in words and typed in again."""

from __future__ import annotations

import hashlib

from hvcpd.security.keys import KEY_BYTES

CHECK_BYTES = 2
"""One mistake in 65,536 goes unnoticed; with the key 144 bits, 24 words of 64."""


def checked_number(secret: bytes) -> int:
    """The key followed by the first bits of its SHA-256."""
    return int.from_bytes(secret + _check(secret), "big")


def secret_of(number: int) -> bytes | None:
    """The key of such a number; None when it does not fit its checksum."""
    written = number.to_bytes(KEY_BYTES + CHECK_BYTES, "big")
    secret = written[:KEY_BYTES]
    return secret if _check(secret) == written[KEY_BYTES:] else None


def _check(secret: bytes) -> bytes:
    return hashlib.sha256(b"hvcpd recovery sheet" + secret).digest()[:CHECK_BYTES]
