"""The actions that coordination asks its surroundings to carry out, and its settings."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from enum import Enum
from typing import Protocol, Self, TypeVar

from hvcpd.config.tasks import Action as TaskAction
from hvcpd.language.messages import Utterance
from hvcpd.security.trust import People

_T = TypeVar("_T")


class Rng(Protocol):
    """The robot's own seeded generator; `random.Random` has both methods."""

    def random(self) -> float: ...

    def choice(self, seq: Sequence[_T], /) -> _T: ...


SECOND_PAUSE_S = 0.45
"""Silence before a sentence is said for the second time: the recogniser ends a sentence after 0.25 s."""
SECOND_GAP_S = 0.7
"""Longest time from understanding a sentence, 0.2 to 0.3 s after its last word, to noticing its repetition: the rest
of the pause, 0.2 s for the onset, 0.1 s of ringing, and 0.15 s to be sure."""
SLOW_STRETCH = 1.25
"""Factor on the length of a sentence said slowly."""
SEALED_STRETCH = 1.6
"""Factor on the length of a sentence with a seal: 2.1 s more than the usual 3.6 s."""
ENCRYPTED_STRETCH = 1.9
"""Factor on the length of a sentence whose statement is encrypted."""


@dataclass(frozen=True)
class Speech:
    """How everything is said: `slowly` for long distances, and each sentence `times` (1 or 2) in a row; `sealed` where
    a key is set, `encrypted` where the content is hidden as well; `follows_noise`: for noise where it is noisy."""

    slowly: bool = False
    times: int = 1
    sealed: bool = False
    encrypted: bool = False
    follows_noise: bool = True

    @property
    def stretch(self) -> float:
        """Factor on the usual length of a sentence."""
        marked = ENCRYPTED_STRETCH if self.encrypted else SEALED_STRETCH if self.sealed else 1.0
        return self.times * (SLOW_STRETCH if self.slowly else 1.0) * marked


class Talk(Enum):
    """How much a robot says; see `chatter`."""

    FULL = "full"
    NORMAL = "normal"
    TERSE = "terse"


@dataclass(frozen=True)
class Say:
    """Speak this sentence now, `times` in a row with SECOND_PAUSE_S between; answer with `spoken` when the last sample
    has left the loudspeaker. `level_db` is relative to the usual level; `for_noise`: as people speak in noise."""

    utterance: Utterance
    slowly: bool = False
    times: int = 1
    level_db: float = 0.0
    for_noise: bool = False


@dataclass(frozen=True)
class Perform:
    """Carry out these actions of a task in order; answer with `performed` or `perform_failed`. Task 0: a motion."""

    task: int
    actions: tuple[TaskAction, ...]


@dataclass(frozen=True)
class Halt:
    """Stop the wheels and forget the current actions."""


@dataclass(frozen=True)
class BreakOff:
    """End the present sentence at once, for a more urgent one; answer with `spoken`, and with `garbled`, for nobody has
    understood it."""


@dataclass(frozen=True)
class SaveTask:
    """Remember this view of a task: state is open, claimed or done."""

    number: int
    state: str
    owner: str | None


@dataclass(frozen=True)
class SavePeer:
    """Remember that this robot or person was heard."""

    name: str
    team: str | None
    heard_at_s: float


@dataclass(frozen=True)
class SaveStopped:
    """Remember that the robot is stopped, or no longer: a restart does not release it."""

    stopped: bool


@dataclass(frozen=True)
class SaveDue:
    """Remember that a task was done for the occurrence due at this time, s since 1970."""

    number: int
    due_s: float


@dataclass(frozen=True)
class SaveChange:
    """Remember the last change of a task: its number, 0 for none, and whether it is left out since."""

    number: int
    count: int
    skipped: bool


Action = Say | BreakOff | Perform | Halt | SaveTask | SaveDue | SaveChange | SavePeer | SaveStopped


@dataclass(frozen=True)
class Timing:
    """How long robots wait for each other, in seconds of the sample clock.

    A recogniser reports a sentence 0.2 to 0.3 s after its last word and notices a voice 0.08 to 0.2 s after its
    first; the gaps follow from that. A sentence lasts 2 to 5 s.
    """

    wake_min_s: float = 1.0
    """Listening before the first greeting: the noise must be known first."""
    wake_spread_s: float = 4.0
    """Drawn on top, so that robots switched on together do not greet at once: longer than a greeting."""
    meeting_s: float = 10.0
    """For each robot of a team: by then every robot that is there and finds a task has claimed one. A confirmation with
    a claim takes 7 s."""
    greeting_wait_s: float = 4.0
    """Time for the next answer to a greeting to begin; each answer restarts it."""
    greetings_max: int = 3
    """How often an unanswered greeting is repeated before the robot works alone."""
    reply_gap_s: float = 0.15
    """Before an answer, once the question is understood: people leave about 0.2 s (Stivers et al. 2009)."""
    turn_gap_s: float = 1.2
    """Before anything else, so that an answer comes first: reply gap, slots of objections and of some confirmations."""
    slot_s: float = 0.25
    """Step of the back-off: longer than the onset detection, so that two different draws don't collide. Measured in
    whole missions: a voice is noticed 0.08 to 0.2 s after its first sample, the later the farther."""
    reply_slots: int = 3
    turn_slots: int = 8
    """Minimum, for a robot that does not know whose turn it is."""
    recognition_s: float = 0.3
    """After the robot's own last word: then the others have understood it, and the round of turns begins for all at
    once."""
    settle_s: float = 0.5
    """After a voice falls silent: by then its sentence has been recognised."""
    back_off_s: float = 6.0
    """Range of the random time, extended in `effects`, for which an unanswered sentence is held back before its
    repetition. Two robots that do not hear each other collide at a robot between them, and the slots of a turn are
    shorter than a sentence. Two sentences of 3.5 s that begin within 6 s at random miss each other once in six times,
    within 24 s three times in four."""
    objection_s: float = 0.9
    """After a claim, besides a slot for each robot: recognition, reply gap, onset, and a margin."""
    others_s: float = 10.0
    """A robot at the place of a task for several robots says so again after this time, if the others are not there yet
    or have not heard it; with the turn and the hold-back, after three times as long."""
    answer_s: float = 4.0
    """Time for a read-back or a confirmation to begin before the sentence is repeated."""
    repeats_max: int = 3
    """How often an unanswered order, question or read-back is said."""
    claims_max: int = 6
    """How often an unanswered claim or report is said, if others were there: at a loss of 30 % the probability that all
    of six rounds fail between two robots is (1 − 0.7²)⁶ = 1.8 %."""
    claims_among_talkers: int = 3
    """Greatest factor on `claims_max`, where voices are heard meanwhile: then the air is crowded, not empty."""
    claims_alone: int = 2
    """How often a claim or report is said if no other robot has been heard of, or none answered the last one."""
    stop_again_s: float = 1.2
    """From a robot's "stop" to its second one: it lasts half a second, and robots that heard the first have
    answered."""
    ask_again_s: float = 30.0
    """Shortest time between two questions about tasks that may be done; at most twice as long."""
    standing_s: float = 60.0
    """A robot stopped for this long says once how it is released: the person who stopped it knows, but others come
    by."""
    bad_air_s: float = 300.0
    """For this long after a sentence was missed, a robot asks for another confirmation before it acts."""
    lease_s: float = 240.0
    """A claim is free again if its owner was not heard of for this long: a 20 m drive takes 100 s, and in a crowd a
    report waits for more than a minute until it is heard."""
    lease_per_robot_s: float = 40.0
    """Shortest lease for each other robot: a turn, with its confirmation, takes 12.5 s, and where three of ten
    sentences are lost a report waits for three rounds of them once in a hundred times."""
    unconfirmed_lease_s: float = 90.0
    """An apparently unconfirmed claim is free again sooner: it may have been denied, unheard."""
    renewal_s: float = 100.0
    """A working robot that has not spoken of its task for this long says that it is working on it."""
    denied_s: float = 60.0
    """A claim that was denied is not raised again for this long."""
    decide_s: float = 0.3
    """Between two tasks."""
    silent_peer_s: float = 30.0
    """A robot that did not answer an order is not asked again for this long."""
    absent_s: float = 600.0
    """A robot that was not heard for this long counts as gone: longer than the longest silent work."""
    name_conflict_s: float = 300.0
    """After another voice has used the robot's name, the robot does nothing under it for this long."""
    recent_s: float = 15.0
    """An answer refers to a sentence said at most this long ago: both last 5 s at most, with the gaps between."""
    answer_kept_s: float = 12.0
    """An answer that did not get the floor for this long is dropped: two sentences of others with their gaps; by then
    the speaker has asked again."""
    second_s: float = 0.0
    """Time after an understood sentence in which its second saying may begin. 0: everything is said once."""

    def for_speech(self, speech: Speech) -> Self:
        """The same times for a team that speaks in this way: sentences take longer, and if they are said twice no other
        robot begins before the second saying would have."""
        second_s = SECOND_GAP_S if speech.times > 1 else 0.0
        return replace(
            self,
            second_s=second_s,
            greeting_wait_s=self.greeting_wait_s + second_s,
            reply_gap_s=self.reply_gap_s + second_s,
            turn_gap_s=self.turn_gap_s + second_s,
            settle_s=self.settle_s + second_s,
            objection_s=self.objection_s + second_s,
            answer_s=self.answer_s + second_s,
            recent_s=self.recent_s * speech.stretch,
            answer_kept_s=self.answer_kept_s * speech.stretch,
            lease_s=self.lease_s * speech.stretch,
            lease_per_robot_s=self.lease_per_robot_s * speech.stretch,
            unconfirmed_lease_s=self.unconfirmed_lease_s * speech.stretch,
        )

    def for_latency(self, latency_s: float) -> Self:
        """The same times with sound cards that delay a voice: others notice a speaker later by this much.

        All robots of a team are assumed to have similar cards.
        """
        return replace(
            self,
            slot_s=self.slot_s + latency_s,
            # Before a turn all slots of answers pass, and the voice in the last of them must be noticed.
            turn_gap_s=self.turn_gap_s + self.reply_slots * latency_s,
            objection_s=self.objection_s + 2.0 * latency_s,
        )


@dataclass(frozen=True)
class Role:
    """This robot's role in the team. A coordinator gives orders and does no task itself.

    `unable` are the numbers of the tasks that it lacks the means for. A robot that is not `listed` cannot expect the
    others to know its name: it spells it. `roster` are the names that all were given in advance, present or not. All
    robots of a team need the same `speech`.
    """

    name: str
    team: str | None = None
    coordinator: bool = False
    volunteer: bool = True
    nearest_first: bool = False
    unable: frozenset[int] = frozenset()
    listed: bool = True
    roster: tuple[str, ...] = ()
    speech: Speech = field(default_factory=Speech)
    people: People = People.QUESTIONS
    """Statements that they may command without a key, where one is set."""
    talk: Talk = Talk.NORMAL
    softly_db: float = 0.0
    """Level of its speech relative to the usual one: below 0 in quiet hours."""
