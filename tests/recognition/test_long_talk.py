"""Talk that goes on and on is cut where it pauses."""

from __future__ import annotations

import numpy as np
import pytest

from hvcpd.people.stage import LongTalk, Stretch
from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from hvcpd.recognition.stream import FrameStream

LONGEST = 3 * SAMPLE_RATE_HZ


def talk(*parts: tuple[float, float]) -> Samples:
    """Noise: seconds and RMS of each part."""
    rng = np.random.default_rng(2)
    return np.concatenate([rms * rng.standard_normal(round(s * SAMPLE_RATE_HZ)) for s, rms in parts]).astype(np.float32)


LOUD, FAINT = 0.1, 0.003
SOUND = talk((1.0, FAINT), (3.2, LOUD), (0.3, FAINT), (1.0, LOUD), (0.3, FAINT), (0.8, LOUD), (0.4, FAINT))


def heard(sound: Samples, block: int, busy_from_s: float = 1.0) -> list[Stretch]:
    return fed(LongTalk(LONGEST), FrameStream(), sound, block, busy_from_s)


def fed(
    recogniser: LongTalk, frames: FrameStream, sound: Samples, block: int = 400, busy_from_s: float = 1.0
) -> list[Stretch]:
    found = []
    for at in range(0, len(sound), block):
        chunks = list(frames.push(sound[at : at + block], False))
        found += recogniser.push(chunks, at >= busy_from_s * SAMPLE_RATE_HZ)
    return found


@pytest.mark.parametrize("block", [160, 400, 1600])
def test_each_pause_ends_what_may_have_begun_after_one_before(block: int) -> None:
    found = heard(SOUND, block)
    places_s = [([start / SAMPLE_RATE_HZ for start in each.starts], each.end / SAMPLE_RATE_HZ) for each in found]
    # The first 3.2 s began the talk; they are long enough, and a sentence may begin with them, or later.
    expected = [([1.0], 4.2), ([1.0, 4.5], 5.5), ([1.0, 4.5, 5.8], 6.6)]
    assert len(places_s) == len(expected)
    for (starts, end), (wanted, until) in zip(places_s, expected, strict=True):
        assert starts == pytest.approx(wanted, abs=0.05)
        assert end == pytest.approx(until, abs=0.05)


def test_what_is_short_is_left_to_those_who_look_at_all_of_it() -> None:
    assert heard(talk((1.0, FAINT), (1.0, LOUD), (0.3, FAINT), (1.0, LOUD), (0.3, FAINT)), 400) == []


def test_talk_that_has_ended_begins_anew() -> None:
    recogniser, frames = LongTalk(LONGEST), FrameStream()
    assert fed(recogniser, frames, SOUND)
    assert fed(recogniser, frames, talk((1.0, FAINT), (1.0, LOUD), (0.4, FAINT))) == []


def test_noise_that_does_not_change_has_no_pauses() -> None:
    assert heard(talk((8.0, LOUD)), 400, 0.0) == []


def test_lost_sound_ends_what_was_followed() -> None:
    recogniser, frames, half = LongTalk(LONGEST), FrameStream(), round(4.0 * SAMPLE_RATE_HZ)
    assert fed(recogniser, frames, SOUND[:half], busy_from_s=0.0) == []
    list(frames.lose(5000))
    assert fed(recogniser, frames, SOUND[half:], busy_from_s=0.0) == []
