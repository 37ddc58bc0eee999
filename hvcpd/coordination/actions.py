"""What coordination asks its surroundings to do, and the settings that it follows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol, TypeVar

from hvcpd.config.tasks import Action as TaskAction
from hvcpd.language.messages import Utterance

_T = TypeVar("_T")


class Chance(Protocol):
    """The robot's own seeded generator; `random.Random` has both methods."""

    def random(self) -> float: ...

    def choice(self, seq: Sequence[_T], /) -> _T: ...


@dataclass(frozen=True)
class Say:
    """Speak this sentence now; answer with `spoken` when its last sample has left the loudspeaker."""

    utterance: Utterance


@dataclass(frozen=True)
class Perform:
    """Carry out these actions of a task in order; answer with `performed` or `perform_failed`."""

    task: int
    actions: tuple[TaskAction, ...]


@dataclass(frozen=True)
class Halt:
    """Stop the wheels and forget what was being performed."""


@dataclass(frozen=True)
class SaveTask:
    """Remember this view of a task: state is open, claimed, done or failed."""

    number: int
    state: str
    owner: str | None


@dataclass(frozen=True)
class SavePeer:
    """Remember that this robot or person was heard."""

    name: str
    team: str | None
    heard_at_s: float


Action = Say | Perform | Halt | SaveTask | SavePeer


@dataclass(frozen=True)
class Timing:
    """How long robots wait for each other, in seconds of the sample clock.

    A recogniser reports a sentence about 0.3 s after its last word and notices a voice about 0.08 s after its
    first; the gaps follow from that. A sentence lasts 2 to 5 s.
    """

    wake_min_s: float = 1.0
    """Listening before the first greeting: the noise must be known first."""
    wake_spread_s: float = 4.0
    """Drawn on top, so that robots switched on together do not greet at once: longer than a greeting."""
    greeting_wait_s: float = 7.0
    """Time for two answers to a greeting."""
    greetings_max: int = 3
    """So often an unanswered greeting is repeated before the robot works alone."""
    reply_gap_s: float = 0.15
    """Before an answer, once the question is understood: people leave about 0.2 s (Stivers et al. 2009)."""
    turn_gap_s: float = 0.9
    """Before anything else, so that an answer always comes first: recognition, reply gap and onset detection."""
    slot_s: float = 0.12
    """Step of the random back-off: longer than the onset detection, so that two different draws don't collide."""
    reply_slots: int = 3
    turn_slots: int = 12
    settle_s: float = 0.5
    """After a voice falls silent: by then its sentence has been recognised."""
    objection_s: float = 1.6
    """After a claim: time for an objection to be heard to begin (recognition, reply gap, slots, onset)."""
    answer_s: float = 4.0
    """Time for a read-back or a confirmation to begin before the sentence is repeated."""
    repeats_max: int = 3
    """So often an unanswered order, read-back or report is said again."""
    lease_s: float = 150.0
    """A claim whose owner was not heard of for so long is free again: a 20 m drive takes 100 s."""
    renewal_s: float = 60.0
    """A working robot that has not spoken of its task for so long says that it is at it: two chances a lease."""
    decide_s: float = 0.3
    """Between two tasks."""
    silent_peer_s: float = 30.0
    """A robot that did not answer an order is not asked again for so long."""


@dataclass(frozen=True)
class Role:
    """Who this robot is in the team. A coordinator gives orders and does no task itself."""

    name: str
    team: str | None = None
    coordinator: bool = False
    volunteer: bool = True
    nearest_first: bool = False
