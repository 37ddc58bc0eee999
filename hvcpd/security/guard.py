"""Seals or encrypts one robot's sentences, and judges those that it hears.

Counters as in HOTP (RFC 4226): a speaker's seals are numbered, and a listener accepts none that is not after the last
one that it accepted, within a look-ahead window (section 7.2). Farther ahead it accepts the second of two that follow
each other (section 7.4). The counter cannot tell whether a seal that was never heard is old: a robot that was away, or
whose microphone was covered, would believe a recording of a sentence that it missed. So presence is proved separately:
by answering a challenge, which is the sealed "say again" of a robot in doubt, and by every seal soon after that.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from hvcpd.security.cipher import Ciphers, Message
from hvcpd.security.codes import LOST, Codes
from hvcpd.security.keys import KeyRing, TeamKey
from hvcpd.security.seal import SEAL_BITS, Seals, Sentence
from hvcpd.security.silence import CODE_PATIENCE, GrowingSilence, Patience
from hvcpd.security.trust import Trust

NEAR = 16
"""Look-ahead window: number of a speaker's seals in a row that may go unheard. Each factor of two costs one bit: 16
cost 4 of the 24."""
FAR = 2048
"""Largest distance between a seal's number and the last one at which two seals in a row are accepted: a day of talk.
Such a search takes 23 ms, of an encrypted statement 18 ms (x86, one key, in the daemon, which has no OpenSSL for its
hashes); only wrong seals need it."""
RESERVED = 4
"""Step in which counters are kept on the disk, ahead of use: a power cut skips some numbers and repeats none."""
PRESENT_S = 300.0
"""Time after each right seal for which a speaker that has proved its presence counts as present."""
PROVED_S = 1800.0
"""Longest time after the proof for which a speaker counts as present. Without it an attacker that holds back many
orders and plays one every few minutes would keep their speaker present for ever. The proof costs two sentences each
half an hour."""
CHALLENGE_S = 30.0
"""Time for which a challenge holds: two sentences, said slowly, and their turns."""
KEPT = 512
"""Recently accepted seals, kept word by word to tell a recording from a mistake."""
DOUBTED, SURE = "doubted/", "sure/"
"""Marks instead of counters. DOUBTED, of a key: those under it may lag behind, or are LOST; so a speaker is believed
only once it has answered a challenge. SURE, of a speaker: it has, since the doubt of the same number."""
NO_SPEAKER = ("sheet/", "clock/", DOUBTED, SURE, LOST)
"""Prefix of the counters of everything but a speaker's seals."""
SKIPPED = FAR - 2 * NEAR
"""Numbers that a robot whose own counter may lag behind skips: it repeats none, unless nothing could be kept for
a day of talk, and is believed again from its second seal on."""
LOST_BITS = 48
"""Bits of the random number at which a robot that lost its counter begins: it is no longer believed under that key,
but no number is used twice."""
CODE = "code"
"""Codes are counted together under this name, whichever name their speaker gives; no robot has it."""


@dataclass(frozen=True)
class Verdict:
    """The verdict on a sentence; `silence_s`: its speaker is ignored for this long from now.

    `plain`: the decrypted statement, if there was one and the key fits.
    """

    trust: Trust
    silence_s: float | None = None
    plain: bytes | None = field(default=None, repr=False)


@dataclass(frozen=True)
class _Sealed:
    """A sentence and the seal that was said after it."""

    sentence: Sentence
    seal: int
    bits: int

    def find(self, key: TeamKey, challenge: int | None, counters: range) -> tuple[int, None] | None:
        """The first of `counters` under which it is its speaker's; it has nothing to decrypt."""
        seals = Seals(key.voice_key(self.sentence.speaker), self.sentence, challenge, self.bits)
        found = seals.find(self.seal, counters)
        return (found, None) if found is not None else None


_Proof = _Sealed | Message


@dataclass(frozen=True)
class _Heard:
    """The knowledge about one speaker under one key."""

    last: int = -1
    far: int | None = None


class Guard:
    """One robot's. `counters` are those of `saves` in its former life; `wall_s` as for `Codes`."""

    def __init__(
        self,
        own_name: str,
        ring: KeyRing,
        counters: Mapping[str, int] | None = None,
        wall_s: float | None = None,
        bits: int = SEAL_BITS,
        patience: Patience | None = None,
        far_cipher: int = FAR,
    ) -> None:
        """`bits` of a seal, and the look-ahead for encrypted statements, differ in tests and for passive listeners."""
        kept = self._kept = dict(counters or {})
        self._own = own_name.casefold()
        self._ring = ring
        self._bits = bits
        self._far_cipher = far_cipher
        self._silence = GrowingSilence(patience or Patience())
        self._code_silence = GrowingSilence(CODE_PATIENCE)
        self._codes = {key: Codes(key, kept, wall_s) for key in ring.accepted}
        self._heard = {name: _Heard(last) for name, last in kept.items() if not name.startswith(NO_SPEAKER)}
        self._doubts = {name: value for name, value in kept.items() if name.startswith((DOUBTED, SURE))}
        self._own_counter = _name(ring.spoken, self._own)
        self._next = self._reserved = kept.get(self._own_counter, -1) + 1
        self._present_s: dict[str, tuple[float, float]] = {}
        self._asked: dict[str, tuple[int, float]] = {}
        self._asked_by: dict[str, tuple[int, float]] = {}
        self._overheard: dict[str, tuple[int, float]] = {}
        self._taken: OrderedDict[_Proof, bytes | None] = OrderedDict()
        self._saves: dict[str, int] = {}

    def seal(self, sentence: Sentence, now: float, challenges: bool = False) -> int:
        """The seal of this robot's next sentence. `challenges`: it asks its addressee to say something again."""
        challenge = self._answered_by(sentence, now)
        seals = Seals(self._ring.spoken.voice_key(self._own), sentence, challenge, self._bits)
        return self._sent(seals.at(self._count()), sentence, now, challenges)

    def encrypt(self, sentence: Sentence, plain: bytes, now: float, challenges: bool = False) -> int:
        """The packet that says `plain` within `sentence`; otherwise as `seal`."""
        challenge = self._answered_by(sentence, now)
        ciphers = Ciphers(self._ring.spoken.cipher_key(self._own), sentence, challenge)
        return self._sent(ciphers.at(self._count(), plain), sentence, now, challenges)

    def _answered_by(self, sentence: Sentence, now: float) -> int | None:
        """The challenge that this sentence answers: its addressee's, or the latest where it is said to many."""
        to = sentence.addressee.casefold()
        latest = max(self._asked_by, key=lambda name: self._asked_by[name][1], default=to)
        return _valid(self._asked_by.pop(latest if sentence.is_for_many else to, None), now)

    def _count(self) -> int:
        """This robot's next number, used up by this."""
        number, self._next = self._next, self._next + 1
        if self._next > self._reserved:
            self._reserved = self._next + RESERVED - 1
            self._saves[self._own_counter] = self._reserved - 1
        return number

    def _sent(self, seal: int, sentence: Sentence, now: float, challenges: bool) -> int:
        if challenges:
            self._asked[sentence.addressee.casefold()] = (seal, now)
        return seal

    def judge(self, sentence: Sentence, seal: int | None, code: str | None, now: float, asks: bool = False) -> Verdict:
        """The verdict on a sentence with this seal or code, or neither. `asks`: it asks to say something again."""
        if code is not None:
            return self._judge_code(code, now)
        if seal is None:
            return Verdict(Trust.BARE)
        verdict = self._judge(_Sealed(sentence, seal, self._bits), now)
        if asks:
            self.challenged(sentence, seal, verdict, now)
        return verdict

    def judge_message(self, message: Message, now: float) -> Verdict:
        """The verdict on an encrypted statement, and the statement. If it asks to say something again, the caller
        reports that by `challenged`."""
        return self._judge(message, now)

    def challenged(self, sentence: Sentence, seal: int, verdict: Verdict, now: float) -> None:
        """Note that the sentence judged last asks its addressee to repeat a sentence."""
        if verdict.trust.proves_speaker:
            name, to = sentence.speaker.casefold(), sentence.addressee.casefold()
            (self._asked_by if to == self._own else self._overheard)[name if to == self._own else to] = (seal, now)

    def _judge(self, proof: _Proof, now: float) -> Verdict:
        name = proof.sentence.speaker.casefold()
        if self._ring.is_revoked(name):
            return Verdict(Trust.REVOKED)
        if self._silence.is_silent(name, now):
            return Verdict(Trust.SILENCED)
        verdict = self._examine(name, proof, now)
        if verdict.trust is Trust.WRONG:
            return Verdict(Trust.WRONG, self._silence.wrong(name, now))
        if verdict.trust.proves_speaker:
            self._silence.right(name, now)
            self._taken[proof] = verdict.plain
            if len(self._taken) > KEPT:
                self._taken.popitem(last=False)
        return verdict

    def set_clock(self, wall_s: float | None, ring: KeyRing) -> None:
        """When the sample clock was 0, seconds since 1970: the two clocks drift apart by some seconds a day. `ring`:
        the keys that are valid by now."""
        if ring.spoken != self._ring.spoken:
            self._heard[self._own_counter] = _Heard(self._next - 1)
            self._own_counter = _name(ring.spoken, self._own)
            self._next = self._reserved = self._heard.get(self._own_counter, _Heard()).last + 1
        for key in ring.accepted:
            if key not in self._codes:  # the clock was ahead
                self._codes[key] = Codes(key, self._kept, wall_s)
        for codes in self._codes.values():
            codes.wall_s = wall_s
        self._ring = ring

    def saves(self) -> dict[str, int]:
        """Counters that have changed and must be saved; each is returned once."""
        saves, self._saves = self._saves, {}
        return saves

    def _judge_code(self, code: str, now: float) -> Verdict:
        if self._code_silence.is_silent(CODE, now):
            return Verdict(Trust.SILENCED)
        for codes in (self._codes[key] for key in self._ring.accepted):
            if codes.take(code, now):
                self._code_silence.right(CODE, now)
                self._saves |= codes.counters
                return Verdict(Trust.CODE)
        return Verdict(Trust.WRONG, self._code_silence.wrong(CODE, now))

    def _examine(self, name: str, proof: _Proof, now: float) -> Verdict:
        if proof in self._taken:
            return Verdict(Trust.USED, plain=self._taken[proof])
        challenge = _valid(self._asked.get(name), now)
        overheard = _valid(self._overheard.get(name), now)
        others = (None,) if overheard is None else (None, overheard)
        verdict = Verdict(Trust.WRONG)
        for key in self._ring.accepted:
            if challenge is not None and (found := self._take(key, name, proof, challenge)):
                del self._asked[name]
                self._present_s[name] = (now, now)
                self._trust_counter(key, name)
                return Verdict(Trust.FRESH, plain=found[1])
            is_doubted = self._doubts_counter(key, name)
            for other in () if is_doubted else others:
                if found := self._take(key, name, proof, other):
                    return Verdict(self._presence(name, now), plain=found[1])
            elsewhere = self._elsewhere(key, name, proof, challenge, 0 if is_doubted else NEAR)
            verdict = max(verdict, elsewhere, key=lambda v: _RANK.index(v.trust))
        return verdict

    def _presence(self, name: str, now: float) -> Trust:
        """A speaker who was here a moment ago still is."""
        proved_s, last_s = self._present_s.get(name, (float("-inf"), float("-inf")))
        if now - last_s > PRESENT_S or now - proved_s > PROVED_S:
            return Trust.SEALED
        self._present_s[name] = (proved_s, now)
        return Trust.FRESH

    def _take(self, key: TeamKey, name: str, proof: _Proof, challenge: int | None) -> tuple[int, bytes | None] | None:
        """The number of a seal that is one of those that may come next, or follows one that was far ahead."""
        heard = self._heard_of(key, name)
        windows = [range(heard.last + 1, heard.last + 1 + NEAR)]
        if heard.far is not None:
            windows.append(range(heard.far + 1, heard.far + 1 + NEAR))
        found = next((found for window in windows if (found := proof.find(key, challenge, window))), None)
        if found is not None and name != self._own:
            self._heard[_name(key, name)] = _Heard(found[0])
            self._saves[_name(key, name)] = found[0]
        return found

    def _elsewhere(self, key: TeamKey, name: str, proof: _Proof, challenge: int | None, near: int) -> Verdict:
        """Why a seal was not accepted: it is old, or ahead by more than `near`, which is remembered; 0 of a doubted
        speaker, who is asked again, for a seal that may come next may also be one that was heard before."""
        heard = self._heard_of(key, name)
        if found := proof.find(key, None, range(max(heard.last + 1 - KEPT, 0), heard.last + 1)):
            return Verdict(Trust.USED, plain=found[1])
        far = self._far_cipher if isinstance(proof, Message) else FAR
        ahead = range(heard.last + 1 + near, heard.last + 1 + far)
        found = proof.find(key, None, ahead)
        if found is None and challenge is not None:
            found = proof.find(key, challenge, ahead)
        if found is None:
            return Verdict(Trust.WRONG)
        self._heard[_name(key, name)] = replace(heard, far=found[0])
        return Verdict(Trust.AHEAD, plain=found[1])

    def _doubts_counter(self, key: TeamKey, name: str) -> bool:
        """Whether the speaker's counter was lost, and it has not answered a challenge since."""
        doubted = self._doubts.get(DOUBTED + key.fingerprint)
        return doubted is not None and self._doubts.get(SURE + _name(key, name)) != doubted

    def _trust_counter(self, key: TeamKey, name: str) -> None:
        if self._doubts_counter(key, name):
            sure = {SURE + _name(key, name): self._doubts[DOUBTED + key.fingerprint]}
            self._doubts |= sure
            self._saves |= sure

    def _heard_of(self, key: TeamKey, name: str) -> _Heard:
        if name == self._own and key == self._ring.spoken:
            return _Heard(self._next - 1)
        return self._heard.get(_name(key, name), _Heard())


_RANK = (Trust.WRONG, Trust.USED, Trust.AHEAD)


def _valid(challenge: tuple[int, float] | None, now: float) -> int | None:
    """The challenge, if it still holds."""
    return challenge[0] if challenge is not None and now - challenge[1] <= CHALLENGE_S else None


def _name(key: TeamKey, name: str) -> str:
    """The name of a counter on the disk."""
    return f"{key.fingerprint}/{name}"
