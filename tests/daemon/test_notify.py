"""What the service manager is told, over a real AF_UNIX datagram socket."""

from __future__ import annotations

import asyncio
import os
import socket
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from structlog.testing import capture_logs

from hil_fakes.shared_room import SimulatedAir, VirtualStream
from hvcpd.daemon.main_loop import DEAF, NO_SOUND, STOPPED, Daemon
from hvcpd.daemon.notify import ServiceManager
from hvcpd.daemon.sound_service import TOO_BUSY
from hvcpd.daemon.wiring import wire_up
from hvcpd.errors import DeviceError
from hvcpd.ports import Samples
from tests.daemon.hand_clock import Clock
from tests.daemon.test_main_loop import settings_of
from tests.daemon.virtual import devices_of, shared_room


class Listener:
    """The manager's end of the socket."""

    def __init__(self, name: str) -> None:
        self.environment = {"NOTIFY_SOCKET": name}
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self._socket.bind("\0" + name[1:] if name.startswith("@") else name)
        self._socket.setblocking(False)

    def told(self) -> list[str]:
        """Every datagram since the last call."""
        datagrams = []
        while True:
            try:
                datagrams.append(self._socket.recv(4096).decode())
            except BlockingIOError:
                return datagrams

    def close(self) -> None:
        self._socket.close()


@pytest.fixture(params=["path", "abstract"])
def listener(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Listener]:
    listener = Listener(str(tmp_path / "notify") if request.param == "path" else f"@hvcpd-test-{os.getpid()}")
    yield listener
    listener.close()


def test_each_message_is_one_datagram(listener: Listener) -> None:
    manager = ServiceManager(listener.environment)
    manager.status("looking for the wheels")
    manager.status("looking for the wheels")
    manager.ready("Rob listens")
    manager.status("Rob listens")
    manager.stopping("saying goodbye")
    manager.close()
    manager.status("nobody is told this")
    assert listener.told() == [
        "STATUS=looking for the wheels",
        "READY=1\nSTATUS=Rob listens",
        "STOPPING=1\nSTATUS=saying goodbye",
    ]


def test_beats_come_four_to_a_period_however_often_they_are_given(listener: Listener) -> None:
    clock = Clock()
    manager = ServiceManager(listener.environment | {"WATCHDOG_USEC": "10000000"}, clock)
    beats = 0
    for _ in range(401):  # blocks of 25 ms: 10 s
        manager.beat()
        beats += len(listener.told())
        clock.now_s += 0.025
    assert beats == 5, "at 0, 2.5, 5, 7.5 and 10 s"


@pytest.mark.parametrize(
    "watchdog", [{}, {"WATCHDOG_USEC": "ten"}, {"WATCHDOG_USEC": "10000000", "WATCHDOG_PID": "1"}], ids=str
)
def test_without_a_watchdog_of_its_own_there_is_no_beat(tmp_path: Path, watchdog: dict[str, str]) -> None:
    listener = Listener(str(tmp_path / "notify"))
    ServiceManager(listener.environment | watchdog).beat()
    assert listener.told() == []
    ServiceManager(listener.environment | {"WATCHDOG_USEC": "1", "WATCHDOG_PID": str(os.getpid())}).beat()
    assert listener.told() == ["WATCHDOG=1"]
    listener.close()


def test_a_manager_that_is_gone_or_deaf_harms_nobody(tmp_path: Path) -> None:
    ServiceManager({}).ready("nobody asked")
    ServiceManager({"NOTIFY_SOCKET": str(tmp_path / "gone")}).ready("nobody is there")
    deaf = Listener(str(tmp_path / "deaf"))
    manager = ServiceManager(deaf.environment)
    for number in range(10_000):  # far more than its queue takes: no call may wait
        manager.status(str(number))
    assert 0 < len(deaf.told()) < 10_000
    deaf.close()


@pytest.mark.slow
def test_a_robot_tells_when_it_is_ready_that_sound_flows_and_that_it_ends(tmp_path: Path, units: Path) -> None:
    listener = Listener(str(tmp_path / "notify"))
    clock = Clock()
    manager = ServiceManager(listener.environment | {"WATCHDOG_USEC": "4000000"}, clock)
    settings = settings_of(tmp_path, units, "Rob")
    beats_by: list[tuple[float, int]] = []
    told: list[str] = []

    def watch(now_s: float) -> None:
        clock.now_s = 100.0 + now_s
        told.extend(listener.told())
        beats_by.append((now_s, told.count("WATCHDOG=1")))
        if 2.0 <= now_s < 2.025:
            raise DeviceError("the sound card stopped")
        if 3.0 <= now_s < 3.025 and daemon.robot is not None:
            daemon.robot.coordination.stop(daemon.robot.now)
        if now_s >= 4.0:
            daemon.leave()

    with shared_room([settings], watch) as room:
        daemon = Daemon(wire_up(settings), devices_of(room), manager)
        room.streams[0].settled = daemon.settled
        asyncio.run(daemon.run())
    told.extend(listener.told())
    listener.close()
    states = [text for text in told if text != "WATCHDOG=1" and ", 0 of " not in text]
    assert states == [
        "STATUS=preparing words; the first time takes longest",
        "STATUS=looking for the wheels",
        "READY=1\nSTATUS=Rob of team plant listens",
        f"STATUS={NO_SOUND}",
        "STATUS=Rob of team plant listens",
        f"STATUS=Rob of team plant listens; {STOPPED}",
        "STOPPING=1\nSTATUS=saying goodbye",
    ]
    assert told.index(states[2]) < told.index("WATCHDOG=1")
    assert next(beats for now_s, beats in beats_by if now_s >= 3.9) == 4, "one a second of sound, at 0, 1, 2 and 3 s"


@pytest.mark.slow
def test_a_robot_on_a_computer_that_is_too_busy_says_so(tmp_path: Path, units: Path) -> None:
    listener = Listener(str(tmp_path / "notify"))
    settings = settings_of(tmp_path, units, "Rob")

    def watch(now_s: float) -> None:
        assert isinstance(room.medium, SimulatedAir)
        before = room.medium.counters
        room.medium.counters = replace(before, card_underflows=before.card_underflows + 1)
        if now_s >= 8.0:
            daemon.leave()

    with shared_room([settings], watch) as room, capture_logs() as logs:
        daemon = Daemon(wire_up(settings), devices_of(room), ServiceManager(listener.environment))
        room.streams[0].settled = daemon.settled
        asyncio.run(daemon.run())
    told = listener.told()
    listener.close()
    assert told.count(f"STATUS={TOO_BUSY}: sound is lost or late") == 1
    assert [line["event"] for line in logs].count(TOO_BUSY) == 1


@pytest.mark.slow
def test_a_robot_whose_microphone_is_switched_off_says_so_and_stands_until_it_hears(
    tmp_path: Path, units: Path
) -> None:
    listener = Listener(str(tmp_path / "notify"))
    settings = settings_of(tmp_path, units, "Rob")

    class Switched(VirtualStream):
        async def read(self) -> Samples:
            return await super().read() * np.float32(self.room.now_s >= 16.0)

    def watch(now_s: float) -> None:
        if now_s >= 17.0:
            daemon.leave()

    with shared_room([settings], watch) as room:
        room.streams[0] = Switched(room)
        daemon = Daemon(wire_up(settings), devices_of(room), ServiceManager(listener.environment))
        room.streams[0].settled = daemon.settled
        asyncio.run(daemon.run())
    states = [text for text in listener.told() if text.startswith("STATUS=") and ", 0 of " not in text]
    listener.close()
    deaf = states.index(f"STATUS={DEAF}")
    assert states[deaf + 1] == "STATUS=Rob of team plant listens"
