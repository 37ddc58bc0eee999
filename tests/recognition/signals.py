"""Small deterministic 'words' for the tests: gliding vowels and hiss, far apart from each other by construction."""

from __future__ import annotations

import numpy as np

from hvcpd.language.graph import Arc, WordGraph
from hvcpd.ports import SAMPLE_RATE_HZ, Samples

# Each word is a series of sounds: first and second formant in Hz, or a hiss around one frequency.
SOUNDS: dict[str, list[tuple[float, float]]] = {
    "hi": [(0, 1500), (800, 1200), (300, 2400)],
    "rob": [(450, 1100), (700, 1000), (300, 800)],
    "bot": [(300, 700), (620, 1050), (0, 3600)],
    "stop": [(0, 5500), (700, 1050), (250, 700)],
    "water": [(300, 650), (720, 1150), (480, 1400)],
    "green": [(0, 2200), (430, 1600), (280, 2450), (270, 1300)],
    "rose": [(430, 1150), (480, 850), (0, 4600)],
}
SECONDS_A_SOUND_S = 0.11


def word(name: str, pitch_hz: float = 120.0, length_s: float | None = None) -> Samples:
    """One word at a mean power of about -20 dBFS."""
    sounds = SOUNDS[name]
    n = int((length_s or SECONDS_A_SOUND_S * len(sounds)) * SAMPLE_RATE_HZ)
    t = np.arange(n) / SAMPLE_RATE_HZ
    at = np.linspace(0, len(sounds) - 1e-6, n)
    which = at.astype(int)
    voiced = np.array([first > 0 for first, _ in sounds], float)
    first = np.interp(at, np.arange(len(sounds)) + 0.5, [f or 400.0 for f, _ in sounds])
    second = np.interp(at, np.arange(len(sounds)) + 0.5, [f for _, f in sounds])
    tone = np.zeros(n)
    for k in range(1, int(4000 / pitch_hz)):
        f = k * pitch_hz
        amplitude = np.exp(-(((f - first) / 120.0) ** 2)) + 0.5 * np.exp(-(((f - second) / 200.0) ** 2)) + 0.003
        tone += amplitude * np.sin(2 * np.pi * f * t + k * k)
    rng = np.random.default_rng(sum(name.encode()))
    noise = rng.standard_normal(n)
    band = np.cos(2 * np.pi * np.cumsum(second) / SAMPLE_RATE_HZ) * np.convolve(noise, np.hanning(32) / 16, "same")
    sound = np.where(voiced[which] > 0, tone, 0.4 * band)
    edge = np.minimum(1.0, np.minimum(np.arange(n), np.arange(n)[::-1]) / 160.0)
    sound = sound * edge
    return np.asarray(0.1 * sound / np.sqrt(np.mean(sound**2)), np.float32)


def sentence(words: str, pitch_hz: float = 125.0, pause_s: float = 0.15) -> Samples:
    """Words one after the other; a comma makes a pause."""
    parts: list[Samples] = []
    for token in words.split():
        parts.append(word(token.strip(","), pitch_hz))
        if token.endswith(","):
            parts.append(np.zeros(int(pause_s * SAMPLE_RATE_HZ), np.float32))
    return np.concatenate(parts)


def in_noise(
    sound: Samples, before_s: float = 1.0, after_s: float = 0.8, noise_dbfs: float = -60.0, seed: int = 1
) -> Samples:
    """The sound with time around it, in white noise, rounded to 16 bits."""
    pads = int(before_s * SAMPLE_RATE_HZ), int(after_s * SAMPLE_RATE_HZ)
    x = np.pad(sound, pads)
    noise = np.random.default_rng(seed).standard_normal(len(x)) * 10.0 ** (noise_dbfs / 20.0)
    return np.asarray(np.round(np.clip(x + noise, -1, 1) * 32767) / 32767, np.float32)


def graph() -> WordGraph:
    """(hi rob | hi bot) [, water (green | rose)] and bare stop."""
    arcs = (
        Arc(0, 1, "hi"),
        Arc(1, 2, "rob"),
        Arc(1, 2, "bot"),
        Arc(2, 3, "water"),
        Arc(3, 4, "green"),
        Arc(3, 4, "rose"),
        Arc(2, 4, "stop"),
        Arc(0, 4, "stop"),
    )
    return WordGraph(n_nodes=5, arcs=arcs, start=0, finals=frozenset({2, 4}), pauses=frozenset({2}))


def templates() -> dict[str, dict[str, list[Samples]]]:
    """One voice, one template a word, at another pitch than the sentences'."""
    return {"oak": {name: [word(name)] for name in SOUNDS}}
