"""OnsetSchedule of sentences, found in noise."""

from __future__ import annotations

import numpy as np

from hvcpd.ports import Samples
from hvcpd.recognition.matched_filter import PART, REACH, WhiteningFilter
from hvcpd.recognition.onset_search import MOST, SIZE, SOUND_SAMPLES, STEP, OnsetSearch

RANDOM = np.random.default_rng(11)
SOUNDS: list[Samples] = [np.asarray(RANDOM.standard_normal(n) * np.hanning(n), np.float32) for n in (2500, 6000, 3000)]


def _heard(number: int | None, at: int, gain: float) -> tuple[Samples, WhiteningFilter]:
    noise = np.asarray(np.random.default_rng(3).standard_normal(32_000 + SIZE + 2 * REACH), np.float32)
    whitening = WhiteningFilter()
    whitening.push(noise[:32_000])
    heard = noise[32_000:].copy()
    if number is not None:
        sound = SOUNDS[number][: len(heard) - REACH - at]
        heard[REACH + at : REACH + at + len(sound)] += np.float32(gain) * sound
    return whitening.whiten(heard), whitening


def test_each_sound_is_found_where_it_begins() -> None:
    onsets = OnsetSearch(SOUNDS)
    for number, at in ((0, 100), (1, 900), (2, STEP - 10)):
        whitened, whitening = _heard(number, at, 0.7)
        found = onsets.find([(5_000, whitened)], whitening)[0]
        assert (found[0].sound, found[0].at) == (number, 5_000 + at)


def test_noise_alone_has_no_onset() -> None:
    whitened, whitening = _heard(None, 0, 0.0)
    assert OnsetSearch(SOUNDS).find([(0, whitened)], whitening)[0] == []


def test_what_is_sought_has_whole_parts_only() -> None:
    """A rest of a few ms would be judged by what the cut does to it: the sound goes on there."""
    assert SOUND_SAMPLES % PART == 0


def test_what_begins_after_the_step_is_left_to_the_next_one() -> None:
    whitened, whitening = _heard(0, STEP + 600, 0.7)
    assert OnsetSearch(SOUNDS).find([(0, whitened)], whitening)[0] == []


def test_several_places_are_as_one_after_the_other() -> None:
    whitened, whitening = _heard(1, 900, 0.7)
    places = [(2_000, whitened[500 : 500 + SIZE]), (1_500, whitened[:SIZE])]
    onsets = OnsetSearch(SOUNDS)
    assert onsets.find(places, whitening) == [onsets.find([place], whitening)[0] for place in places]


def test_no_sounds_no_onsets() -> None:
    whitened, whitening = _heard(0, 100, 1.0)
    assert OnsetSearch([]).find([(0, whitened)], whitening)[0] == []


def test_onsets_of_one_step_are_bounded() -> None:
    whitened, whitening = _heard(0, 100, 1.0)
    whitened += np.asarray(100.0 * np.sin(np.arange(len(whitened)) ** 2 / 9e4), np.float32)
    assert len(OnsetSearch(SOUNDS * 9).find([(0, whitened)], whitening)[0]) <= MOST


def test_loud_hisses_of_others_hide_no_beginning() -> None:
    """A hiss is a part of many words; here one is heard again and again, louder than the word that begins."""
    whitened, whitening = _heard(0, 2500, 0.7)
    hiss = np.pad(SOUNDS[1][2500:3500], REACH)
    for at in (200, 1300):
        whitened[at : at + 1000] += 4 * whitening.whiten(hiss)
    found = [(onset.sound, onset.at) for onset in OnsetSearch(SOUNDS).find([(0, whitened)], whitening)[0]]
    assert found == [(0, 2500)]
