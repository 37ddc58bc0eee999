"""Talk that goes on and on is cut where it pauses."""

from __future__ import annotations

import numpy as np
import pytest

from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from hvcpd.recognition.long_talk import LongTalk, Stretch

LONGEST = 3 * SAMPLE_RATE_HZ


def talk(*parts: tuple[float, float]) -> Samples:
    """Noise: seconds and RMS of each part."""
    rng = np.random.default_rng(2)
    return np.concatenate([rms * rng.standard_normal(round(s * SAMPLE_RATE_HZ)) for s, rms in parts]).astype(np.float32)


LOUD, FAINT = 0.1, 0.003
SOUND = talk((1.0, FAINT), (3.2, LOUD), (0.3, FAINT), (1.0, LOUD), (0.3, FAINT), (0.8, LOUD), (0.4, FAINT))


def heard(sound: Samples, block: int, busy_from_s: float = 1.0) -> list[Stretch]:
    ears, found = LongTalk(LONGEST), []
    for at in range(0, len(sound), block):
        found += ears.push(at, sound[at : at + block], at >= busy_from_s * SAMPLE_RATE_HZ)
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
    ears = LongTalk(LONGEST)
    quiet = talk((1.0, FAINT))
    for at in range(0, len(SOUND), 400):
        ears.push(at, SOUND[at : at + 400], at >= SAMPLE_RATE_HZ)
    n = len(SOUND) // 400 * 400 + 400
    again = np.concatenate([quiet, talk((1.0, LOUD), (0.4, FAINT))])
    assert [s for at in range(0, len(again), 400) for s in ears.push(n + at, again[at : at + 400], at >= 16000)] == []


def test_noise_that_does_not_change_has_no_pauses() -> None:
    assert heard(talk((8.0, LOUD)), 400, 0.0) == []


def test_lost_sound_ends_what_was_followed() -> None:
    ears = LongTalk(LONGEST)
    half = round(4.0 * SAMPLE_RATE_HZ)
    found = ears.push(0, SOUND[:half], True)
    found += ears.push(half + 5000, SOUND[half:], True)
    assert found == []
