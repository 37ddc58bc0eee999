"""One robot's view of each place with room for only one robot: the keeper, the waiting robots, and its own request.

Times are seconds of the robot's sample clock; -inf means never, inf means that nothing is due.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

from hvcpd.config.shared_places import BODY_M, LINE_M, SharedPlace
from hvcpd.config.tasks import Place

TELL_S, TELL_MAX_S = 20.0, 300.0
"""Between two statements of a robot that it is inside: at first, and doubled after each up to the longest. A robot that
passes through says it once or twice; one that stays in a dock does not keep people awake."""
LEASE_TELLS = 3.25
"""A keeper that does not mention the place for this many of those pauses has left it: one statement may be lost, and
the pause after that is twice as long."""
ANSWER_S = 1.5
"""From a request until an answer would have been noticed: recognition, the shortest gap, a slot, and a margin."""
WAITS_S = 35.0
"""A robot that has neither asked nor been told to wait for this long no longer waits."""
ASK_NEXT_S = 5.0
"""After another robot was given the place, or said that it is inside: it shall know who waits before it leaves."""
PAUSE_MAX_S = 24.0
"""A robot that waits pauses for as long as the keeper has been inside so far, and at most this long: with what is drawn
and the request less than WAITS_S. At a steady pace three that waited left a robot that worked in there no turn to
announce its task, and the others none to confirm it: 36 of 300 missions with tasks inside, at a loss of 30 %, never
ended."""
PAUSE_SPREAD = 0.25
"""Share of that pause that is drawn: all that wait have heard the same sentence, and asked again at the same moment."""


@dataclass
class PlaceState:
    """One place. `keeper` is the last robot heard to have it; only the keeper may give it to another robot."""

    place: SharedPlace
    since_s: float
    """When this robot began to listen."""
    keeper: str | None = None
    lease_end_s: float = -math.inf
    """Until then the keeper counts as inside if it says nothing more."""
    inside: bool = False
    """This robot is inside."""
    using: bool = False
    """This robot has the place, and is inside or on its way in."""
    wanted_s: float | None = None
    """Since when this robot has wanted it."""
    held: bool = False
    """This robot has reached the line, and stands there."""
    ask_s: float = math.inf
    """When this robot's next request is due."""
    asker: str | None = None
    """The other robot that said the last request; None: this one."""
    began_s: float = -math.inf
    """When that request began: a voice during it hides it from the others."""
    asked_s: float = -math.inf
    """When that request ended."""
    answer_s: float = math.inf
    """Until then an answer to that request may begin."""
    answered_s: float = -math.inf
    """When a voice last followed a request of this robot that it did not understand: perhaps the keeper's."""
    silences: int = 0
    """Number of requests, of any robot, that nobody answered."""
    again_s: float = -math.inf
    """This robot does not ask the keeper before then."""
    given_s: float = -math.inf
    """When the place was last heard to be given to the keeper, or the keeper to wait for it."""
    gave: bool = False
    """It was this robot that gave it: it answers first when the keeper still waits for it."""
    announced: bool = False
    """This robot has said that it has the place, and says so when it leaves."""
    tell_s: float = math.inf
    """When this robot next says that it is inside: a robot that is not heard, and so gets no answer, then stays out."""
    tells: int = 0
    """How often this robot has said so during its present stay."""
    taken_s: float = math.inf
    """When the keeper was first heard to be inside, in its present stay."""
    waiting: dict[str, tuple[float, float]] = field(default_factory=dict)
    """The other robots that want it: when they were first and last heard to ask."""
    out_s: float = -math.inf
    """This robot does not try to make room for others again before then."""
    came_from: Place | None = None
    """Where this robot makes room for others: where it last was beyond the line, or the nearest task there."""

    @property
    def topic(self) -> str:
        """The topic of its requests, for the floor."""
        return f"way {self.place.name}"

    def line_ahead_m(self, here: Place, way: Sequence[Place]) -> float | None:
        """Distance to the line where a robot waits; None if the way does not lead in."""
        before_m = 0.0
        for goal in way:
            line_m = self.place.way_m(here, goal, LINE_M)
            if line_m is not None and self.place.way_m(here, goal, BODY_M) is not None:
                return before_m + line_m
            here, before_m = goal, before_m + here.distance_m(goal)
        return None

    def nearest_outside(self, here: Place, places: Iterable[Place | None]) -> Place | None:
        """The nearest of these places that is beyond the line; None if none is."""
        outside = (each for each in places if each is not None and self.place.distance_m(each) > LINE_M)
        return min(outside, key=here.distance_m, default=None)

    def next_s(self) -> float:
        """When something is next due."""
        return min(self.ask_s, self.answer_s, self.tell_s)

    def was_asked(self, asker: str | None, began_s: float, now: float) -> None:
        """A request has ended: an answer may begin."""
        if now - self.asked_s > WAITS_S:
            self.silences = 0
        self.asker, self.began_s, self.asked_s, self.answer_s = asker, began_s, now, now + ANSWER_S

    def note_waiting(self, name: str, now: float) -> None:
        """Another robot asks for the place."""
        first_s, last_s = self.waiting.get(name, (now, now))
        self.waiting[name] = (first_s if now - last_s < WAITS_S else now, now)

    def hold_off(self, now: float) -> None:
        """Those that wait have been told that a robot is inside: they pause before they ask again."""
        for name in self.queue(now):
            self.note_waiting(name, now)

    def queue(self, now: float) -> tuple[str, ...]:
        """The other robots that wait, the one that has waited longest first."""
        waits = (name for name, (_, last_s) in self.waiting.items() if now - last_s < WAITS_S)
        return tuple(sorted(waits, key=lambda name: self.waiting[name]))

    def comes_first(self, name: str, now: float) -> bool:
        """Whether a robot comes first in the alphabet of all that wait."""
        return all(name.lower() < other.lower() for other in self.queue(now))

    def tell(self, now: float) -> None:
        """This robot says that it is inside."""
        self.tells += 1
        # an integer has no largest value, and a robot may stay in its dock for weeks
        self.tell_s = now + TELL_S * min(1 << (self.tells - 1), TELL_MAX_S / TELL_S)
        self.announced = self.announced or self.tells > 1  # it stays, and the others expect to hear when it leaves

    def is_taken_by(self, keeper: str, now: float) -> None:
        """The keeper was heard to be inside. The longer it stays, the longer the pauses that it makes."""
        stays_on = keeper == self.keeper and now < self.lease_end_s
        taken_s = min(self.taken_s, now) if stays_on else now
        self.keep(keeper, now + LEASE_TELLS * min(TELL_S + now - taken_s, TELL_MAX_S))
        self.taken_s = taken_s
        self.hold_off(now)

    def pause_s(self, drawn: float, now: float) -> float:
        """How long to pause before the next request, once the keeper was heard to be inside; `drawn`: from 0 to 1."""
        return min(max(ASK_NEXT_S, now - self.taken_s), PAUSE_MAX_S) * (1.0 + PAUSE_SPREAD * drawn)

    def keep(self, keeper: str, lease_end_s: float) -> None:
        """This robot is the keeper from now on; forget all that was heard about giving it the place."""
        self.taken_s, self.gave, self.answer_s = math.inf, False, math.inf
        self.keeper, self.lease_end_s, self.given_s, self.silences = keeper, lease_end_s, -math.inf, 0
