"""Which card is taken, and what is said when there is none."""

from __future__ import annotations

import sys
from functools import partial
from pathlib import Path

import pytest

from hvcpd.errors import DeviceError
from hvcpd.hardware.audio import Direction, card_ids, find_device, list_devices, load_backend
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
    assert "arecord -l" in fault(FakeCard(()), "input", None)


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


def test_portaudio_that_does_not_start(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """As sounddevice, whose own error nobody can name before it is imported."""
    (tmp_path / "sounddevice.py").write_text("class PortAudioError(Exception): ...\nraise PortAudioError('host error')")
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.delitem(sys.modules, "sounddevice", raising=False)
    with pytest.raises(DeviceError, match="host error"):
        load_backend()


CARDS = {"Headphones": 0, "Audio": 1, "Camera": 2}


@pytest.mark.parametrize(
    "wanted", ["hw:CARD=Camera", "plughw:CARD=Camera,DEV=0", "hw:Camera,0", "CARD=Camera", "plughw:Camera"]
)
def test_a_card_is_found_by_its_id_whatever_its_number(wanted: str) -> None:
    card = FakeCard((device("one (hw:1,0)", 1, 1), device("two (hw:2,0)", 1, 1), device("twelve (hw:12,0)", 1, 1)))
    for number, index in ((1, 0), (2, 1), (12, 2)):
        assert find_device(card, "input", wanted, partial(dict, CARDS, Camera=number)).index == index


def test_one_of_a_cards_devices() -> None:
    card = FakeCard((device("front (hw:1,0)", 1, 1), device("digital (hw:1,3)", 1, 1)))
    assert find_device(card, "output", "hw:CARD=Audio,DEV=3", lambda: CARDS).index == 1
    assert find_device(card, "output", "hw:CARD=Audio", lambda: CARDS).index == 0


def card_fault(wanted: str, cards: dict[str, int], direction: Direction = "input") -> str:
    with pytest.raises(DeviceError) as error:
        find_device(FakeCard(ALL), direction, wanted, lambda: cards)
    return str(error.value)


def test_a_slip_of_the_pen_in_an_id_is_answered_with_the_nearest() -> None:
    assert "audio.input_device: there is no sound card with the id 'Camra'; did you mean 'Camera'?" in card_fault(
        "hw:CARD=Camra", CARDS
    )
    assert "there is 'Headphones', 'Audio', 'Camera'" in card_fault("hw:CARD=x", CARDS)
    assert "there is no sound card" in card_fault("hw:CARD=x", {})


def test_a_card_without_that_direction() -> None:
    message = card_fault("hw:CARD=Camera", CARDS, "output")
    assert "the sound card 'Camera' has no loudspeaker" in message
    assert HEADSET["name"] in message


@pytest.mark.parametrize("wanted", ["hw:1,0", "plughw:1,0", "hw:1", "plughw:CARD=1,DEV=0"])
def test_a_card_is_found_by_its_number_too(wanted: str) -> None:
    """As `arecord -D plughw:1,0` has it; there was "no microphone" of that name, and hw:1 was hw:12, too."""
    card = FakeCard((device("twelve (hw:12,0)", 1, 1), device("one (hw:1,0)", 1, 1)))
    assert find_device(card, "input", wanted, dict).index == 1
    assert "has no microphone '(hw:3,0)'" in fault(card, "input", "plughw:3,0")


def test_the_kernels_list_of_cards(tmp_path: Path) -> None:
    for number, name in ((0, "Headphones"), (10, "Device")):
        (tmp_path / f"card{number}").mkdir()
        (tmp_path / f"card{number}" / "id").write_text(name + "\n")
    (tmp_path / "card3").mkdir()
    assert card_ids(tmp_path) == {"Headphones": 0, "Device": 10}
    assert card_ids(tmp_path / "nothing") == {}
