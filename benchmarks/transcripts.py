"""Transcripts of our voices and of others by a general recogniser that does not know the phrasebook.

Random sentences of the phrasebook are transcribed, or those of a file (--text), a line each. A transcript counts as
understood when, of the sentences said and 600 others of the phrasebook (none with --text), the one nearest to it (edit
distance of the letters over the sentence's length) is the one that was said. Word errors are counted after numbers and
short forms ("I'm") are written out; "for" in place of "four" is an error, for every talker. The recogniser is
PocketSphinx with its own open language model; with --model, Whisper: that needs faster-whisper and a folder with a
CTranslate2 model. hvcpd depends on none of them. With --noise, the speech is also heard in that noise, 10 dB below it.

    python -m benchmarks.transcripts [--model DIR] [--noise FILE.wav] [--snr 10] [--sentences 24] [--seed 101]
        [--text FILE] [--only oak,oak-n,flite] [--wrong]
"""

from __future__ import annotations

import argparse
import random
import re
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.judging import PAD_S, talkers
from benchmarks.voice import VOCABULARY
from hvcpd.control.say.sounding import sayable_phrases
from hvcpd.evaluation.sphinx import heard
from hvcpd.hardware.soundfile import read_wav
from hvcpd.language.phrasebook import Phrasebook
from hvcpd.language.words import spoken_words
from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from hvcpd.synthesis.lexicon import Lexicon

LEVEL_RMS = 0.06
NOISE_RMS = 1e-4
"""Each talker at one level (-24 dBFS) over a very quiet room (-80 dBFS)."""

_SHORT_FORMS = {
    "i'm": "i am", "i'll": "i will", "i've": "i have", "can't": "cannot", "don't": "do not", "didn't": "did not",
    "what's": "what is", "who's": "who is", "meter": "metre", "meters": "metres",
}  # fmt: skip


def edits(a: Sequence[str], b: Sequence[str]) -> int:
    """The edit distance of two sequences."""
    row = list(range(len(b) + 1))
    for i, x in enumerate(a, 1):
        previous, row = row, [i]
        for j, y in enumerate(b, 1):
            row.append(min(previous[j] + 1, row[-1] + 1, previous[j - 1] + (x != y)))
    return row[-1]


def plain(transcript: str) -> list[str]:
    """A transcript as the phrasebook writes words."""
    text = transcript.lower().replace("\u2019", "'")
    for short, long in _SHORT_FORMS.items():
        text = re.sub(rf"\b{short}\b", long, text)
    return list(spoken_words(text))


def on_air(sound: Samples, seed: int, noise: Samples | None = None, snr_db: float = 0.0) -> Samples:
    """The sound at the common level, with silence around it, in a little noise and in any stretch of `noise`, whose
    mean power over all of it is `snr_db` below the speech's."""
    padded = np.pad(sound * (LEVEL_RMS / float(np.sqrt(np.mean(sound**2)))), round(PAD_S / 2 * SAMPLE_RATE_HZ))
    rng = np.random.default_rng(seed)
    out = padded + NOISE_RMS * rng.standard_normal(len(padded))
    if noise is not None:
        level = LEVEL_RMS * 10.0 ** (-snr_db / 20.0) / float(np.sqrt(np.mean(np.square(noise, dtype=np.float64))))
        out += level * np.roll(noise, -int(rng.integers(len(noise))))[: len(padded)]
    return np.asarray(out, np.float32)


def sphinx() -> Callable[[Samples], str]:
    """PocketSphinx with its own model of English, as a function from sound to text. Raises ImportError."""
    from pocketsphinx import Decoder

    return partial(heard, Decoder(loglevel="FATAL"))


def whisper_model(folder: Path) -> Any:
    """A CTranslate2 Whisper model; exits where faster-whisper is missing."""
    try:
        from faster_whisper import WhisperModel
    except ImportError:
        raise SystemExit("skipped: --model needs faster-whisper") from None
    return WhisperModel(str(folder), device="cpu", compute_type="int8")


def whisper(folder: Path) -> Callable[[Samples], str]:
    """A Whisper model as a function from sound to text."""
    model = whisper_model(folder)

    def written(sound: Samples) -> str:
        parts, _ = model.transcribe(
            sound, language="en", beam_size=1, temperature=0.0, condition_on_previous_text=False
        )
        return " ".join(part.text for part in parts)

    return written


def margin(wrong: Sequence[int], words: Sequence[int], rounds: int = 2000) -> float:
    """Half of the 95 % interval of the share of words wrong, over sentences (bootstrap)."""
    picks = np.random.default_rng(1).integers(len(wrong), size=(rounds, len(wrong)))
    shares = np.asarray(wrong)[picks].sum(axis=1) / np.asarray(words)[picks].sum(axis=1)
    low, high = np.quantile(shares, (0.025, 0.975))
    return float(high - low) / 2.0


Phrases = tuple[tuple[str, ...], ...]
"""A sentence: phrases, between which the speaker pauses, of words."""


def of_phrasebook(count: int, others: int, chooser: random.Random) -> tuple[list[Phrases], list[str]]:
    """Random sentences of the phrasebook: `count` different ones, and `others` to choose among."""
    book, said = Phrasebook(VOCABULARY), list[Phrases]()
    while len(said) < count:
        phrases = book.phrases(book.sample(chooser))
        said += [phrases] if phrases not in said else []
    return said, [" ".join(book.render(book.sample(chooser))) for _ in range(others)]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--model", type=Path, help="folder of a CTranslate2 Whisper model (default: PocketSphinx)")
    parser.add_argument("--noise", type=Path, help="a recording, as of a kitchen")
    parser.add_argument("--snr", type=float, default=10.0, help="of the noise, dB (default 10)")
    parser.add_argument("--sentences", type=int, default=24)
    parser.add_argument("--others", type=int, default=600, help="sentences not said, to choose among (default 600)")
    parser.add_argument("--seed", type=int, default=101)
    parser.add_argument("--text", type=Path, help="sentences to say instead, a line each; commas are pauses")
    parser.add_argument("--only", default="", help="names of talkers, separated by commas")
    parser.add_argument("--wrong", action="store_true", help="print what was misheard")
    options = parser.parse_args()
    written = whisper(options.model) if options.model else sphinx()
    noises = {"quiet": None, **({options.noise.stem: read_wav(options.noise)} if options.noise else {})}
    if options.text:
        lines = options.text.read_text(encoding="utf-8").splitlines()
        said, others = [sayable_phrases(line) for line in lines if line.strip()], list[str]()
    else:
        said, others = of_phrasebook(options.sentences, options.others, random.Random(options.seed))
    texts = [" ".join(word for phrase in phrases for word in phrase) for phrases in said]
    candidates = sorted({*texts, *others})
    print(f"{'talker':12}{'noise':>10}{'understood':>12}{'word errors':>24}")
    for name, talker in talkers(Lexicon.load()).items():
        if options.only and name not in options.only.split(","):
            continue
        sounds = [talker.speak(phrases) for phrases in said]
        for kind, noise in noises.items():
            understood, wrong, misheard = 0, [], []
            for seed, (text, sound) in enumerate(zip(texts, sounds, strict=True)):
                words = plain(written(on_air(sound, seed, noise, options.snr)))
                wrong.append(edits(text.split(), words))
                got = " ".join(words)
                nearest = min(candidates, key=lambda candidate: edits(candidate, got) / len(candidate))
                understood += nearest == text
                if wrong[-1]:
                    misheard.append(f"    {' ' if nearest == text else 'X'} {text}\n      -> {got}")
            counts = [len(text.split()) for text in texts]
            errors = f"{sum(wrong)}/{sum(counts)} {sum(wrong) / sum(counts):.3f} ± {margin(wrong, counts):.3f}"
            print(f"{name:12}{kind:>10}{understood:>9}/{len(said):<2}{errors:>24}", flush=True)
            if options.wrong:
                print("\n".join(misheard), flush=True)


if __name__ == "__main__":
    main()
