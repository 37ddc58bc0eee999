"""Synthetic speech to train on, as it is heard: in rooms, through microphones, in noise.

python -m benchmarks.phones.material --out FILE.npz [--texts 24000] [--takes 2] [--seed 1] [--calibration]
"""

from __future__ import annotations

import argparse
import random
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.hearing.noises import steady
from benchmarks.phones.texts import Texts
from benchmarks.phones.voices import calibrators, resampled, talkers
from hil_fakes.robot_noise import fan, motor
from hvcpd.people.bands import logs_of, noise_of
from hvcpd.people.phones import PHONES, centred
from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from hvcpd.synthesis.lexicon import Lexicon

LEAD_S = 1.0


@dataclass(frozen=True, eq=False)
class Take:
    """Logarithms of band energies, shape (frames, N_BANDS), and the phones that are said, as numbers."""

    logs: NDArray[np.float32]
    phones: NDArray[np.int64]
    words: tuple[str, ...]


def common_words() -> dict[str, tuple[str, ...]]:
    """Phones of the words in PocketSphinx's dictionary, without stress."""
    from pocketsphinx import get_model_path

    found: dict[str, tuple[str, ...]] = {}
    for line in Path(get_model_path("en-us/cmudict-en-us.dict")).read_text().splitlines():
        word, *phones = line.split()
        if "(" not in word:
            found[word] = tuple(phones)
    return found


def phones_of(words: Sequence[str], lexicon: Lexicon, known: Mapping[str, Sequence[str]]) -> list[int]:
    """Numbers of the phones: of our lexicon if it lists the word, else of the dictionary."""
    said: list[str] = []
    for word in words:
        if lexicon.listed(word) or word not in known:
            said += lexicon.sounds(word)[0]
        else:
            said += known[word]
    return [PHONES.index(phone) for phone in said]


class Air:
    """What happens to speech on its way."""

    def __init__(self, seed: int) -> None:
        self._rng = np.random.default_rng(seed)
        n = 60 * SAMPLE_RATE_HZ
        self._colours = {colour: steady(colour, n, seed) for colour in ("white", "pink")}
        self._colours |= {"fan": fan(n, self._rng), "motor": motor(n, self._rng)}
        self._talk: list[Samples] = []

    def heard(self, sound: Samples) -> NDArray[np.float32]:
        """`centred` logarithms of the energies of what arrives."""
        rng = self._rng
        sound = self._through(sound)
        self._talk = [*self._talk[-5:], sound]
        sound = np.asarray(0.1 * sound / max(float(np.sqrt(np.mean(sound[np.abs(sound) > 0.01] ** 2))), 1e-3))
        lead, tail = round(LEAD_S * SAMPLE_RATE_HZ), round(rng.uniform(0.05, 0.6) * SAMPLE_RATE_HZ)
        whole = np.pad(sound, (lead, tail))
        snr_db = float(rng.choice((rng.uniform(2, 15), rng.uniform(10, 30), 60.0), p=(0.3, 0.4, 0.3)))
        whole = whole + 0.1 * 10.0 ** (-snr_db / 20) * self._noise(len(whole))
        if rng.random() < 0.3:
            whole = resampled(resampled(np.asarray(whole, np.float32), 2.0), 0.5)
        begin = lead - round(rng.uniform(0.05, 0.6) * SAMPLE_RATE_HZ)
        whole = np.asarray(whole, np.float32)
        return centred(logs_of(whole[begin:], noise_of(whole, lead)))

    def _through(self, sound: Samples) -> Samples:
        """Another vocal tract and rate, a room, and a microphone."""
        rng = self._rng
        if rng.random() < 0.8:
            sound = resampled(sound, rng.uniform(0.85, 1.18))
        if rng.random() < 0.4:
            rt60 = rng.uniform(0.1, 0.5)
            tail = rng.standard_normal(round(rt60 * SAMPLE_RATE_HZ)) * rng.uniform(0.02, 0.12)
            tail *= 10.0 ** (-3.0 * np.arange(len(tail)) / len(tail))
            tail[0] = 1.0
            n = len(sound) + len(tail)
            size = 1 << (n - 1).bit_length()
            sound = np.fft.irfft(np.fft.rfft(sound, size) * np.fft.rfft(tail, size), size)[:n]
        spectrum = np.fft.rfft(sound)
        hz = np.linspace(0, SAMPLE_RATE_HZ / 2, len(spectrum))
        corners = np.array([0, 150, 400, 1000, 2000, 4000, 8000])
        tilt_db = np.interp(hz, corners, np.cumsum(rng.normal(0, 2.5, len(corners))))
        return np.asarray(np.fft.irfft(spectrum * 10.0 ** (tilt_db / 20), len(sound)), np.float32)

    def _noise(self, n: int) -> NDArray[np.float32]:
        rng = self._rng
        if self._talk and rng.random() < 0.15:
            babble = sum(np.resize(np.roll(t, rng.integers(len(t))), n) for t in self._talk)
            out = np.asarray(babble, np.float32)
        else:
            noise = self._colours[str(rng.choice(sorted(self._colours)))]
            at = int(rng.integers(len(noise) - n))
            out = noise[at : at + n]
        return np.asarray(out / max(float(np.sqrt(np.mean(out**2))), 1e-6), np.float32)


def save(path: Path, takes: Sequence[Take]) -> None:
    """As arrays one after the other."""
    arrays: dict[str, Any] = {
        "logs": np.concatenate([t.logs for t in takes]).astype(np.float16),
        "phones": np.concatenate([t.phones for t in takes]).astype(np.uint8),
        "n_frames": np.array([len(t.logs) for t in takes]),
        "n_phones": np.array([len(t.phones) for t in takes]),
        "words": np.array([" ".join(t.words) for t in takes]),
    }
    np.savez(path, **arrays)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--texts", type=int, default=24000)
    parser.add_argument("--takes", type=int, default=2, help="of each text, as it is heard in different places")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--calibration", action="store_true", help="by the voices that are kept for it")
    o = parser.parse_args()
    lexicon, known = Lexicon.load(), common_words()
    texts, air, chooser = Texts(known, o.seed), Air(o.seed), random.Random(o.seed)
    voices = [(v, 1.0) for v in calibrators()] if o.calibration else talkers(lexicon)
    found = []
    for number in range(o.texts):
        text = texts.draw()
        talker = chooser.choices([v for v, _ in voices], [share for _, share in voices])[0]
        sound = talker(text.phrases, chooser)
        phones = np.array(phones_of(text.words, lexicon, known))
        for _ in range(o.takes):
            logs = air.heard(sound)
            if len(logs) > 2 * len(phones) + 10 and len(logs) < 1500:
                found.append(Take(logs, phones, text.words))
        if number % 200 == 199:
            print(f"{number + 1} texts, {sum(len(t.logs) for t in found) / 360000:.2f} h", flush=True)
    save(o.out, found)


if __name__ == "__main__":
    main()
