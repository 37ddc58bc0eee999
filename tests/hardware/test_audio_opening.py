"""The stream is opened: which cards it takes, and what it lets go of where one is missing, in use, or hangs."""

from __future__ import annotations

import asyncio
import threading

import pytest

from hvcpd.config.settings import AudioSettings
from hvcpd.errors import DeviceError
from hvcpd.hardware.audio_stream import AudioStream
from tests.hardware.fake_card import CAMERA, HEADSET, SPEAKER, FakeCard

SETTINGS = AudioSettings(block_ms=10, queue_s=0.1, watchdog_s=5.0)


def opening_fault(card: FakeCard, settings: AudioSettings = SETTINGS) -> str:
    async def scene() -> None:
        stream = AudioStream(settings, card)
        try:
            await stream.open()
            await stream.start()
        finally:
            await stream.close()

    with pytest.raises(DeviceError) as error:
        asyncio.run(scene())
    return str(error.value)


def test_a_card_in_use() -> None:
    card = FakeCard()
    card.busy = True
    assert "is another program using it?" in opening_fault(card)


def test_a_card_that_does_not_start_is_let_go() -> None:
    card = FakeCard()
    card.refuses_to_start = True
    assert "does not start" in opening_fault(card)
    assert card.inputs[-1].closed
    assert card.outputs[-1].closed


def test_a_loudspeaker_that_cannot_be_opened_leaves_no_microphone_open() -> None:
    card = FakeCard((CAMERA, SPEAKER | {"rates_hz": ()}), defaults=(0, 1))
    assert SPEAKER["name"] in opening_fault(card)
    assert card.inputs[-1].closed


def test_no_such_device() -> None:
    assert "there is no microphone 'x'" in opening_fault(FakeCard(), AudioSettings(input_device="x"))


async def test_opened_afresh_the_cards_are_listed_anew() -> None:
    card = FakeCard((HEADSET,))
    first = AudioStream(SETTINGS, card)
    await first.open()
    await first.close()
    card.devices.insert(0, CAMERA | {"index": 0})
    card.devices[1]["index"] = 1
    second = AudioStream(AudioSettings(input_device="headset", output_device="headset"), card)
    await second.open(afresh=True)
    assert card.listed_afresh == 1
    assert card.inputs[-1].options["device"] == 1
    await second.close()


async def test_a_sound_system_that_did_not_start_again_is_started_at_the_next_try() -> None:
    card = FakeCard()
    card.broken = True
    for _ in range(2):
        with pytest.raises(DeviceError, match="host error"):
            await AudioStream(SETTINGS, card).open(afresh=True)
    card.broken = False
    stream = AudioStream(SETTINGS, card)
    await stream.open(afresh=True)
    await stream.close()


async def test_a_sound_system_that_hangs_while_it_is_opened_is_told_in_time() -> None:
    card = FakeCard()
    card.hangs = threading.Event()
    stream = AudioStream(SETTINGS, card, open_s=0.02)
    with pytest.raises(DeviceError, match=r"did not answer for 0\.02 s"):
        await stream.open()
    card.hangs.set()
    await stream.close()
    assert all(opened.closed for opened in (*card.inputs, *card.outputs)), "what it opened too late is let go of"
