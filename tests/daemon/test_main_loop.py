"""A whole daemon, from its settings to its wheels, in virtual time."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from contextlib import closing
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from structlog.testing import capture_logs

from hvcpd.config.settings import Settings
from hvcpd.config.settings_file import load_settings, load_with_sources
from hvcpd.daemon.main_loop import Daemon
from hvcpd.daemon.reloading import Rereading
from hvcpd.daemon.wiring import Wiring, wire_up
from hvcpd.errors import DeviceError, HvcpdError
from hvcpd.memory.people import person_path, write_person
from hvcpd.memory.store import Store
from hvcpd.people.enrolled import Person
from tests.daemon.virtual import SharedRoom, devices_of, shared_room

pytestmark = pytest.mark.slow

ONE_TASK = """
tasks:
- {number: 1, name: water the green rose, place: {x_m: -4.6, y_m: -5.0}, actions: [go to place, {water: 1}]}
"""


class OverError(HvcpdError):
    """The test has seen enough."""


def settings_of(directory: Path, units: Path, name: str, **more: object) -> Settings:
    (directory / "state").mkdir()
    (directory / "state" / "units").symlink_to(units)
    (directory / "tasks.yaml").write_text(ONE_TASK)
    given = {"name": name, "tasks": str(directory / "tasks.yaml"), "state_dir": str(directory / "state"), "seed": 3}
    return load_settings(None, given | more, system_path=directory / "none.yaml")


def live(outfits: list[Wiring], room: SharedRoom) -> list[Daemon]:
    """Run a daemon for each wiring until the room ends it."""
    daemons = [Daemon(wiring, devices_of(room, number)) for number, wiring in enumerate(outfits)]
    for stream, daemon in zip(room.streams, daemons, strict=True):
        stream.settled = daemon.settled

    async def run() -> None:
        lives = [asyncio.ensure_future(daemon.run()) for daemon in daemons]
        ends = await asyncio.gather(*lives, return_exceptions=True)
        for end in ends:
            if not isinstance(end, OverError):
                raise end if isinstance(end, BaseException) else AssertionError(end)

    asyncio.run(run())
    return daemons


def until(limit_s: float, done: Callable[[], bool] = lambda: False) -> Callable[[float], None]:
    def watch(now: float) -> None:
        if now >= limit_s or done():
            raise OverError("the test has seen enough")

    return watch


def said(logs: list[Any]) -> list[str]:
    return [line["text"] for line in logs if line["event"] == "said"]


def reported(logs: list[Any]) -> bool:
    """Whether a robot has said that the one task is done; the rest of its time would tell nothing more."""
    return any(text.lower().endswith("task one complete") for text in said(logs))


@pytest.fixture(scope="module")
def lonely(tmp_path_factory: pytest.TempPathFactory, units: Path) -> tuple[list[Any], SharedRoom, Wiring]:
    """A robot alone in the room, from switching on until its task is done."""
    directory = tmp_path_factory.mktemp("lonely")
    settings = settings_of(directory, units, "Rob")
    wiring = wire_up(settings)
    with shared_room([settings], until(90.0, lambda: reported(logs))) as room:
        with capture_logs() as logs:
            live([wiring], room)
        poses = room.bodies[0].pose
    assert poses is not None
    return logs, room, wiring


def test_it_claims_drives_waters_and_reports(lonely: tuple[list[Any], SharedRoom, Wiring]) -> None:
    logs, room, _ = lonely
    sentences = said(logs)
    assert sentences[0] == "Hi team plant, I am Rob, I will complete task one, one metre"
    assert sentences[-1].lower().endswith("task one complete")
    body = room.bodies[0].pose
    assert abs(body.x_m + 4.6) < 0.1
    assert abs(body.y_m + 5.0) < 0.1


def test_every_event_is_one_log_line(lonely: tuple[list[Any], SharedRoom, Wiring]) -> None:
    logs, _, _ = lonely
    states = [(line["number"], line["state"], line["owner"]) for line in logs if line["event"] == "task"]
    assert states == [(1, "claimed", "Rob"), (1, "done", "Rob")]
    assert [line["task"] for line in logs if line["event"] == "performed"] == [1]
    assert {"starting", "listening"} <= {line["event"] for line in logs}


def test_it_remembers_across_a_restart(lonely: tuple[list[Any], SharedRoom, Wiring]) -> None:
    logs, _, wiring = lonely
    with closing(Store(wiring.settings.memory_path)) as store:
        assert [(task.state, task.owner) for task in store.tasks()] == [("done", "Rob")]
        assert [record.text for record in store.transcript()] == said(logs)
    with capture_logs() as later:

        def idle() -> bool:
            return any(line["event"] == "nothing left to do" for line in later)

        with shared_room([wiring.settings], until(30.0, idle)) as room:
            live([wiring], room)
    assert idle()
    assert not any("complete task" in text for text in said(later))


def test_everything_is_taken_down_and_the_wheels_stand(lonely: tuple[list[Any], SharedRoom, Wiring]) -> None:
    _, room, _ = lonely
    assert room.streams[0].log == ["open", "start", "close"]
    for motor in room.bodies[0].motors:
        assert (motor.memory.get("torque_enable"), motor.true_speed_rad_s) == (0, 0.0)


def test_a_card_that_dies_while_driving_stops_the_wheels_and_the_task_is_done_when_it_is_back(
    tmp_path: Path, units: Path
) -> None:
    settings = settings_of(tmp_path, units, "Rob", names=["Rob"])
    way_m: list[float] = []

    def watch(now: float) -> None:
        if not way_m and room.bodies[0].pose.x_m > -4.9:
            way_m.append(room.bodies[0].pose.x_m)
            raise DeviceError("the sound card stopped")
        until(90.0, lambda: reported(logs))(now)

    def time_passes() -> None:
        """While there is no sound nobody else moves the clock of the motors."""
        room.bodies[0].advance(0.3)  # braking
        way_m.append(room.bodies[0].pose.x_m)
        room.bodies[0].advance(5.0)
        way_m.append(room.bodies[0].pose.x_m)

    with shared_room([settings], watch) as room, capture_logs() as logs:
        room.streams[0].on_open_afresh = time_passes
        live([wire_up(settings)], room)
    dying_m, standing_m, later_m = way_m
    assert later_m == pytest.approx(standing_m, abs=1e-3)
    assert standing_m - dying_m < 0.03, "0.2 m/s and the motors' time constant of 0.1 s make 2 cm"
    assert [line["task"] for line in logs if line["event"] == "performed"] == [1]
    assert said(logs)[-1].endswith("ask one complete"), "it speaks again"
    events = [line["event"] for line in logs]
    assert events.index("sound failed") < events.index("sound is back") < events.index("performed")
    assert room.streams[0].log == ["open", "start", "close", "open afresh", "start", "close"]


def test_a_daemon_that_fails_on_the_way_goes_on_from_where_the_robot_stands(tmp_path: Path, units: Path) -> None:
    settings = settings_of(tmp_path, units, "Rob", names=["Rob"])
    failed: list[float] = []

    def watch(now: float) -> None:
        if not failed and room.bodies[0].pose.x_m > -4.8:
            failed.append(now)
            raise OverError("the daemon fails")
        until(failed[0] + 90.0 if failed else 90.0, lambda: reported(logs))(now)

    with shared_room([settings], watch) as room, capture_logs() as logs:
        live([wire_up(settings)], room)
        live([wire_up(settings)], room)
        assert failed
        assert room.bodies[0].pose.x_m == pytest.approx(-4.6, abs=0.06)
    assert [line["task"] for line in logs if line["event"] == "performed"] == [1]
    assert "going on where it was" in {line["event"] for line in logs}


def two_outfits(folder: Path, units: Path, **settings: object) -> list[Wiring]:
    """Of Rob and Bot, each with a folder of its own."""
    outfits = []
    for name, y_m, seed in (("Rob", -5.0, 1), ("Bot", -4.0, 2)):
        (folder / name).mkdir()
        outfits.append(wire_up(settings_of(folder / name, units, name, **{"start.y_m": y_m, "seed": seed, **settings})))
    return outfits


@pytest.mark.slow
def test_two_daemons_greet_each_other_and_share_one_task(tmp_path: Path, units: Path) -> None:
    outfits = two_outfits(tmp_path, units)
    with capture_logs() as logs:
        quiet_since: list[float] = []

        def done() -> bool:
            if [line["state"] for line in logs if line["event"] == "task"].count("done") == 2:
                quiet_since.append(room.now_s)
            return bool(quiet_since) and room.now_s - quiet_since[0] > 1.0

        with shared_room([wiring.settings for wiring in outfits], until(120.0, done)) as room:
            live(outfits, room)
    assert [line["task"] for line in logs if line["event"] == "performed"] == [1]
    heard = {line["speaker"] for line in logs if line["event"] == "heard" and line["confidence"] > 0}
    assert heard == {"Rob", "Bot"}
    assert not any(line["event"] in ("wheels failed", "memory failed") for line in logs)


@pytest.mark.slow
def test_two_daemons_that_know_only_their_own_names_meet_and_remember_each_other(tmp_path: Path, units: Path) -> None:
    outfits = two_outfits(tmp_path, units, names=["Anna"])
    with capture_logs() as logs:

        def done() -> bool:
            return any("confirmed" in text for text in said(logs))

        with shared_room([wiring.settings for wiring in outfits], until(60.0, done)) as room:
            live(outfits, room)
    assert {line["name"] for line in logs if line["event"] == "name learned"} == {"Rob", "Bot"}
    assert any(text.startswith(("Hi Rob, I am Bot, confirmed", "Hi Bot, I am Rob, confirmed")) for text in said(logs))
    for wiring, other in zip(outfits, ("Bot", "Rob"), strict=True):
        with closing(Store(wiring.settings.memory_path)) as store:
            names = tuple(peer.name for peer in store.peers())
        assert names == (other,)
        assert wiring.names_with(names) == (*wiring.names, other)


@pytest.mark.slow
def test_who_is_enrolled_while_it_lives_is_known_after_a_reload(tmp_path: Path, units: Path) -> None:
    settings = settings_of(tmp_path, units, "Rob", names=["Bot"], mode="follow")
    given = {"name": "Rob", "tasks": str(settings.tasks), "state_dir": str(settings.state_dir), "names": ["Bot"]}

    load = partial(load_with_sources, None, given, system_path=tmp_path / "none.yaml", environment={})
    rereading = Rereading(load, load().sources)
    reloads: list[asyncio.Task[None]] = []

    def watch(now_s: float) -> None:
        if now_s > 4.0 and not reloads:
            take = np.random.default_rng(1).gamma(2.0, 1.0, (30, 24)).astype(np.float32)
            write_person(person_path(settings.state_dir, "Clara"), Person("Clara", {"stop": [take]}))
            reloads.append(asyncio.get_running_loop().create_task(daemon.reload()))
        robot = daemon.robot
        known = robot is not None and robot.phrasebook.known_name("Clara") is not None
        if now_s > 25.0 or known:
            raise OverError("the test has seen enough")

    with capture_logs() as logs, shared_room([settings], watch) as room:
        daemon = Daemon(rereading.read(None)[1], devices_of(room, 0), rereading=rereading)
        room.streams[0].settled = daemon.settled
        with pytest.raises(OverError):
            asyncio.run(daemon.run())
    assert [line["name"] for line in logs if line["event"] == "name learned"] == ["Clara"]
    assert daemon.robot is not None
    assert daemon.robot.phrasebook.known_name("Clara") == "Clara"
    assert daemon.wiring.people["clara"].takes.keys() == {"stop"}
