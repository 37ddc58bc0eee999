"""A button of one's own stops the robot as any other stop does, and a broken wire, too."""

from __future__ import annotations

import asyncio
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from gpiozero.pins.mock import MockFactory
from structlog.testing import capture_logs

from hvcpd.config.skill_settings import StopButtonSettings
from hvcpd.coordination.states import State
from hvcpd.daemon.main_loop import Daemon
from hvcpd.daemon.wiring import wire_up
from hvcpd.errors import DeviceError
from hvcpd.hardware.stop_button import StopButton, make_stop_button
from hvcpd.ports import Wheels
from tests.daemon.test_main_loop import OverError, settings_of
from tests.daemon.virtual import devices_of, shared_room


@pytest.fixture
def pins() -> Iterator[Any]:
    factory = MockFactory()
    yield factory
    factory.reset()


@pytest.mark.parametrize("normally_closed", [True, False])
def test_it_is_pressed_where_the_contact_is_not_as_usual(pins: Any, normally_closed: bool) -> None:
    button = StopButton(17, normally_closed, pins)
    line = pins.pin(17)
    line.drive_low()  # closed, to ground
    assert button.pressed is not normally_closed
    line.drive_high()
    assert button.pressed is normally_closed
    button.close()


def test_a_pin_that_cannot_be_read_any_more_counts_as_pressed(pins: Any) -> None:
    button = StopButton(17, False, pins)
    pins.pin(17).drive_high()
    assert not button.pressed
    button.close()
    assert button.pressed


def test_without_a_pin_there_is_none_and_one_that_is_taken_is_told(pins: Any) -> None:
    assert make_stop_button(StopButtonSettings()) is None
    first = StopButton(17, True, pins)
    with pytest.raises(DeviceError, match="stop button's pin 17 cannot be used"):
        StopButton(17, True, pins)
    first.close()


class Button:
    """Pressed for a while."""

    pressed = True

    def close(self) -> None:
        pass


@pytest.mark.slow
def test_a_press_while_the_robot_starts_has_it_begin_stopped(tmp_path: Path, units: Path) -> None:
    """The button was not looked at before the robot listened, which takes a minute at its first start."""

    def watch(now: float) -> None:
        if now > 0.5:
            raise OverError("the test has seen enough")

    button = Button()
    wiring = wire_up(settings_of(tmp_path, units, "Rob"))
    with shared_room([wiring.settings], watch) as room, capture_logs() as logs:
        devices = devices_of(room, 0, button)

        def make_wheels(*of: Any) -> Wheels | None:
            button.pressed = False
            return devices.make_wheels(*of)

        daemon = Daemon(wiring, replace(devices, make_wheels=make_wheels))
        room.streams[0].settled = daemon.settled
        with pytest.raises(OverError):
            asyncio.run(daemon.run())
    assert daemon.robot is not None
    assert daemon.robot.coordination.state is State.STOPPED
    assert [line["event"] for line in logs].count("stop button pressed") == 1


@pytest.mark.slow
def test_the_robot_is_stopped_and_so_is_the_next_start(tmp_path: Path, units: Path) -> None:
    button = Button()

    def watch(now: float) -> None:
        if now > 0.5:
            raise OverError("the test has seen enough")

    wiring = wire_up(settings_of(tmp_path, units, "Rob"))
    with shared_room([wiring.settings], watch) as room, capture_logs() as logs:
        for button.pressed in (True, False):
            daemon = Daemon(wiring, devices_of(room, 0, button))
            room.streams[0].settled = daemon.settled
            room.now_s = 0.0
            with pytest.raises(OverError):
                asyncio.run(daemon.run())
            assert daemon.robot is not None
            assert daemon.robot.coordination.state is State.STOPPED
    assert [line["event"] for line in logs].count("stop button pressed") == 1
