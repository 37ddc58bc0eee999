"""A whole robot stops before a place that only one robot fits in, and drives on when it is given it."""

from __future__ import annotations

from hvcpd.config.shared_places import LINE_M, SharedPlace
from hvcpd.config.tasks import Action, Dock, Forward, GoTo, Place, Turn, Wait
from hvcpd.hardware.navigator import Navigator
from hvcpd.language import messages as m
from hvcpd.ports import STANDSTILL, Pose
from hvcpd.robot.performer import Performer
from hvcpd.robot.records import SaidRecord
from tests.robot.test_hold import Bench

DOOR = SharedPlace("front door", 2.0, -0.5, 2.5, 0.5)


class DoorBench(Bench):
    """A robot in a team of two, with a door on its way."""

    def __init__(self, *actions: Action) -> None:
        super().__init__(*actions, places=(DOOR,), roster=("Bot", "Rob"))

    def hear(self, statement: m.Statement) -> None:
        self.coordination.heard(m.Utterance("Bot", m.ToRobot("Rob"), None, statement), self.robot.now)

    def until_at_the_line(self) -> None:
        self.until_driving()
        self.run(9.0)  # in 12 s it would have asked four times, and take the place of a robot that is not there
        assert self.wheels == STANDSTILL

    @property
    def x_m(self) -> float:
        return self.robot.odometry.pose.x_m


def test_it_asks_stops_at_the_line_and_goes_in_when_it_is_given_the_place() -> None:
    bench = DoorBench(GoTo(Place(4.0, 0.0)))
    bench.until_at_the_line()
    assert 2.0 - LINE_M - 0.1 < bench.x_m < 2.0 - LINE_M + 0.05
    assert any("I will use the front door" in r.text for r in bench.records if isinstance(r, SaidRecord))
    bench.hear(m.PlaceTaken("front door"))
    stood_m = bench.x_m
    bench.run(40.0)
    assert abs(bench.x_m - stood_m) < 0.01
    bench.hear(m.PlaceGiven("front door"))
    bench.run(25.0)
    assert bench.x_m > 3.5


def test_a_way_straight_on_is_a_way_too() -> None:
    bench = DoorBench(Forward(4.0))
    bench.until_at_the_line()
    assert bench.x_m < 2.0 - LINE_M + 0.05


def test_the_way_ahead_is_told_as_far_as_it_is_known() -> None:
    performer = Performer(Navigator(), Pose(1.0, 1.0, 0.5))
    there, then = Place(2.0, 0.0), Place(2.0, 3.0)
    performer.begin((GoTo(there), Turn(90.0), GoTo(then), Dock(), Wait(2.0), GoTo(there)))
    assert performer.way == (there, then, Place(1.0, 1.0))
    performer.begin((Wait(2.0), GoTo(there)))
    assert performer.way == ()
    performer.begin((Forward(-2.0),))
    performer.step(Pose(1.0, 1.0), 0.0, None)
    assert performer.way == (Place(-1.0, 1.0),)
