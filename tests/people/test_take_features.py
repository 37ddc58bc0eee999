"""Takes by what the net of phones makes of them: near to the same word, though only energies are kept of them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from hvcpd.assembly.sound import Sound, make_sound
from hvcpd.control.enrol.recordings import check_take
from hvcpd.language.graph import Arc, WordGraph
from hvcpd.people.bands import N_BANDS, Bands, heard_alone, levelled, logs_of, noise_of, upper_lost
from hvcpd.people.enrolled_listener import TandemTakes, _features_of
from hvcpd.people.phones import centred, phones_of
from hvcpd.people.template_decoder import Hearing
from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from hvcpd.recognition.frontend import Energies, energies_of, smoothed
from hvcpd.synthesis.speaker import Speaker
from hvcpd.synthesis.voices import VOICES, Voice

CHILD = Voice("child", 240.0, 1.35, 0.92, -32.0, 0.6, 3000.0)
"""Unlike all robots' voices."""
WORDS = ("stop", "left", "right", "report", "water", "rose")
GRAPH = WordGraph(2, tuple(Arc(0, 1, word) for word in WORDS), 0, frozenset((1,)), frozenset())


@pytest.fixture(scope="module")
def sound(units: Path) -> Sound:
    return make_sound(None, units)


def said(sound: Sound, word: str, voice: Voice = CHILD) -> Samples:
    return Speaker(voice, sound.lexicon, sound.cache).render([[word]])


def in_room(speech: Samples, noise_rms: float, seed: int = 1) -> Bands:
    """Logarithms of the net's bands, with 0.5 s of noise around."""
    pad = SAMPLE_RATE_HZ // 2
    heard = np.pad(0.3 * speech, (2 * pad, pad))
    heard = (heard + noise_rms * np.random.default_rng(seed).standard_normal(len(heard))).astype(np.float32)
    whole, part = levelled(heard, heard[pad:])
    return logs_of(part, noise_of(whole, 2 * pad))


def take(sound: Sound, word: str) -> Energies:
    energies = check_take(np.pad(said(sound, word), 4000)).energies
    assert energies is not None
    return energies


@pytest.fixture(scope="module")
def takes(sound: Sound) -> dict[str, dict[str, list[Energies]]]:
    return {"anna": {word: [take(sound, word)] for word in WORDS}}


def heard(takes: dict[str, dict[str, list[Energies]]], logs: Bands) -> Hearing:
    return TandemTakes(GRAPH, takes).hear(logs, phones_of(centred(logs)))


@pytest.mark.parametrize("noise_rms", [1e-4, 0.01])
def test_what_a_voice_says_is_nearest_to_its_own_take(
    sound: Sound, takes: dict[str, dict[str, list[Energies]]], noise_rms: float
) -> None:
    for word in WORDS:
        found = heard(takes, in_room(said(sound, word), noise_rms))
        assert found.best == (word,)


def test_another_voice_with_takes_of_other_words_does_not_take_them_over(
    sound: Sound, takes: dict[str, dict[str, list[Energies]]]
) -> None:
    more = {**takes, "bert": {"stop": [take(sound, "stop")], "left": takes["anna"]["right"]}}
    assert heard(more, in_room(said(sound, "report"), 1e-3)).best == ("report",)


def test_bands_of_a_take_are_nearly_those_of_its_sound(sound: Sound) -> None:
    for voice in VOICES[:3]:
        speech = said(sound, "water", voice)
        energies = smoothed(np.pad(energies_of(speech), ((1, 1), (0, 0)), mode="edge"))
        kept = heard_alone(energies, 10)
        whole = logs_of(levelled(speech, speech)[1], np.zeros(N_BANDS))
        assert kept.shape == (len(energies) + 20, N_BANDS)
        n = min(len(energies), len(whole))
        loud = whole[:n].mean(axis=1) > np.median(whole[:n].mean(axis=1))
        off = (centred(kept)[10 : 10 + n] - centred(whole)[:n])[loud]
        assert np.sqrt(np.mean(off**2)) < 0.8  # 3.5 dB


def test_what_a_telephone_takes_away_is_made_up_in_takes_too(sound: Sound) -> None:
    energies = take(sound, "stop")
    narrow = energies.copy()
    narrow[:, -5:] = 1e-9
    wide, made_up = heard_alone(energies, 5), heard_alone(narrow, 5)
    assert not upper_lost(np.exp(wide))
    loudest = energies.sum(axis=1).argmax() + 5
    assert made_up[loudest, -4:].mean() > wide[:5, -4:].mean() + 1.0


def test_no_take_is_too_short_or_too_quiet() -> None:
    for frames, level in ((1, 1.0), (2, 1e-7), (5, 0.0)):
        energies = np.full((frames, 24), level, np.float32)
        found = heard({"anna": {"stop": [energies]}}, np.zeros((20, N_BANDS)))
        assert found.best in (None, ("stop",))


def test_features_are_computed_once_for_each_take(takes: dict[str, dict[str, list[Energies]]]) -> None:
    _features_of.cache_clear()
    for _ in range(2):  # a word is learned
        TandemTakes(GRAPH, takes)
    assert _features_of.cache_info().misses == len(WORDS)


def test_without_takes_nothing_can_be_known() -> None:
    with pytest.raises(ValueError, match="no templates"):
        TandemTakes(GRAPH, {"anna": {}})
