"""What one robot remembers of the talk: who knows whom, what was missed, claimed, passed on, doubted and asked again.

Times are seconds of the robot's sample clock; -inf means never. Names that serve as keys are in lower case.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

from hvcpd.coordination.entry import Entry
from hvcpd.language import messages as m

NEVER_S = -math.inf


@dataclass
class Missed:
    """Sentences that the robot may have missed."""

    any_work: bool = False
    """Tasks may have been done that it heard nothing of: what others leave out of their lists may be done, even if it
    has heard nobody speak of it."""
    heard_work: bool = False
    """Work went on before its first word or while it was switched off: it asks for the remaining tasks."""
    ask_again_s: float = NEVER_S
    """It does not ask for the remaining tasks again before then."""
    asked: int = 0
    """How often it has asked about tasks that may be done, since all was last certain."""
    left_out_s: float = math.inf
    """When it asks because it can do none of the tasks that are left, and hears of nobody who does them."""
    left_out_asks: int = 0
    """How often it has asked for that reason."""
    last_s: float = NEVER_S
    """When it last turned out that this robot, or one it spoke to, had missed a sentence."""


@dataclass(frozen=True)
class HeardClaim:
    """A robot's claim, and the board's entry for each of its tasks before."""

    speaker: str = ""
    before: Mapping[int, Entry] = field(default_factory=dict)
    at_s: float = NEVER_S


@dataclass(frozen=True)
class QuotedReport:
    """A report that a robot passed on in the name of `speaker`."""

    speaker: str
    number: int
    at_s: float


RelayedMessage = tuple[str, str, m.Statement | None]
"""Speaker, addressee and statement."""


@dataclass
class Relays:
    """The sentences that were passed on, and the pairs of robots that need this."""

    passed_on: dict[RelayedMessage, tuple[int, float]] = field(default_factory=dict)
    """How often, and when last."""
    apart: dict[frozenset[str], float] = field(default_factory=dict)
    """Pairs that do not hear each other, and when that was last seen."""


@dataclass
class Acquaintance:
    """Which robots know this robot's name, and how it made its own and others' names known."""

    unheard: frozenset[str] = frozenset()
    """Robots that were listed in advance, may be there, and wait for a turn to say their first word."""
    all_heard_s: float = math.inf
    """By then each of them that is there has spoken."""
    introduced: bool = False
    """Whether it has said its own name."""
    passed_over: bool = False
    """The others take a robot that has not spoken for absent."""
    greetings: int = 0
    """How often it has greeted."""
    alone: bool = False
    """Nobody has answered any repetition of a claim: later ones are said less often."""
    known_by: set[str] = field(default_factory=set)
    """Robots that have said this robot's name: it need not be spelled for them."""
    spelled_s: float = NEVER_S
    """When this robot last spelled its name."""
    own_name_heard_s: tuple[float, ...] = ()
    """When another voice used this robot's name: the last two times."""
    was_busy: bool = False
    """It has claimed a task since it last said that it is free."""
    strangers: bool = False
    """A robot has spelled its name: there are robots nearby that were not known in advance."""
    call_s: float | None = None
    """When this robot next asks who is here, because it has nobody to give an order to."""
    calls: int = 0
    """How often it has asked this."""
    garbled_s: tuple[float, ...] = ()
    """When speech was not understood, recently."""
    ask_s: float = NEVER_S
    """It does not ask for names again before then."""
    pause_s: float | None = None
    """Between two questions for names; None before the first."""
    respell_s: float | None = None
    """Between two spellings of its name; None before the first."""
    met: int = 0
    """How many peers there were when it last asked for names."""
    called_s: float = NEVER_S
    """When somebody last greeted all, or asked who is here: robots answer with their names."""
    who_here_s: float = NEVER_S
    """When somebody without a name last asked who is here: the answers are for everybody, as greetings are."""


@dataclass
class Waiting:
    """How a robot that only takes orders waits for one."""

    giver: str | None = None
    """The robot that was last heard to give an order, or whose order another robot was heard to answer."""
    asked: int = 0
    """How often it asked for the remaining tasks since its last order."""
    until_s: float | None = None
    """When its patience ends."""


@dataclass
class Doubts:
    """This robot's questions and replies to each speaker whose seal was wrong or missing, by name."""

    asked: dict[str, tuple[float, int]] = field(default_factory=dict)
    """When it was first asked to say its sentence again, and how often."""
    answered: dict[str, tuple[float, float]] = field(default_factory=dict)
    """When it was last told that it is not trusted, and for how long this is not repeated, s."""


@dataclass
class Repair:
    """How well the two sides of an exchange understand each other."""

    last_said: m.Utterance | None = None
    last_call: str | None = None
    """The speaker that this sentence answered, if one answer of any robot is enough."""
    asked: int = 0
    """How often this robot asked for a repetition."""
    was_asked: int = 0
    """How often it was asked for a repetition."""
    speak_slowly: bool = False
    aloud_until_s: float = NEVER_S
    """Until then it speaks at the usual level, in quiet hours, too."""
    noisy_until_s: float = NEVER_S
    """Until then it speaks for noise: a voice was hardly louder than the noise."""
    stop_s: float = NEVER_S
    """When the last "stop" was said."""
    resume_s: float = NEVER_S
    """When "resume" was heard last."""
    unclear_s: tuple[float, ...] = ()
    """When speech was for this robot by name, and not understood otherwise, lately."""
    foreign_until_s: float = NEVER_S
    """Until then speech that is not understood may be code words of a message for others."""

    def reset(self) -> None:
        """A new exchange begins."""
        self.asked, self.was_asked, self.speak_slowly = 0, 0, False
