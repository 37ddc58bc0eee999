"""Attacks on sealed speech at the level of sound: a loudspeaker and a recorder in the room of a whole robot.

The listener is a robot that was stopped, so that nothing drives: an order that it believes it refuses with "I have
stopped", and one that it does not believe in any other way, or not at all. An honest robot talks to it in between. The
attacker has no key, but the honest robot's very voice, all recordings, a pair of scissors, and noise.
"""

from __future__ import annotations

import random
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from hil_fakes.room import PinkNoise
from hil_fakes.word_attacks import LISTENER, NAMES
from hvcpd.assembly.make import make_robot
from hvcpd.assembly.plan import MemoryPlan, RobotPlan, SecurityPlan, TeamPlan
from hvcpd.assembly.sound import Sound
from hvcpd.config.task_file import load_tasks
from hvcpd.config.tasks import default_tasks_path
from hvcpd.coordination.actions import Role
from hvcpd.language import messages as m
from hvcpd.language.marks import SEAL_WORDS
from hvcpd.language.spelling import BITS
from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from hvcpd.robot.records import SaidRecord, SaveCounter
from hvcpd.robot.robot import Robot
from hvcpd.robot.sealing import Sealing
from hvcpd.robot.speech_output import spoken
from hvcpd.security.guard import Guard
from hvcpd.security.keys import KEY_BYTES, KeyRing, TeamKey
from hvcpd.security.seal import SEAL_BITS
from hvcpd.security.silence import Patience
from hvcpd.synthesis.leveling import audible

BLOCK = 400
NOISE_RMS = 0.003
"""20 dB below speech of LEVEL."""
LEVEL = 0.3
"""Factor of the synthesizer's own level: about -30 dBFS at the microphone."""
QUIET_S = 1.6
"""After this time without a word no answer is expected: the longest gap of an answer, and a margin."""
MOTIONS = (m.TurnBy(90.0), m.TurnBy(-90.0), m.MoveBy(1.0), m.MoveBy(2.0), m.ComeBack())


@dataclass(frozen=True)
class Take:
    """A sentence as it was said: its meaning with its seal, its sound, and where its seal begins in that, samples."""

    utterance: m.Utterance
    sound: Samples
    seal_at: int


class AudioAttacks:
    """`run` makes attacks of all kinds in turn. `tried`, `believed`: how many of each kind; `honest`: sentences of the
    honest robot that were believed, and all. With `encrypts` it hides what it says, and its messages are attacked."""

    def __init__(self, seed: int, sound: Sound, encrypts: bool = False) -> None:
        self._rng = random.Random(seed)
        self._sound = sound
        self._ring = KeyRing(TeamKey(self._rng.randbytes(KEY_BYTES)))
        self._counters: dict[str, int] = {}
        self._noise = PinkNoise(NOISE_RMS, seed)
        self._encrypts = encrypts
        self._rob = Sealing(Guard("Rob", self._ring), encrypts)
        self._takes: list[Take] = []
        self._robot = self._switch_on()
        self.tried: Counter[str] = Counter()
        self.believed: Counter[str] = Counter()
        self.honest = [0, 0]
        self._kinds: dict[str, Callable[[], Samples]] = {
            "replay at once": lambda: self._takes[-1].sound,
            "replay later": lambda: self._recording().sound,
            "replay after a restart": self._after_restart,
            "replay by another robot": lambda: self._spoken(self._recording().utterance, "Zoe").sound,
            "sentence and seal of two recordings": self._scissors,
            "guess": lambda: self._spoken(self._guessed()).sound,
            "guess in another voice": lambda: self._spoken(self._guessed(), "Zoe").sound,
            "other words under an unheard seal": self._other_words,
            "other addressee under an unheard seal": self._readdressed,
            "one word of an unheard seal changed": self._one_word_wrong,
            "jammed, and played after a restart": self._jammed,
            "replay over other talk": self._overlapping,
            "no seal": lambda: self._spoken(self._invented(None)).sound,
        }

    def run(self, n: int) -> None:
        """Make `n` attacks, an honest sentence before each kind's first and then every few."""
        for number in range(n):
            if number % 3 == 0 or len(self._takes) < 3:
                self._say_honestly()
            kind = tuple(self._kinds)[number % len(self._kinds)]
            attack = self._kinds[kind]()
            self.tried[kind] += 1
            self.believed[kind] += self._is_believed(self._play(attack))

    def _switch_on(self) -> Robot:
        tasks = load_tasks(default_tasks_path())
        role = Role(LISTENER, "plant", volunteer=False)
        plan = RobotPlan(
            role,
            TeamPlan(NAMES),
            tasks,
            self._rng.getrandbits(32),
            memory=MemoryPlan(stopped=True, counters=dict(self._counters)),
            # The seals alone must keep attacks out.
            security=SecurityPlan(self._ring, self._encrypts, Patience(free=float("inf"))),
        )
        robot = make_robot(plan, self._sound)
        self._robot = robot
        self._listen(np.zeros(2 * SAMPLE_RATE_HZ, np.float32))
        return robot

    def _listen(self, sound: Samples) -> list[m.Utterance]:
        """The listener's sentences in this time; it also hears noise."""
        said: list[m.Utterance] = []
        for start in range(0, len(sound), BLOCK):
            block = np.zeros(BLOCK, np.float32)
            piece = sound[start : start + BLOCK]
            block[: len(piece)] = piece
            output = self._robot.step(block + self._noise.take(BLOCK), None)
            for record in output.records:
                if isinstance(record, SaidRecord):
                    said.append(record.utterance)
                elif isinstance(record, SaveCounter):
                    self._counters[record.name] = record.value
        return said

    def _play(self, sound: Samples) -> list[m.Utterance]:
        """The listener's answers to a sound, until it is silent."""
        said = self._listen(sound)
        quiet_s = 0.0
        while quiet_s < QUIET_S:
            said += self._listen(np.zeros(4 * BLOCK, np.float32))
            quiet_s = 0.0 if self._robot.speaking else quiet_s + 4 * BLOCK / SAMPLE_RATE_HZ
        return said

    @staticmethod
    def _is_believed(said: list[m.Utterance]) -> bool:
        return any(not isinstance(u.statement, m.SayAgain | m.Distrusted) for u in said)

    def _say_honestly(self) -> None:
        """The honest robot orders something, and says it again when it is asked to."""
        statement = self._rng.choice(MOTIONS)
        for _ in range(3):
            take = self._sealed(statement)
            self._takes.append(take)
            said = self._play(take.sound)
            for utterance in said:
                self._rob.judge(utterance, self._robot.phrasebook, self._robot.now)
            if not any(isinstance(u.statement, m.SayAgain) for u in said):
                break
        self.honest[0] += self._is_believed(said)
        self.honest[1] += 1

    def _sealed(self, statement: m.Statement, to: str = LISTENER) -> Take:
        utterance = m.Utterance("Rob", m.ToRobot(to), None, statement)
        return self._spoken(self._rob.marked(utterance, self._robot.phrasebook, self._robot.now))

    def _spoken(self, utterance: m.Utterance, voice_of: str = "Rob") -> Take:
        speaker, book = self._sound.speaker_of(voice_of), self._robot.phrasebook
        sound = spoken(speaker, utterance, book)
        end = speaker.render(book.phrases(utterance)[-1:]) if utterance.mark is not None else sound[:0]
        return Take(utterance, sound * np.float32(LEVEL), len(sound) - len(end))

    def _recording(self) -> Take:
        return self._rng.choice(self._takes)

    def _invented(self, mark: m.Mark | None) -> m.Utterance:
        return m.Utterance("Rob", m.ToRobot(LISTENER), None, self._rng.choice(MOTIONS), mark)

    def _guessed(self) -> m.Utterance:
        n_words = self._robot.phrasebook.cipher_words if self._encrypts else SEAL_WORDS
        value = self._rng.getrandbits(BITS * n_words)
        return self._invented(m.Cipher(value, n_words) if self._encrypts else m.Seal(value))

    def _after_restart(self) -> Samples:
        self._switch_on()
        return self._recording().sound

    def _scissors(self) -> Samples:
        a, b = self._recording(), self._recording()
        if isinstance(a.utterance.mark, m.Cipher) and isinstance(b.utterance.mark, m.Cipher):
            return self._spliced(a.utterance, a.utterance.mark, b.utterance.mark)
        while b.utterance.mark == a.utterance.mark:
            b = self._sealed(self._rng.choice(MOTIONS))
        return np.concatenate([a.sound[: a.seal_at], b.sound[b.seal_at :]])

    def _spliced(self, said: m.Utterance, first: m.Cipher, second: m.Cipher) -> Samples:
        """The openings of all messages are alike: only cuts between the code words are worth a try."""
        half = first.n_words // 2 * BITS
        if first.value >> half == second.value >> half:  # of one recording
            second = replace(second, value=~second.value & (1 << BITS * second.n_words) - 1)
        value = first.value >> half << half | second.value & (1 << half) - 1
        return self._spoken(replace(said, mark=replace(first, value=value))).sound

    def _other_words(self) -> Samples:
        """Of a message the words are hidden; so here its code words are the seal of a plain sentence."""
        unheard = self._sealed(MOTIONS[0]).utterance
        mark = unheard.mark
        if isinstance(mark, m.Cipher):
            mark = m.Seal(mark.value % (1 << SEAL_BITS))
        return self._spoken(replace(unheard, statement=self._rng.choice(MOTIONS[1:]), mark=mark)).sound

    def _readdressed(self) -> Samples:
        unheard = self._sealed(self._rng.choice(MOTIONS), "Zoe")
        return self._spoken(replace(unheard.utterance, addressee=m.ToRobot(LISTENER))).sound

    def _one_word_wrong(self) -> Samples:
        unheard = self._sealed(self._rng.choice(MOTIONS)).utterance
        mark = unheard.mark
        n_words = mark.n_words if isinstance(mark, m.Cipher) else SEAL_WORDS
        wrong = self._rng.randrange(1, 1 << BITS) << BITS * self._rng.randrange(n_words)
        if isinstance(mark, m.Seal | m.Cipher):
            mark = replace(mark, value=mark.value ^ wrong)
        return self._spoken(replace(unheard, mark=mark)).sound

    def _jammed(self) -> Samples:
        """Noise covers the seal of the honest robot for the listener, and a restart later its recording is played."""
        take = self._sealed(self._rng.choice(MOTIONS))
        covered = take.sound.copy()
        noise = PinkNoise(0.3, self._rng.getrandbits(16)).take(len(covered) - take.seal_at)
        covered[take.seal_at :] += noise
        self._play(covered)
        self._switch_on()
        return take.sound

    def _overlapping(self) -> Samples:
        sound = self._recording().sound
        other = self._spoken(m.Utterance("Zoe", m.ToAll(), None, m.WhoHere()), "Zoe").sound
        out = np.zeros(max(len(sound), len(other)), np.float32)
        out[: len(sound)] += sound
        out[: len(other)] += other
        return out[: audible(out)[1]]
