"""What one robot knows of each place that only one fits in: who has it, who waits, and how far its own asking is.

Times are seconds of the robot's sample clock; -inf means never, inf that nothing is due.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

from hvcpd.config.shared_places import BODY_M, LINE_M, SharedPlace
from hvcpd.config.tasks import Place


@dataclass
class Pass:
    """One place. `keeper` had it last, as far as this robot has heard, and alone may give it to another one."""

    place: SharedPlace
    since_s: float
    """When this robot began to listen."""
    keeper: str | None = None
    lease_end_s: float = -math.inf
    """Until then the keeper is taken to be in it, if it says no more."""
    inside: bool = False
    """This robot stands in it."""
    using: bool = False
    """This robot has it, and is in it or on its way in."""
    wanted_s: float | None = None
    """Since when this robot has wanted it."""
    held: bool = False
    """It has come to the line, and stands."""
    ask_s: float = math.inf
    """When it is to ask for it."""
    asked_s: float = -math.inf
    """When it last finished asking."""
    answer_s: float = math.inf
    """Until then an answer to that may begin."""
    silences: int = 0
    """So often in a row nobody has said anything in answer."""
    again_s: float = -math.inf
    """It does not ask whoever has the place before then."""
    given_s: float = -math.inf
    """When it last gave the place to the keeper, or heard that the keeper still waits for it."""
    told: bool = False
    """It has said that it has the place, and says so when it leaves."""
    tell_s: float = math.inf
    """When it is to say that it is in it: whoever is not heard, and so gets no answer, stays out then."""
    waiting: dict[str, tuple[float, float]] = field(default_factory=dict)
    """Who else wants it: when they were first and last heard to ask."""
    came_from: Place | None = None
    """Where this robot last stood outside."""

    @property
    def topic(self) -> str:
        """What its requests are about, for the floor."""
        return f"way {self.place.name}"

    def line_ahead_m(self, here: Place, way: Sequence[Place]) -> float | None:
        """How far it is to where a robot waits; None: the way does not lead in."""
        before_m = 0.0
        for goal in way:
            ends = (here.x_m, here.y_m), (goal.x_m, goal.y_m)
            line_m = self.place.way_m(*ends, LINE_M)
            if line_m is not None and self.place.way_m(*ends, BODY_M) is not None:
                return before_m + line_m
            here, before_m = goal, before_m + math.dist(*ends)
        return None

    def next_s(self) -> float:
        """When something is due."""
        asking_s = min(self.ask_s, self.answer_s) if self.wanted_s is not None else math.inf
        return min(asking_s, self.tell_s)

    def keep(self, keeper: str, lease_end_s: float) -> None:
        """Somebody has it from now on; whatever this robot heard before of its being given is over."""
        self.keeper, self.lease_end_s, self.given_s, self.silences = keeper, lease_end_s, -math.inf, 0
