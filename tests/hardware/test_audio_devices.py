"""Which card is taken, and what is said when there is none."""

from __future__ import annotations

import pytest

from hvcpd.errors import DeviceError
from hvcpd.hardware.audio import Direction, find_device, list_devices
from tests.hardware.fake_card import CAMERA, HEADSET, SPEAKER, FakeCard, device

ALL = (SPEAKER, HEADSET, CAMERA)


def fault(card: FakeCard, direction: Direction, wanted: str | None) -> str:
    with pytest.raises(DeviceError) as error:
        find_device(card, direction, wanted)
    return str(error.value)


def test_all_devices_are_listed() -> None:
    found = list_devices(FakeCard(ALL))
    assert [(entry.index, entry.inputs, entry.outputs) for entry in found] == [(0, 0, 8), (1, 1, 2), (2, 2, 0)]
    assert [entry.can("input") for entry in found] == [False, True, True]
    assert found[0].rate_hz == 44_100.0


def test_the_default_is_the_systems() -> None:
    card = FakeCard(ALL, defaults=(2, 1))
    assert find_device(card, "input", None).name == CAMERA["name"]
    assert find_device(card, "output", None).name == HEADSET["name"]


def test_a_part_of_the_name_in_any_case() -> None:
    assert find_device(FakeCard(ALL), "input", "camera").index == 2
    assert find_device(FakeCard(ALL), "output", "HEADPHONES").index == 0


def test_the_whole_name_wins_over_parts() -> None:
    card = FakeCard((device("usb", 1, 1), device("usb 2", 1, 1)))
    assert find_device(card, "input", "usb").index == 0
    assert "is part of several names" in fault(card, "input", "us")


def test_only_devices_of_that_direction_count() -> None:
    message = fault(FakeCard(ALL), "output", "camera")
    assert "there is no loudspeaker 'camera'" in message
    assert SPEAKER["name"] in message
    assert CAMERA["name"] not in message


def test_a_slip_of_the_pen_is_answered_with_the_nearest() -> None:
    card = FakeCard((device("pulse", 2, 2), device("default", 2, 2)))
    assert "did you mean 'pulse'?" in fault(card, "input", "plusa")


def test_no_device_at_all() -> None:
    assert "no microphone on this machine" in fault(FakeCard((SPEAKER,)), "input", None)
    assert "no loudspeaker on this machine" in fault(FakeCard((CAMERA,)), "output", "x")
    assert "python3 -m sounddevice" in fault(FakeCard(()), "input", None)


def test_without_a_default_the_only_one_is_taken() -> None:
    assert find_device(FakeCard((SPEAKER, CAMERA), (None, None)), "input", None).index == 1
    message = fault(FakeCard(ALL, (None, None)), "input", None)
    assert "audio.input_device" in message
    assert HEADSET["name"] in message
    assert CAMERA["name"] in message


def test_a_default_without_this_direction_is_none() -> None:
    assert "no default microphone" in fault(FakeCard(ALL, (0, 0)), "input", None)


def test_portaudio_that_cannot_tell() -> None:
    card = FakeCard(ALL)
    card.broken = True
    assert "cannot be listed" in fault(card, "input", None)
