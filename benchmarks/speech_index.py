"""How much of `hvcpctl say --lombard`'s gain the spectrum can give at all, by the speech intelligibility index.

The index (ANSI S3.5-1997, one-third octave bands, without masking between bands) is a sum over bands of importance
times audibility, which grows by 1/30 a dB of signal to noise from -15 to 15 dB. At equal loudness it is greatest where
a band's power is proportional to its importance over its K-weight, but for bands that are lost, which get none, and
bands that are clear, which need no more. `best` knows the noise: no filter that follows the noise gains more.

    python -m benchmarks.speech_index [--sentences 8] [--seed 707] [--snr 3,0,-3] [--noise white,pink,fan,motor]
"""

from __future__ import annotations

import argparse
import random
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from benchmarks.in_noise import LOUDNESS_LUFS, OFFSET_DB, noise
from benchmarks.voice import VOCABULARY
from hvcpd.language.phrasebook import Phrasebook
from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from hvcpd.synthesis.delivery import for_noise
from hvcpd.synthesis.lexicon import Lexicon
from hvcpd.synthesis.loudness import k_weighting, loudness_lufs
from hvcpd.synthesis.speaker import Speaker
from hvcpd.synthesis.voices import VOICES

Bands = NDArray[np.float64]

CENTRES_HZ = np.array(
    [160, 200, 250, 315, 400, 500, 630, 800, 1000, 1250, 1600, 2000, 2500, 3150, 4000, 5000, 6300, 8000], np.float64
)
"""One-third octaves; of the last we have the lower half."""
IMPORTANCE = np.array(
    [83, 95, 150, 289, 440, 578, 653, 711, 818, 844, 882, 898, 868, 844, 771, 527, 364, 185], np.float64
) / 10_000.0  # fmt: skip
"""ANSI S3.5-1997, table 3, for average speech."""
AUDIBLE_DB = 15.0
"""A band is lost that far below the noise, and clear that far above it."""


def band_powers(sound: Samples | NDArray[np.float64]) -> Bands:
    """Mean power in each band, of a sound, shape (n,)."""
    power = np.abs(np.fft.rfft(np.asarray(sound, np.float64))) ** 2 / len(sound)
    hz = np.fft.rfftfreq(len(sound), 1.0 / SAMPLE_RATE_HZ)
    edges = [(centre * 2.0 ** (-1 / 6), centre * 2.0 ** (1 / 6)) for centre in CENTRES_HZ]
    return np.array([power[(low <= hz) & (hz < high)].sum() for low, high in edges])


def index(speech: Bands, masker: Bands) -> float:
    """The index of speech in noise, from 0 to 1."""
    snr_db = 10.0 * np.log10(np.maximum(speech, 1e-30) / masker)
    return float(np.sum(IMPORTANCE * np.clip((snr_db + AUDIBLE_DB) / (2.0 * AUDIBLE_DB), 0.0, 1.0)))


def best_index(speech: Bands, masker: Bands) -> float:
    """The greatest index of any spectrum as loud as this one, in this noise: bands are given up from the worst on."""
    weights = np.abs(k_weighting(CENTRES_HZ)) ** 2
    enough = masker * 10.0 ** (AUDIBLE_DB / 10.0)
    used, found = np.ones(len(speech), bool), []
    while used.any():
        power, free, left = np.zeros(len(speech)), used.copy(), float(np.sum(weights * speech))
        while free.any():
            share = np.where(free, IMPORTANCE / weights * left / IMPORTANCE[free].sum(), 0.0)
            clear = free & (share > enough)
            power[free] = np.minimum(share, enough)[free]
            if not clear.any():
                break
            left -= float(np.sum(weights[clear] * enough[clear]))
            free &= ~clear
        found.append(index(power, masker))
        used[np.argmin(np.where(used, power / masker, np.inf))] = False
    return max(found)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sentences", type=int, default=8)
    parser.add_argument("--seed", type=int, default=707)
    parser.add_argument("--snr", default="3,0,-3", help="dB, as in `in_noise`")
    parser.add_argument("--noise", default="white,pink,fan,motor")
    options = parser.parse_args()
    lexicon, book, chooser = Lexicon.load(), Phrasebook(VOCABULARY), random.Random(options.seed)
    said = [
        Speaker(VOICES[number % len(VOICES)], lexicon).render(book.phrases(book.sample(chooser)))
        for number in range(options.sentences)
    ]
    print(f"{'noise':8}{'SNR':>6}{'plain':>8}{'for noise':>11}{'best':>7}{'  best needs less SNR by'}")
    for kind in options.noise.split(","):
        for snr_db in map(float, options.snr.split(",")):
            print(f"{kind:8}{snr_db:4g} dB{row(said, kind, snr_db)}", flush=True)


def row(said: Sequence[Samples], kind: str, snr_db: float) -> str:
    """The mean indices of the sentences, plain, shaped and at best; and the gain that shaping leaves, in dB."""
    found = []
    for seed, sound in enumerate(said):
        masker = band_powers(10.0 ** ((LOUDNESS_LUFS + OFFSET_DB - snr_db) / 20.0) * noise(kind, len(sound), seed))
        plain, shaped = (at_level(each) for each in (sound, for_noise(sound)))
        better = index(shaped * 10.0**0.1, masker) - index(shaped, masker)
        best = best_index(shaped, masker)
        found.append((index(plain, masker), index(shaped, masker), best, (best - index(shaped, masker)) / better))
    plain_, shaped_, best_, left_db = np.mean(found, axis=0)
    return f"{plain_:8.2f}{shaped_:11.2f}{best_:7.2f}{left_db:12.1f} dB"


def at_level(sound: Samples) -> Bands:
    """The band powers of a sound at the loudness of all."""
    return band_powers(sound * 10.0 ** ((LOUDNESS_LUFS - loudness_lufs(sound)) / 20.0))


if __name__ == "__main__":
    main()
