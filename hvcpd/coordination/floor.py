"""The floor: who speaks when. Listen before talk with random back-off (non-persistent CSMA, Kleinrock & Tobagi 1975).

Answers wait less than everything else, so that nobody cuts in between a question and its answer. Of several who could
answer, each waits for a slot of its own; whoever hears another one answer holds back.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from enum import IntEnum

from hvcpd.coordination.actions import Chance, Timing
from hvcpd.coordination.table import Trigger
from hvcpd.language.messages import Utterance

RANK_MAX = 10
"""Slots for answers are given to so many robots; beyond, they are shared: that ten before fail to answer is rare."""


SLOTS_PER_SPEAKER = 3
"""Slots of back-off for each robot in a large team: fewer collide more often, more lose time (benchmarks/missions)."""


class Urgency(IntEnum):
    ALARM = 0
    ANSWER = 1
    AGAIN = 2
    """A sentence that has not been answered yet, once more."""
    TURN = 3


@dataclass
class Intent:
    """Something to be said: composed only when the floor is had, so that it is still true then.

    `compose` returns None when there is no longer anything to say. `trigger` moves the state machine when the
    sentence is out; `topic` tells intents apart: a new one replaces an old one of the same topic. `slot` is the
    answerer's place in the order of those who could answer (None: drawn); `call` is who is to be answered, if one
    answer is enough. A `tentative` answer is given up as soon as anything else is said to the one who called, or
    something that was not understood. An answer that did not get the floor for ANSWER_KEPT_S is no answer any more.
    """

    urgency: Urgency
    topic: str
    compose: Callable[[], Utterance | None]
    trigger: Trigger | None = None
    slot: int | None = None
    call: str | None = None
    slowly: bool = False
    tentative: bool = False
    ready_s: float = 0.0
    wanted_s: float = 0.0


ANSWER_KEPT_S = 12.0
"""Two sentences of others with their gaps; who asked has by then asked again."""


class Floor:
    """The queue of what one robot wants to say, and whether it may begin."""

    def __init__(self, timing: Timing, chance: Chance) -> None:
        self._timing = timing
        self._chance = chance
        self._intents: list[Intent] = []
        self._busy = False
        self._released_s = -math.inf
        self._slots = timing.turn_slots
        self._again_slots = timing.again_slots
        self.speaking: Intent | None = None

    @property
    def busy(self) -> bool:
        """Somebody else is speaking."""
        return self._busy

    def expect_speakers(self, n: int) -> None:
        """So many others may want the floor: the back-off is drawn from more slots."""
        self._slots = max(self._timing.turn_slots, SLOTS_PER_SPEAKER * n)
        self._again_slots = self._timing.again_slots + n

    def unsettled_until(self, now: float) -> float:
        """Until when something that somebody says may still come to be understood."""
        if self._busy or self.speaking is not None:
            return now + self._timing.settle_s
        return self._released_s + self._timing.settle_s

    def want(self, intent: Intent, now: float) -> None:
        self.withdraw(intent.topic)
        intent.ready_s = now + self._gap(intent)
        intent.wanted_s = now
        self._intents.append(intent)

    def withdraw(self, topic: str) -> None:
        if self._intents:
            self._intents = [intent for intent in self._intents if intent.topic != topic]

    def answered(self, call: str, only_tentative: bool = False) -> None:
        """Somebody else has answered: who wanted to holds back."""
        if self._intents:
            self._intents = [i for i in self._intents if i.call != call or (only_tentative and not i.tentative)]

    def garbled(self) -> None:
        """Something was said that may have been an objection."""
        if self._intents:
            self._intents = [intent for intent in self._intents if not intent.tentative]

    def clear(self) -> None:
        self._intents.clear()

    def channel(self, busy: bool, now: float) -> None:
        """Somebody began or ended to speak; after an end everybody backs off anew."""
        if self._busy and not busy:
            self._released_s = now
            self._back_off(now)
        if busy and not self._busy:
            self.garbled()  # most likely another one answers; if not, the question comes again
        self._busy = busy

    def hold_back(self, now: float) -> None:
        """A sentence was understood: back off from its end as others do, so that answers come first."""
        self._back_off(now)

    def begin(self, now: float) -> Intent | None:
        """The intent whose turn has come, now being spoken; None if there is none or the floor is taken."""
        if not self._intents or self._busy or self.speaking is not None:
            return None
        due = [intent for intent in self._intents if intent.ready_s <= now]
        late = [i for i in due if i.call is not None and now - i.wanted_s > ANSWER_KEPT_S]
        if late:
            self._intents = [intent for intent in self._intents if intent not in late]
            due = [intent for intent in due if intent not in late]
        if not due:
            return None
        intent = min(due, key=lambda i: (i.urgency, i.ready_s))
        self._intents.remove(intent)
        self.speaking = intent
        return intent

    def ended(self, now: float) -> Intent | None:
        """The own sentence is out; returns what it was."""
        intent, self.speaking = self.speaking, None
        self._back_off(now)
        return intent

    def next_deadline(self) -> float | None:
        if not self._intents or self._busy or self.speaking is not None:
            return None
        return min(intent.ready_s for intent in self._intents)

    def _back_off(self, now: float) -> None:
        for intent in self._intents:
            intent.ready_s = max(intent.ready_s, now + self._gap(intent))

    def _gap(self, intent: Intent) -> float:
        timing = self._timing
        if intent.urgency >= Urgency.AGAIN:
            slots = self._slots if intent.urgency is Urgency.TURN else self._again_slots
            return timing.turn_gap_s + int(self._chance.random() * slots) * timing.slot_s
        slot = int(self._chance.random() * timing.reply_slots) if intent.slot is None else intent.slot
        return timing.reply_gap_s + slot * timing.slot_s
