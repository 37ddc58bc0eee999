"""Air at the level of words: sentences take time, collide, get lost; thousands of missions run in seconds.

It owns no robots: the talkers are anything with the five methods of `Talker`. All chance is seeded.
"""

from __future__ import annotations

import heapq
import itertools
import random
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from typing import Protocol

from hvcpd.language.messages import Utterance

WORD_S = 0.33
"""Mean duration of a spoken word with its share of the pauses; measured on our synthesizer's sentences."""
ONSET_S = 0.08
"""After this a listener knows that somebody speaks."""
RELEASE_S = 0.2
"""After this a listener knows that nobody speaks any more."""
RECOGNITION_S = 0.3
"""After the last word the sentence is reported."""


class Talker(Protocol):
    """What the channel needs of a robot; `hvcpd.coordination.Coordination` has it."""

    def heard(self, utterance: Utterance, now: float) -> None: ...
    def garbled(self, over_own_speech: bool, now: float) -> None: ...
    def channel(self, busy: bool, now: float) -> None: ...
    def spoken(self, now: float) -> None: ...
    def tick(self, now: float) -> None: ...


@dataclass
class _Sound:
    speaker: str
    utterance: Utterance
    start_s: float
    end_s: float


@dataclass
class WordChannel:
    """Shared air for named talkers: `say` puts a sentence into it; `run_until` delivers what follows.

    `loss` is the chance that a listener misses a sentence altogether; a sentence that overlaps another one, or
    the listener's own, is garbled. `after_each` runs after every event (to collect the talkers' actions).
    """

    talkers: dict[str, Talker]
    n_words: Callable[[Utterance], int]
    loss: float = 0.0
    seed: int = 0
    after_each: Callable[[float], None] = lambda _now: None
    now: float = 0.0
    sent: int = 0
    collisions: int = 0
    _events: list[tuple[float, int, Callable[[], None]]] = field(default_factory=list)
    _sounds: list[_Sound] = field(default_factory=list)

    def __post_init__(self) -> None:
        self._chance = random.Random(self.seed)
        self._order = itertools.count()

    def at(self, time_s: float, what: Callable[[], None]) -> None:
        heapq.heappush(self._events, (time_s, next(self._order), what))

    def say(self, speaker: str, utterance: Utterance) -> None:
        length_s = WORD_S * self.n_words(utterance) * (0.9 + 0.2 * self._chance.random())
        sound = _Sound(speaker, utterance, self.now, self.now + length_s)
        self._sounds = [s for s in self._sounds if s.end_s > self.now - 10.0] + [sound]
        self.sent += 1
        for name in self.talkers:
            if name != speaker:
                self.at(sound.start_s + ONSET_S, partial(self._tell_busy, name))
                self.at(sound.end_s + RELEASE_S, partial(self._tell_busy, name))
                self.at(sound.end_s + RECOGNITION_S, partial(self._deliver, name, sound))
        self.at(sound.end_s, lambda: self._ended(sound))

    def _overlapping(self, sound: _Sound) -> list[_Sound]:
        return [s for s in self._sounds if s is not sound and s.start_s < sound.end_s and s.end_s > sound.start_s]

    def _ended(self, sound: _Sound) -> None:
        self.collisions += bool(self._overlapping(sound))
        if sound.speaker in self.talkers:  # people who only speak are no talkers
            self.talkers[sound.speaker].spoken(self.now)

    def _tell_busy(self, listener: str) -> None:
        others = [s for s in self._sounds if s.speaker != listener]
        busy = any(s.start_s + ONSET_S <= self.now < s.end_s + RELEASE_S - 1e-9 for s in others)
        self.talkers[listener].channel(busy, self.now)

    def _deliver(self, listener: str, sound: _Sound) -> None:
        overlap = self._overlapping(sound)
        own = [s for s in overlap if s.speaker == listener]
        if own and max(s.end_s for s in own) >= sound.end_s:
            return  # it was drowned by the listener's own voice to its end
        if self._chance.random() < self.loss:
            return
        if overlap:
            self.talkers[listener].garbled(bool(own), self.now)
        else:
            self.talkers[listener].heard(sound.utterance, self.now)

    def run_until(self, end_s: float, next_deadline: Callable[[], float]) -> None:
        """Deliver everything, and tick the talkers when they are due, until `end_s`."""
        while True:
            due = min(self._events[0][0] if self._events else end_s, next_deadline(), end_s)
            self.now = max(self.now, due)
            if self.now >= end_s:
                return
            while self._events and self._events[0][0] <= self.now:
                heapq.heappop(self._events)[2]()
                self.after_each(self.now)
            for talker in self.talkers.values():
                talker.tick(self.now)
            self.after_each(self.now)
