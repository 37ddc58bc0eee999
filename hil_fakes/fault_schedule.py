"""The faults of a robot's wheels in a trial, with their times: drawn from a seed, the same on every machine."""

from __future__ import annotations

import random
from dataclasses import dataclass
from enum import Enum

from hil_fakes.dynamixel.faults import ReplyFault


class Fault(Enum):
    """Something that goes wrong."""

    BAD_REPLIES = "bad replies"
    """A few replies in a row are lost, damaged, late or noisy."""
    BABBLE = "babble"
    """Random bytes run over the line for a while."""
    UNPLUG = "unplug"
    """The adapter is pulled, and mostly put back."""
    DEAD_MOTOR = "dead motor"
    """A motor loses its cable, and mostly gets it back."""
    BROWN_OUT = "brown-out"
    """A motor restarts: no torque, no memory, its turns forgotten. Behind OpenCR: the whole controller."""
    HARDWARE_ERROR = "hardware error"
    """A motor shuts itself down."""
    OBSTACLE = "obstacle"
    """Something holds a wheel, for a while or for good."""
    EMPTY_BATTERY = "empty battery"
    """The voltage falls below the required minimum, and stays there."""
    HANG = "hang"
    """The program sends nothing for a while."""


STOPS = frozenset(
    {Fault.UNPLUG, Fault.DEAD_MOTOR, Fault.HARDWARE_ERROR, Fault.HANG, Fault.EMPTY_BATTERY, Fault.OBSTACLE}
)
"""Faults after which the wheels must stand; an obstacle only if the wheel has a command to turn, and keeps getting
one."""

LASTING_SHARE = 0.2
"""Every fifth cable or obstacle stays as it is: the task must fail then, not hang."""


@dataclass(frozen=True)
class Event:
    """A fault at a time (s). `side` 0 is the left wheel; `until_s` may be infinite; `replies` for BAD_REPLIES."""

    at_s: float
    fault: Fault
    side: int
    until_s: float
    replies: tuple[ReplyFault, ...] = ()


def schedule(seed: int) -> list[Event]:
    """One to four faults, far enough apart that each can be judged by itself; in order of time."""
    rng = random.Random(f"wheel faults {seed}")
    events: list[Event] = []
    at_s = 0.5
    for _ in range(rng.randint(1, 4)):
        at_s += rng.uniform(0.4, 4.0)
        fault = rng.choice(list(Fault))
        lasting = fault in (Fault.UNPLUG, Fault.DEAD_MOTOR, Fault.OBSTACLE) and rng.random() < LASTING_SHARE
        until_s = float("inf") if lasting else at_s + rng.uniform(0.6, 3.0)
        kinds = [kind for kind in ReplyFault if kind is not ReplyFault.NONE]
        replies = tuple(rng.choice(kinds) for _ in range(rng.randint(1, 6)))
        events.append(Event(at_s, fault, rng.randint(0, 1), until_s, replies if fault is Fault.BAD_REPLIES else ()))
        if until_s == float("inf"):
            break
        at_s = until_s
    return events
