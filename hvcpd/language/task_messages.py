"""Statements about tasks: claims, progress, reports, and their confirmations."""

from __future__ import annotations

from dataclasses import dataclass


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
    """The speaker is at work on this task: it renews the speaker's claim."""

    task: TaskRef


@dataclass(frozen=True)
class Claim:
    """The speaker will do this task, and then `also` that one; after an order it is the read-back.

    `distance_m`: the distance to the task, in metres. A nearer robot can outbid a claim that states it; addressed to a
    robot that has just claimed the task, the claim is such a bid.
    """

    task: TaskRef
    also: TaskByNumber | None = None
    distance_m: int | None = None

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
    """The speaker cannot do this task: it lacks the means, or has tried and failed."""

    task: TaskRef


@dataclass(frozen=True)
class Unknown:
    """The speaker knows no such task."""

    task: TaskByNumber


@dataclass(frozen=True)
class Busy:
    """The speaker is busy with another task."""


@dataclass(frozen=True)
class Completed:
    """The speaker has done this task, and `also` that one; with `next` it claims another one in the same turn, and
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
        """The tasks that are done: one or two, in their order."""
        return (self.task,) if self.also is None else (self.task, self.also)

    @property
    def claim(self) -> Claim | None:
        """The tasks claimed in the same turn."""
        return Claim(self.next, self.then) if self.next is not None else None


@dataclass(frozen=True)
class Failed:
    """The speaker gave this task up; it is free for others. `reason` is one that the task file lists."""

    task: TaskByNumber
    reason: str | None = None


@dataclass(frozen=True)
class Change:
    """The task is to be done once more or, with `skip`, to be left out this time.

    `count` is the number of this change of the task, for robots that have missed it, 1 to 9 and then from 1 again;
    None: the speaker wants the change now.
    """

    task: TaskByNumber
    skip: bool = False
    count: int | None = None


@dataclass(frozen=True)
class Confirmed:
    """The addressee's last sentence is right; for a claim or report the task is named, so that it is read back.

    `complete`: the task was reported as done; a robot that missed the report learns it in this way.
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
    """The addressee's last sentence about a task is right; in the same turn follows the speaker's own claim or report,
    to all."""

    confirmed: Confirmed
    statement: Claim | Completed

    @property
    def given_up(self) -> tuple[TaskRef, ...]:
        """The tasks that the addressee must have reported as failed, because the speaker claims them itself."""
        claim = self.statement if isinstance(self.statement, Claim) else self.statement.claim
        return tuple(ref for ref in self.confirmed.tasks if claim is not None and ref in claim.tasks)


TaskStatement = (
    Working | Claim | Order | Unable | Unknown | Busy | Completed | Failed | Change | Confirmed | ConfirmedAnd
)
