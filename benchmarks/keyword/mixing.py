"""Mixes clips as a robot hears them: over talk and noise, in rooms, through loudspeakers, from faint to overdriven; in
the front end's energies, at a twentieth of the cost of samples.

Powers of independent sounds add, but for a random share of their product; a room is a decay in each band, a loudspeaker
or microphone a gain of each band, and a speaker's size a shift along the bands (N. Jaitly & G. Hinton, "Vocal tract
length perturbation improves speech recognition", ICML workshop 2013). Clips that were hard are drawn more often.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from benchmarks.keyword.clips import KINDS, Clip
from benchmarks.keyword.microphones import received
from benchmarks.keyword.noises import noises
from hvcpd.ports import SAMPLE_RATE_HZ
from hvcpd.recognition.frontend import (
    HIGH_HZ,
    HOP_SAMPLES,
    LOW_HZ,
    N_BANDS,
    WINDOW_SAMPLES,
    Energies,
    energies_of,
    power_weights,
)

FRAMES_S = SAMPLE_RATE_HZ // HOP_SAMPLES
N_FRAMES = 320
"""3.2 s a take: the net's 2.2 s, and what follows the word."""
LONGEST = 400
"""Frames of talk in a take at most; of longer talk a piece is heard."""
EARLIEST_S = 1.0
"""Least time from the beginning to the keyword's end."""
LATEST_S = 0.75
"""Least time from the keyword's end to the end."""
POSITIVE = 0.42
AGAIN = 0.15
"""Share of calls that are said twice, the second one a copy."""
AGAIN_S = (0.65, 1.2)
"""Range of the time between the ends of both calls."""
OTHERS = {"word": 0.44, "talk": 0.36, "sound": 0.08, "inside": 0.12}
"""What else is said over the background, by share."""
OFTEN = {"words stop": 26.0, "words": 7.0, "negatives": 11.0, "natural": 2.0}
"""People's recordings are drawn so many times as often as a synthesizer's: they are few and all unlike. The robots'
natural voices are those that are heard most."""
UNDER_TALK_DB = (-4.0, 20.0)
"""How much less loud than talk a noise is that comes with it."""
NONE = -1
"""The frame where a word ends that was not said."""
CUT = 0.15
"""Share of other words and talk of which only a part is heard: it begins, or ends, as abruptly as the word does."""
LEAST_CUT = 0.2
"""The shortest such part, of the whole."""
SHIFTS = np.linspace(-0.35, 0.35, 29)
"""Octaves by which a speaker may be larger or smaller."""
CROSS = 0.3
"""Standard deviation of the cosine between two sounds in a band, which averages a few bins: measured with white noise
and with two talkers, 0.25 to 0.31 below 2.5 kHz, 0.2 above."""
TILT_DB = (-7.0, 7.0)
"""Range of a voice's tilt, dB an octave: dull to shouted."""
TAIL_FRAMES = 40
FORGET = 0.7
"""Weight of a clip's earlier losses in the mean of them."""
LEAST = 0.15
"""What an easy clip's loss counts as: it is still drawn."""
MOST = 4.0
"""What a hard clip's loss counts as: it may be mislabelled."""

_low_mel, _high_mel = 2595.0 * np.log10(1.0 + np.array([LOW_HZ, HIGH_HZ]) / 700.0)
CENTRES_HZ = 700.0 * (10.0 ** (np.linspace(_low_mel, _high_mel, N_BANDS + 2)[1:-1] / 2595.0) - 1.0)
_WEIGHTS = power_weights()


def _warp(octaves: float) -> NDArray[np.float32]:
    """The matrix that moves energies up by so many octaves, shape (N_BANDS, N_BANDS)."""
    at = np.interp(CENTRES_HZ * 2.0**-octaves, CENTRES_HZ, np.arange(N_BANDS))
    return np.asarray(np.clip(1.0 - np.abs(at[None] - np.arange(N_BANDS)[:, None]), 0.0, None), np.float32)


WARPS = [_warp(float(octaves)) for octaves in SHIFTS]


@dataclass(frozen=True, eq=False)
class Takes:
    """`energies`: shape (takes, N_FRAMES, N_BANDS); `ends`: the frames where the keyword ends, shape (takes, 2), NONE
    where it does not; `inside`: whether it is part of a sentence; `clips`: kind and number of each take's own clip."""

    energies: Energies
    ends: NDArray[np.int64]
    inside: NDArray[np.bool_]
    clips: list[tuple[str, int]]


class EnergyMixer:
    """Draws takes at random."""

    def __init__(self, clips: Sequence[Clip], data: Path | None, part: str, seed: int) -> None:
        self._rng = np.random.default_rng(seed)
        self._clips = {kind: of_part(clips, kind, part) for kind in KINDS}
        self._energies = {kind: [_of_clip(c) for c in found] for kind, found in self._clips.items()}
        self._even = {kind: np.diff(shares(found), prepend=0.0) for kind, found in self._clips.items()}
        self._losses = {kind: np.ones(len(found)) for kind, found in self._clips.items()}
        self._noises = [_normalised(energies_of(np.asarray(n, np.float32))) for n in noises(data, seed)]
        self._aim()

    def learned(self, takes: Takes, losses: NDArray[np.float32]) -> None:
        """Note how hard those takes were."""
        for (kind, number), loss in zip(takes.clips, losses, strict=True):
            if number >= 0:
                mean = self._losses[kind]
                mean[number] = FORGET * mean[number] + (1.0 - FORGET) * np.clip(loss, LEAST, MOST)
        self._aim()

    def _aim(self) -> None:
        self._sums = {kind: np.cumsum(even * self._losses[kind]) for kind, even in self._even.items()}
        self._evenly = {kind: np.cumsum(even) for kind, even in self._even.items()}

    def draw(self, n: int) -> Takes:
        """Draw so many takes."""
        rng = self._rng
        whole, said = np.zeros((2, n, N_FRAMES, N_BANDS), np.float32)
        ends, inside, clips = np.full((n, 2), NONE), np.zeros(n, np.bool_), list[tuple[str, int]]()
        for k in range(n):
            level_db = self._background(whole[k])
            kind = "stop" if rng.random() < POSITIVE else str(rng.choice(list(OTHERS), p=list(OTHERS.values())))
            number = -1
            if kind in ("stop", "inside") or rng.random() < 0.7:
                sound, end, number = self._take(kind, self._sums)
                sound = self._through(sound) * 10.0 ** ((level_db or 0.0) / 10.0)
                latest = N_FRAMES - round(LATEST_S * FRAMES_S)
                at = int(rng.integers(round(EARLIEST_S * FRAMES_S), latest)) - end
                if kind == "talk":  # any piece of it
                    at = int(rng.integers(round(EARLIEST_S * FRAMES_S) - end, N_FRAMES // 2))
                again = round(rng.uniform(*AGAIN_S) * FRAMES_S) if rng.random() < AGAIN else N_FRAMES
                for copy, begin in enumerate((at, at + again) if kind == "stop" else (at,)):
                    _add(said[k], sound, begin)
                    if kind == "stop" and begin + end < latest:
                        ends[k, copy] = begin + end
            clips.append((kind, number))
            inside[k] = kind == "inside"
        return Takes(self._received(mixed(whole, said, rng)), ends, inside, clips)

    def _background(self, out: Energies) -> float | None:
        """Add what else is heard, of power 1; the level in dB of what is said over it."""
        rng, kind = self._rng, self._rng.random()
        if kind < 0.2:
            return None
        if kind < 0.68:
            n_talkers = int(rng.choice((1, 2, 5), p=(0.75, 0.15, 0.1)))
            for _ in range(n_talkers):
                self._talk(out, 1.0 / n_talkers)
            if rng.random() < 0.6:
                out += self._noise() * 10.0 ** (-rng.uniform(*UNDER_TALK_DB) / 10.0)
            return float(rng.uniform(-7.0, 8.0) if rng.random() < 0.7 else rng.uniform(5.0, 25.0))
        if kind < 0.92:
            out += self._noise()
            return float(rng.uniform(-6.0, 8.0) if rng.random() < 0.5 else rng.uniform(5.0, 30.0))
        sound, _, _ = self._take("sound", self._evenly)
        _add(out, sound, int(rng.integers(-len(sound) // 2, N_FRAMES // 2)))
        return float(rng.uniform(-3.0, 15.0))

    def _talk(self, out: Energies, gain: float) -> None:
        """Somebody talks, from the beginning or from some time on."""
        rng = self._rng
        at = int(rng.integers(-3 * FRAMES_S, 0)) if rng.random() < 0.7 else int(rng.integers(0, N_FRAMES // 2))
        while at < N_FRAMES:
            sound, end, _ = self._take("talk" if rng.random() < 0.8 else "word", self._evenly)
            if at + len(sound) > 0:
                _add(out, self._through(sound) * gain, at)
            at += end + int(FRAMES_S * rng.exponential(0.3))
            if rng.random() < 0.1:
                break

    def _noise(self) -> Energies:
        noise = self._noises[self._rng.integers(len(self._noises))]
        at = int(self._rng.integers(len(noise) - N_FRAMES))
        return noise[at : at + N_FRAMES] @ WARPS[self._rng.integers(len(WARPS))]

    def _take(self, kind: str, sums: dict[str, NDArray[np.float64]]) -> tuple[Energies, int, int]:
        """A clip at another pace and of another size, the frame at which its word ends, and its number."""
        rng = self._rng
        number = int(np.searchsorted(sums[kind], rng.random() * sums[kind][-1]))
        number = min(number, len(self._clips[kind]) - 1)
        sound, end = self._energies[kind][number]
        if kind == "talk" and len(sound) > LONGEST:
            at = int(rng.integers(len(sound) - LONGEST + 1))
            sound, end = sound[at : at + LONGEST], min(end - at, LONGEST - 1)
        if kind in ("word", "talk") and rng.random() < CUT:
            n = round(len(sound) * rng.uniform(LEAST_CUT, 1.0))
            at = int(rng.integers(len(sound) - n + 1))
            sound, end = sound[at : at + max(n, 2)], max(n, 2) - 1
        is_short = kind in ("stop", "word")
        factor = 2.0 ** (rng.uniform(-0.4, 0.7) if is_short and rng.random() < 0.4 else rng.normal(0.0, 0.15))
        sound, end = _stretched(sound, float(factor)), round(end * factor)
        if rng.random() < 0.7:
            sound = sound @ WARPS[rng.integers(len(WARPS))]
        return sound, min(end, len(sound) - 1), number

    def _through(self, sound: Energies) -> Energies:
        """A throat that mumbles or shouts, a loudspeaker, and a room; as much power as before."""
        rng = self._rng
        gains = _colour(rng)
        if rng.random() < 0.4:
            gains *= 10.0 ** (rng.uniform(*TILT_DB) * np.log2(np.clip(CENTRES_HZ, 250.0, 4000.0) / 1000.0) / 10.0)
        if rng.random() < 0.35:
            low, high = rng.uniform(150.0, 700.0), rng.uniform(3000.0, 8000.0)
            gains /= (1.0 + (low / CENTRES_HZ) ** 4) * (1.0 + (CENTRES_HZ / high) ** 4)
        out = sound * gains.astype(np.float32)
        if rng.random() < 0.7:
            kept = 10.0 ** (-6.0 / FRAMES_S / 2.0 ** rng.uniform(-3.0, 0.6))
            padded = np.pad(out, ((int(rng.integers(1, 4)), TAIL_FRAMES), (0, 0)))
            tail = lfilter([1.0 - kept], [1.0, -kept], padded, axis=0)[: len(out) + TAIL_FRAMES]
            tail *= rng.gamma(3.0, 1.0 / 3.0, tail.shape) * 10.0 ** (-rng.uniform(-8.0, 15.0) / 10.0)
            tail[: len(out)] += out
            out = tail
        before, after = (float(np.sum(each @ _WEIGHTS)) for each in (sound, out))
        return np.asarray(out * (before / max(after, 1e-9)), np.float32)

    def _received(self, whole: Energies) -> Energies:
        """By one microphone and its driver, of some gain and with noise of its own."""
        rng, n = self._rng, len(whole)
        for k in range(n):
            whole[k] *= _colour(rng).astype(np.float32)
        power = np.maximum((whole @ _WEIGHTS).mean(axis=1), 1e-6)
        level_db = np.where(rng.random(n) < 0.9, rng.uniform(-52.0, -12.0, n), rng.uniform(-12.0, 10.0, n))
        floor_db = np.minimum(rng.uniform(-90.0, -60.0, n), level_db - 8.0)
        floor = np.stack([self._noises[rng.integers(2)][at : at + N_FRAMES] for at in rng.integers(0, 3000, n)])
        out = (
            whole * (10.0 ** (level_db / 10.0) / power)[:, None, None]
            + floor * 10.0 ** (floor_db / 10.0)[:, None, None]
        )
        return np.asarray(received(np.asarray(out, np.float32), rng) * _FULL_SCALE + 1e-7, np.float32)


def _of_clip(clip: Clip) -> tuple[Energies, int]:
    loud = clip.sound[np.abs(clip.sound) > 0.05 * np.abs(clip.sound).max()].astype(np.float64)
    sound = np.pad(clip.sound / np.float32(np.sqrt(np.mean(loud**2))), WINDOW_SAMPLES)
    return energies_of(sound) / _FULL_SCALE, (clip.end + WINDOW_SAMPLES) // HOP_SAMPLES


def _normalised(energies: Energies) -> Energies:
    return np.asarray(energies / (energies @ _WEIGHTS).mean(), np.float32)


_FULL_SCALE = np.float32(
    (energies_of(np.random.default_rng(0).standard_normal(64000).astype(np.float32)) @ _WEIGHTS).mean()
)
"""Power of sound of RMS 1."""


def _stretched(sound: Energies, factor: float) -> Energies:
    at = np.arange(max(round(len(sound) * factor), 2)) / factor
    first = np.minimum(at.astype(int), len(sound) - 2)
    share = np.clip(at - first, 0.0, 1.0).astype(np.float32)[:, None]
    return np.asarray(sound[first] * (1 - share) + sound[first + 1] * share, np.float32)


def _colour(rng: np.random.Generator) -> NDArray[np.float64]:
    corners_hz = np.array([0, 150, 400, 1000, 2000, 4000, 8000])
    tilt_db = np.interp(CENTRES_HZ, corners_hz, np.cumsum(rng.normal(0.0, 2.0, len(corners_hz))))
    return np.asarray(10.0 ** ((tilt_db - tilt_db.mean()) / 10.0))


def mixed(first: Energies, second: Energies, rng: np.random.Generator) -> Energies:
    """Energies of the sum of two independent sounds."""
    cosine = np.clip(rng.standard_normal(first.shape, np.float32) * np.float32(CROSS), -0.9, 0.9)
    return np.asarray(first + second + 2.0 * cosine * np.sqrt(first * second), np.float32)


def _add(whole: Energies, sound: Energies, at: int) -> None:
    begin, first = max(at, 0), max(-at, 0)
    n = min(len(whole) - begin, len(sound) - first)
    if n > 0:
        whole[begin : begin + n] += sound[first : first + n]


def of_part(clips: Sequence[Clip], kind: str, part: str) -> list[Clip]:
    """Clips of that part; where there are none to validate with, those to train with."""
    found = [c for c in clips if c.kind == kind]
    return [c for c in found if c.part == part] or [c for c in found if c.part == "train"]


def shares(clips: Sequence[Clip]) -> NDArray[np.float64]:
    """Of each, cumulative."""
    weights = np.array([next((w for start, w in OFTEN.items() if c.source.startswith(start)), 1.0) for c in clips])
    return np.asarray(np.cumsum(weights) / max(weights.sum(), 1.0))
