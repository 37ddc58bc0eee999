"""The seal of a sentence: a truncated HMAC over its words, its speaker and addressee, and a counter.

HMAC-SHA-256 (RFC 2104) cut to its first bits, as RFC 4226 does it with its own. With the counter no two seals of a
speaker are alike; with a challenge the seal also proves that its speaker has just heard the asking robot.
"""

from __future__ import annotations

import hmac
from dataclasses import dataclass

from hvcpd.security.hkdf import HASH

SEAL_BITS = 24
"""Four words of 64. See docs/security.md for the value of a guess."""
COUNTER_BYTES = 8
_VERSION = b"hvcpd seal 1"


@dataclass(frozen=True)
class Sentence:
    """The sealed text: the canonical words, as the phrasebook says the meaning, with speaker and addressee."""

    speaker: str
    addressee: str
    words: tuple[str, ...]

    @property
    def is_for_many(self) -> bool:
        """Whether it is said to all, to a team or to nobody in particular; no robot has this name."""
        return self.addressee in ("", "all") or self.addressee.startswith("team ")

    def encoded(self) -> bytes:
        """Each part after its length, so that no two sentences are encoded alike."""
        parts = (self.speaker.casefold(), self.addressee.casefold(), *self.words)
        return b"".join(len(p).to_bytes(4, "big") + p for p in map(str.encode, parts))


def framed(version: bytes, sentence: Sentence, challenge: int | None) -> bytes:
    """The authenticated bytes, each part after its length; `challenge` is what the sentence answers, None for none."""
    answered = b"" if challenge is None else challenge.to_bytes(COUNTER_BYTES, "big")
    return b"".join(len(part).to_bytes(4, "big") + part for part in (version, sentence.encoded(), answered))


class Seals:
    """All seals of one sentence under one key; `challenge` is the seal that it answers, None for none."""

    def __init__(self, key: bytes, sentence: Sentence, challenge: int | None = None, bits: int = SEAL_BITS) -> None:
        self._mac = hmac.new(key, framed(_VERSION, sentence, challenge), HASH)
        self._bits = bits

    def at(self, counter: int) -> int:
        """The seal number `counter`, 0 and up."""
        mac = self._mac.copy()
        mac.update(counter.to_bytes(COUNTER_BYTES, "big"))
        return int.from_bytes(mac.digest(), "big") >> (mac.digest_size * 8 - self._bits)

    def find(self, seal: int, counters: range) -> int | None:
        """The first of `counters` with this seal."""
        return next((counter for counter in counters if counter >= 0 and self.at(counter) == seal), None)
