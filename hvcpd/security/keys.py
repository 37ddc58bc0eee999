"""The team's key and keys derived from it. No object here shows a secret when it is printed."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

from hvcpd.security.hkdf import HASH_BYTES, expand, extract

KEY_BYTES = 16
"""128 bits: beyond guessing, and 24 words on a recovery sheet."""
SALT = b"hvcpd team key, version 1"
CODE_KEY_BYTES = 20
"""The length that RFC 4226 (section 4, R6) recommends, and authenticators accept."""
FINGERPRINT_BYTES = 4
"""Enough to see by eye that two robots have the same key."""


@dataclass(frozen=True)
class TeamKey:
    """One secret of a team. Raises ValueError for a secret of another length than KEY_BYTES."""

    secret: bytes = field(repr=False)

    def __post_init__(self) -> None:
        if len(self.secret) != KEY_BYTES:
            raise ValueError(f"a team key has {KEY_BYTES} bytes")

    @cached_property
    def fingerprint(self) -> str:
        """Identifies a key without revealing it: hexadecimal."""
        return self._derived(b"fingerprint", FINGERPRINT_BYTES).hex()

    def voice_key(self, name: str) -> bytes:
        """The key with which the robot of that name seals its sentences; upper and lower case are the same."""
        return self._derived(b"voice/" + name.casefold().encode(), HASH_BYTES)

    def cipher_key(self, name: str) -> bytes:
        """The key with which it encrypts; AES-128."""
        return self._derived(b"cipher/" + name.casefold().encode(), KEY_BYTES)

    @cached_property
    def sheet_key(self) -> bytes:
        """The key of the codes on the printed sheet."""
        return self._derived(b"sheet", CODE_KEY_BYTES)

    @cached_property
    def clock_key(self) -> bytes:
        """The key of the codes that an authenticator shows."""
        return self._derived(b"clock", CODE_KEY_BYTES)

    def _derived(self, purpose: bytes, length: int) -> bytes:
        return expand(extract(SALT, self.secret), purpose, length)


@dataclass(frozen=True)
class KeyRing:
    """A robot's keys: the key that it speaks with, others that it accepts, and the names that it no longer trusts."""

    spoken: TeamKey
    others: tuple[TeamKey, ...] = ()
    revoked: frozenset[str] = frozenset()

    @property
    def accepted(self) -> tuple[TeamKey, ...]:
        return (self.spoken, *self.others)

    def is_revoked(self, name: str) -> bool:
        return name.casefold() in {revoked.casefold() for revoked in self.revoked}
