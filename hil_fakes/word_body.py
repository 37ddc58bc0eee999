"""Where a robot of a mission at the level of words is: it drives in straight lines at a constant speed."""

from __future__ import annotations

from dataclasses import dataclass

from hvcpd.config.tasks import Action, Forward, GoTo, Place, Use, Wait

SPEED_M_S = 0.2
"""A burger's, with its turns."""
USE_S = 5.0
"""Duration of every skill, as on the bench with sound."""


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
        return self.place.toward(goal, share)

    def halt(self, now: float) -> None:
        here, self.moving = self.at(now), None
        self.driven_m += self.place.distance_m(here)
        self.place = here
        self.job += 1


def takes_s(action: Action, here: Place) -> float:
    """How long an action takes that begins `here`, s."""
    match action:
        case GoTo(place):
            return here.distance_m(place) / SPEED_M_S
        case Forward(distance_m):
            return abs(distance_m) / SPEED_M_S
        case Wait(duration_s):
            return duration_s
        case Use():
            return USE_S
        case _:
            return 0.0
