"""`hvcpctl drive` and the wheels' part of `hvcpctl doctor`: on paper, and on fake motors in real time."""

import json
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from typing import Any

import pytest

from hil_fakes.dynamixel.bus import FakeBus
from hil_fakes.dynamixel.motor import FakeMotor, turtlebot3_pair
from hil_fakes.dynamixel.opencr import FakeOpenCR
from hil_fakes.dynamixel.paced import PacedPort
from hil_fakes.dynamixel.pump import RealTimePump
from hvcpd.control.cli import main, make_parser
from hvcpd.control.drive.drive import run
from hvcpd.errors import DeviceError
from hvcpd.hardware.wheels_bus import MakePort
from hvcpd.hardware.wheels_port import WaitingPort
from tests.control.conftest import Ran

pytestmark = pytest.mark.slow


class PatientPort(WaitingPort):
    """Waits longer for a reply than any busy machine needs."""

    def __init__(self, path: str, baud_rate: int, timeout_s: float) -> None:
        super().__init__(path, baud_rate, max(timeout_s, 10.0))


@contextmanager
def moving(*devices: FakeMotor | FakeOpenCR) -> Iterator[FakeBus]:
    """Fakes whose time passes by the clock on the wall; all of them answer."""
    with FakeBus(devices or turtlebot3_pair(), seed=1) as bus, RealTimePump(bus.advance):
        yield bus


@contextmanager
def robot(*devices: FakeMotor | FakeOpenCR) -> Iterator[FakeBus]:
    """Fakes whose time stands still."""
    with FakeBus(devices or turtlebot3_pair(), seed=1) as bus:
        yield bus


def drive(bus: FakeBus, *arguments: str, make_port: MakePort | None = None) -> int:
    """`hvcpctl drive` on that bus."""
    options = make_parser().parse_args(["drive", *arguments, "--port", bus.path])
    return run(options, make_port or partial(PacedPort, bus))


def lines(capsys: pytest.CaptureFixture[str]) -> list[dict[str, Any]]:
    return [json.loads(line) for line in capsys.readouterr().out.splitlines()]


@pytest.mark.parametrize(
    ("arguments", "x_m", "y_m", "heading_deg"),
    [
        (["forward", "1.5"], 1.5, 0.0, 0.0),
        (["forward", "-0.5"], -0.5, 0.0, 0.0),
        (["turn", "-90"], 0.0, 0.0, -90.0),
        (["goto", "1", "2", "0.5", "0.5"], 0.5, 0.5, None),
        (["goto", "1", "0", "--back"], 0.0, 0.0, 0.0),
    ],
)
def test_a_rehearsal_ends_where_the_robot_would(
    capsys: pytest.CaptureFixture[str], arguments: list[str], x_m: float, y_m: float, heading_deg: float | None
) -> None:
    assert main(["drive", *arguments, "--dry-run", "--json"]) == 0
    *_, last = lines(capsys)
    assert (last["event"], last["state"], last["dry_run"]) == ("end", "arrived", True)
    assert (last["x_m"], last["y_m"]) == pytest.approx((x_m, y_m), abs=0.03)
    if heading_deg is not None:
        assert last["heading_deg"] == pytest.approx(heading_deg, abs=2.0)


@pytest.mark.parametrize("action", ["status", "stop", "calibrate"])
def test_everything_else_can_be_rehearsed_too(ran: Ran, action: str) -> None:
    assert ran("drive", action, "--dry-run")


@pytest.mark.parametrize(
    ("arguments", "part"),
    [
        (["forward", "11"], "not from -10 to 10 m"),
        (["forward", "nan"], "not from"),
        (["turn", "right"], "'right' is not a number"),
        (["fly"], "there is no action 'fly'"),
    ],
)
def test_no_motion_without_a_bound(capsys: pytest.CaptureFixture[str], arguments: list[str], part: str) -> None:
    with pytest.raises(SystemExit) as end:
        main(["drive", *arguments])
    assert end.value.code == 2
    assert part in capsys.readouterr().err


def test_a_rehearsed_stop_says_what_it_would_do(capsys: pytest.CaptureFixture[str], ran: Ran) -> None:
    assert "would stop the wheels" in ran("drive", "stop", "--dry-run")
    assert main(["drive", "stop", "--dry-run", "--json"]) == 0
    assert lines(capsys) == [{"event": "stopped", "dry_run": True, "confirmed": []}]


def test_nothing_is_minus_zero(ran: Ran) -> None:
    assert "-0.0" not in ran("drive", "goto", "1", "0", "1", "1", "--back", "--dry-run")


def test_half_a_place_is_none(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["drive", "goto", "1", "2", "3", "--dry-run"]) == 2
    assert "give X Y for each" in capsys.readouterr().err


@pytest.mark.parametrize("devices", [(), (FakeOpenCR(),)], ids=["dynamixel", "opencr"])
def test_forward_drives_and_leaves_the_wheels_off(
    capsys: pytest.CaptureFixture[str], devices: tuple[FakeOpenCR, ...]
) -> None:
    with moving(*devices) as bus:
        kind = "opencr" if devices else "dynamixel"
        assert drive(bus, "forward", "0.05", "--json", "--driver", kind, make_port=PatientPort) == 0
        motors = [*bus.motors.values()] or [devices[0].left, devices[0].right]
        assert [motor.true_angle_rad * 0.033 for motor in motors] == pytest.approx([0.05, 0.05], abs=0.01)
        assert [motor.memory.get("torque_enable") for motor in motors] == [0, 0]
    *_, last = lines(capsys)
    assert last["x_m"] == pytest.approx(0.05, abs=0.01)


def test_status_tells_voltage_temperature_and_odometry(capsys: pytest.CaptureFixture[str]) -> None:
    with robot() as bus:
        assert drive(bus, "status", "--json") == 0
        assert drive(bus, "status") == 0
    out = capsys.readouterr().out
    status = json.loads(out.splitlines()[0])
    assert status["voltage_v"] == pytest.approx(12.0)
    assert [motor["temperature_c"] for motor in status["motors"]] == [30, 30]
    assert "battery   12.0 V" in out


def test_a_blocked_wheel_fails_with_status_1_and_the_reason(capsys: pytest.CaptureFixture[str]) -> None:
    with moving() as bus:
        for motor in bus.motors.values():
            motor.blocked = True
        assert drive(bus, "forward", "0.5", "--driver", "dynamixel", make_port=PatientPort) == 1
    assert "failed: a wheel is blocked" in capsys.readouterr().out


def spin(motor: FakeMotor) -> None:
    for name, value in (("operating_mode", 1), ("torque_enable", 1), ("goal_velocity", 200)):
        motor.memory.set(name, value)


def test_stop_stops_whatever_is_wrong(capsys: pytest.CaptureFixture[str]) -> None:
    left = FakeMotor(1, voltage_v=9.5)
    left.memory.set("firmware_version", 30)
    spin(left)
    with robot(left) as bus:  # the right motor is missing
        assert drive(bus, "stop") == 0
        assert (left.memory.get("goal_velocity"), left.memory.get("torque_enable")) == (0, 0)
    assert "motor 1" in capsys.readouterr().out


def test_stop_stops_opencr_in_debug_mode(capsys: pytest.CaptureFixture[str]) -> None:
    controller = FakeOpenCR(debug_mode=True)
    with robot(controller) as bus:
        assert drive(bus, "stop", "--json") == 0
        assert controller.left.memory.get("torque_enable") == 0
    assert lines(capsys)[-1]["confirmed"] == [f"{bus.path}: OpenCR"]


def test_a_stop_that_nobody_confirms_is_an_error() -> None:
    with (
        robot(FakeMotor(9)) as bus,
        pytest.raises(DeviceError, match=r"neither OpenCR \(ID 200\) nor motors 1 and 2 answer, but ID 9"),
    ):
        drive(bus, "stop")


@pytest.mark.parametrize("driver", ["auto", "opencr"])
def test_a_controller_that_waits_for_a_motor_is_told_from_a_silent_one(
    capsys: pytest.CaptureFixture[str], driver: str
) -> None:
    controller = FakeOpenCR()
    controller.right.powered = False  # its cable came off after the controller had started
    with moving(controller) as bus:
        assert main(["doctor", "--only", "wheels", "--driver", driver, "--port", bus.path]) == 1
    assert "answers late, as it does while it waits for a motor" in capsys.readouterr().out
