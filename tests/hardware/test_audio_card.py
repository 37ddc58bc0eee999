"""Cards of other rates and channels, and two cards whose clocks run apart."""

from __future__ import annotations

import asyncio

import numpy as np
import pytest

from hvcpd.config.settings import AudioSettings
from hvcpd.errors import DeviceError
from hvcpd.hardware.audio_card import FILLED_BLOCKS, PATIENCE_S, Loudspeaker, Microphone
from hvcpd.hardware.audio_exchange import LEAD_BLOCKS
from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from tests.hardware.fake_card import FakeCard, Status, device
from tests.hardware.test_audio_resample import inner, level_db, sine
from tests.hardware.test_audio_stream import opened

SETTINGS = AudioSettings(block_ms=10)
BLOCK = 160
USB = {"rates_hz": (48_000,)}


def two_cards(input_hz: int, output_hz: int, inputs: int = 1, outputs: int = 2) -> FakeCard:
    microphone = device("mic", inputs, 0, float(input_hz)) | {"rates_hz": (input_hz,)}
    loudspeaker = device("box", 0, outputs, float(output_hz)) | {"rates_hz": (output_hz,)}
    return FakeCard((microphone, loudspeaker), defaults=(0, 1))


def live(card: FakeCard, heard: Samples, say: Samples) -> tuple[Samples, Samples]:
    """A robot that hears `heard` (at the card's rate) and says `say` (16 kHz); what it heard and the card played."""

    async def whole() -> Samples:
        got: list[Samples] = []
        said = 0
        async with opened(SETTINGS, card) as (stream, _):
            frames = card.inputs[-1].options["blocksize"]
            for begin in range(0, len(heard), frames):
                card.interrupt(heard[begin : begin + frames])
                while sum(map(len, got)) + BLOCK <= (begin + frames) * SAMPLE_RATE_HZ // rate - BLOCK:
                    got.append(await stream.read())
                    part = say[said : said + len(got[-1])]
                    stream.write(np.pad(part, (0, len(got[-1]) - len(part))))
                    said += len(got[-1])
        return np.concatenate(got)

    rate = int(card.devices[0]["default_samplerate"])
    got = asyncio.run(asyncio.wait_for(whole(), 60.0))
    return got, np.concatenate(card.played)


@pytest.mark.parametrize("rate_hz", [48_000, 44_100, 32_000])
def test_a_card_without_16_khz_is_opened_at_its_own_rate_and_converted(rate_hz: int) -> None:
    card = two_cards(rate_hz, rate_hz)
    heard = sine(440.0, rate_hz).astype(np.float32)
    said = sine(1000.0, SAMPLE_RATE_HZ).astype(np.float32)
    got, played = live(card, heard, said)
    assert card.inputs[-1].options["samplerate"] == rate_hz
    assert level_db(inner(got - sine(440.0, SAMPLE_RATE_HZ)[: len(got)], SAMPLE_RATE_HZ)) < -60.0
    delay = round((LEAD_BLOCKS + FILLED_BLOCKS) * 0.010 * rate_hz)
    spoken = played[delay:]
    wanted = sine(1000.0, rate_hz)
    assert len(spoken) > len(wanted) // 2
    # The filter is given block by block: nothing is said before its window is in, so what is said is not early.
    lag = int(np.argmax([np.dot(spoken[k : k + 4000], wanted[:4000]) for k in range(rate_hz // 100)]))
    assert 0 <= lag <= rate_hz // 100
    error = inner(spoken[lag : lag + 6000] - wanted[:6000], rate_hz)
    assert level_db(error) < -40.0


def test_input_and_output_may_be_different_cards_of_different_rates() -> None:
    card = two_cards(44_100, 48_000)
    heard = sine(440.0, 44_100).astype(np.float32)
    got, played = live(card, heard, np.zeros(0, np.float32))
    assert card.inputs[-1].options["device"] == 0
    assert card.outputs[-1].options["device"] == 1
    assert level_db(inner(got - sine(440.0, SAMPLE_RATE_HZ)[: len(got)], SAMPLE_RATE_HZ)) < -60.0
    assert abs(len(played) / 48_000 - len(heard) / 44_100) < 0.025, "as much is played as was heard"


@pytest.mark.parametrize("channel", [1, 2])
def test_one_channel_is_listened_to(channel: int) -> None:
    card = FakeCard((device("stereo", 2, 1),))
    microphone = Microphone(card, AudioSettings(block_ms=10, input_channel=channel))
    microphone.stream.start()
    frames = np.stack([np.full(BLOCK, 0.25, np.float32), np.full(BLOCK, 0.5, np.float32)], axis=1)
    microphone.stream.coming.append((frames[:, :channel], Status()))
    heard, _ = microphone.read()
    np.testing.assert_array_equal(heard, np.full(BLOCK, 0.25 * channel, np.float32))


@pytest.mark.parametrize("rate_hz", [16_000, 48_000])
def test_what_is_no_number_is_silence(rate_hz: int) -> None:
    """A sound server's filter that has once computed NaN gives nothing else: for the daemon the microphone was not
    mute, and the robot drove on, deaf."""
    card = two_cards(rate_hz, rate_hz)
    microphone = Microphone(card, SETTINGS)
    microphone.stream.start()
    size = rate_hz // 100
    wrong = np.resize(np.array([np.nan, np.inf, -np.inf], np.float32), (size, 1))
    for frames in (wrong, wrong, np.full((size, 1), 0.25, np.float32), np.full((size, 1), 0.25, np.float32)):
        microphone.stream.coming.append((frames, Status()))
    assert not np.concatenate([microphone.read()[0] for _ in range(2)]).any()
    assert np.concatenate([microphone.read()[0] for _ in range(2)])[-1] == pytest.approx(0.25, abs=1e-3)


def test_a_channel_that_is_not_there() -> None:
    with pytest.raises(DeviceError, match=r"audio\.input_channel: 'mono' has 1 channel, not 2"):
        Microphone(FakeCard((device("mono", 1, 1),)), AudioSettings(input_channel=2))


@pytest.mark.parametrize(("outputs", "opened"), [(1, 1), (2, 2), (8, 2)])
def test_the_voice_is_on_both_loudspeakers(outputs: int, opened: int) -> None:
    card = FakeCard((device("box", 1, outputs),))
    loudspeaker = Loudspeaker(card, SETTINGS, lambda *_: None)
    loudspeaker.start()
    loudspeaker.write(np.full(BLOCK, 0.5, np.float32))
    assert card.outputs[-1].options["channels"] == opened
    np.testing.assert_array_equal(card.outputs[-1].frames[-1], np.full((BLOCK, opened), 0.5, np.float32))


def test_a_card_of_no_rate_of_ours() -> None:
    with pytest.raises(DeviceError, match=r"'mic' can do none of 16000, 8000, 48000, 44100, 32000, 96000 Hz"):
        Microphone(FakeCard((device("mic", 1, 1, 8_000.0) | {"rates_hz": ()},)), SETTINGS)


@pytest.mark.parametrize("skew", [-1, 1])
async def test_clocks_that_drift_apart_are_kept_together_by_silence_while_nobody_speaks(skew: int) -> None:
    """A sample in 800, ten times worse than the worst of real quartzes."""
    async with opened(SETTINGS, FakeCard((device("both", 1, 1),))) as (stream, card):
        for block in range(8000):
            card.interrupt(np.zeros(BLOCK, np.float32), skew=skew if block % 5 == 0 else 0)
            stream.write(await stream.read())
            if block % 100 == 0:
                assert 0 < card.outputs[-1].level < card.outputs[-1].buffer
    name = "clock_inserted" if skew > 0 else "clock_dropped"
    assert 1600 - BLOCK < getattr(stream.counters, name) < 1600 + BLOCK
    assert card.outputs[-1].ran_dry == 0


def test_speech_is_not_cut_for_the_clocks() -> None:
    card = FakeCard((device("both", 1, 1),))
    counted: list[tuple[str, int]] = []
    loudspeaker = Loudspeaker(card, SETTINGS, lambda name, by: counted.append((name, by)))
    loudspeaker.start()
    speech = np.full(BLOCK, 0.5, np.float32)
    for _ in range(160):
        card.outputs[-1].play(BLOCK + 1)
        loudspeaker.write(speech)
    assert counted == []
    for _ in range(2):
        card.outputs[-1].play(BLOCK + 1)
        loudspeaker.write(np.zeros(BLOCK, np.float32))
    assert [name for name, _ in counted] == ["clock_inserted"]


def test_a_buffer_that_ran_dry_is_filled_again() -> None:
    """The thread slept longer than the buffer lasts: afterwards the latency is what it was."""
    card = FakeCard((device("both", 1, 1),))
    loudspeaker = Loudspeaker(card, SETTINGS, lambda *_: None)
    loudspeaker.start()
    card.outputs[-1].play(10 * BLOCK)
    for _ in range(50):
        loudspeaker.write(np.zeros(BLOCK, np.float32))
        card.outputs[-1].play(BLOCK)
    assert abs(card.outputs[-1].level - (FILLED_BLOCKS - 1) * BLOCK) <= BLOCK // 2


def test_what_answers_to_old_sound_is_left_out_and_not_waited_for() -> None:
    counted: list[tuple[str, int]] = []
    card = FakeCard()
    loudspeaker = Loudspeaker(card, SETTINGS, lambda name, by: counted.append((name, by)))
    loudspeaker.start()
    room = card.outputs[-1].write_available // BLOCK
    for _ in range(room + 3):
        loudspeaker.write(np.full(BLOCK, 0.5, np.float32), behind=True)
    assert counted == [("output_late", BLOCK)] * 3


def test_sound_that_waits_in_the_card_is_behind() -> None:
    card = FakeCard()
    microphone = Microphone(card, SETTINGS)
    microphone.stream.start()
    microphone.stream.coming.append((np.zeros((4 * BLOCK, 1), np.float32), Status()))
    seen = []
    for _ in range(4):
        microphone.read()
        seen.append(microphone.behind)
    assert seen == [True, True, False, False]


@pytest.mark.parametrize(("skew", "name"), [(1, "clock_inserted"), (-1, "clock_dropped")])
def test_words_without_end_are_cut_for_the_clocks_at_last(skew: int, name: str) -> None:
    card = FakeCard((device("both", 1, 1),))
    counted: list[tuple[str, int, int]] = []
    blocks = [0]
    loudspeaker = Loudspeaker(card, SETTINGS, lambda name, by: counted.append((name, by, blocks[0])))
    loudspeaker.start()
    told_s = []
    while not counted:
        blocks[0] += 1
        assert blocks[0] < 100 * 60
        drifts = abs(card.outputs[-1].level - FILLED_BLOCKS * BLOCK) < 1.5 * BLOCK
        card.outputs[-1].play(BLOCK + skew if drifts else BLOCK)
        loudspeaker.write(np.full(BLOCK, 0.5, np.float32))
        told_s.append(loudspeaker.latency_s)
    assert counted[0][0] == name
    assert counted[0][2] * 0.010 > PATIENCE_S
    filled_s = FILLED_BLOCKS * 0.010
    assert told_s[0] == filled_s
    assert (told_s[-2] - filled_s) * -skew > 0.007, "meanwhile the latency is told as it is"


def test_the_samples_that_an_overflow_took_are_estimated() -> None:
    now = [0.0]
    card = FakeCard((device("usb", 1, 1) | USB,))
    microphone = Microphone(card, SETTINGS, lambda: now[0])
    microphone.stream.start()
    for _ in range(50):
        now[0] += 0.010
        microphone.stream.coming.append((np.zeros((480, 1), np.float32), Status()))
        assert microphone.read()[1] is None
    now[0] += 0.210
    microphone.stream.coming.append((np.zeros((480, 1), np.float32), Status(input_overflow=True)))
    assert microphone.read()[1] == 3200, "of 16 kHz"
