"""What an utterance means: frozen dataclasses, without a word of how it is said."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from enum import Enum

from hvcpd.language.addressees import Addressee as Addressee
from hvcpd.language.addressees import ToAll as ToAll
from hvcpd.language.addressees import ToRobot as ToRobot
from hvcpd.language.addressees import ToTeam as ToTeam
from hvcpd.language.motions import ComeBack as ComeBack
from hvcpd.language.motions import Motion as Motion
from hvcpd.language.motions import MoveBy as MoveBy
from hvcpd.language.motions import TurnBy as TurnBy
from hvcpd.language.motions import WillMove as WillMove
from hvcpd.language.proofs import Cipher as Cipher
from hvcpd.language.proofs import Code as Code
from hvcpd.language.proofs import Mark as Mark
from hvcpd.language.proofs import Seal as Seal


@dataclass(frozen=True)
class TaskByNumber:
    """A task by its number in the repository."""

    number: int


@dataclass(frozen=True)
class TaskByName:
    """A task by its name, in lower case."""

    name: str


TaskRef = TaskByNumber | TaskByName


@dataclass(frozen=True)
class Working:
    """The speaker is at this task now: it renews the speaker's claim."""

    task: TaskRef


@dataclass(frozen=True)
class Claim:
    """The speaker will do this task, and then `also` that one; after an order it is the read-back."""

    task: TaskRef
    also: TaskByNumber | None = None

    @property
    def tasks(self) -> tuple[TaskRef, ...]:
        """One or two, in the order in which they will be done."""
        return (self.task,) if self.also is None else (self.task, self.also)


@dataclass(frozen=True)
class Order:
    """The addressee is asked to do this task."""

    task: TaskRef


@dataclass(frozen=True)
class Unable:
    """The speaker cannot do this task: it lacks what it takes, or has tried and failed."""

    task: TaskRef


@dataclass(frozen=True)
class Unknown:
    """The speaker knows no such task."""

    task: TaskByNumber


@dataclass(frozen=True)
class Busy:
    """The speaker is at something else now."""


@dataclass(frozen=True)
class Completed:
    """The speaker has done this task, and `also` that one; with `next` it claims another one in the same breath, and
    with `then` one more.

    `count`: of a task that was changed, the last `Change` that the speaker knew of.
    """

    task: TaskByNumber
    next: TaskByNumber | None = None
    count: int | None = None
    also: TaskByNumber | None = None
    then: TaskByNumber | None = None

    @property
    def tasks(self) -> tuple[TaskByNumber, ...]:
        """What is done: one or two, in the order in which they were."""
        return (self.task,) if self.also is None else (self.task, self.also)

    @property
    def claim(self) -> Claim | None:
        """What is claimed in the same breath."""
        return Claim(self.next, self.then) if self.next is not None else None


@dataclass(frozen=True)
class Failed:
    """The speaker gave this task up; it is free for others. `reason` is one that the task file lists."""

    task: TaskByNumber
    reason: str | None = None


@dataclass(frozen=True)
class Change:
    """The task is to be done once more or, with `skip`, to be left out this time.

    `count` tells whoever has missed it which change of this task it is, 1 to 9 and then anew; None: somebody wants it
    now.
    """

    task: TaskByNumber
    skip: bool = False
    count: int | None = None


@dataclass(frozen=True)
class Confirmed:
    """What the addressee said last is right; of a claim or report the task is named, so that it is read back.

    `complete`: it was reported that the task is done; whoever missed the report learns it so.
    """

    task: TaskByNumber | None = None
    complete: bool = False
    also: TaskByNumber | None = None

    @property
    def tasks(self) -> tuple[TaskByNumber, ...]:
        """The tasks that are named: none, one or two."""
        return tuple(ref for ref in (self.task, self.also) if ref is not None)


@dataclass(frozen=True)
class ConfirmedAnd:
    """What the addressee said last of a task is right; and in the same breath the speaker's own claim or report, to
    all."""

    confirmed: Confirmed
    statement: Claim | Completed


@dataclass(frozen=True)
class Negative:
    """What the addressee said last is wrong."""


@dataclass(frozen=True)
class SayAgain:
    """The speaker did not understand: the addressee's last sentence once more, more slowly if asked so."""

    slowly: bool = False


@dataclass(frozen=True)
class NotUnderstood:
    """The speaker gives up asking."""


@dataclass(frozen=True)
class WhatDoing:
    """What is the addressee at?"""


@dataclass(frozen=True)
class WhoHere:
    """Everybody who hears it shall say its name."""


@dataclass(frozen=True)
class WhatLeft:
    """Which tasks are not done yet?"""


@dataclass(frozen=True)
class ReportWanted:
    """Everybody who hears it shall say its team, task, state and battery: a shift changes."""


class Doing(Enum):
    """What somebody is at, in a report."""

    FREE = "free"
    WORKING = "working"
    BUSY = "busy"
    STOPPED = "stopped"


@dataclass(frozen=True)
class Report:
    """What the speaker is at, its task if it is at one, and its battery's voltage if it knows that."""

    doing: Doing
    task: TaskByNumber | None = None
    battery_v: float | None = None
    """In the steps that can be said: half a volt, rounded down."""


@dataclass(frozen=True)
class Free:
    """The speaker is at nothing."""


@dataclass(frozen=True)
class Left:
    """The tasks that are not done yet, as far as the speaker knows: up to three by number, and whether that is all."""

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
    """The speaker goes, and gives back what it had claimed."""


@dataclass(frozen=True)
class NameTaken:
    """The speaker has heard another voice use its name."""


@dataclass(frozen=True)
class Spelled:
    """The speaker's name, letter by letter, in lower case: "zorg". As a greeting it is answered like one.

    `ask`: the speaker does not understand everybody, and asks those whom it may not know to spell their names.
    """

    letters: str
    ask: bool = False


@dataclass(frozen=True)
class Relayed:
    """What somebody else said, passed on word by word."""

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
    `waits`: it has stood for a while, and tells how it is released."""

    forgot: bool = False
    waits: bool = False


@dataclass(frozen=True)
class Distrusted:
    """The speaker does not believe that who seemed to say something did say it, and does nothing about it."""


@dataclass(frozen=True)
class SealedMessage:
    """The speaker says something that only those understand who have the key; a `Cipher` holds what."""


@dataclass(frozen=True)
class Resume:
    """A halted robot may take on tasks again."""


Statement = (
    Working
    | Claim
    | Order
    | Unable
    | Unknown
    | Busy
    | Completed
    | Failed
    | Change
    | Confirmed
    | ConfirmedAnd
    | Negative
    | SayAgain
    | NotUnderstood
    | Remark
    | Stop
    | Stopped
    | Resume
    | WhatDoing
    | WhoHere
    | WhatLeft
    | ReportWanted
    | Report
    | Free
    | Left
    | Leaving
    | NameTaken
    | ComeBack
    | MoveBy
    | TurnBy
    | WillMove
    | Spelled
    | Relayed
    | Distrusted
    | SealedMessage
)


def parts(utterance: Utterance) -> tuple[Utterance, ...]:
    """What an utterance says to whom: a confirmation to its addressee, and what was said with it to all."""
    both = utterance.statement
    if not isinstance(both, ConfirmedAnd):
        return (utterance,)
    return (
        replace(utterance, statement=both.confirmed),
        replace(utterance, addressee=ToAll(), statement=both.statement),
    )


def own_words(statement: Statement | None) -> Statement | None:
    """The statement itself, or what it passes on of somebody else, or says besides a confirmation."""
    return statement.statement if isinstance(statement, Relayed | ConfirmedAnd) else statement


@dataclass(frozen=True)
class Utterance:
    """One sentence.

    `speaker` is None only for the calls that anybody may make without a name (stop, resume); `addressee` None
    speaks to nobody in particular; `team` is the speaker's, when it says so; `statement` None is a bare greeting.
    `mark` proves who speaks, and is no part of the meaning: two utterances are equal whatever their marks. With a
    `Cipher`, "sealed message" is said in place of the statement, which whoever has no key does not learn.
    """

    speaker: str | None
    addressee: Addressee | None = None
    team: str | None = None
    statement: Statement | None = None
    mark: Mark | None = field(default=None, compare=False)
