"""What an utterance means: frozen dataclasses, without a word of how it is said."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class ToAll:
    """Everybody within earshot."""


@dataclass(frozen=True)
class ToTeam:
    """Every member of a team."""

    team: str


@dataclass(frozen=True)
class ToRobot:
    """One robot (or person), by its name as it is written."""

    name: str


Addressee = ToAll | ToTeam | ToRobot


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
    """The speaker will do this task; after an order it is the read-back."""

    task: TaskRef


@dataclass(frozen=True)
class Order:
    """The addressee is asked to do this task."""

    task: TaskRef


@dataclass(frozen=True)
class Unable:
    """The speaker does not know this task or cannot do it now."""

    task: TaskRef


@dataclass(frozen=True)
class Completed:
    """This task is done."""

    task: TaskByNumber


@dataclass(frozen=True)
class Failed:
    """The speaker gave this task up; it is free for others."""

    task: TaskByNumber


@dataclass(frozen=True)
class Confirmed:
    """What the addressee said last is right."""


@dataclass(frozen=True)
class Negative:
    """What the addressee said last is wrong."""


@dataclass(frozen=True)
class SayAgain:
    """The speaker did not understand."""


@dataclass(frozen=True)
class Remark:
    """A sentence that a task has its robot say; it changes nothing."""

    text: str


@dataclass(frozen=True)
class Stop:
    """Halt at once and stay halted."""


@dataclass(frozen=True)
class Stopped:
    """The speaker has halted."""


@dataclass(frozen=True)
class Resume:
    """A halted robot may take on tasks again."""


Statement = (
    Working | Claim | Order | Unable | Completed | Failed | Confirmed | Negative | SayAgain | Remark
    | Stop | Stopped | Resume
)


@dataclass(frozen=True)
class Utterance:
    """One sentence.

    `speaker` is None only for the calls that anybody may make without a name (stop, resume); `addressee` None
    speaks to nobody in particular; `team` is the speaker's, when it says so; `statement` None is a bare greeting.
    """

    speaker: str | None
    addressee: Addressee | None = None
    team: str | None = None
    statement: Statement | None = None
