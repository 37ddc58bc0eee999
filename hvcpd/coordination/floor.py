"""The floor: who speaks when. Listen before talk with random back-off (non-persistent CSMA, Kleinrock & Tobagi 1975).

Answers wait less than everything else, so that nobody cuts in between a question and its answer.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from enum import IntEnum

from hvcpd.coordination.actions import Chance, Timing
from hvcpd.coordination.table import Trigger
from hvcpd.language.messages import Utterance


class Urgency(IntEnum):
    ANSWER = 0
    TURN = 1


@dataclass
class Intent:
    """Something to be said: composed only when the floor is had, so that it is still true then.

    `compose` returns None when there is no longer anything to say. `trigger` moves the state machine when the
    sentence is out; `topic` tells intents apart: a new one replaces an old one of the same topic.
    """

    urgency: Urgency
    topic: str
    compose: Callable[[], Utterance | None]
    trigger: Trigger | None = None
    ready_s: float = field(default=0.0)


class Floor:
    """The queue of what one robot wants to say, and whether it may begin."""

    def __init__(self, timing: Timing, chance: Chance) -> None:
        self._timing = timing
        self._chance = chance
        self._intents: list[Intent] = []
        self._busy = False
        self._released_s = -math.inf
        self.speaking: Intent | None = None

    @property
    def busy(self) -> bool:
        """Somebody else is speaking."""
        return self._busy

    def unsettled_until(self, now: float) -> float:
        """Until when something that somebody says may still come to be understood."""
        if self._busy or self.speaking is not None:
            return now + self._timing.settle_s
        return self._released_s + self._timing.settle_s

    def want(self, intent: Intent, now: float) -> None:
        self.withdraw(intent.topic)
        intent.ready_s = now + self._gap(intent.urgency)
        self._intents.append(intent)

    def withdraw(self, topic: str) -> None:
        self._intents = [intent for intent in self._intents if intent.topic != topic]

    def clear(self) -> None:
        self._intents.clear()

    def channel(self, busy: bool, now: float) -> None:
        """Somebody began or ended to speak; after an end everybody backs off anew."""
        if self._busy and not busy:
            self._released_s = now
            self._back_off(now)
        self._busy = busy

    def hold_back(self, now: float) -> None:
        """A sentence was understood: back off from its end as others do, so that answers come first."""
        self._back_off(now)

    def begin(self, now: float) -> Intent | None:
        """The intent whose turn has come, now being spoken; None if there is none or the floor is taken."""
        if self._busy or self.speaking is not None:
            return None
        due = [intent for intent in self._intents if intent.ready_s <= now]
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
        if self._busy or self.speaking is not None:
            return None
        return min((intent.ready_s for intent in self._intents), default=None)

    def _back_off(self, now: float) -> None:
        for intent in self._intents:
            intent.ready_s = max(intent.ready_s, now + self._gap(intent.urgency))

    def _gap(self, urgency: Urgency) -> float:
        timing = self._timing
        gap_s, slots = (
            (timing.reply_gap_s, timing.reply_slots)
            if urgency is Urgency.ANSWER
            else (timing.turn_gap_s, timing.turn_slots)
        )
        return gap_s + int(self._chance.random() * slots) * timing.slot_s
