"""Six digits that are good once: counted (HOTP, RFC 4226) on a printed sheet, or by the clock (TOTP, RFC 6238)."""

from __future__ import annotations

import base64
import hmac

DIGITS = 6
"""The length that authenticators on telephones show, and a person can say in three seconds."""
STEP_S = 30
"""Validity of a code of the clock (RFC 6238, section 5.2)."""


def counted_code(key: bytes, count: int, digits: int = DIGITS) -> str:
    """The code number `count` (0 and up) of a key: decimal digits. SHA-1, as authenticators expect."""
    mac = hmac.digest(key, count.to_bytes(8, "big"), "sha1")
    offset = mac[-1] & 0x0F
    number = int.from_bytes(mac[offset : offset + 4], "big") & 0x7FFF_FFFF
    return f"{number % 10**digits:0{digits}d}"


def step_of(wall_s: float) -> int:
    """The number of the code that the clock shows at a time, seconds since 1970."""
    return int(wall_s // STEP_S)


def authenticator_uri(key: bytes, team: str) -> str:
    """The text for an authenticator, as in its "Key URI Format": issuer hvcpd, SHA-1, six digits, 30 s."""
    secret = base64.b32encode(key).decode().rstrip("=")
    return f"otpauth://totp/hvcpd:{team}?secret={secret}&issuer=hvcpd&digits={DIGITS}&period={STEP_S}"
