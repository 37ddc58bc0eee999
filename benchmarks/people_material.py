"""The sounds of `benchmarks.people`: other synthesizers' sentences and words, and people's recordings."""

from __future__ import annotations

import random
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.hearing.noises import steady
from benchmarks.judging import Phrases, program
from hvcpd.hardware.soundfile import read_wav
from hvcpd.language.graph import Arc, WordGraph
from hvcpd.language.phrasebook import Phrasebook
from hvcpd.people.enrolled import Person
from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from hvcpd.recognition.frontend import ENERGY_FLOOR
from hvcpd.recognition.stages import Segment
from hvcpd.recognition.templates import trimmed_energies

SPEECH_RMS = 0.05
QUIET_RMS = 10.0 ** (-75 / 20)
"""A quiet room's noise, full scale = 1."""
LEAD_S, GAP_S = 3.0, 1.6
"""Of noise before the first sentence, and between two."""
RATES_WPM = (150, 175, 200)
"""The takes of a synthetic voice that enrols, words a minute: it says a word the same way every time."""
CALLS = ("stop", "rob stop", "all stop")
FIRST_WORDS = ("hi all", "who is here", "what is left", "move forward", "rob what are you doing", "bot come back")
"""First sentences of people who do not know the phrasebook."""


@dataclass(frozen=True)
class Foreigner:
    """A synthesizer's voice that no robot has; `words` says single words at its usual and at other rates."""

    name: str
    speak: Mapping[int, tuple[str, ...]]
    """The command for each rate, in words a minute; with {text} and {wav}."""

    def say(self, phrases: Phrases, rate: int = RATES_WPM[1]) -> Samples:
        """Phrases as sound."""
        return program(self.speak[rate])(phrases)


def foreigners() -> list[Foreigner]:
    """Five voices of espeak-ng, four of flite, one of pico, as far as installed; a line tells which are not."""
    found = []
    commands: dict[int, tuple[str, ...]]
    for voice in ("en-us", "en-gb", "en-gb-scotland", "en-us+f3", "en-gb+m3"):
        commands = {r: ("espeak-ng", "-v", voice, "-s", str(r), "-w", "{wav}", "{text}") for r in RATES_WPM}
        found.append(Foreigner(f"espeak-ng {voice}", commands))
    for voice in ("slt", "rms", "awb", "kal16"):
        stretch = {r: f"duration_stretch={RATES_WPM[1] / r:.2f}" for r in RATES_WPM}
        commands = {
            r: ("flite", "-voice", voice, "--setf", s, "-t", "{text}", "-o", "{wav}") for r, s in stretch.items()
        }
        found.append(Foreigner(f"flite {voice}", commands))
    commands = {
        r: (
            "pico2wave",
            "-l",
            "en-US",
            "-w",
            "{wav}",
            f'<speed level="{round(100 * r / RATES_WPM[1])}">{{text}}</speed>',
        )
        for r in RATES_WPM
    }
    found.append(Foreigner("pico", commands))
    for name in sorted({f.speak[RATES_WPM[0]][0] for f in found}):
        if shutil.which(name) is None:
            print(f"{name}: skipped, not installed")
    return [f for f in found if shutil.which(f.speak[RATES_WPM[0]][0])]


@dataclass(frozen=True)
class Said:
    """Words, and the samples of the stream that they take."""

    words: tuple[str, ...]
    start: int
    end: int


def sentences(book: Phrasebook, n: int, seed: int) -> list[Sequence[Sequence[str]]]:
    """Random sentences of the phrasebook, in phrases."""
    chooser = random.Random(seed)
    return [book.phrases(book.sample(chooser)) for _ in range(n)]


def levelled(sound: Samples, rms: float = SPEECH_RMS) -> Samples:
    """The sound with this RMS where it is loud."""
    sound = sound - sound.mean()
    loud = sound[np.abs(sound) > 0.1 * np.abs(sound).max()]
    return np.asarray(sound * (rms / np.sqrt(np.mean(loud.astype(np.float64) ** 2))), np.float32)


def stream(
    sounds: Sequence[tuple[tuple[str, ...], Samples]], snr_db: float | None, colour: str, seed: int
) -> tuple[Samples, list[Said]]:
    """One after the other in noise that is `snr_db` below the speech; None: in a quiet room."""
    gap = np.zeros(round(GAP_S * SAMPLE_RATE_HZ), np.float32)
    parts, said, at = [np.zeros(round(LEAD_S * SAMPLE_RATE_HZ), np.float32)], [], round(LEAD_S * SAMPLE_RATE_HZ)
    for words, sound in sounds:
        said.append(Said(words, at, at + len(sound)))
        parts += [levelled(sound), gap]
        at += len(sound) + len(gap)
    clean = np.concatenate(parts)
    rms = QUIET_RMS if snr_db is None else SPEECH_RMS * 10.0 ** (-snr_db / 20.0)
    return np.asarray(clean + rms * steady(colour, len(clean), seed), np.float32), said


def alone(sound: Samples, snr_db: float | None, colour: str, seed: int) -> Segment:
    """A sound in noise as in `stream`, which is told where it is."""
    heard, [said] = stream([((), sound)], snr_db, colour, seed)
    return Segment(heard, said.start, said.start, said.end)


def enrol(name: str, takes: Mapping[str, Sequence[Samples]]) -> Person:
    """A person with these recordings of words, without checks."""
    return Person(name, {w: [np.maximum(trimmed_energies(t), ENERGY_FLOOR) for t in ts] for w, ts in takes.items()})


def words_of(foreigner: Foreigner, words: Sequence[str]) -> dict[str, list[Samples]]:
    """Single words at all rates."""
    return {word: [levelled(foreigner.say([[word]], rate)) for rate in RATES_WPM] for word in words}


DIGITS = tuple("zero one two three four five six seven eight nine".split())
ONE_DIGIT = WordGraph(2, tuple(Arc(0, 1, word) for word in DIGITS), 0, frozenset((1,)), frozenset())


def digits(folder: Path) -> dict[tuple[str, int], list[Samples]]:
    """Recordings named DIGIT_SPEAKER_TAKE.wav: for each speaker and digit, its takes in order."""
    found: dict[tuple[str, int], dict[int, Samples]] = {}
    for path in sorted(folder.glob("[0-9]_*_*.wav")):
        digit, speaker, take = path.stem.split("_")
        found.setdefault((speaker, int(digit)), {})[int(take)] = np.asarray(read_wav(path), np.float32)
    return {key: [takes[n] for n in sorted(takes)] for key, takes in found.items()}
