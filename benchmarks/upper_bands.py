"""Makes `hvcpd/people/upper_bands.npz`, which predicts the mel bands of speech above 4 kHz from those below.

    python -m benchmarks.upper_bands [--sentences 12] [--seed 1] [--out hvcpd/people/upper_bands.npz]

Ridge regression of the logarithms of PocketSphinx's upper mel bands on the lower ones, over loud frames of sentences
by our own synthesizer's voices and, where it is installed, by voices of espeak-ng that no other benchmark listens to.
Prints how much of each upper band's variance is explained. Nothing is learned from recordings of people.
"""

from __future__ import annotations

import argparse
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks.judging import Phrases, program
from benchmarks.people_material import levelled, sentences
from hvcpd.assembly.sound import make_phrasebook, make_sound, user_cache_folder
from hvcpd.config.settings import DEFAULT_TEAMS
from hvcpd.config.task_file import load_tasks
from hvcpd.config.tasks import default_tasks_path
from hvcpd.people.bands import FIRST_UPPER_BAND, LEAST, mel_bands, noise_subtracted
from hvcpd.ports import Samples
from hvcpd.synthesis.speaker import Speaker
from hvcpd.synthesis.voices import VOICES

OTHERS = ("en-029", "en-gb-x-rp", "en-us-nyc", "en-gb-x-gbclan+f2", "en-us+m7", "en-gb+f5", "en-us+f1", "en-gb+m1")
LOUD_DB = 35.0
"""Frames that are no further below a sentence's loudest one count."""
RIDGE = 1.0
"""Added to the bands' sums of squares, against chance."""

Floats = NDArray[np.float64]


def spoken(n: int, seed: int) -> Iterator[Samples]:
    """Sentences of the phrasebook by all voices."""
    sound = make_sound(None, user_cache_folder())
    book = make_phrasebook(("Rob", "Bot", "Anna"), DEFAULT_TEAMS, load_tasks(default_tasks_path()))
    voices: list[Callable[[Phrases], Samples]] = [Speaker(voice, sound.lexicon, sound.cache).render for voice in VOICES]
    if shutil.which("espeak-ng") and shutil.which("sox"):
        voices += [program(("espeak-ng", "-v", voice, "-w", "{wav}", "{text}")) for voice in OTHERS]
    else:
        print("espeak-ng's voices: skipped, needs the programs espeak-ng and sox")
    for number, speak in enumerate(voices):
        for phrases in sentences(book, n, seed + number):
            yield levelled(speak(phrases))


def log_bands(sound: Samples) -> Floats:
    """Of the loud frames of one sentence, shape (n, N_BANDS)."""
    bands = mel_bands(sound)
    power = bands.sum(axis=1)
    loud = power > power.max() * 10.0 ** (-LOUD_DB / 10.0)
    return np.asarray(np.log(noise_subtracted(bands, np.zeros(bands.shape[1])) + LEAST)[loud])


def regression(known: Floats, wanted: Floats) -> tuple[Floats, Floats]:
    """By ridge regression: the weights of what is known, the constants first, and what they tell of what is wanted."""
    known = np.pad(known, ((0, 0), (1, 0)), constant_values=1.0)
    ridge = RIDGE * np.eye(known.shape[1])
    weights = np.asarray(np.linalg.solve(known.T @ known + ridge, known.T @ wanted), np.float64)
    return weights, np.asarray(known @ weights)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sentences", type=int, default=12, help="of each voice")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--out", type=Path, default=Path("hvcpd/people/upper_bands.npz"))
    o = parser.parse_args()
    logs = np.concatenate([log_bands(sound) for sound in spoken(o.sentences, o.seed)])
    upper = logs[:, FIRST_UPPER_BAND:]
    weights, told = regression(logs[:, :FIRST_UPPER_BAND], upper)
    explained = 1.0 - (upper - told).var(axis=0) / upper.var(axis=0)
    np.savez(o.out, weights=weights.astype(np.float32))
    print(f"{len(logs)} frames, explained: {', '.join(f'{part:.0%}' for part in explained)}; wrote {o.out}")


if __name__ == "__main__":
    main()
