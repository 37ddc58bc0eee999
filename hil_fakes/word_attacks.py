"""Attacks on sealed speech at the level of words: an attacker that hears all, says anything, and covers microphones at
will.

Two honest robots talk to a third, the listener. Between their sentences the attacker, who has no key, says one of its
own, made from sentences that it has heard. Nothing here is silenced after wrong seals: the seals alone must keep it
out.
"""

from __future__ import annotations

import random
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field, replace

from hil_fakes.word_seals import keyed_book
from hvcpd.config.tasks import TaskDefinition
from hvcpd.coordination.actions import Role
from hvcpd.coordination.coordination import Coordination
from hvcpd.coordination.trusting import believes
from hvcpd.language import messages as m
from hvcpd.language.marks import SEAL_WORDS, is_sealed
from hvcpd.language.phrasebook import Phrasebook
from hvcpd.language.spelling import BITS
from hvcpd.robot.sealing import Sealing
from hvcpd.security.guard import CHALLENGE_S, Guard
from hvcpd.security.keys import KEY_BYTES, KeyRing, TeamKey
from hvcpd.security.seal import SEAL_BITS
from hvcpd.security.silence import Patience

NAMES = ("Rob", "Zoe", "Bot")
LISTENER = "Bot"
PACE_S = 6.0
"""Between two sentences."""
UNHEARD = 0.2
"""The share of honest sentences that the listener does not hear."""
RESTARTS = 0.01
"""The chance before each honest sentence that the listener is switched off and on."""
MOVING = (m.TurnBy(90.0), m.MoveBy(1.0), m.Order(m.TaskByNumber(1)), m.ComeBack())
"""Sentences whose recording is useful to an attacker if the listener never heard them."""


@dataclass
class Tally:
    """The result: attacks and those believed, by kind; honest sentences heard, and those believed."""

    tried: Counter[str] = field(default_factory=Counter)
    believed: Counter[str] = field(default_factory=Counter)
    honest: int = 0
    honest_believed: int = 0


class WordAttacks:
    """`run` makes attacks of all kinds in turn; `bits` shortens the seals, to measure the value of a guess. With
    `encrypts` the honest robots encrypt their statements, and the attacks are on their messages."""

    def __init__(
        self, seed: int, tasks: tuple[TaskDefinition, ...], bits: int = SEAL_BITS, encrypts: bool = False
    ) -> None:
        self._rng = random.Random(seed)
        self._bits = bits
        self._encrypts = encrypts
        self._ring = KeyRing(TeamKey(self._rng.randbytes(KEY_BYTES)))
        self._book: Phrasebook = keyed_book(NAMES, tasks)
        self._counters: dict[str, int] = {}
        self._speakers = {name: self._sealing(name) for name in NAMES}
        self._ears = Coordination(Role(LISTENER, "plant", roster=NAMES), tasks, self._rng)
        self._now = 0.0
        self._heard: list[m.Utterance] = []
        self._own: list[m.Utterance] = []
        self.tally = Tally()
        self._kinds: dict[str, Callable[[], m.Utterance]] = {
            "replay at once": lambda: self._heard[-1],
            "replay later": self._recording,
            "replay after a restart": self._after_restart,
            "replay of what was not heard": self._missed,
            "replay as another robot": self._as_another,
            "its own voice played back": lambda: self._rng.choice(self._own),
            "seal of another sentence": lambda: replace(self._invented(), mark=self._recording().mark),
            "other words under an unheard seal": lambda: replace(self._invented(), mark=self._missed().mark),
            "other addressee under an unheard seal": self._readdressed,
            "one word of an unheard seal changed": self._one_word_wrong,
            "seal cut from two": self._spliced,
            "guess": self._guess,
            "code words of a message for a seal": self._recast,
            "no seal": self._invented,
        }

    def run(self, n: int) -> Tally:
        """Make `n` attacks, one after each honest sentence."""
        for _ in range(20):
            self._honest()
        for number in range(n):
            self._honest()
            kind = tuple(self._kinds)[number % len(self._kinds)]
            attack = self._kinds[kind]()
            self.tally.tried[kind] += 1
            self.tally.believed[kind] += self._believes(attack)
        return self.tally

    def _sealing(self, name: str) -> Sealing:
        counters = self._counters if name == LISTENER else None
        guard = Guard(name, self._ring, counters, bits=self._bits, patience=Patience(free=float("inf")))
        return Sealing(guard, self._encrypts)

    def _honest(self) -> None:
        """A speaker says a sentence; the listener may miss it, and doubts speakers that have been silent for long."""
        self._now += PACE_S
        if self._rng.random() < RESTARTS:
            self._restart()
        drawn = self._sample()
        said = self._sealed(drawn.speaker or "", drawn)
        own = self._sealed(LISTENER, m.Utterance(LISTENER, m.ToRobot("Rob"), None, m.Confirmed()))
        self._own = [*self._own[-50:], own]
        for name in NAMES[:2]:
            self._speakers[name].judge(own, self._book, self._now)
        if self._rng.random() < UNHEARD:
            return
        self.tally.honest += 1
        believed = self._believes(said) or self._proves(said)
        self.tally.honest_believed += believed
        self._heard = [*self._heard[-300:], said]

    def _proves(self, said: m.Utterance) -> bool:
        """The listener asks for it again, sealed, and is answered."""
        name = said.speaker or ""
        asked = self._sealed(LISTENER, m.Utterance(LISTENER, m.ToRobot(name), None, m.SayAgain()))
        self._speakers[name].judge(asked, self._book, self._now)
        again = self._sealed(name, replace(said, mark=None))
        self._heard.append(again)
        return self._believes(again)

    def _sealed(self, name: str, utterance: m.Utterance) -> m.Utterance:
        return self._speakers[name].marked(utterance, self._book, self._now)

    def _believes(self, utterance: m.Utterance) -> bool:
        recogniser = self._speakers[LISTENER]
        opened, verdict = recogniser.judge(utterance, self._book, self._now)
        self._counters |= recogniser.guard.saves()
        own = utterance.speaker == LISTENER
        return verdict.trust.proves_speaker if own else believes(self._ears.knowledge, opened, verdict.trust)

    def _sample(self) -> m.Utterance:
        """Something sealed that an honest robot says to the listener, or to all."""
        while True:
            drawn = self._book.sample(self._rng)
            if is_sealed(drawn.statement) and not isinstance(drawn.statement, m.SayAgain) and drawn.speaker:
                to = self._rng.choice((m.ToRobot(LISTENER), m.ToAll()))
                return replace(drawn, speaker=self._rng.choice(NAMES[:2]), addressee=to)

    def _invented(self) -> m.Utterance:
        return replace(self._sample(), addressee=m.ToRobot(LISTENER))

    def _recording(self) -> m.Utterance:
        return self._rng.choice(self._heard)

    def _restart(self) -> None:
        self._speakers[LISTENER] = self._sealing(LISTENER)

    def _after_restart(self) -> m.Utterance:
        self._restart()
        return self._recording()

    def _missed(self) -> m.Utterance:
        """An honest robot's order to the listener, which the attacker kept from it, to be played after a restart."""
        said = m.Utterance("Rob", m.ToRobot(LISTENER), None, self._rng.choice(MOVING))
        recorded = self._sealed("Rob", said)
        self._restart()
        self._now += 2.0 * CHALLENGE_S
        return recorded

    def _as_another(self) -> m.Utterance:
        heard = self._recording()
        return replace(heard, speaker="Zoe" if heard.speaker == "Rob" else "Rob")

    def _readdressed(self) -> m.Utterance:
        said = m.Utterance("Rob", m.ToRobot("Zoe"), None, self._rng.choice(MOVING))
        return replace(self._sealed("Rob", said), addressee=m.ToRobot(LISTENER))

    def _guess(self) -> m.Utterance:
        """A seal, or the packet of a message, drawn at random."""
        mark: m.Mark = m.Seal(self._rng.getrandbits(self._bits))
        if self._encrypts:
            n_words = self._book.cipher_words
            mark = m.Cipher(self._rng.getrandbits(BITS * n_words), n_words)
        return replace(self._invented(), mark=mark)

    def _recast(self) -> m.Utterance:
        """The code words of a message, or the last of them, as if they were the seal of a plain sentence."""
        value, _ = _value_of(self._missed())
        return replace(self._invented(), mark=m.Seal(value & (1 << self._bits) - 1))

    def _one_word_wrong(self) -> m.Utterance:
        missed = self._missed()
        value, n_words = _value_of(missed)
        place, other = self._rng.randrange(n_words), self._rng.randrange(1, 1 << BITS)
        return self._with_value(missed, value ^ other << BITS * place)

    def _spliced(self) -> m.Utterance:
        """The first half of one seal and the second of another, after words that both had."""
        a, b = self._missed(), self._recording()
        (first, n_words), (second, _) = _value_of(a), _value_of(b)
        half = n_words // 2 * BITS
        return self._with_value(a, first >> half << half | second & (1 << half) - 1)

    def _with_value(self, utterance: m.Utterance, value: int) -> m.Utterance:
        if isinstance(utterance.mark, m.Cipher):
            return replace(utterance, mark=replace(utterance.mark, value=value))
        return replace(utterance, mark=m.Seal(value & (1 << self._bits) - 1))


def _value_of(utterance: m.Utterance) -> tuple[int, int]:
    """The number that the code words say, and how many there are."""
    match utterance.mark:
        case m.Cipher(value, n_words):
            return value, n_words
        case m.Seal(value):
            return value, SEAL_WORDS
        case _:
            return 0, SEAL_WORDS
