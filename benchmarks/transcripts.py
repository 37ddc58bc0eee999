"""What a general neural recogniser, told nothing of the phrasebook, writes down of our voices and of others.

Random sentences of the phrasebook are transcribed; a transcript counts as understood when, of the sentences said and
600 others of the phrasebook, the one nearest to it (edit distance of the letters over the sentence's length) is the one
that was said. Word errors are counted after numbers and short forms ("I'm") are written out; "for" in place of "four"
is an error, for every talker. Needs faster-whisper and a folder with a CTranslate2 Whisper model; hvcpd depends on
neither.

    python -m benchmarks.transcripts --model DIR [--sentences 24] [--seed 101] [--only oak,flite] [--wrong]
"""

from __future__ import annotations

import argparse
import random
import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from benchmarks.judging import PAD_S, talkers
from benchmarks.voice import VOCABULARY
from hvcpd.language.phrasebook import Phrasebook
from hvcpd.language.words import spoken_words
from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from hvcpd.synthesis.lexicon import Lexicon

N_OTHERS = 600
"""Sentences that were not said, among which a transcript's nearest is looked for."""

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


def on_air(sound: Samples, seed: int) -> Samples:
    """The sound at the common level, with silence around it, in a little noise."""
    padded = np.pad(sound * (LEVEL_RMS / float(np.sqrt(np.mean(sound**2)))), round(PAD_S / 2 * SAMPLE_RATE_HZ))
    return (padded + NOISE_RMS * np.random.default_rng(seed).standard_normal(len(padded))).astype(np.float32)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--model", type=Path, required=True, help="folder of a CTranslate2 Whisper model")
    parser.add_argument("--sentences", type=int, default=24)
    parser.add_argument("--seed", type=int, default=101)
    parser.add_argument("--only", default="", help="names of talkers, separated by commas")
    parser.add_argument("--wrong", action="store_true", help="print what was misheard")
    options = parser.parse_args()
    try:
        from faster_whisper import WhisperModel
    except ImportError:
        raise SystemExit("skipped: this benchmark needs faster-whisper") from None
    listener = WhisperModel(str(options.model), device="cpu", compute_type="int8")
    book, chooser = Phrasebook(VOCABULARY), random.Random(options.seed)
    said: list[tuple[tuple[str, ...], ...]] = []
    while len(said) < options.sentences:
        phrases = book.phrases(book.sample(chooser))
        said += [phrases] if phrases not in said else []
    texts = [" ".join(word for phrase in phrases for word in phrase) for phrases in said]
    others = [" ".join(book.render(book.sample(chooser))) for _ in range(N_OTHERS)]
    candidates = sorted({*texts, *others})
    print(f"{'talker':12}{'understood':>12}{'word errors':>13}")
    for name, talker in talkers(Lexicon.load()).items():
        if options.only and name not in options.only.split(","):
            continue
        understood = wrong = total = 0
        misheard = []
        for seed, (text, phrases) in enumerate(zip(texts, said, strict=True)):
            sound = on_air(talker.speak(phrases), seed)
            parts, _ = listener.transcribe(
                sound, language="en", beam_size=1, temperature=0.0, condition_on_previous_text=False
            )
            words = plain(" ".join(part.text for part in parts))
            got = " ".join(words)
            wrong += edits(text.split(), words)
            total += len(text.split())
            nearest = min(candidates, key=lambda candidate: edits(candidate, got) / len(candidate))
            understood += nearest == text
            if words != text.split():
                misheard.append(f"    {' ' if nearest == text else 'X'} {text}\n      -> {got}")
        print(f"{name:12}{understood / len(said):12.3f}{wrong / total:13.3f}", flush=True)
        if options.wrong:
            print("\n".join(misheard), flush=True)


if __name__ == "__main__":
    main()
