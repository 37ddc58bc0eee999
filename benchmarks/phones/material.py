"""Training speech as a microphone records it: in rooms, and in noise.

    python -m benchmarks.phones.material --data DIR --out FILE.npz [--texts 5000] [--takes 2] [--seed 1]
        [--people | --games | --kokoro DIR [--usual] | --ours [--usual]] [--boxes] [--part train|calibration|test]

Synthetic voices say the texts (`texts`, `voices`); with `--ours`, the robots' alone. With `--people`, instead: words of
people, alone and in strings (`recorded`), and noise in which nobody speaks; with `--games`, lines of the games in
DIR/games.
"""

from __future__ import annotations

import argparse
import random
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.hearing.noises import steady
from benchmarks.people_material import DIGITS
from benchmarks.phones.recorded import bare_words, joined, lines_of_games, noises, orders_of_coffee, string_of
from benchmarks.phones.rooms import Rooms, stretched
from benchmarks.phones.texts import Texts, common_words
from benchmarks.phones.voices import calibrators, held_out, ours, resampled, talkers
from hil_fakes.robot_noise import fan, motor
from hvcpd.people.bands import estimated_noise, log_bands
from hvcpd.people.phones import PHONES, mean_normalised
from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from hvcpd.synthesis.lexicon import Lexicon

LEAD_S = 1.0
NOTHING_EVERY = 8
"""One take in so many texts is noise alone."""

ORDERS_TIMES = 3
"""As often as other texts by people is each order of coffee said to train on: they are few."""

Said = tuple[Sequence[str], Samples]


@dataclass(frozen=True, eq=False)
class Take:
    """Logarithms of band energies, shape (frames, N_BANDS), and the phones that are said, as numbers."""

    logs: NDArray[np.float32]
    phones: NDArray[np.int64]
    words: tuple[str, ...]


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

    def __init__(self, seed: int, data: Path, boxes: bool = False) -> None:
        """`boxes`: all of it in simulated rooms."""
        self._rng = np.random.default_rng(seed)
        self._in_rooms = 1.0 if boxes else 0.5
        n = 60 * SAMPLE_RATE_HZ
        self._noises: list[NDArray[np.floating]] = [steady(colour, n, seed) for colour in ("white", "pink")]
        self._noises += [fan(n, self._rng), motor(n, self._rng), *noises(data, "train")]
        self._others = joined(data / "negatives", "train")
        self._rooms = Rooms(data / "rooms", self._rng, boxes)
        self._talk: list[Samples] = []

    def nothing(self) -> NDArray[np.float32]:
        """Likewise, of noise alone."""
        n = round(self._rng.uniform(0.6, 3.0) * SAMPLE_RATE_HZ)
        lead = round(LEAD_S * SAMPLE_RATE_HZ)
        whole = np.asarray(0.1 * self._steady(lead + n), np.float32)
        return mean_normalised(log_bands(whole[lead // 2 :], estimated_noise(whole, lead)))

    def heard(self, sound: Samples) -> NDArray[np.float32]:
        """`mean_normalised` logarithms of the energies of what arrives."""
        rng = self._rng
        sound = self._through(sound)
        self._talk = [*self._talk[-5:], sound]
        sound = np.asarray(0.1 * sound / max(float(np.sqrt(np.mean(sound[np.abs(sound) > 0.01] ** 2))), 1e-3))
        lead, tail = round(LEAD_S * SAMPLE_RATE_HZ), round(rng.uniform(0.05, 0.6) * SAMPLE_RATE_HZ)
        whole = np.pad(sound, (lead, tail))
        snr_db = float(rng.choice((rng.uniform(-3, 12), rng.uniform(8, 30), 60.0), p=(0.4, 0.35, 0.25)))
        whole = whole + 0.1 * 10.0 ** (-snr_db / 20) * self._noise(len(whole))
        if rng.random() < 0.3:
            whole = resampled(resampled(np.asarray(whole, np.float32), 2.0), 0.5)
        begin = lead - round(rng.uniform(0.05, 0.6) * SAMPLE_RATE_HZ)
        whole = np.asarray(whole, np.float32)
        return mean_normalised(log_bands(whole[begin:], estimated_noise(whole, lead)))

    def _through(self, sound: Samples) -> Samples:
        """Another vocal tract and rate, a room, and a microphone."""
        rng = self._rng
        if rng.random() < 0.8:
            sound = resampled(sound, rng.uniform(0.85, 1.18))
        if rng.random() < 0.3:
            sound = stretched(sound, float(2.0 ** rng.uniform(-0.3, 0.4)))
        arrived: NDArray[np.floating] = sound
        tail = self._rooms.draw() if rng.random() < self._in_rooms else None
        if tail is not None:
            n = len(sound) + len(tail)
            size = 1 << (n - 1).bit_length()
            arrived = np.fft.irfft(np.fft.rfft(sound, size) * np.fft.rfft(tail, size), size)[:n]
        spectrum = np.fft.rfft(arrived)
        hz = np.linspace(0, SAMPLE_RATE_HZ / 2, len(spectrum))
        corners = np.array([0, 150, 400, 1000, 2000, 4000, 8000])
        tilt_db = np.interp(hz, corners, np.cumsum(rng.normal(0, 2.5, len(corners))))
        return np.asarray(np.fft.irfft(spectrum * 10.0 ** (tilt_db / 20), len(arrived)), np.float32)

    def _noise(self, n: int) -> NDArray[np.float32]:
        rng = self._rng
        kind = rng.random()
        if self._talk and kind < 0.1:
            babble = sum(np.resize(np.roll(t, rng.integers(len(t))), n) for t in self._talk)
            return _of_power_1(np.asarray(babble))
        if kind < 0.15:
            at = int(rng.integers(len(self._others) - n))
            return _of_power_1(self._others[at : at + n])
        return self._steady(n)

    def _steady(self, n: int) -> NDArray[np.float32]:
        noise = self._noises[self._rng.integers(len(self._noises))]
        return _of_power_1(np.resize(np.roll(noise, -int(self._rng.integers(len(noise)))), n))


def _of_power_1(sound: NDArray[np.floating]) -> NDArray[np.float32]:
    return np.asarray(sound / max(float(np.sqrt(np.mean(sound**2))), 1e-6), np.float32)


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


def by_voices(o: argparse.Namespace, known: Mapping[str, Sequence[str]], lexicon: Lexicon) -> Iterator[Said]:
    """Texts by synthetic voices."""
    texts, chooser = Texts(known, o.seed, o.usual), random.Random(o.seed)
    if o.ours:
        voices = ours(lexicon)
    elif o.part == "train":
        voices = talkers(lexicon, o.kokoro)
    else:
        voices = [(v, 1.0) for v in (calibrators if o.part == "calibration" else held_out)(o.kokoro)]
    for _ in range(o.texts):
        text = texts.draw()
        talker = chooser.choices([v for v, _ in voices], [share for _, share in voices])[0]
        yield text.words, talker(text.phrases, chooser)


def by_people(o: argparse.Namespace) -> Iterator[Said]:
    """Every word of the speakers, and after each a string of words; and sentences, of which nobody knows the
    speaker."""
    chooser = random.Random(o.seed)
    said = bare_words(o.data, o.part, DIGITS)
    for utterance in said:
        string = string_of(said, chooser)
        yield utterance.words, utterance.sound
        yield string.words, string.sound
    for utterance in (ORDERS_TIMES if o.part == "train" else 1) * orders_of_coffee(o.data, o.part):
        yield utterance.words, utterance.sound


def by_actors(o: argparse.Namespace) -> Iterator[Said]:
    """Lines of games, in any order; `--texts` of them at most."""
    lines = lines_of_games(o.data, o.part)
    random.Random(o.seed).shuffle(lines)
    for utterance in lines[: o.texts]:
        yield utterance.words, utterance.sound


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--data", type=Path, required=True, help="recordings of people, rooms and noises")
    parser.add_argument("--texts", type=int, default=5000, help="by synthetic voices or actors")
    parser.add_argument("--takes", type=int, default=2, help="of each text, as it is heard in different places")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--kokoro", type=Path, help="voices, as the npm package kokoro-js has them in package/voices")
    parser.add_argument("--ours", action="store_true", help="the robots' own voices instead, and many more like them")
    parser.add_argument("--usual", action="store_true", help="usual names and tasks, and more of their sentences")
    parser.add_argument("--people", action="store_true", help="by people")
    parser.add_argument("--games", action="store_true", help="by actors (benchmarks.phones.games)")
    parser.add_argument("--boxes", action="store_true", help="all in simulated rooms (needs pyroomacoustics)")
    parser.add_argument(
        "--part", choices=("train", "calibration", "test"), default="train", help="of the voices and people"
    )
    o = parser.parse_args()
    if o.kokoro is None and not (o.people or o.games or o.ours):
        parser.error("texts need the voices of --kokoro: `npm pack kokoro-js`, package/voices")
    lexicon, known = Lexicon.load(), common_words()
    air = Air(o.seed, o.data, o.boxes)
    found = []
    said = by_people(o) if o.people else by_actors(o) if o.games else by_voices(o, known, lexicon)
    for number, (words, sound) in enumerate(said):
        phones = np.array(phones_of(words, lexicon, known))
        for _ in range(o.takes):
            logs = air.heard(sound)
            if len(logs) > 2 * len(phones) + 10 and len(logs) < 1500:
                found.append(Take(logs, phones, tuple(words)))
        if number % NOTHING_EVERY == 0:
            found.append(Take(air.nothing(), np.zeros(0, np.int64), ()))
        if number % 200 == 199:
            print(f"{number + 1} texts, {sum(len(t.logs) for t in found) / 360000:.2f} h", flush=True)
    save(o.out, found)


if __name__ == "__main__":
    main()
