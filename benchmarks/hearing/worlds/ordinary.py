"""Everyday sounds without speech, generated from a seed: animals, bells, knocks, music, engines, weather, alarms.

All are events of one kind: something excites (pulses of a pitch that glides, noise, or a few partials), resonances
colour it, an envelope gives it its time, and it is repeated, more or less regularly. A recipe says from what span each
of these is drawn, so that no two clips are alike.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import butter, lfilter, sosfilt

from hil_fakes.loudspeakers import Peak, peaking
from hil_fakes.robot_noise import unit
from hvcpd.ports import SAMPLE_RATE_HZ

Sound = NDArray[np.float64]
Span = tuple[float, float]
CLIP_S = 5.0
"""As those of ESC-50."""


@dataclass(frozen=True)
class Recipe:
    """Spans to draw from: pitch (Hz; 0: noise alone) and what it is at the end of an event; resonances, Hz; length of
    an event, s; how many there are a second (0: one); how regular their times are, 1 as a clock; `attack_s`; `decay`,
    in time constants by the event's end; the share of noise; `partials` where they are no harmonics."""

    name: str
    pitch_hz: Span
    glide: Span = (1.0, 1.0)
    resonances_hz: tuple[Span, ...] = ()
    length_s: Span = (0.1, 0.5)
    rate_hz: Span = (1.0, 3.0)
    regular: float = 0.5
    attack_s: Span = (0.005, 0.02)
    decay: Span = (1.0, 4.0)
    noise: Span = (0.0, 0.2)
    partials: tuple[float, ...] = ()
    flutter_hz: Span = (0.0, 0.0)


# fmt: off
RECIPES = (
    Recipe(
        "cat", (350, 700), (0.7, 1.2), ((800, 1400), (1800, 2600), (3000, 3800)), (0.4, 1.2), (0.5, 1), 0.3,
        (0.05, 0.2),
    ),
    Recipe(
        "baby", (350, 550), (0.7, 1.1), ((900, 1300), (2000, 3000), (3500, 4500)), (0.5, 1.3), (0.6, 1.1), 0.7,
        (0.03, 0.1),
    ),
    Recipe(
        "dog", (250, 900), (0.5, 0.9), ((500, 1000), (1200, 2000), (2500, 3500)), (0.1, 0.35), (0.8, 3), 0.5,
        noise=(0.2, 0.6),
    ),
    Recipe("crow", (350, 600), (0.8, 1.0), ((1200, 1700), (2200, 3000)), (0.2, 0.5), (0.8, 2), 0.6, noise=(0.3, 0.6)),
    Recipe("sheep", (200, 400), (0.8, 1.0), ((600, 900), (1500, 2200)), (0.5, 1.2), (0.4, 1), 0.3, flutter_hz=(7, 12)),
    Recipe("bird", (2000, 5000), (0.6, 1.6), (), (0.05, 0.25), (2, 8), 0.6, (0.005, 0.03), (0, 2), (0, 0.05), (1,)),
    Recipe("whistle", (700, 2500), (0.7, 1.5), (), (0.2, 1.0), (0.7, 2), 0.4, (0.02, 0.1), (0, 1), (0, 0.1), (1,)),
    Recipe(
        "laugh", (150, 400), (0.7, 1.0), ((500, 900), (1200, 1900), (2400, 3200)), (0.08, 0.2), (3, 6), 0.9,
        noise=(0.3, 0.7),
    ),
    Recipe(
        "cough", (100, 250), (0.6, 1.0), ((500, 900), (1300, 1900), (2500, 3500)), (0.2, 0.4), (0.5, 2), 0.3,
        noise=(0.6, 0.9),
    ),
    Recipe(
        "snore", (40, 90), (0.8, 1.2), ((250, 600), (900, 1500)), (0.8, 1.6), (0.3, 0.5), 0.9, (0.2, 0.5),
        noise=(0.3, 0.7),
    ),
    Recipe(
        "hum", (100, 300), (0.8, 1.25), ((250, 450), (900, 1300)), (0.3, 0.9), (1, 2), 0.7, (0.03, 0.1), (0, 1),
        (0, 0.05),
    ),
    Recipe(
        "bell", (400, 2000), (1, 1), (), (0.8, 3), (0.4, 1.5), 0.7, (0.001, 0.003), (3, 7), (0, 0.02), (0.5, 1,
        1.19, 1.56, 2, 2.6, 3.2),
    ),
    Recipe(
        "glass", (1500, 4000), (1, 1), (), (0.1, 0.5), (1, 6), 0.2, (0.001, 0.002), (4, 8), (0.1, 0.3), (1, 1.7,
        2.3, 3.1),
    ),
    Recipe("piano", (110, 880), (1, 1), ((400, 900),), (0.3, 1.2), (1.5, 5), 0.95, (0.002, 0.01), (2, 4), (0, 0.01)),
    Recipe(
        "violin", (200, 900), (0.98, 1.02), ((450, 600), (2200, 2800)), (0.3, 1.2), (1, 3), 0.95, (0.05, 0.15),
        (0, 1), flutter_hz=(5, 6),
    ),
    Recipe("alarm", (800, 3200), (1, 1), (), (0.08, 0.5), (1, 5), 1.0, (0.002, 0.005), (0, 0), (0, 0), (1, 2, 3)),
    Recipe("siren", (500, 800), (1.4, 2.0), (), (0.5, 3), (0.4, 2), 1.0, (0.05, 0.1), (0, 0), (0, 0.05), (1, 2, 3, 4)),
    Recipe(
        "telephone", (400, 1200), (1, 1), (), (0.4, 1), (0.4, 0.8), 1.0, (0.01, 0.02), (0, 1), (0, 0), (1, 1.2,
        2.4), (15, 25),
    ),
    Recipe("horn", (250, 500), (1, 1), ((900, 1600),), (0.3, 1.2), (0.4, 1.2), 0.3, (0.02, 0.05), (0, 0), (0, 0.1)),
    Recipe(
        "knock", (80, 250), (0.6, 0.9), ((150, 400), (700, 1500)), (0.04, 0.12), (2, 6), 0.9, (0.001, 0.003), (4,
        8), (0.3, 0.7),
    ),
    Recipe("clap", (0, 0), (1, 1), ((800, 2500),), (0.02, 0.08), (1, 7), 0.8, (0.001, 0.002), (3, 6), (1, 1)),
    Recipe(
        "keys", (0, 0), (1, 1), ((2500, 5000), (1000, 2000)), (0.01, 0.04), (3, 10), 0.2, (0.001, 0.001), (3, 6),
        (1, 1),
    ),
    Recipe(
        "steps", (60, 120), (0.7, 1), ((150, 400), (1500, 3000)), (0.05, 0.15), (1.4, 2.5), 0.95, (0.002, 0.01),
        (3, 6), (0.5, 0.9),
    ),
    Recipe(
        "door", (60, 150), (0.6, 1), ((100, 300), (400, 900)), (0.2, 0.6), (0.2, 0.8), 0.2, (0.002, 0.01), (4,
        7), (0.5, 0.9),
    ),
    Recipe(
        "creak", (80, 400), (0.5, 2.0), ((600, 1200), (1800, 3000)), (0.3, 1.2), (0.4, 1), 0.2, (0.05, 0.2), (0,
        2), (0.05, 0.3),
    ),
    Recipe(
        "saw", (0, 0), (1, 1), ((1500, 3500), (600, 1200)), (0.2, 0.45), (1.5, 2.5), 0.95, (0.05, 0.15), (0, 2),
        (1, 1),
    ),
    Recipe(
        "wind", (0, 0), (1, 1), ((200, 700),), (2, 5), (0.3, 0.6), 0.2, (0.5, 1.5), (0, 1), (1, 1),
        flutter_hz=(0.3, 1),
    ),
    Recipe("water", (400, 1500), (1.1, 1.6), (), (0.02, 0.08), (5, 25), 0.0, (0.001, 0.005), (2, 5), (0, 0.3), (1,)),
    Recipe(
        "engine", (25, 90), (0.8, 1.3), ((100, 250), (400, 800)), (2, 5), (0.3, 0.5), 0.2, (0.2, 0.5), (0, 0),
        (0.2, 0.5),
    ),
    Recipe("drum", (50, 200), (0.6, 0.9), ((80, 250),), (0.1, 0.4), (2, 6), 0.95, (0.001, 0.003), (3, 6), (0.2, 0.7)),
    Recipe(
        "frog", (80, 200), (0.9, 1.1), ((500, 900), (1500, 2500)), (0.1, 0.4), (1, 3), 0.6, (0.02, 0.05), (0, 2),
        flutter_hz=(20, 40),
    ),
    Recipe("hiss", (0, 0), (1, 1), ((3000, 6500),), (0.2, 1.5), (0.5, 1.5), 0.3, (0.02, 0.2), (0, 2), (1, 1)),
    Recipe(
        "zip", (0, 0), (1, 1), ((2000, 6000),), (0.2, 0.6), (0.5, 1.5), 0.3, (0.02, 0.1), (0, 1), (1, 1),
        flutter_hz=(60, 150),
    ),
)


def clip(recipe: Recipe, rng: np.random.Generator) -> Sound:
    """CLIP_S seconds of it, RMS 1."""
    n = round(CLIP_S * SAMPLE_RATE_HZ)
    out = np.zeros(n)
    rate_hz = rng.uniform(*recipe.rate_hz)
    pitch_hz, timbre = rng.uniform(*recipe.pitch_hz), [rng.uniform(*span) for span in recipe.resonances_hz]
    at_s = rng.uniform(0.0, min(0.5 / rate_hz, 1.0))
    while at_s < CLIP_S - 0.05:
        event = _event(recipe, pitch_hz * rng.uniform(0.9, 1.1), timbre, rng) * rng.uniform(0.5, 1.0)
        at = round(at_s * SAMPLE_RATE_HZ)
        out[at : at + len(event)] += event[: n - at]
        jitter = np.exp(rng.normal(0.0, 1.0 - recipe.regular))
        at_s += jitter / rate_hz
    return unit(out + 1e-9)


def _event(recipe: Recipe, pitch_hz: float, timbre: list[float], rng: np.random.Generator) -> Sound:
    length_s = rng.uniform(*recipe.length_s)
    n = max(round(length_s * SAMPLE_RATE_HZ), 64)
    t = np.linspace(0.0, 1.0, n)
    hz = pitch_hz * rng.uniform(*recipe.glide) ** np.sin(0.5 * np.pi * t * rng.uniform(0.6, 2.0))
    hz *= 1.0 + 0.01 * np.interp(np.linspace(0, 9, n), np.arange(10), rng.standard_normal(10))
    phase = np.cumsum(hz) / SAMPLE_RATE_HZ
    sound = np.zeros(n)
    if pitch_hz and recipe.partials:
        for order in recipe.partials:
            if order * hz.max() < 7500.0:
                sound += np.sin(2.0 * np.pi * order * phase + order) * np.exp(-t * order) / order
    elif pitch_hz:
        sound = np.diff(np.floor(phase), prepend=0.0)
        sound = lfilter([1.0], [1.0, -0.9], sound - sound.mean())  # as a larynx: 12 dB an octave, less what is radiated
    share = rng.uniform(*recipe.noise)
    breath = rng.standard_normal(n)
    sound = (1.0 - share) * unit(sound + 1e-9) + share * breath if pitch_hz else breath
    for hz_of in timbre:
        peak = Peak(float(np.clip(hz_of * rng.uniform(0.95, 1.05), 60.0, 7500.0)), 18.0, 4.0)
        sound = sosfilt(peaking(peak), sound)
    if timbre:
        sound = sosfilt(butter(1, min(max(timbre) * 1.3, 7500.0), fs=SAMPLE_RATE_HZ, output="sos"), sound)
    seconds = t * length_s
    envelope = np.minimum(seconds / rng.uniform(*recipe.attack_s), 1.0) * np.exp(-t * rng.uniform(*recipe.decay))
    envelope *= np.minimum((1.0 - t) * length_s / 0.01, 1.0)
    if recipe.flutter_hz[1]:
        envelope *= 0.6 + 0.4 * np.sin(2.0 * np.pi * rng.uniform(*recipe.flutter_hz) * seconds)
    return np.asarray(unit(sound) * envelope)
