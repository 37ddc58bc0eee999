"""Air at the level of words: sentences take time, collide, get lost or misheard; thousands of missions run in seconds.

It owns no robots: the talkers are anything with the methods of `Talker`, and may come and go. All chance is seeded.
"""

from __future__ import annotations

import heapq
import itertools
import math
import random
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Protocol

from hvcpd.language.messages import Stop, Utterance
from hvcpd.security.trust import Trust

WORD_S = 0.33
"""Mean duration of a spoken word with its share of the pauses; measured on our synthesizer's sentences."""
ONSET_S = 0.13
"""After this a listener has noticed a voice; 0.08 to 0.2 s in whole missions with sound."""
RELEASE_S = 0.15
"""After this a listener has noticed the end of a voice."""
RECOGNITION_S = 0.3
"""After the last word the sentence is reported."""
REMEMBERED_S = 30.0
"""Time for which sounds are kept, to find which overlapped; no sentence lasts longer."""


class Talker(Protocol):
    """The interface of a robot on the channel; `hvcpd.coordination.Coordination` has it."""

    def heard(
        self, utterance: Utterance, now: float, confidence: float = 1.0, snr_db: float | None = None, trust: Trust = ...
    ) -> None: ...
    def garbled(self, over_own_speech: bool, now: float) -> None: ...
    def channel(self, busy: bool, now: float) -> None: ...
    def spoken(self, now: float, cut: bool = False) -> None: ...
    def tick(self, now: float) -> None: ...
    def next_deadline(self) -> float: ...


@dataclass(frozen=True)
class Conditions:
    """The effect of air on sentences. `loss` and `mishearing` are probabilities for each listener of each sentence."""

    loss: float = 0.0
    """A listener notices a voice and understands nothing."""
    mishearing: float = 0.0
    """A listener understands another sentence of the phrasebook, which differs in one word."""
    delay_s: float = 0.0
    """Largest delay beyond RECOGNITION_S after which a sentence is reported; drawn separately for each listener."""
    latency_s: float = 0.0
    """From the decision to speak until the first sample is in the air: the delay of sound cards and their drivers."""


@dataclass(eq=False)
class Sound:
    """One sentence in the air; `cut` when its speaker was switched off, or broke off, in the middle of it."""

    speaker: str
    utterance: Utterance
    start_s: float
    end_s: float
    cut: bool = False
    again: Callable[[], Sound] | None = None
    """Says the sentence once more, if it is to be said twice."""
    pause_s: float = 0.0
    """Pause before the sentence is said once more."""
    noticed_by: tuple[str, ...] = ()
    """Robots that heard it begin: they hear it end, wherever they are by then."""

    def overlaps(self, other: Sound) -> bool:
        return self.start_s < other.end_s and self.end_s > other.start_s


@dataclass
class WordChannel:
    """Shared air for named talkers: `say` puts a sentence into it; `run_until` delivers the events that follow.

    A sentence that overlaps another one, or the listener's own, is garbled. `touched` runs for every talker that
    something happened to (to collect its actions). `earshot(speaker, listener)` tells who can hear whom now, and
    `fading` with what probability a sentence is lost on that way, besides what `conditions` lose; `mishear` makes the
    wrong sentence; `misses(listener, utterance)` tells who hears nothing of one. A sentence that a listener does not
    follow, because it does not know a name, is garbled. `judge` tells what a listener makes of a sentence with a seal.
    """

    talkers: Mapping[str, Talker]
    length_words: Callable[[Utterance], int]
    conditions: Conditions = field(default_factory=Conditions)
    seed: int = 0
    touched: Callable[[str], None] = lambda _name: None
    earshot: Callable[[str, str], bool] = lambda _speaker, _listener: True
    fading: Callable[[str, str], float] | None = None
    mishear: Callable[[Utterance, random.Random], Utterance] = lambda utterance, _rng: utterance
    misses: Callable[[str, Utterance], bool] = lambda _listener, _utterance: False
    follows: Callable[[str, Utterance], bool] = lambda _listener, _utterance: True
    judge: Callable[[str, Utterance], tuple[Utterance, Trust]] = lambda _listener, utterance: (utterance, Trust.OPEN)
    now: float = 0.0
    sent: int = 0
    collisions: int = 0
    airtime_s: float = 0.0
    misheard: int = 0
    _events: list[tuple[float, int, Callable[[], None]]] = field(default_factory=list)
    _sounds: list[Sound] = field(default_factory=list)
    _due: dict[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self._rng = random.Random(self.seed)
        self._order = itertools.count()
        self.refresh()

    def at(self, time_s: float, what: Callable[[], None]) -> None:
        """Do something at a time; it may touch any talker."""
        heapq.heappush(self._events, (time_s, next(self._order), what))

    def refresh(self, names: Iterable[str] | None = None) -> None:
        """Talkers came, went, or were touched from outside: collect their actions, and note when they are due."""
        if names is None:
            self._due.clear()
        names = list(self.talkers if names is None else names)
        for name in names:
            if name in self.talkers:
                self.touched(name)
        self._due |= {name: self.talkers[name].next_deadline() for name in names if name in self.talkers}

    def say(
        self, speaker: str, utterance: Utterance, stretch: float = 1.0, times: int = 1, pause_s: float = 0.0
    ) -> Sound:
        """Put a sentence into the air, `times` in a row with pauses between; it lasts `stretch` times as long as usual.

        Its speaker learns that it has spoken after the last time.
        """
        length_s = stretch * WORD_S * self.length_words(utterance) * (0.9 + 0.2 * self._rng.random())
        start_s = self.now + self.conditions.latency_s
        sound = Sound(speaker, utterance, start_s, start_s + length_s)
        if times > 1:
            sound.again = lambda: self.say(speaker, utterance, stretch, times - 1, pause_s)
            sound.pause_s = pause_s
        if self._sounds and self._sounds[0].end_s < self.now - REMEMBERED_S:
            self._sounds = [s for s in self._sounds if s.end_s > self.now - REMEMBERED_S]
        self._sounds.append(sound)
        self.sent += 1
        self.airtime_s += length_s
        self.at(sound.start_s + ONSET_S, lambda: self._onset(sound))
        self.at(sound.end_s, lambda: self._ended(sound))
        self.at(sound.end_s + RELEASE_S, lambda: self._released(sound))
        deliver = self._deliver_late if self.conditions.delay_s else self._deliver_all
        self.at(sound.end_s + RECOGNITION_S, lambda: deliver(sound))
        return sound

    @property
    def speaking(self) -> bool:
        """Whether anybody speaks."""
        return any(sound.start_s <= self.now < sound.end_s and not sound.cut for sound in self._sounds)

    def switch_off(self, name: str) -> None:
        """The talker, taken out of `talkers`, falls silent and deaf, in mid-sentence if it speaks."""
        self._due.pop(name, None)
        for sound in self._sounds:
            if sound.speaker == name and sound.start_s <= self.now < sound.end_s:
                sound.cut = True

    def break_off(self, name: str) -> None:
        """The talker ends in mid-sentence, if it speaks, and listens on."""
        for sound in self._sounds:
            if sound.speaker == name and sound.start_s <= self.now < sound.end_s and not sound.cut:
                sound.cut, sound.end_s = True, self.now
                self.talkers[name].spoken(self.now, cut=True)

    def _listeners(self, sound: Sound) -> list[str]:
        return [name for name in self.talkers if name != sound.speaker and self.earshot(sound.speaker, name)]

    def _audible(self, sound: Sound, listener: str) -> bool:
        return sound.speaker == listener or self.earshot(sound.speaker, listener)

    def _overlapping(self, sound: Sound) -> list[Sound]:
        return [s for s in reversed(self._sounds) if s is not sound and s.overlaps(sound)]

    def _onset(self, sound: Sound) -> None:
        if sound.cut:
            return
        names = self._listeners(sound)
        sound.noticed_by = tuple(names)
        for name in names:
            self.talkers[name].channel(True, self.now)
        self.refresh(names)

    def _ended(self, sound: Sound) -> None:
        self.collisions += bool(self._overlapping(sound))
        if sound.again is not None and not sound.cut:
            self._say_again(sound, sound.again)
        elif sound.speaker in self.talkers and not sound.cut:  # people who only speak are no talkers
            self.talkers[sound.speaker].spoken(self.now)
            self.refresh((sound.speaker,))

    def _say_again(self, sound: Sound, again: Callable[[], Sound]) -> None:
        """After the pause, unless the speaker was switched off in it."""
        talker = self.talkers.get(sound.speaker)

        def say() -> None:
            if self.talkers.get(sound.speaker) is talker:
                again()

        self.at(self.now + sound.pause_s, say)

    def _released(self, sound: Sound) -> None:
        names = [name for name in self.talkers if name in sound.noticed_by]
        going_on = [s for s in self._sounds if s.start_s + ONSET_S <= self.now < s.end_s + RELEASE_S - 1e-9]
        for name in names:
            busy = any(s.speaker != name and self._audible(s, name) for s in going_on)
            self.talkers[name].channel(busy, self.now)
        self.refresh(names)

    def _deliver_all(self, sound: Sound) -> None:
        names = self._listeners(sound)
        overlap = self._overlapping(sound)
        for name in names:
            self._deliver(name, sound, overlap)
        self.refresh(names)

    def _deliver_late(self, sound: Sound) -> None:
        def deliver(name: str) -> None:
            if name in self.talkers:
                self._deliver(name, sound, self._overlapping(sound))
                self.refresh((name,))

        for name in self._listeners(sound):
            self.at(self.now + self._rng.random() * self.conditions.delay_s, lambda name=name: deliver(name))  # type: ignore[misc]

    def _deliver(self, listener: str, sound: Sound, overlap: list[Sound]) -> None:
        talker, rng = self.talkers[listener], self._rng
        if self.misses(listener, sound.utterance):
            return
        overlap = [s for s in overlap if self._audible(s, listener)]
        if overlap or sound.cut:
            own = [s for s in overlap if s.speaker == listener]
            if isinstance(sound.utterance.statement, Stop) and not sound.cut:
                talker.heard(sound.utterance, self.now)  # over any voice; tests with sound measure it
                return
            if not own or max(s.end_s for s in own) < sound.end_s:  # else drowned by the own voice to its end
                talker.garbled(bool(own), self.now)
            return
        if self.conditions.loss and rng.random() < self.conditions.loss:
            return
        if self.fading is not None and rng.random() < self.fading(sound.speaker, listener):
            return
        utterance = sound.utterance
        if not self.follows(listener, utterance):
            talker.garbled(False, self.now)
            return
        if self.conditions.mishearing and rng.random() < self.conditions.mishearing:
            utterance = self.mishear(utterance, rng)
            self.misheard += 1
        utterance, trust = self.judge(listener, utterance)
        talker.heard(utterance, self.now, trust=trust)

    def run_until(self, end_s: float) -> None:
        """Deliver everything, and tick the talkers when they are due, until `end_s`."""
        events = self._events
        while True:
            next_event_s = events[0][0] if events else math.inf
            due_s = min(self._due.values(), default=math.inf)
            self.now = max(self.now, min(next_event_s, due_s, end_s))
            if self.now >= end_s:
                return
            if next_event_s <= due_s:
                heapq.heappop(events)[2]()
                continue
            due = [name for name, time_s in self._due.items() if time_s <= self.now]
            for name in due:
                self.talkers[name].tick(self.now)
            self.refresh(due)
