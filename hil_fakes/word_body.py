"""Where a robot of a mission at the level of words is: it drives in straight lines at a constant speed."""

from __future__ import annotations

import math
from dataclasses import dataclass

from hvcpd.config.tasks import Place

SPEED_M_S = 0.2
"""A burger's, with its turns."""


@dataclass
class Body:
    """A robot's place and activity: it drives in straight lines at a constant speed."""

    place: Place
    job: int = 0
    moving: tuple[float, float, Place] | None = None
    driven_m: float = 0.0
    """The way that it has driven to places, up to its last halt."""

    def at(self, now: float) -> Place:
        if self.moving is None:
            return self.place
        start_s, end_s, goal = self.moving
        share = min(max((now - start_s) / max(end_s - start_s, 1e-9), 0.0), 1.0)
        return Place(
            self.place.x_m + share * (goal.x_m - self.place.x_m), self.place.y_m + share * (goal.y_m - self.place.y_m)
        )

    def halt(self, now: float) -> None:
        here, self.moving = self.at(now), None
        self.driven_m += math.hypot(here.x_m - self.place.x_m, here.y_m - self.place.y_m)
        self.place = here
        self.job += 1
