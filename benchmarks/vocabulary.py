"""Word confusions in noise: what `check-vocabulary` predicts, compared with what is measured.

Words of the phrasebook and near neighbours of them are said with other pitch and rate than the templates', seeded
noise is added, and the templates classify: a word is confused with another that costs less. Prints predicted and
measured rates by distance, the constants for `ConfusionCurve` that fit best, and the worst pairs.

    python -m benchmarks.vocabulary [--voices oak,rose] [--seeds 3]
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from hvcpd.assembly.separation import CONDITIONS, Condition, ConfusionCurve, References, VoiceSounds
from hvcpd.assembly.sound import Sound, make_phrasebook, make_sound, user_cache_folder
from hvcpd.config.settings import DEFAULT_TEAMS
from hvcpd.config.task_file import load_tasks
from hvcpd.config.tasks import default_tasks_path
from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from hvcpd.recognition.frontend import CONTEXT_FRAMES, Features, energies_of, features_of, power_weights
from hvcpd.recognition.templates import trimmed_energies
from hvcpd.synthesis.voices import Voice, voice_named

NEIGHBOURS = (
    "read rod bob rot boat but bed bread blew grin grain ride light rite write lose nose rise house noon moon "
    "fine line pine mine tree free too to do for fore ate late sex sick pen hen eleven heaven lift laughed "
    "hair hear fear fell fail sail"
).split()
"""Words that sound nearly or wholly like some of the phrasebook's: the near end of the curve."""
PITCHES = (0.97, 1.03)
"""As a robot's pitch falls over its sentence (`speaker.PITCH_STEPS`)."""
RATES = (0.95, 1.05)
"""Robots keep their rate; the joints with neighbouring words shorten and lengthen a word by about this."""
BINS = (0.0, 1.0, 3.0, 6.0, 9.0, 12.0, 15.0, 18.0, 22.0, 26.0, 30.0, 40.0, 60.0, 1e9)


def takes(word: str, voice: Voice, units: Sound) -> Iterator[Samples]:
    """The word alone, as it is said in mid-sentence, with each pitch and rate."""
    for rate in RATES:
        for pitch in PITCHES:
            varied = replace(voice, f0_hz=pitch * voice.f0_hz, rate=rate * voice.rate)
            yield units.speaker_in(varied).templates(word)[0]


def coloured(colour: str, count: int, random: np.random.Generator) -> NDArray[np.float64]:
    """Noise whose power falls as 1 over the frequency (pink), or does not (white), from 80 Hz as `band_noise`."""
    spectrum = np.fft.rfft(random.standard_normal(count))
    hz = np.maximum(np.fft.rfftfreq(count, 1.0 / SAMPLE_RATE_HZ), 80.0)
    return np.fft.irfft(spectrum / np.sqrt(hz) if colour == "pink" else spectrum, count)


def heard(
    sound: Samples, sounds: VoiceSounds, scale: float, index: int, condition: Condition, random: np.random.Generator
) -> Features:
    """Features of the take in that noise, at the level of the voice's templates, shape (frames, N_FEATURES). `scale`:
    the factor from a recording's energies to the templates'."""
    pad = 4 * 160
    clean = np.pad(sound, (pad, pad)).astype(np.float64)
    energies = energies_of(clean.astype(np.float32))
    if condition.snr_db is not None:
        noise = coloured(condition.colour, len(clean), random)
        have = float((energies_of(noise.astype(np.float32)) @ power_weights()).mean())
        want = float((sounds.noises[index] - sounds.mask) @ power_weights()) / scale
        energies = energies_of((clean + noise * math.sqrt(want / have)).astype(np.float32))
    frames = len(trimmed_energies(sound))
    first = np.argmax(np.convolve(energies_of(clean.astype(np.float32)).sum(axis=1), np.ones(frames), "valid"))
    block = energies[max(first - CONTEXT_FRAMES, 0) : first + frames + CONTEXT_FRAMES]
    floor = sounds.noises[index] if condition.snr_db is None else np.full_like(sounds.noises[index], sounds.mask)
    return features_of((block * scale + floor).astype(np.float32))


def measure(voice: Voice, words: list[str], seeds: int) -> tuple[NDArray[np.float64], ...]:
    """Distances (conditions, words, words), confusions of the same shape, and trials a pair."""
    units = make_sound(None, user_cache_folder())
    speaker = units.speaker_in(voice)
    templates = {word: speaker.templates(word) for word in words}
    energies = np.concatenate([trimmed_energies(take) for takes in templates.values() for take in takes])
    scale = 1.0 / float(energies.sum(axis=1).mean())  # as `TemplateBank` scales a voice: its mean total becomes 1
    sounds = VoiceSounds(templates)
    phrases = [(word,) for word in words]
    distances = np.stack([sounds.distances(phrase, phrases) for phrase in phrases], axis=1)
    all_words = [References([sounds.takes(p) for p in phrases], condition=i) for i in range(len(CONDITIONS))]
    confused = np.zeros(distances.shape)
    trials = 0
    for w, word in enumerate(words):
        random = np.random.default_rng(w + 1)
        trials = 0
        for take in takes(word, voice, units):
            for _ in range(seeds):
                trials += 1
                for i, condition in enumerate(CONDITIONS):
                    features = heard(take, sounds, scale, i, condition, random)
                    cost = all_words[i].costs(features[None])[0]
                    confused[i, w] += (cost < cost[w]) + 0.5 * (cost == cost[w])
    return distances.astype(float), confused, np.full(distances.shape, float(trials))


def fit(distance: NDArray[np.float64], wrong: NDArray[np.float64], trials: NDArray[np.float64]) -> ConfusionCurve:
    """Most likely scale and power, by trying a grid; binomial likelihood."""
    best, found = -math.inf, ConfusionCurve()
    bins, where = np.unique(np.round(distance * 4.0), return_inverse=True)
    counts, errors = (np.bincount(where, weights=x) for x in (trials, wrong))
    for power in np.arange(0.2, 2.01, 0.05):
        for scale in np.geomspace(0.005, 2.0, 120):
            curve = ConfusionCurve(float(scale), float(power))
            p = np.clip([curve.rate(d / 4.0) for d in bins], 1e-6, 0.5)
            likelihood = float((errors * np.log(p) + (counts - errors) * np.log1p(-p)).sum())
            if likelihood > best:
                best, found = likelihood, curve
    return found


def parser() -> argparse.ArgumentParser:
    """What can be chosen."""
    out = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    out.add_argument("--voices", default="oak,rose")
    out.add_argument("--seeds", type=int, default=3)
    return out


def fitted(options: argparse.Namespace) -> dict[str, object]:
    """Weights for `ConfusionCurve`, and what they were fitted to."""
    book = make_phrasebook(("Rob", "Bot"), DEFAULT_TEAMS, load_tasks(default_tasks_path()))
    words = sorted({*book.graph.words, *NEIGHBOURS})
    apart = ~np.eye(len(words), dtype=bool)
    rows = []
    for name in options.voices.split(","):
        d, wrong, trials = measure(voice_named(name), words, options.seeds)
        rows.append([x[:, apart] for x in (d, wrong, trials)])
    d, wrong, trials = (np.concatenate(x, axis=1) for x in zip(*rows, strict=True))
    for label, part in (("quiet", slice(0, 1)), ("0 dB", slice(1, 3)), ("-5 dB", slice(3, 5))):
        print(f"\n{label}: distance, pairs, trials, predicted, measured")
        _table(d[part].ravel(), wrong[part].ravel(), trials[part].ravel())
    curve = fit(d.ravel(), wrong.ravel(), trials.ravel())
    return {
        "data": f"{len(words)} words of voices {options.voices} at other pitch and rate, in quiet and noise; "
        f"{options.seeds} seeds",
        "score": f"{int(wrong.sum())} confusions in {int(trials.sum())} comparisons",
        "weights": {"scale": round(curve.scale, 3), "power": round(curve.power, 2)},
    }


def _table(d: NDArray[np.float64], wrong: NDArray[np.float64], trials: NDArray[np.float64]) -> None:
    curve = ConfusionCurve()
    for low, high in pairwise(BINS):
        inside = (d >= low) & (d < high)
        if inside.any():
            predicted = np.mean([curve.rate(x) for x in d[inside]])
            measured = wrong[inside].sum() / trials[inside].sum()
            print(
                f"  {low:4.0f} to {min(high, 999):4.0f}  {inside.sum():6d} {trials[inside].sum():8.0f}"
                f"  {predicted:9.4%} {measured:9.4%}"
            )


if __name__ == "__main__":
    print(fitted(parser().parse_args()))
