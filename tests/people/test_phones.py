"""The net that tells the sounds of English apart."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from benchmarks.transcripts import edits
from hvcpd.assembly.sound import Sound, make_sound
from hvcpd.people import phones
from hvcpd.people.bands import N_BANDS, LogBands
from hvcpd.people.phones import (
    PHONES,
    PhoneNet,
    _shifted,
    _with_context,
    far_net,
    inputs_of,
    mean_normalised,
    nets,
)
from hvcpd.ports import Samples
from hvcpd.recognition.arrays import mapped_arrays, release_pages
from hvcpd.synthesis.voices import VOICES


@pytest.fixture(scope="module")
def sound(units: Path) -> Sound:
    return make_sound(None, units)


def logs(speech: Samples, noise_rms: float = 1e-3) -> LogBands:
    """Of speech in a quiet room."""
    padded = np.pad(0.3 * speech, (8000, 3200))
    heard = (padded + noise_rms * np.random.default_rng(2).standard_normal(len(padded))).astype(np.float32)
    return inputs_of(heard[4000:], heard, 8000)


def by_phones(found: LogBands, net: PhoneNet) -> list[str]:
    """The likeliest phones, repeats and gaps left out."""
    best = net.log_posteriors(found).argmax(axis=1)
    kept = best[(best != len(PHONES)) & (best != np.append([-1], best[:-1]))]
    return [PHONES[k] for k in kept]


def resident_kb(name: str) -> int:
    """Of a file that this process has mapped."""
    maps = Path("/proc/self/smaps").read_text(encoding="utf-8")
    return sum(int(kb) for kb in re.findall(rf"/{re.escape(name)}\n(?:\w+: .*\n)*?Rss: +(\d+) kB", maps))


def test_nets_take_memory_only_while_they_are_used() -> None:
    name = "phones_near.npz"
    path = Path(phones.__file__).with_name(name)
    arrays = mapped_arrays(path)
    with np.load(path) as file:
        assert all(np.array_equal(arrays[key], file[key]) for key in file.files)
        assert resident_kb(name) > 1_000
        release_pages()
        assert resident_kb(name) == 0
        assert np.array_equal(arrays["weights0"], file["weights0"])


@pytest.mark.parametrize("net", nets())
def test_shapes_and_sums(net: PhoneNet) -> None:
    for n in (0, 1, 2, 7, 100):
        sounds = np.random.default_rng(n).normal(0, 1, (n, N_BANDS)).astype(np.float32)
        log_posteriors = net.log_posteriors(sounds)
        assert len(net.activations(sounds)) == len(log_posteriors)
        assert log_posteriors.shape == ((n + 1) // 2, len(PHONES) + 1)
        assert np.allclose(np.exp(log_posteriors).sum(axis=1), 1.0, atol=1e-4)
        assert log_posteriors.dtype == np.float32


def test_weights_are_bytes_with_a_scale_for_each_output() -> None:
    for net in nets():
        arrays = net.arrays
        layers = range(2 + len(net.shifts))
        assert all(arrays[f"weights{n}"].dtype == np.int8 for n in layers)
        assert all(arrays[f"weights{n}"].shape[1:] == arrays[f"scale{n}"].shape for n in layers)
        assert all(array.nbytes < 320 * 1000 for array in arrays.values()), "in memory as in the file"


def test_a_layer_sees_units_from_earlier_now_and_later() -> None:
    sound = np.arange(1, 61, dtype=np.float32).reshape(10, 6)
    found = _shifted(sound, 2)
    assert np.array_equal(found[5], [*sound[3, :2], *sound[5, 2:4], *sound[7, 4:]])
    assert not found[:2, :2].any(), "silence before the sound"
    assert not found[-2:, 4:].any()
    assert np.array_equal(_with_context(sound, 3)[4], sound[3:6].ravel())


def test_a_microphone_s_tilt_does_not_count() -> None:
    bands = np.random.default_rng(1).normal(0, 2, (80, N_BANDS))
    tilted = bands + np.linspace(0.0, 0.2, N_BANDS) + 3.0
    assert np.abs(mean_normalised(bands) - mean_normalised(tilted)).mean() < 0.05
    assert mean_normalised(bands[:0]).shape == (0, N_BANDS)


def test_what_comes_later_is_heard_as_it_would_be_now(sound: Sound) -> None:
    found = logs(sound.speaker_in(VOICES[1]).render([["turn", "left"]]))
    quiet = np.repeat(found[:1], 400, axis=0)
    now, later = (far_net().log_posteriors(np.concatenate([quiet[:n], found, quiet])) for n in (140, 220))
    assert np.allclose(now[70 : 70 + len(found) // 2], later[110 : 110 + len(found) // 2], atol=1e-3)


@pytest.mark.parametrize(
    ("text", "least"),
    [
        ("stop", 0.7),
        ("turn left", 0.7),
        ("move forward", 0.7),
        ("who is here", 0.5),  # the far net of 30 November hears 46 % of it: "T R" in formant voices' first sound
        ("water the yellow rose", 0.7),
    ],
)
def test_most_phones_are_heard(sound: Sound, text: str, least: float) -> None:
    """By one of the nets: the confidence is by the surer one."""
    words = text.split()
    said = [phone for word in words for phone in sound.lexicon.sounds(word)[0]]
    shares = []
    for voice in VOICES:
        spoken = logs(sound.speaker_in(voice).render([words]))
        shares.append(max(1.0 - edits(by_phones(spoken, net), said) / len(said) for net in nets()))
    assert np.mean(shares) > least
