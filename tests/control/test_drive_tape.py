"""The questions of `hvcpctl drive calibrate`: a slip is asked again, an end of input says what is needed."""

import io

import pytest

from hvcpd.control.drive.drive import TapeMeasure
from hvcpd.errors import ConfigError
from hvcpd.hardware.calibration import Measured, calibrate
from hvcpd.hardware.kinematics import BURGER
from hvcpd.hardware.navigator import Journey
from hvcpd.ports import Pose


@pytest.mark.parametrize(
    ("typed", "complaint"),
    [
        ("one metre\n", "'one metre' is not two numbers"),
        ("1.0\n", "'1.0' is not two numbers"),
        ("nan 0\n", "further than 3 m"),
        ("101 2\n", "give metres"),
    ],
)
def test_a_slip_is_asked_again(typed: str, complaint: str) -> None:
    out = io.StringIO()
    assert TapeMeasure(io.StringIO(typed + "1.01, -0.02\n"), out).ask("straight on") == Measured(1.01, -0.02)
    assert complaint in out.getvalue()
    assert out.getvalue().count("metres ahead, metres to the left") == 2


def test_without_a_person_it_says_that_one_is_needed() -> None:
    for question in (TapeMeasure(io.StringIO(), io.StringIO()).ready, TapeMeasure(io.StringIO(), io.StringIO()).ask):
        with pytest.raises(ConfigError, match="run it on a terminal"):
            question("straight on")


def test_the_start_of_every_run_is_marked_before_it_is_driven() -> None:
    order: list[str] = []

    def perform(_journey: Journey) -> None:
        order.append("drive")

    def ask(name: str) -> Measured:
        order.append("measure")
        return Measured(1.0, 0.0) if name == "straight on" else Measured(0.0, 0.0)

    poses = iter([Pose(0.0, 0.0), Pose(1.0, 0.0)] + [Pose(1.0, 0.0)] * 4)
    calibrate(BURGER, lambda: next(poses), perform, ask, lambda _name: order.append("mark"))
    assert order == [
        "mark",
        "drive",
        "measure",
        "mark",
        "drive",
        "drive",
        "measure",
        "mark",
        "drive",
        "drive",
        "measure",
    ]
