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
    """The speaker is at this task now: it renews the speaker's claim."""

    task: TaskRef


@dataclass(frozen=True)
class Claim:
    """The speaker will do this task, and then `also` that one; after an order it is the read-back.

    `way_m`: the way there, in metres. Who tells it can be outbid by somebody nearer; said to whom has just claimed that
    task, it is such a bid.
    """

    task: TaskRef
    also: TaskByNumber | None = None
    way_m: int | None = None

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
        """The tasks that are done: one or two, in their order."""
        return (self.task,) if self.also is None else (self.task, self.also)

    @property
    def claim(self) -> Claim | None:
        """The tasks claimed in the same breath."""
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
