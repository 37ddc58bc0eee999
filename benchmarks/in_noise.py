"""The gain of shaping speech for noise: how much more noise it bears at equal loudness, judged by a recogniser.

PocketSphinx has the phrasebook's network as its grammar; with --model, Whisper knows nothing of it (see `transcripts`).
Random sentences, each voice in turn, are said plainly and as `hvcpctl say --lombard` says them but at the plain
sentence's loudness, in white or pink noise, a fan's or wheel motors'. SNR: loudness of the speech (LUFS) less the
noise's RMS level (dBFS), and 1.5 dB. Prints the share of words wrong, where that is a half, and the gain in dB with its
95 % interval over sentences.

    python -m benchmarks.in_noise [--model DIR] [--sentences 16] [--seed 707] [--snr 8,6,4,2,0] [--noise white,pink]
        [--natural]
"""

from __future__ import annotations

import argparse
import random
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks.hearing.noises import steady
from benchmarks.judging import PAD_S
from benchmarks.transcripts import edits, margin, plain, whisper
from benchmarks.voice import VOCABULARY, Sentence
from hil_fakes.robot_noise import fan, motor, unit
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
ROUNDS = 2000
Counts = NDArray[np.int64]
Wrong = NDArray[np.int64]
Judge = Callable[[Samples], list[str]]
"""The words that a recogniser writes."""
MACHINES = {"fan": fan, "motor": motor}
WAYS: dict[str, Callable[[Samples], Samples]] = {"plain": lambda sound: sound, "for noise": for_noise}


def noise(kind: str, n: int, seed: int) -> NDArray[np.float64]:
    """`n` samples of RMS 1."""
    if kind in MACHINES:
        return unit(MACHINES[kind](n, np.random.default_rng(seed)))
    return steady(kind, n, seed)


def wrong_words(judge: Judge, said: Sequence[tuple[Sentence, Samples]], kind: str, snr_db: float) -> list[int]:
    """For each sentence the number of words wrong, at most all of them."""
    wrong = []
    for seed, (phrases, sound) in enumerate(said):
        words = [word for phrase in phrases for word in phrase]
        level = 10.0 ** ((LOUDNESS_LUFS - loudness_lufs(sound)) / 20.0)
        padded = np.pad(sound * level, round(PAD_S * SAMPLE_RATE_HZ))
        masker = 10.0 ** ((LOUDNESS_LUFS + OFFSET_DB - snr_db) / 20.0) * noise(kind, len(padded), seed)
        wrong.append(min(edits(words, judge((padded + masker).astype(np.float32))), len(words)))
    return wrong


def open_judge(folder: Path) -> Judge:
    """Whisper, which knows nothing of the phrasebook."""
    write = whisper(folder)
    return lambda sound: plain(write(sound))


def grammar_judge(book: Phrasebook, lexicon: Lexicon) -> Judge:
    """PocketSphinx with the phrasebook's network as its grammar."""
    with tempfile.TemporaryDirectory() as folder:
        decoder = make_decoder(book.graph, Path(folder), lexicon)
    return lambda sound: heard(decoder, sound).split()


def half_db(snrs_db: Sequence[float], wrong: Wrong, counts: Counts) -> float:
    """The SNR at which half of the words are wrong, interpolated; NaN where that is outside.

    `wrong`: at each SNR, from high to low, of each sentence; `counts`: the sentences' words.
    """
    shares = wrong.sum(axis=1) / counts.sum()
    for (high_db, low), (low_db, high) in pairwise(zip(snrs_db, shares, strict=True)):
        if low <= 0.5 <= high and high > low:
            return float(low_db + (high - 0.5) / (high - low) * (high_db - low_db))
    return float("nan")


def gain(snrs_db: Sequence[float], before: Wrong, after: Wrong, counts: Counts) -> str:
    """How much lower the SNR may be, and the 95 % interval: sentences are drawn again, each with both its ways."""

    def gain_db(picked: NDArray[np.intp]) -> float:
        words = counts[picked]
        return half_db(snrs_db, before[:, picked], words) - half_db(snrs_db, after[:, picked], words)

    rng, every = np.random.default_rng(1), np.arange(len(counts))
    drawn = [gain_db(rng.choice(every, len(every))) for _ in range(ROUNDS)]
    low, high = np.nanquantile(drawn, (0.025, 0.975))
    inside = np.mean(np.isfinite(drawn))
    return f"{gain_db(every):.1f} dB ({low:.1f} to {high:.1f}; {inside:.0%} of the draws lie within these SNRs)"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--model", type=Path, help="folder of a CTranslate2 Whisper model (default: PocketSphinx)")
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
    unshaped = [(said, speakers[number % len(voices)].render(said)) for number, said in enumerate(sentences)]
    snrs_db = [float(each) for each in options.snr.split(",")]
    judge = open_judge(options.model) if options.model else grammar_judge(book, lexicon)
    counts = np.array([sum(map(len, phrases)) for phrases in sentences])
    for kind in options.noise.split(","):
        found: list[Wrong] = []
        for way, shaped in WAYS.items():
            said = [(phrases, shaped(sound)) for phrases, sound in unshaped]
            wrong = np.array([wrong_words(judge, said, kind, snr_db) for snr_db in snrs_db])
            row = "".join(
                f"  {snr_db:g} dB {sum(each) / sum(counts):.2f} ± {margin(each.tolist(), counts.tolist()):.2f}"
                for snr_db, each in zip(snrs_db, wrong, strict=True)
            )
            print(f"{kind:6}{way:10}{row}   half wrong at {half_db(snrs_db, wrong, counts):.1f} dB", flush=True)
            found.append(wrong)
        print(f"{kind:6}gain {gain(snrs_db, found[0], found[1], counts)}", flush=True)


if __name__ == "__main__":
    main()
