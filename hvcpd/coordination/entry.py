"""One task on the board, as one robot knows it."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from hvcpd.config.tasks import TaskDefinition

OPEN, CLAIMED, DONE = "open", "claimed", "done"


@dataclass
class Entry:
    """One task's state. `lease_end_s` is when a claim lapses; `failed_by` are the robots that gave the task up.

    `hearsay`: this robot heard once that the task is done, from a robot that it had not heard claim it. It then leaves
    the task alone, but does not tell others that it is done.
    """

    definition: TaskDefinition
    state: str = OPEN
    owner: str | None = None
    lease_end_s: float = 0.0
    failed_by: frozenset[str] = frozenset()
    hearsay: bool = False
    said_by: str | None = None
    """The robot that left this task, done by hearsay, out of its list of remaining tasks; None: its report was
    heard."""
    times_said: int = 0
    """How often it did."""
    firm: bool = False
    """The claim is known to be confirmed, or its owner to be at work: reason enough to deny the task to others."""
    times_heard: int = 0
    """How often the owner, or a robot that answered it, was heard to name the owner: a word can be misheard."""
    times_denied: int = 0
    """How often this robot's claim of it was denied."""
    since_s: float = -math.inf
    """When this robot learned of its state and owner, by the sample clock."""
    distance_m: int | None = None
    """The distance that its owner stated with the claim."""
    due_s: float | None = None
    """Of a recurring task: when the occurrence that this entry describes was due, s since 1970; None: unknown."""
    is_due: bool = False
    """It became due, or was added, while this robot was listening. A robot whose time has not come, or that does not
    know the task, leaves it out of its list of remaining tasks without meaning that it is done."""
    was_open: bool = False
    """It was open when this robot was last switched off: perhaps it had been added to this robot alone."""
    known_to: frozenset[str] = frozenset()
    """The robots that have spoken of it since it became due: if they leave it out of their lists, it is done."""
    change: int = 0
    """The number of the last change that is known; 0: none was made."""
    is_changed: bool = False
    """The last change was made since the task was last due."""
    rumoured_change: tuple[int, float] = (0, -math.inf)
    """The number of a change that was heard once, and is not believed yet; and when, s."""
    skipped: bool = False
    """Nobody has done it: it is to be left out this time."""
    opened_s: float = -math.inf
    """Of a recurring task: when this robot heard or knew it to become due, by the sample clock."""
    gone: bool = False
    """The team no longer has this task; questions about it may still be answered."""
    done_s: float = -math.inf
    """When it was last known to be done, by the sample clock."""
    done_by: str | None = None
    """The robot that did it then."""
    acted_s: float = -math.inf
    """When this robot itself last did it."""
    helpers: dict[str, float] = field(default_factory=dict)
    """Of a task for several robots: those that do it with its owner, and when the claim of each lapses."""
    parts: frozenset[str] = frozenset()
    """Those of them that have done their part."""
    parts_before: frozenset[str] = frozenset()
    """Those that did their part before the others were no longer heard, or that this robot, which waits to do it, did
    not know to be at it."""
    calls: int = 0
    """How often this robot has called others to do it with, without an answer."""
    call_s: float = -math.inf
    """When it may call again."""
    is_new_to_others: bool = False
    """Another robot does not know the task: it understands the number, and not the name."""

    @property
    def number(self) -> int:
        return self.definition.number

    @property
    def recurs(self) -> bool:
        return self.definition.every is not None

    @property
    def is_shared(self) -> bool:
        """Whether it takes several robots."""
        return self.definition.robots > 1

    @property
    def team(self) -> frozenset[str]:
        """The robots that have it: its owner, and those that do it with the owner."""
        return frozenset() if self.owner is None or self.state != CLAIMED else frozenset((self.owner, *self.helpers))

    @property
    def has_room(self) -> bool:
        """Whether it was claimed, and needs more robots than have said that they will do it."""
        return 0 < len(self.team) < self.definition.robots and not self.parts

    @property
    def known_done(self) -> bool:
        return self.state == DONE and not self.hearsay

    @property
    def waits(self) -> bool:
        """Whether nobody does it unless a person asks for it, or asks for it again."""
        return self.known_done and (self.skipped or self.definition.on_demand)

    @property
    def lasting_state(self) -> str:
        """The state to remember after a restart. Hearsay is left out, because it would come back as knowledge. A task
        that the team no longer has is not remembered as done: the team may have it again."""
        if self.gone and self.owner is None:
            return OPEN
        if self.state == DONE and self.hearsay:
            return OPEN if self.owner is None else CLAIMED
        return self.state


def new_entry(task: TaskDefinition) -> Entry:
    """The entry of a task that nobody has spoken of."""
    if not task.on_demand:
        return Entry(task)
    return Entry(task, DONE, skipped=True, change=1)  # all know that it is left out, as if a person had told them so


def spoken_name(task: TaskDefinition) -> str:
    """A task's name in the form of a spoken reference: lower case, single spaces."""
    return " ".join(task.name.lower().split())
