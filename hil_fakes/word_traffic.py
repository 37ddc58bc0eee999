"""Missions at the level of words in which robots get in each other's way: they drive step by step, and may be held.

It keeps the score from outside: which robots truly were in each place together, and how long each waited for one.
"""

from __future__ import annotations

import random
from collections import defaultdict
from dataclasses import dataclass, field, replace
from itertools import takewhile

from hil_fakes.word_body import SPEED_M_S, takes_s
from hil_fakes.word_mission import WordMission
from hil_fakes.word_plans import random_plan
from hil_fakes.word_setup import WordPlan
from hvcpd.config.shared_places import SharedPlace
from hvcpd.config.tasks import Action, Forward, GoTo, Place, TaskDefinition, Tend

STEP_S = 0.25
"""Interval at which a robot's place is computed: it drives 5 cm in it."""
HULL_M = 0.105
"""From the middle of a burger to its outermost part: nearer to the area, it is in it."""
MOUTH_M = 1.5
"""From the corridor to where the straight way through it begins and ends."""
LIMIT_S = 6000.0
"""By then all is done several times over."""


@dataclass
class Route:
    """A robot's present actions and their progress; a halt ends its `job`."""

    task: int
    acts: bool
    actions: tuple[Action, ...]
    job: int
    goal: Place | None = None
    """Where the action under way leads, if it is a way."""
    rest_s: float = 0.0
    """Of the action under way, if it only takes time."""


@dataclass
class Traffic:
    """The results of a mission's ways."""

    passages: int = 0
    collisions: int = 0
    """Robots that came into a place in which another one was, both switched on."""
    wrecks: int = 0
    """Robots that came upon one that was switched off in there."""
    waits_s: list[float] = field(default_factory=list)
    """Of each robot that had to stop before a place: how long it stood there, if nobody stood in it switched off."""
    blocked_s: list[float] = field(default_factory=list)
    """The same of the others."""


class TrafficMission(WordMission):
    """A mission whose robots ask before each step whether they may go on, as whole robots do in each block."""

    def __init__(self, plan: WordPlan, keep: bool = False) -> None:
        self._routes: dict[str, Route] = {}
        super().__init__(plan, keep)
        self.traffic = Traffic()
        self.held: dict[str, float] = {}
        """The robots that wait at a place, and since when."""
        self._blocked: set[str] = set()
        self._inside: dict[str, frozenset[str]] = defaultdict(frozenset)
        self.air.at(STEP_S, self._step)

    def perform(self, name: str, task: int, actions: tuple[Action, ...]) -> None:
        """Have a robot carry out the actions, from the next step on."""
        body = self.bodies[name]
        body.halt(self.air.now)
        ways = tuple(leg for action in actions for leg in self._legs(body.place, action))
        self._routes[name] = Route(task, self.robots[name].at_place, ways, body.job)
        self._begin_next(name)

    def _legs(self, here: Place, action: Action) -> tuple[Action, ...]:
        """A way to the other side of the first place leads straight through it, lengthwise, as between two rooms."""
        if not isinstance(action, GoTo) or not self.plan.places:
            return (action,)
        corridor = self.plan.places[0]
        ends_m = corridor.low_x_m - MOUTH_M, corridor.high_x_m + MOUTH_M
        middle_m, y_m = 0.5 * (ends_m[0] + ends_m[1]), 0.5 * (corridor.low_y_m + corridor.high_y_m)
        west, east = (Place(x_m, y_m) for x_m in ends_m)
        near, far = (west, east) if here.x_m < middle_m else (east, west)
        within = corridor.distance_m(here) < MOUTH_M
        if (here.x_m < middle_m) == (action.place.x_m < middle_m):
            return (GoTo(near), action) if within else (action,)
        return (GoTo(far), action) if within else (GoTo(near), GoTo(far), action)

    def _begin_next(self, name: str) -> None:
        """Prepare the first of the actions that are left."""
        route, here = self._routes[name], self.bodies[name].place
        route.goal, route.rest_s = None, 0.0
        if route.actions:
            route.rest_s = takes_s(route.actions[0], here)
            match route.actions[0]:
                case GoTo(place):
                    route.goal = place
                case Forward(distance_m):
                    route.goal = Place(here.x_m + distance_m, here.y_m)

    def _step(self) -> None:
        for name, robot in tuple(self.robots.items()):
            body, route = self.bodies[name], self._routes.get(name)
            if route is not None and route.job != body.job:
                del self._routes[name]
                route = None
            robot.sensed(here=body.place)
            free = robot.may_drive(_way(route), self.air.now)
            self._note_hold(name, held=route is not None and not free)
            if route is not None and free:
                self._go_on(name, route)
            self.air.refresh((name,))
        for name in self.held.keys() - self.robots.keys():
            del self.held[name]
        self._note_places()
        self.air.at(self.air.now + STEP_S, self._step)

    def _go_on(self, name: str, route: Route) -> None:
        body = self.bodies[name]
        if route.goal is not None:
            left_m = body.place.distance_m(route.goal)
            share = min(SPEED_M_S * STEP_S / left_m, 1.0) if left_m > 0.0 else 1.0
            body.place = body.place.toward(route.goal, share)
            if share < 1.0:
                return
        elif route.rest_s > STEP_S:
            route.rest_s -= STEP_S
            return
        route.actions = route.actions[1:]
        if route.actions:
            self._begin_next(name)
        else:
            del self._routes[name]
            self.carried_out(name, route.task, route.acts)

    def _note_hold(self, name: str, held: bool) -> None:
        if held:
            self.held.setdefault(name, self.air.now)
        elif name in self.held:
            waited_s = self.air.now - self.held.pop(name)
            (self.traffic.blocked_s if name in self._blocked else self.traffic.waits_s).append(waited_s)
            self._blocked.discard(name)

    def _note_places(self) -> None:
        """The robots in each place, and those that have just met another one there."""
        for place in self.plan.places:
            bodies = self.bodies.items()
            inside = frozenset(name for name, b in bodies if place.distance_m(b.place) < HULL_M)
            for name in inside - self._inside[place.name]:
                self.traffic.passages += 1
                others = inside - {name}
                self.traffic.collisions += bool(others & self.robots.keys())
                self.traffic.wrecks += bool(others - self.robots.keys())
            self._inside[place.name] = inside
            if inside - self.robots.keys():
                self._blocked |= self.held.keys()


def _way(route: Route | None) -> tuple[Place, ...]:
    """Where it is about to drive, up to the next thing that is no way."""
    if route is None or route.goal is None:
        return ()
    ways = takewhile(lambda action: isinstance(action, GoTo), route.actions[1:])
    return (route.goal, *(action.place for action in ways if isinstance(action, GoTo)))


CORRIDOR_M = (1.0, 2.0)
"""How long the corridor is, from room to room."""
ROOM_M = 4.0
"""How far the rooms reach to either side."""


def corridor_plan(
    seed: int, *, loss: tuple[float, float] = (0.0, 0.3), outages_max: int = 2, inside: float = 0.0
) -> WordPlan:
    """Two rooms with a corridor between them, two to six robots and six to sixteen tasks in both, up to `outages_max`
    robots switched off. `inside`: the share of the tasks, 0 to 1, that lie in the corridor instead."""
    rng, rng_inside = random.Random(f"corridor {seed}"), random.Random(f"inside {seed}")
    plan = random_plan(seed, loss=loss, robots=(2, 6), tasks=(6, 16), outages_max=outages_max)
    half_m = 0.5 * rng.uniform(*CORRIDOR_M)
    corridor = SharedPlace("corridor", -half_m, -0.5, half_m, 0.5)

    def somewhere(side: int) -> Place:
        return Place(side * (half_m + rng.uniform(1.0, ROOM_M)), rng.uniform(-ROOM_M, ROOM_M))

    def task(number: int) -> TaskDefinition:
        there = somewhere(rng.choice((-1, 1)))
        if rng_inside.random() < inside:
            there = Place(rng_inside.uniform(-half_m, half_m), 0.0)
        return TaskDefinition(number, f"job {number}", there, (GoTo(there), Tend(rng.uniform(2.0, 8.0))))

    tasks = tuple(task(each.number) for each in plan.tasks)
    starts = {name: somewhere(rng.choice((-1, 1))) for name in plan.names}
    conditions = replace(plan.conditions, mishearing=0.0)
    return replace(
        plan,
        tasks=tasks,
        starts=starts,
        places=(corridor,),
        nearest_first=rng.random() < 0.5,
        conditions=conditions,
        limit_s=LIMIT_S,
    )
