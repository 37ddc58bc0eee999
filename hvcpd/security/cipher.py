"""Statements that are encrypted and authenticated: AES-128 in counter mode with CBC-MAC (NIST SP 800-38C, RFC 3610).

The tag has 32 bits, the least that CCM allows, because each further bit costs airtime. Of the common modes only CCM
permits this safely: its tag is a truncated output of a block cipher, and a forgery succeeds with probability 2^-32
whatever is changed, whereas short tags of GCM leak its key (Ferguson 2005), and Poly1305's, cut short, can be guessed.

The nonce is the speaker's counter, which is not spoken: as with seals, a listener tries those that may come next.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from hvcpd.security.keys import TeamKey
from hvcpd.security.seal import COUNTER_BYTES, Sentence, framed

if TYPE_CHECKING:
    from cryptography.hazmat.primitives.ciphers.aead import AESCCM

TAG_BYTES = 4
NONCE_BYTES = 13
"""The longest of CCM: messages have up to 64 KiB then, which is plenty for two bytes."""
_VERSION = b"hvcpd cipher 1"


@dataclass(frozen=True)
class Message:
    """The content of an encrypted statement on the air: the `sentence` around it, and the `packet` of `n_bytes`,
    including the tag, as a number."""

    sentence: Sentence
    packet: int
    n_bytes: int

    def find(self, key: TeamKey, challenge: int | None, counters: range) -> tuple[int, bytes] | None:
        """The first of `counters` under which it is its speaker's, and the decrypted statement."""
        return Ciphers(key.cipher_key(self.sentence.speaker), self.sentence, challenge).find(self, counters)


class Ciphers:
    """All encryptions under one speaker's key, 16 bytes, of a statement in one sentence.

    `challenge` is the seal or packet that it answers, None for none. Sentence and challenge are authenticated with it.
    """

    def __init__(self, key: bytes, sentence: Sentence, challenge: int | None = None) -> None:
        self._aead = _aead(key)
        self._with = framed(_VERSION, sentence, challenge)

    def at(self, counter: int, plain: bytes) -> int:
        """The packet number `counter`, 0 and up."""
        return int.from_bytes(self._aead.encrypt(_nonce(counter), plain, self._with), "big")

    def find(self, message: Message, counters: range) -> tuple[int, bytes] | None:
        """The first of `counters` under which the message is authentic, and its plain text."""
        from cryptography.exceptions import InvalidTag

        if message.packet >> 8 * message.n_bytes:  # code words hold some bits more than bytes
            return None
        packet = message.packet.to_bytes(message.n_bytes, "big")
        for counter in counters:
            try:
                return counter, self._aead.decrypt(_nonce(counter), packet, self._with)
            except InvalidTag:
                continue
        return None


def _nonce(counter: int) -> bytes:
    return counter.to_bytes(COUNTER_BYTES, "big").rjust(NONCE_BYTES, b"\0")


def _aead(key: bytes) -> AESCCM:
    """Loaded only when needed: 8 MB that a robot without encryption does not need."""
    from cryptography.hazmat.primitives.ciphers.aead import AESCCM

    return AESCCM(key, tag_length=TAG_BYTES)
