"""Playing through a loudspeaker, for the commands."""

from __future__ import annotations

import numpy as np
import pytest

from hvcpd.errors import DeviceError
from hvcpd.hardware.audio_play import Playback, play
from hvcpd.ports import SAMPLE_RATE_HZ
from tests.hardware.fake_card import CAMERA, HEADSET, SPEAKER, FakeCard
from tests.hardware.test_audio_resample import inner, level_db, sine


def test_all_is_played_to_the_end_on_the_wanted_device() -> None:
    card = FakeCard((SPEAKER, HEADSET))
    sound = np.linspace(-1, 1, 1000, dtype=np.float32)
    play(sound, "headset", card)
    assert card.stream.options["device"] == 1
    assert card.stream.options["samplerate"] == 16_000
    np.testing.assert_array_equal(np.concatenate(card.played), sound)
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


@pytest.mark.parametrize("rate_hz", [44_100, 48_000])
def test_a_loudspeaker_without_16_khz_is_given_its_own_rate(rate_hz: int) -> None:
    card = FakeCard((SPEAKER,), rates_hz=(rate_hz,))
    card.buffer_frames = 10 * rate_hz
    said = sine(1000.0, SAMPLE_RATE_HZ).astype(np.float32)
    with Playback(None, card) as player:
        for begin in range(0, len(said), 700):
            player(0.0, said[begin : begin + 700])
    assert card.stream.options["samplerate"] == rate_hz
    played = np.concatenate(card.played)
    wanted = sine(1000.0, rate_hz)
    assert abs(len(played) - len(wanted)) <= 2, "to the last sample, though the conversion holds some back"
    n = min(len(played), len(wanted))
    assert level_db(inner(played[:n] - wanted[:n], rate_hz)) < -40.0


def test_a_loudspeaker_of_no_rate_of_ours() -> None:
    with pytest.raises(DeviceError, match=r"can do none of 16000, .* Hz"):
        play(np.zeros(10, np.float32), None, FakeCard(rates_hz=()))


def test_a_card_that_is_stereo_only_is_given_both_channels() -> None:
    card = FakeCard((HEADSET | {"least_outputs": 2},))
    sound = np.linspace(-1, 1, 1000, dtype=np.float32)
    play(sound, None, card)
    np.testing.assert_array_equal(np.concatenate(card.outputs[-1].frames), np.stack([sound, sound], axis=1))


def test_a_loudspeaker_that_is_pulled_out_is_let_go() -> None:
    card = FakeCard()
    with Playback(None, card) as player:
        player(0.0, np.zeros(10, np.float32))
        card.stream.gone = True
        with pytest.raises(DeviceError, match="still connected"):
            player(0.0, np.zeros(10, np.float32))
    assert card.stream.closed
