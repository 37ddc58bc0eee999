"""The pose of a robot whose daemon comes back in mid-mission."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from structlog.testing import capture_logs

from hvcpd.daemon.pose_keeper import EVERY_S, KeptPose, PoseKeeper
from hvcpd.errors import DeviceError
from hvcpd.ports import Pose, WheelReading

THERE = Pose(1.25, -0.5, 0.75)
ANGLES = WheelReading(31.5, -7.25)
KEPT = KeptPose(THERE, ANGLES)


@pytest.fixture
def boot(tmp_path: Path) -> Path:
    path = tmp_path / "boot_id"
    path.write_text("first\n")
    return path


def live(keeper: PoseKeeper, *poses: Pose, end: Callable[[], None] = lambda: None) -> None:
    """Note the poses, then end by what `end` raises."""

    async def run() -> None:
        try:
            with keeper.forgotten_at_the_end():
                for number, pose in enumerate(poses):
                    keeper.note(pose, ANGLES, number * EVERY_S)
                    await keeper.settled()
                end()
        finally:
            await keeper.close()

    asyncio.run(run())


def fail() -> None:
    raise DeviceError("the wheels have gone")


def be_cancelled() -> None:
    raise asyncio.CancelledError


def test_after_a_failure_it_is_where_it_was(tmp_path: Path, boot: Path) -> None:
    with pytest.raises(DeviceError):
        live(PoseKeeper(tmp_path / "rob.pose", boot), Pose(0.0, 0.0), THERE, end=fail)
    assert PoseKeeper(tmp_path / "rob.pose", boot).recall() == KEPT


def test_while_it_lives_the_file_is_there_for_whoever_comes_after_a_kill(tmp_path: Path, boot: Path) -> None:
    seen: list[KeptPose | None] = []
    keeper = PoseKeeper(tmp_path / "rob.pose", boot)
    live(keeper, THERE, end=lambda: seen.append(PoseKeeper(tmp_path / "rob.pose", boot).recall()))
    assert seen == [KEPT]


@pytest.mark.parametrize("end", [lambda: None, be_cancelled])
def test_an_orderly_end_forgets_it(end: Callable[[], None], tmp_path: Path, boot: Path) -> None:
    try:
        live(PoseKeeper(tmp_path / "rob.pose", boot), THERE, end=end)
    except asyncio.CancelledError:
        assert end is be_cancelled
    assert PoseKeeper(tmp_path / "rob.pose", boot).recall() is None
    assert sorted(path.name for path in tmp_path.iterdir()) == ["boot_id"]


def test_another_boot_forgets_it(tmp_path: Path, boot: Path) -> None:
    with pytest.raises(DeviceError):
        live(PoseKeeper(tmp_path / "rob.pose", boot), THERE, end=fail)
    boot.write_text("second\n")
    assert PoseKeeper(tmp_path / "rob.pose", boot).recall() is None


def test_a_computer_that_does_not_tell_its_boots_begins_at_the_start(tmp_path: Path) -> None:
    with pytest.raises(DeviceError):
        live(PoseKeeper(tmp_path / "rob.pose", tmp_path / "none"), THERE, end=fail)
    assert PoseKeeper(tmp_path / "rob.pose", tmp_path / "none").recall() is None


@settings(deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    content=st.one_of(
        st.binary(max_size=300),
        st.sampled_from(
            [
                b'{"boot": "first", "x_m": NaN, "y_m": 0, "heading_rad": 0, "left_rad": 0, "right_rad": 0}',
                b'{"boot": "first", "x_m": 1e999, "y_m": 0, "heading_rad": 0, "left_rad": 0, "right_rad": 0}',
                b'{"boot": "first", "x_m": [], "y_m": 0, "heading_rad": 0, "left_rad": 0, "right_rad": 0}',
                b'{"boot": "first"}',
                b"[" * 900,
                b"7",
            ]
        ),
    )
)
def test_whatever_the_file_holds_the_robot_begins(content: bytes, tmp_path: Path, boot: Path) -> None:
    (tmp_path / "rob.pose").write_bytes(content)
    assert PoseKeeper(tmp_path / "rob.pose", boot).recall() is None


def test_a_folder_that_cannot_be_written_is_told_once(tmp_path: Path, boot: Path) -> None:
    with capture_logs() as logs:
        live(PoseKeeper(tmp_path / "gone" / "rob.pose", boot), Pose(0.0, 0.0), THERE, Pose(2.0, 0.0))
    assert [line["event"] for line in logs] == ["pose not kept"]


def test_a_standing_robot_writes_nothing(tmp_path: Path, boot: Path) -> None:
    keeper = PoseKeeper(tmp_path / "rob.pose", boot)

    def remove_it() -> None:
        (tmp_path / "rob.pose").unlink()
        keeper.note(THERE, ANGLES, 100.0)
        assert not (tmp_path / "rob.pose").exists()

    live(keeper, THERE, end=remove_it)


def test_a_flicker_of_the_encoders_is_no_motion(tmp_path: Path, boot: Path) -> None:
    keeper = PoseKeeper(tmp_path / "rob.pose", boot)
    flicker = (Pose(THERE.x_m + 5e-5 * step, THERE.y_m, THERE.heading_rad - 1e-4 * step) for step in (1, -1, 1, 2))
    seen: list[KeptPose | None] = []
    live(keeper, THERE, *flicker, end=lambda: seen.append(keeper.recall()))
    creeping = [Pose(THERE.x_m + 0.0004 * step, THERE.y_m, THERE.heading_rad) for step in range(8)]
    live(keeper, *creeping, end=lambda: seen.append(keeper.recall()))
    assert seen[0] == KEPT
    assert seen[1] is not None
    assert creeping[-1].near(seen[1].pose)
