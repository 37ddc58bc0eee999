"""The floor: who speaks when. Listen before talk with random back-off (non-persistent CSMA, Kleinrock & Tobagi 1975).

Answers wait less than everything else, so that no other sentence comes between a question and its answer. If several
robots could answer, each waits for a slot of its own, and holds back when it hears another one answer. Turns go round:
after a sentence that was understood, all robots that know the same names agree on the order of their slots, beginning
after the last speaker (as with a token; mini-slotted alternating priorities, Kleinrock & Scholl 1980). Only robots that
do not know who spoke draw their slot, from those after the others' turns. A robot that has missed its turn repeatedly
draws one of two slots before all others.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from enum import IntEnum
from functools import lru_cache

from hvcpd.coordination.actions import Rng, Timing
from hvcpd.coordination.states import Trigger
from hvcpd.language.messages import Utterance

OWN_TURN = "own turn"
"""The topic of the state machine's own sentences; answers to others have topics of their own."""
AHEAD = "ahead"
"""The topic of a claim of the next task while the robot is on its way to one."""
LEFT_ALONE = "left alone"
"""The topic of the statement that a robot has left a task for several robots."""
RESUMES = "requested resume"
"""The beginning of the topics of "resume" for the robot's owner."""
RANK_MAX = 10
"""Number of robots that get answer slots of their own; others share: ten before them rarely all fail to answer."""
SLOTS_MAX = 64
"""Maximum number of slots that random back-off is drawn from: doubled after each sentence that nobody understood, and
three quarters after each that was understood (binary exponential back-off, as in Ethernet)."""
EARLY_SLOTS = 3
"""Slots before all turns for robots that wait at a place with room for only one, or are in one that others wait for.
Teams with such places begin all turns later by these slots. Without them robots waited 16.9 s on average instead of
15.0 (600 missions)."""
CROWD = 4
"""In a larger team a robot may miss its turn so often that its lease ends before it can report."""
OVERDUE_SLOTS = 2
"""Slots before all turns in a crowd, for a robot that has waited too long."""
OVERDUE_S = 15.0
"""Waiting time, for each robot of the team, that is too long: a turn with its answer takes 12.5 s. If twelve robots
lose three sentences of ten, one then waits for 202 to 267 s at most (12 and 18 s for each), otherwise 640 s."""


class Urgency(IntEnum):
    ALARM = 0
    ANSWER = 1
    AGAIN = 2
    """The repetition of a sentence that has not been answered yet."""
    TURN = 3


def nothing() -> None:
    """The effect of most sentences."""


def undecided(_now: float) -> None:
    """The decision of most intents."""


@dataclass
class Intent:
    """A sentence to be said: composed only when the robot has the floor, so that it is still true then.

    First `decide` makes the open choice and may return a trigger, which is then fired. `compose` changes nothing; it
    returns None when there is no longer anything to say. `on_said` notes the consequences once the sentence is begun;
    `trigger` moves the state machine when it is out. A new intent replaces an old one of the same `topic`. `slot` is
    the answerer's place in the order of those who could answer (None: drawn); `call` is the speaker to be answered, if
    one answer is enough. A `tentative` answer is given up as soon as another robot says something to that speaker, or
    an unintelligible sentence is heard. An answer that did not get the floor within `answer_kept_s` is dropped. An
    intent is held back until `not_before_s`, even if it is the robot's turn. An intent to be said `at_once` does not
    wait for other speakers to end. Its turn may come `early`, before all others'.
    """

    urgency: Urgency
    topic: str
    compose: Callable[[], Utterance | None]
    trigger: Trigger | None = None
    slot: int | None = None
    call: str | None = None
    tentative: bool = False
    not_before_s: float = -math.inf
    at_once: bool = False
    early: bool = False
    decide: Callable[[float], Trigger | None] = undecided
    """Makes the choices that were left open, at the time at which it has the floor."""
    on_said: Callable[[], None] = nothing
    ready_s: float = 0.0
    wanted_s: float = 0.0


Order = tuple[int, int]
"""A robot's place in the round of turns, from 0, and the number of robots that take part."""


@lru_cache(maxsize=4096)
def round_of_turns(roster: frozenset[str], present: tuple[str, ...], own: str, last: str) -> Order:
    """The place of `own` among all that take part, from 0, in alphabetical order after `last`."""
    names = sorted({*roster, *present, own, last})
    return (names.index(own) - names.index(last) - 1) % len(names), len(names)


@dataclass(frozen=True)
class Round:
    """Turns after a sentence that was understood: a slot for each robot, repeated until one speaks.

    After an `own` sentence the robot cannot know whether it was understood.
    """

    began_s: float
    place: int
    size: int
    own: bool


class Floor:
    """The queue of one robot's sentences, and whether it may begin one."""

    def __init__(self, timing: Timing, rng: Rng, team: int = 0) -> None:
        self._timing = timing
        self._team = team
        self._anything_said = False
        self._rng = rng
        self._intents: list[Intent] = []
        self.busy = False
        """Another speaker is talking."""
        self.muted = False
        """There is no sound, or no word yet: the robot can say nothing, not even at once."""
        self._released_s = -math.inf
        self.understood_s = -math.inf
        """When a sentence was last understood."""
        self.busy_since_s = -math.inf
        """When another speaker last began to talk."""
        self.is_second = False
        """The present or last sentence most likely repeats the one that was understood before."""
        self._slots = timing.turn_slots
        self._round: Round | None = None
        self._ring_size = 0
        """Number of slots in the last known round of turns."""
        self.early_slots = 0
        """Number of slots before all turns: EARLY_SLOTS, or none."""
        self.answer_slots = 0
        """Number of slots for answers after a sentence. Turns begin after them, if that is later than their gap."""
        self.speaking: Intent | None = None
        self.began_s = -math.inf
        """When this robot last began to speak."""
        self.waited_s = 0.0
        """How long the state machine's last sentence had waited for the floor."""

    def unsettled_until(self, now: float) -> float:
        """The time until which a sentence in the air may still be understood, s."""
        speaking = self.busy or self.speaking is not None
        return (now if speaking else self._released_s) + self._timing.settle_s

    def want(self, intent: Intent, now: float) -> None:
        self.withdraw(intent.topic)
        intent.wanted_s = now
        intent.ready_s = max(now + self._gap(intent, now), intent.not_before_s)
        self._intents.append(intent)

    def say(self, urgency: Urgency, topic: str, utterance: Utterance, now: float, slot: int | None = None) -> None:
        """Want to say a sentence that is true whenever it is said."""
        self.want(Intent(urgency, topic, lambda: utterance, slot=slot), now)

    def wants(self, topic: str) -> bool:
        """Whether a sentence on this topic is waiting."""
        return any(intent.topic == topic for intent in self._intents)

    def hasten(self, topic: str) -> None:
        """Move the waiting sentence on this topic before all turns."""
        for intent in self._intents:
            intent.early |= intent.topic == topic

    def withdraw(self, topic: str) -> None:
        self._intents = [intent for intent in self._intents if intent.topic != topic]

    def take_along(self, topic: str, now: float) -> Intent | None:
        """The waiting intent on a topic, to be said together with the present sentence; None if it is held back."""
        intent = next((i for i in self._intents if i.topic == topic and i.not_before_s <= now), None)
        if intent is not None:
            self.withdraw(topic)
            self.speaking = intent
            self.waited_s = now - intent.wanted_s
        return intent

    def withdraw_all(self, *topics: str) -> None:
        """Withdraw every topic with one of these prefixes."""
        self._intents = [intent for intent in self._intents if not intent.topic.startswith(topics)]

    def answered(self, call: str, only_tentative: bool = False) -> None:
        """Another robot has answered: hold back this robot's answer."""
        self._intents = [i for i in self._intents if i.call != call or (only_tentative and not i.tentative)]

    def garbled(self, now: float) -> None:
        """An unintelligible sentence was heard that may have been an objection; back off from its end as others do."""
        self.hold_back(now)
        self._slots = min(2 * self._slots, SLOTS_MAX)
        if not self.is_second:
            self._give_up_tentative()

    def _give_up_tentative(self) -> None:
        self._intents = [intent for intent in self._intents if not intent.tentative]

    def clear(self) -> list[Intent]:
        """Withdraw all, and return them."""
        withdrawn, self._intents = self._intents, []
        return withdrawn

    def channel(self, busy: bool, now: float) -> None:
        """A speaker began or stopped; after the end every robot backs off again."""
        if self.busy and not busy:
            self._released_s = now
            self.hold_back(now)
        if busy and not self.busy:
            self.busy_since_s = now
            self.is_second = now < self.understood_s + self._timing.second_s
            if not self.is_second:
                self._give_up_tentative()  # most likely another one answers; if not, the question comes again
        self.busy = busy

    def understood(self, now: float, order: Order | None) -> None:
        """A sentence was understood; back off from its end as others do. `order`: the place in the round of turns."""
        self.understood_s = now
        self._slots = max(3 * self._slots // 4, self._timing.turn_slots)
        self.hold_back(now, order)

    def hold_back(self, now: float, order: Order | None = None, own: bool = False) -> None:
        """Back off from the end of a sentence as others do, so that answers come first."""
        self._anything_said = True
        self._round = Round(now, *order, own) if order is not None else None
        self._ring_size = order[1] if order is not None else self._ring_size
        self._back_off(now)

    def begin(self, now: float) -> Intent | None:
        """The intent whose turn has come, now being spoken; None if there is none or the floor is taken."""
        if now < self.next_deadline():
            return None
        due = [intent for intent in self._intents if intent.ready_s <= now and (intent.at_once or not self.busy)]
        in_time = [i for i in due if i.call is not None or i.at_once]
        late = [i for i in in_time if now - i.wanted_s > self._timing.answer_kept_s]
        self.speaking = min((i for i in due if i not in late), key=lambda i: (i.urgency, i.ready_s), default=None)
        self._intents = [i for i in self._intents if i not in late and i is not self.speaking]
        self.began_s = now if self.speaking is not None else self.began_s
        if self.speaking is not None and self.speaking.topic == OWN_TURN:
            self.waited_s = now - self.speaking.wanted_s
        return self.speaking

    def ended(self, now: float, order: Order | None = None) -> Intent | None:
        """The robot's own sentence is out; returns its intent. `order` is as in `hold_back`."""
        intent, self.speaking = self.speaking, None
        self.hold_back(now + self._timing.recognition_s, order, own=True)
        return intent

    def next_deadline(self) -> float:
        if self.speaking is not None or self.muted:
            return math.inf
        return min((i.ready_s for i in self._intents if i.at_once or not self.busy), default=math.inf)

    def _back_off(self, now: float) -> None:
        for intent in (i for i in self._intents if not i.at_once):
            ready_s = max(now + self._gap(intent, now), intent.not_before_s)
            if intent.urgency < Urgency.AGAIN or self._round is None:
                ready_s = max(intent.ready_s, ready_s)
            intent.ready_s = ready_s

    def _gap(self, intent: Intent, now: float) -> float:
        """How long from now to wait: to this robot's slot, drawn or in turn."""
        timing = self._timing
        first_word = not self._anything_said and intent.urgency is Urgency.TURN
        if intent.at_once or (first_word and self._team <= CROWD):
            return 0.0  # nobody can be answering, and few begin at once: each has listened for a time drawn at random
        if intent.urgency < Urgency.AGAIN:
            slot = int(self._rng.random() * timing.reply_slots) if intent.slot is None else intent.slot
            return timing.reply_gap_s + slot * timing.slot_s
        turn_gap_s = max(timing.turn_gap_s, timing.reply_gap_s + self.answer_slots * timing.slot_s)
        if intent.early:
            return turn_gap_s + int(self._rng.random() * EARLY_SLOTS) * timing.slot_s
        turn_gap_s += self.early_slots * timing.slot_s
        if self._ring_size > CROWD:
            if now - intent.wanted_s > OVERDUE_S * self._ring_size:
                return turn_gap_s + int(self._rng.random() * OVERDUE_SLOTS) * timing.slot_s
            turn_gap_s += OVERDUE_SLOTS * timing.slot_s
        collided = intent.urgency is Urgency.AGAIN and self._round is not None and self._round.own
        if self._round is None or collided:  # two robots that spoke at once know of no order
            after_turns = self._ring_size if self._round is None else 0
            return turn_gap_s + (after_turns + int(self._rng.random() * self._slots)) * timing.slot_s
        first_s = self._round.began_s + turn_gap_s + self._round.place * timing.slot_s
        length_s = self._round.size * timing.slot_s
        rounds = max(math.ceil((now - first_s) / length_s), 0)
        return first_s + rounds * length_s - now
