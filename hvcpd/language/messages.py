"""The meanings of utterances: frozen dataclasses, independent of the wording."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from enum import Enum

from hvcpd.errors import PhraseError
from hvcpd.language.addressees import FRIEND as FRIEND
from hvcpd.language.addressees import Addressee as Addressee
from hvcpd.language.addressees import ToAll as ToAll
from hvcpd.language.addressees import ToRobot as ToRobot
from hvcpd.language.addressees import ToTeam as ToTeam
from hvcpd.language.place_messages import PlaceFree as PlaceFree
from hvcpd.language.place_messages import PlaceGiven as PlaceGiven
from hvcpd.language.place_messages import PlaceStatement
from hvcpd.language.place_messages import PlaceTaken as PlaceTaken
from hvcpd.language.place_messages import PlaceWanted as PlaceWanted
from hvcpd.language.range_messages import CannotMeasure as CannotMeasure
from hvcpd.language.range_messages import HowFarAway as HowFarAway
from hvcpd.language.range_messages import Measured as Measured
from hvcpd.language.range_messages import Measuring as Measuring
from hvcpd.language.range_messages import RangeStatement
from hvcpd.language.task_messages import Busy as Busy
from hvcpd.language.task_messages import Change as Change
from hvcpd.language.task_messages import Claim as Claim
from hvcpd.language.task_messages import Completed as Completed
from hvcpd.language.task_messages import Confirmed as Confirmed
from hvcpd.language.task_messages import ConfirmedAnd as ConfirmedAnd
from hvcpd.language.task_messages import Failed as Failed
from hvcpd.language.task_messages import Order as Order
from hvcpd.language.task_messages import TaskByName as TaskByName
from hvcpd.language.task_messages import TaskByNumber as TaskByNumber
from hvcpd.language.task_messages import TaskRef as TaskRef
from hvcpd.language.task_messages import TaskStatement
from hvcpd.language.task_messages import Unable as Unable
from hvcpd.language.task_messages import Unknown as Unknown
from hvcpd.language.task_messages import Working as Working


@dataclass(frozen=True)
class ComeBack:
    """Drive to where you started."""


@dataclass(frozen=True)
class MoveBy:
    """Drive straight on (or back) by a distance in metres."""

    distance_m: float
    back: bool = False


@dataclass(frozen=True)
class TurnBy:
    """Turn on the spot by an angle in degrees, counter-clockwise positive (REP-103)."""

    angle_deg: float


Motion = ComeBack | MoveBy | TurnBy


@dataclass(frozen=True)
class WillMove:
    """The speaker will make this motion: the read-back of its order."""

    motion: Motion


@dataclass(frozen=True)
class Negative:
    """The addressee's last sentence is wrong."""


@dataclass(frozen=True)
class SayAgain:
    """The speaker did not understand: the addressee's last sentence once more, more slowly if `slowly`."""

    slowly: bool = False


@dataclass(frozen=True)
class NotUnderstood:
    """The speaker gives up asking."""


@dataclass(frozen=True)
class WhatDoing:
    """A question for the addressee's activity."""


@dataclass(frozen=True)
class WhoHere:
    """All listeners are asked for their names."""


@dataclass(frozen=True)
class Hail(WhoHere):
    """The same, asked by no more than a greeting: "Hi Rob"."""


@dataclass(frozen=True)
class WhatLeft:
    """A question for the unfinished tasks."""


@dataclass(frozen=True)
class ReportWanted:
    """All listeners are asked for their team, task, state and battery: a shift changes."""


class Doing(Enum):
    """The activity of a speaker, in a report."""

    FREE = "free"
    WORKING = "working"
    BUSY = "busy"
    STOPPED = "stopped"


@dataclass(frozen=True)
class Report:
    """The speaker's activity, its task if it has one, and its battery's voltage if it knows that."""

    doing: Doing
    task: TaskByNumber | None = None
    battery_v: float | None = None
    """In the steps that can be said: half a volt, rounded down."""


@dataclass(frozen=True)
class Free:
    """The speaker has no activity."""


@dataclass(frozen=True)
class Left:
    """The unfinished tasks, as far as the speaker knows: up to three by number, and whether that is all."""

    first: TaskByNumber | None = None
    second: TaskByNumber | None = None
    third: TaskByNumber | None = None
    more: bool = False

    @property
    def numbers(self) -> tuple[int, ...]:
        """The numbers that were named."""
        return tuple(ref.number for ref in (self.first, self.second, self.third) if ref is not None)


@dataclass(frozen=True)
class Leaving:
    """The speaker leaves, and gives back its claims."""


@dataclass(frozen=True)
class NameTaken:
    """The speaker has heard another voice use its name."""


@dataclass(frozen=True)
class Spelled:
    """The speaker's name, letter by letter, in lower case: "zorg". As a greeting it is answered like one.

    `ask`: the speaker does not understand all others, and asks robots that may not know it to spell their names.
    """

    letters: str
    ask: bool = False


@dataclass(frozen=True)
class Relayed:
    """Another speaker's statement, passed on word by word."""

    speaker: str
    statement: Statement


@dataclass(frozen=True)
class Remark:
    """A sentence that a task has its robot say; it changes nothing."""

    text: str


@dataclass(frozen=True)
class Stop:
    """Halt at once and stay halted."""


@dataclass(frozen=True)
class Stopped:
    """The speaker has halted; `forgot`: because it has lost its memory, and does not know whether it may go on;
    `waits`: it has stood for a while, and says how it is released."""

    forgot: bool = False
    waits: bool = False


@dataclass(frozen=True)
class Distrusted:
    """The speaker does not believe that the named speaker said a sentence, and ignores it."""


@dataclass(frozen=True)
class SealedMessage:
    """The speaker's statement is only for listeners with the key; a `Cipher` holds it."""


@dataclass(frozen=True)
class Resume:
    """A halted robot may take on tasks again."""


Statement = (
    TaskStatement
    | PlaceStatement
    | RangeStatement
    | Motion
    | WillMove
    | Negative
    | SayAgain
    | NotUnderstood
    | Remark
    | Stop
    | Stopped
    | Resume
    | WhatDoing
    | WhoHere
    | Hail
    | WhatLeft
    | ReportWanted
    | Report
    | Free
    | Left
    | Leaving
    | NameTaken
    | Spelled
    | Relayed
    | Distrusted
    | SealedMessage
)


@dataclass(frozen=True)
class Seal:
    """A robot's seal after a sentence, which proves its speaker: a number of four code words."""

    value: int


@dataclass(frozen=True)
class Code:
    """A person's code after a sentence, for the same purpose: six digits that are valid once."""

    digits: str = field(repr=False)


@dataclass(frozen=True)
class Cipher:
    """A statement, encrypted: a number of `n_words` code words, said in the statement's place."""

    value: int
    n_words: int


Mark = Seal | Code | Cipher


def parts(utterance: Utterance) -> tuple[Utterance, ...]:
    """The parts of an utterance: a confirmation to its addressee, and the rest of the sentence to all."""
    both = utterance.statement
    if not isinstance(both, ConfirmedAnd):
        return (utterance,)
    return (
        replace(utterance, statement=both.confirmed),
        replace(utterance, addressee=ToAll(), statement=both.statement),
    )


def own_words(statement: Statement | None) -> Statement | None:
    """The statement itself, or the one that it passes on, or the one that it adds to a confirmation."""
    return statement.statement if isinstance(statement, Relayed | ConfirmedAnd) else statement


@dataclass(frozen=True)
class Utterance:
    """One sentence.

    `speaker` is None only for the calls that anybody may make without a name (stop, resume); `addressee` None
    speaks to nobody in particular; `team` is the speaker's, when it says so; `statement` None is a bare greeting.
    `mark` proves who speaks, and is no part of the meaning: two utterances are equal whatever their marks. With a
    `Cipher`, "sealed message" is said in place of the statement, which listeners without a key do not learn.
    """

    speaker: str | None
    addressee: Addressee | None = None
    team: str | None = None
    statement: Statement | None = None
    mark: Mark | None = field(default=None, compare=False)


def for_robots(utterance: Utterance) -> Utterance:
    """The utterance as one of our voices says it: a hail as the whole question, since robots hear no hail in each
    other's voices. Raises PhraseError for an order or an answer without a speaker's name: they hear none of those."""
    if utterance.speaker == FRIEND:
        to = utterance.addressee or ToAll()
        raise PhraseError(f"only people need not say who speaks; with a robot's voice say 'Hi {to}, I am NAME, …'")
    return replace(utterance, statement=WhoHere()) if isinstance(utterance.statement, Hail) else utterance
