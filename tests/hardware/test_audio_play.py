"""Playing through a loudspeaker, for the commands."""

from __future__ import annotations

import numpy as np
import pytest

from hvcpd.errors import DeviceError
from hvcpd.hardware.audio_play import Playback, play
from tests.hardware.fake_card import CAMERA, HEADSET, SPEAKER, FakeCard


def test_all_is_played_to_the_end_on_the_wanted_device() -> None:
    card = FakeCard((SPEAKER, HEADSET))
    sound = np.linspace(-1, 1, 1000, dtype=np.float32)
    play(sound, "headset", card)
    assert card.stream.options["device"] == 1
    assert card.stream.options["samplerate"] == 16_000
    np.testing.assert_array_equal(np.concatenate(card.stream.played), sound)
    assert card.stream.stopped
    assert card.stream.closed


def test_without_a_loudspeaker() -> None:
    with pytest.raises(DeviceError, match="no loudspeaker on this machine"):
        play(np.zeros(10, np.float32), None, FakeCard((CAMERA,)))


def test_a_loudspeaker_in_use() -> None:
    card = FakeCard()
    card.busy = True
    with pytest.raises(DeviceError, match="is another program using it"):
        play(np.zeros(10, np.float32), None, card)


def test_a_loudspeaker_that_cannot_do_16_khz() -> None:
    with pytest.raises(DeviceError, match="cannot play 16000 Hz"):
        play(np.zeros(10, np.float32), None, FakeCard(rates_hz=(44_100,)))


def test_a_loudspeaker_that_is_pulled_out_is_let_go() -> None:
    card = FakeCard()
    with Playback(None, card) as player:
        player(0.0, np.zeros(10, np.float32))
        card.stream.gone = True
        with pytest.raises(DeviceError, match="still connected"):
            player(0.0, np.zeros(10, np.float32))
    assert card.stream.closed
