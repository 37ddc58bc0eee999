"""Mixes clips as a robot hears them: over talk and noise, in rooms, through loudspeakers, from faint to clipped.

    nice python -m benchmarks.keyword.material clips.npz --data DIR --out test.npz [--number 2500] [--seed 19]
        [--part test]

`benchmarks.keyword.score` takes what it writes; the training mixes energies instead (`mixing`).
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks.hearing.noises import steady
from benchmarks.keyword.clips import KINDS, Clip, load
from benchmarks.phones.voices import resampled
from hil_fakes.robot_noise import fan, motor
from hvcpd.hardware.soundfile import read_wav
from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from hvcpd.recognition.frontend import HOP_SAMPLES, WINDOW_SAMPLES, energies_of
from hvcpd.recognition.stream import CHUNK_FRAMES

LENGTH_S = 3.6
N_FRAMES = round(LENGTH_S * SAMPLE_RATE_HZ) // HOP_SAMPLES // CHUNK_FRAMES * CHUNK_FRAMES
_LENGTH = (N_FRAMES - 1) * HOP_SAMPLES + WINDOW_SAMPLES
EARLIEST_S = 1.0
"""Least time from the beginning to the keyword's end."""
LATEST_S = 0.75
"""Least time from the keyword's end to the end."""
POSITIVE = 0.42
AGAIN = 0.15
"""Share of calls that are said twice, the second one a copy."""
AGAIN_S = (0.65, 1.2)
"""Range of the time between the ends of both calls."""
OTHERS = {"word": 0.5, "talk": 0.28, "sound": 0.08, "inside": 0.14}
"""What else is said over the background, by share."""
OFTEN = {"words stop": 16.0, "words": 3.0, "negatives": 6.0, "natural": 2.0}
"""People's recordings are drawn so many times as often as a synthesizer's: they are few and all unlike. The robots'
natural voices are those that are heard most."""
CUT = 0.15
"""Share of other words and talk of which only a part is heard: it begins, or ends, as abruptly as the word does."""
LEAST_CUT = 0.2
"""The shortest such part, of the whole."""
NONE = -1


@dataclass(frozen=True, eq=False)
class Heard:
    """Energies of N_FRAMES frames, the frames at which the keyword ended, and whether it is part of a sentence."""

    energies: NDArray[np.float32]
    ends: tuple[int, ...]
    inside: bool


def stretched(sound: Samples, factor: float) -> Samples:
    """As long as `factor` times the sound, as high: overlapping pieces, each where it fits best what went before
    (WSOLA: W. Verhelst & M. Roelands, ICASSP 1993)."""
    size, reach = 512, 128
    hop = size // 2
    window = np.hanning(size + 1)[:-1].astype(np.float32)
    padded = np.pad(sound, (size, 2 * size + reach))
    n = round(len(sound) * factor / hop) + 2
    out = np.zeros((n + 1) * hop + size, np.float32)
    at = size // 2
    for k in range(n):
        wanted = size // 2 + round(k * hop / factor)
        if wanted + size + reach >= len(padded):
            break
        if k:
            follows = padded[at + hop : at + hop + size]
            first = max(wanted - reach, 0)
            region = padded[first : wanted + reach + size]
            if len(follows) == size and np.any(follows):
                at = first + int(np.argmax(np.correlate(region[::1], follows, "valid")))
            else:
                at = wanted
        piece = padded[at : at + size]
        out[k * hop : k * hop + size] += window[: len(piece)] * piece
    return out[hop : hop + round(len(sound) * factor)]


class Rooms:
    """Impulse responses: some measured, and many made of decaying noise."""

    def __init__(self, folder: Path | None, rng: np.random.Generator) -> None:
        self._rng = rng
        paths = sorted(folder.glob("unis_a_*.wav")) if folder is not None else []
        self._measured = [np.asarray(read_wav(path), np.float32) for path in paths]

    def draw(self) -> Samples | None:
        """A response with its direct sound first, of RMS 1; None: close to the microphone."""
        rng = self._rng
        kind = rng.random()
        if kind < 0.3:
            return None
        if kind < 0.5 and self._measured:
            response = self._measured[rng.integers(len(self._measured))]
            response = response[max(int(np.argmax(np.abs(response))) - 16, 0) :][: SAMPLE_RATE_HZ // 2]
        else:
            rt60_s = 2.0 ** rng.uniform(-3.0, 0.6)
            n = round(min(rt60_s, 1.0) * SAMPLE_RATE_HZ)
            response = rng.standard_normal(n) * 10.0 ** (-3.0 * np.arange(n) / (rt60_s * SAMPLE_RATE_HZ))
            direct_db = rng.uniform(-8.0, 15.0)
            early = rng.integers(16, max(n // 4, 17), 8)
            response[early] *= 3.0
            response *= 1.0 / np.sqrt(np.sum(response**2))
            response[0] += 10.0 ** (direct_db / 20.0)
        return np.asarray(response / np.sqrt(np.sum(response**2)), np.float32)


class Mixer:
    """Draws mixtures at random."""

    def __init__(self, clips: Sequence[Clip], data: Path | None, part: str, seed: int) -> None:
        self._rng = np.random.default_rng(seed)
        self._clips = {kind: of_part(clips, kind, part) for kind in KINDS}
        self._shares = {kind: shares(found) for kind, found in self._clips.items()}
        self._rooms = Rooms(data / "rooms" if data is not None else None, self._rng)
        self._noises = noises(data, seed)

    def draw(self) -> Heard:
        """Draw one mixture."""
        rng = self._rng
        whole, ends = np.zeros(_LENGTH, np.float32), list[int]()
        background, level_db = self._background()
        whole += background
        kind = "stop" if rng.random() < POSITIVE else str(rng.choice(list(OTHERS), p=list(OTHERS.values())))
        if kind in ("stop", "inside") or rng.random() < 0.7:
            sound, end = self._take(kind)
            sound = self._through(_at_level(sound, level_db if level_db is not None else 0.0))
            at = int(rng.integers(round(EARLIEST_S * SAMPLE_RATE_HZ), _LENGTH - round(LATEST_S * SAMPLE_RATE_HZ))) - end
            again = round(rng.uniform(*AGAIN_S) * SAMPLE_RATE_HZ) if rng.random() < AGAIN else _LENGTH
            for begin in (at, at + again) if kind == "stop" else (at,):
                _add(whole, sound, begin)
                if kind == "stop" and begin + end < _LENGTH - round(LATEST_S * SAMPLE_RATE_HZ):
                    ends.append((begin + end) // HOP_SAMPLES)
        return Heard(energies_of(self._received(whole)), tuple(ends), kind == "inside")

    def _background(self) -> tuple[Samples, float | None]:
        """What else is heard, as loud as 0 dB, and the level of what is said over it."""
        rng = self._rng
        kind = rng.random()
        if kind < 0.2:
            return np.zeros(_LENGTH, np.float32), None
        if kind < 0.68:
            n_talkers = int(rng.choice((1, 2, 5), p=(0.75, 0.15, 0.1)))
            talk = sum((self._talk() for _ in range(n_talkers)), np.zeros(_LENGTH, np.float32))
            over_db = rng.uniform(-7.0, 8.0) if rng.random() < 0.7 else rng.uniform(5.0, 25.0)
            if rng.random() < 0.4:
                talk += 10.0 ** (-rng.uniform(5.0, 40.0) / 20.0) * self._noise()
            return np.asarray(talk / np.sqrt(n_talkers), np.float32), over_db
        if kind < 0.92:
            return self._noise(), float(rng.choice((rng.uniform(-6.0, 8.0), rng.uniform(5.0, 30.0))))
        sound = np.zeros(_LENGTH, np.float32)
        clip, _ = self._take("sound")
        _add(sound, _at_level(clip, 0.0), int(rng.integers(-len(clip) // 2, _LENGTH // 2)))
        return sound, float(rng.uniform(-3.0, 15.0))

    def _talk(self) -> Samples:
        """Somebody talks, from the beginning or from some time on."""
        rng, out = self._rng, np.zeros(_LENGTH, np.float32)
        at = int(rng.integers(-3 * SAMPLE_RATE_HZ, 0)) if rng.random() < 0.7 else int(rng.integers(0, _LENGTH // 2))
        while at < _LENGTH:
            kind = "talk" if rng.random() < 0.8 else "word"
            sound, _ = self._take(kind)
            if at + len(sound) > 0:
                _add(out, self._through(_at_level(sound, 0.0)), at)
            at += len(sound) + int(SAMPLE_RATE_HZ * rng.exponential(0.3))
            if rng.random() < 0.1:
                break
        return out

    def _noise(self) -> Samples:
        rng = self._rng
        if rng.random() < 0.12:
            out = _signal(rng)
        else:
            noise = self._noises[rng.integers(len(self._noises))]
            at = int(rng.integers(len(noise) - _LENGTH))
            out = np.asarray(noise[at : at + _LENGTH], np.float32)
        return np.asarray(out / max(float(np.sqrt(np.mean(out**2))), 1e-6), np.float32)

    def _take(self, kind: str) -> tuple[Samples, int]:
        """A clip at another pace and of another size, and where its word ends."""
        rng, clips = self._rng, self._clips[kind]
        clip = clips[int(np.searchsorted(self._shares[kind], rng.random()))]
        sound, end = clip.sound, float(clip.end)
        if kind in ("word", "talk") and rng.random() < CUT:
            sound = _part(sound, rng)
            end = float(len(sound))
        is_person = clip.source.startswith(("words", "digits", "negatives"))
        if rng.random() < (0.85 if is_person else 0.4):
            step = float(2.0 ** rng.uniform(-0.3, 0.3))
            sound, end = resampled(sound, step), end / step
        if kind == "stop" and rng.random() < (0.5 if is_person else 0.25):
            factor = float(2.0 ** rng.uniform(-0.35, 0.7))
            sound, end = stretched(sound, factor), end * factor
        return sound, min(round(end), len(sound) - 1)

    def _through(self, sound: Samples) -> Samples:
        """A throat that whispers or shouts, a loudspeaker, and a room."""
        rng, n = self._rng, len(sound)
        response = self._rooms.draw()
        size = 1 << (n + (len(response) if response is not None else 0)).bit_length()
        spectrum = np.fft.rfft(sound, size)
        hz = np.linspace(0.0, SAMPLE_RATE_HZ / 2, len(spectrum))
        spectrum *= _colour(hz, rng)
        if rng.random() < 0.2:
            spectrum *= 10.0 ** (rng.uniform(2.0, 7.0) * np.log2(np.clip(hz, 250.0, 4000.0) / 1000.0) / 20.0)
        if rng.random() < 0.35:
            spectrum *= _small_loudspeaker(hz, rng)
        if response is not None:
            spectrum *= np.fft.rfft(response, size)
            n = min(n + len(response), size)
        out = np.fft.irfft(spectrum, size)[:n]
        before = float(np.sqrt(np.mean(sound.astype(np.float64) ** 2)))
        after = float(np.sqrt(np.sum(out**2) / max(len(sound), 1)))
        return np.asarray(out * (before / max(after, 1e-9)), np.float32)

    def _received(self, whole: Samples) -> Samples:
        """By one microphone, of some gain and with noise of its own."""
        rng = self._rng
        loud = float(np.sqrt(np.mean(whole**2)) or 1.0)
        spectrum = np.fft.rfft(whole, 1 << 16)
        whole = np.fft.irfft(spectrum * _colour(np.linspace(0.0, 8000.0, len(spectrum)), rng), 1 << 16)[:_LENGTH]
        level_db = rng.uniform(-52.0, -12.0) if rng.random() < 0.9 else rng.uniform(-12.0, 10.0)
        whole = whole / loud * 10.0 ** (level_db / 20.0)
        floor_db = min(rng.uniform(-90.0, -60.0), level_db - 8.0)
        floor = self._noises[int(rng.integers(2))]
        at = int(rng.integers(len(floor) - _LENGTH))
        whole = whole + floor[at : at + _LENGTH] * 10.0 ** (floor_db / 20.0)
        return np.asarray(np.clip(np.round(whole * 32767.0) / 32767.0, -1.0, 1.0), np.float32)


def noises(data: Path | None, seed: int) -> list[NDArray[np.float64]]:
    """Long ones, the first two those of a microphone; without those for tests."""
    n, rng = 40 * SAMPLE_RATE_HZ, np.random.default_rng(seed)
    found = [steady("white", n, seed), steady("pink", n, seed), fan(n, rng), motor(n, rng)]
    for path in sorted((data / "noises").glob("*.wav")) if data is not None else ():
        if path.stem not in ("aircon_2", "dishwasher_3"):
            found.append(np.asarray(read_wav(path), np.float64))
    if data is not None:
        kitchen = np.asarray(read_wav(data / "kitchen.wav"), np.float64)
        found.append(kitchen[: len(kitchen) // 2])
    return found


def _part(sound: Samples, rng: np.random.Generator) -> Samples:
    n = round(len(sound) * rng.uniform(LEAST_CUT, 1.0))
    at = int(rng.integers(len(sound) - n + 1))
    return sound[at : at + n]


def of_part(clips: Sequence[Clip], kind: str, part: str) -> list[Clip]:
    """Clips of that part; where there are none to validate with, those to train with."""
    found = [c for c in clips if c.kind == kind]
    return [c for c in found if c.part == part] or [c for c in found if c.part == "train"]


def shares(clips: Sequence[Clip]) -> NDArray[np.float64]:
    """Of each, cumulative."""
    weights = np.array([next((w for start, w in OFTEN.items() if c.source.startswith(start)), 1.0) for c in clips])
    return np.asarray(np.cumsum(weights) / max(weights.sum(), 1.0))


def _colour(hz: NDArray[np.float64], rng: np.random.Generator) -> NDArray[np.float64]:
    corners = np.array([0, 150, 400, 1000, 2000, 4000, 8000])
    tilt_db = np.interp(hz, corners, np.cumsum(rng.normal(0.0, 2.0, len(corners))))
    return np.asarray(10.0 ** (tilt_db / 20.0))


def _small_loudspeaker(hz: NDArray[np.float64], rng: np.random.Generator) -> NDArray[np.float64]:
    """Two slopes of 12 dB an octave, and a resonance."""
    low, high = rng.uniform(150.0, 700.0), rng.uniform(3000.0, 8000.0)
    peak, width = 2.0 ** rng.uniform(8.3, 11.5), rng.uniform(0.2, 0.6)
    bump_db = rng.uniform(0.0, 10.0) * np.exp(-((np.log2(np.maximum(hz, 1.0) / peak) / width) ** 2))
    slopes = 1.0 / np.sqrt(1.0 + (low / np.maximum(hz, 1.0)) ** 4) / np.sqrt(1.0 + (hz / high) ** 4)
    return np.asarray(slopes * 10.0 ** (bump_db / 20.0))


def _signal(rng: np.random.Generator) -> Samples:
    """A horn, a beep, or claps."""
    t = np.arange(_LENGTH) / SAMPLE_RATE_HZ
    out = np.zeros(_LENGTH)
    kind = rng.integers(3)
    for _ in range(int(rng.integers(1, 6))):
        at, long_s = rng.uniform(0.0, LENGTH_S), rng.uniform(0.05, 0.8)
        inside = (t >= at) & (t < at + long_s)
        if kind == 2:
            out += np.where(t >= at, np.exp(-(t - at) / rng.uniform(0.005, 0.05)), 0.0) * rng.standard_normal(_LENGTH)
        else:
            hz = rng.uniform(200.0, 700.0) if kind == 0 else rng.uniform(500.0, 3500.0)
            n_tones = 12 if kind == 0 else 1
            out += inside * sum(np.sin(2 * np.pi * hz * k * t + k * k) / k**0.7 for k in range(1, n_tones + 1))
    return np.asarray(out + 1e-4 * rng.standard_normal(_LENGTH), np.float32)


def _at_level(sound: Samples, level_db: float) -> Samples:
    """With this RMS where it is loud, full scale = 1."""
    loud = sound[np.abs(sound) > 0.05 * np.abs(sound).max()]
    return np.asarray(sound * (10.0 ** (level_db / 20.0) / np.sqrt(np.mean(loud.astype(np.float64) ** 2))), np.float32)


def _add(whole: Samples, sound: Samples, at: int) -> None:
    begin, first = max(at, 0), max(-at, 0)
    n = min(len(whole) - begin, len(sound) - first)
    if n > 0:
        whole[begin : begin + n] += sound[first : first + n]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("clips", type=Path)
    parser.add_argument("--data", type=Path)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--number", type=int, default=2500)
    parser.add_argument("--seed", type=int, default=19)
    parser.add_argument("--part", default="test")
    o = parser.parse_args()
    mixer = Mixer(load(o.clips), o.data, o.part, o.seed)
    logs = np.empty((o.number, N_FRAMES, energies_of(np.zeros(_LENGTH, np.float32)).shape[1]), np.float16)
    ends, inside = np.full((o.number, 2), NONE), np.zeros(o.number, np.bool_)
    for number in range(o.number):
        heard = mixer.draw()
        logs[number] = np.log(heard.energies)
        ends[number, : len(heard.ends)], inside[number] = heard.ends, heard.inside
        if number % 2000 == 1999:
            print(f"{number + 1} of {o.number}", flush=True)
    np.savez(o.out, logs=logs, ends=ends, inside=inside)


if __name__ == "__main__":
    main()
