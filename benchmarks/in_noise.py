"""The gain of shaping speech for noise: how much more noise it bears at equal loudness, judged by PocketSphinx.

PocketSphinx has the phrasebook's network as its grammar. Random sentences, each voice in turn, are said plainly and as
`hvcpctl say --lombard` says them but at the plain sentence's loudness, in white or pink noise. SNR: loudness of the
speech (LUFS) less the noise's RMS level (dBFS), and 1.5 dB. Prints the share of words wrong, and where that is a half.

    python -m benchmarks.in_noise [--sentences 16] [--seed 707] [--snr 8,6,4,2,0] [--noise white,pink] [--natural]
"""

from __future__ import annotations

import argparse
import random
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.hearing.noises import steady
from benchmarks.judging import PAD_S
from benchmarks.transcripts import edits, margin
from benchmarks.voice import VOCABULARY, Sentence
from hvcpd.evaluation.sphinx import heard, make_decoder
from hvcpd.language.phrasebook import Phrasebook
from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from hvcpd.synthesis.delivery import for_noise
from hvcpd.synthesis.lexicon import Lexicon
from hvcpd.synthesis.loudness import loudness_lufs
from hvcpd.synthesis.speaker import Speaker
from hvcpd.synthesis.voices import VOICES

LOUDNESS_LUFS = -26.0
OFFSET_DB = 1.5
"""LUFS of our speech less its RMS level in dBFS, about."""
WAYS: dict[str, Callable[[Samples], Samples]] = {"plain": lambda sound: sound, "for noise": for_noise}


def wrong_words(
    decoder: Any, said: Sequence[tuple[Sentence, Samples]], colour: str, snr_db: float
) -> tuple[list[int], list[int]]:
    """For each sentence the number of words wrong, and of words."""
    wrong, counts = [], []
    for seed, (phrases, sound) in enumerate(said):
        words = [word for phrase in phrases for word in phrase]
        level = 10.0 ** ((LOUDNESS_LUFS - loudness_lufs(sound)) / 20.0)
        padded = np.pad(sound * level, round(PAD_S * SAMPLE_RATE_HZ))
        noise = 10.0 ** ((LOUDNESS_LUFS + OFFSET_DB - snr_db) / 20.0) * steady(colour, len(padded), seed)
        wrong.append(edits(words, heard(decoder, (padded + noise).astype(np.float32)).split()))
        counts.append(len(words))
    return wrong, counts


def half_db(snrs_db: Sequence[float], shares: Sequence[float]) -> float:
    """The SNR at which half of the words are wrong, interpolated; NaN where that is outside."""
    for (high_db, low), (low_db, high) in zip(
        zip(snrs_db, shares, strict=True), zip(snrs_db[1:], shares[1:], strict=False), strict=False
    ):
        if low <= 0.5 <= high and high > low:
            return low_db + (high - 0.5) / (high - low) * (high_db - low_db)
    return float("nan")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sentences", type=int, default=16)
    parser.add_argument("--seed", type=int, default=707)
    parser.add_argument("--snr", default="8,6,4,2,0", help="dB, from high to low")
    parser.add_argument("--noise", default="white,pink")
    parser.add_argument("--natural", action="store_true")
    options = parser.parse_args()
    lexicon, book, chooser = Lexicon.load(), Phrasebook(VOCABULARY), random.Random(options.seed)
    sentences = [book.phrases(book.sample(chooser)) for _ in range(options.sentences)]
    voices = [replace(voice, natural=options.natural) for voice in VOICES]
    speakers = [Speaker(voice, lexicon) for voice in voices]
    plain = [(said, speakers[number % len(voices)].render(said)) for number, said in enumerate(sentences)]
    snrs_db = [float(each) for each in options.snr.split(",")]
    with tempfile.TemporaryDirectory() as folder:
        decoder = make_decoder(book.graph, Path(folder), lexicon)
    for colour in options.noise.split(","):
        for way, shaped in WAYS.items():
            said = [(phrases, shaped(sound)) for phrases, sound in plain]
            shares, row = [], ""
            for snr_db in snrs_db:
                wrong, counts = wrong_words(decoder, said, colour, snr_db)
                shares.append(sum(wrong) / sum(counts))
                row += f"  {snr_db:g} dB {shares[-1]:.2f} ± {margin(wrong, counts):.2f}"
            print(f"{colour:6}{way:10}{row}   half wrong at {half_db(snrs_db, shares):.1f} dB", flush=True)


if __name__ == "__main__":
    main()
