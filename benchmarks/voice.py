"""Intelligibility of our voices to an independent recogniser, compared with espeak-ng and flite.

PocketSphinx, which knows nothing of our synthesizer, hears random sentences of the phrasebook with the phrasebook's own
network as its grammar, in near silence and in white noise 20 dB below the speech. Prints a table of sentences right
and how fast our voices are. Run it on one core: OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1.

    python -m benchmarks.voice [--sentences 40] [--wrong] [--cost]
"""

from __future__ import annotations

import argparse
import random
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from benchmarks.judging import in_noise, talkers
from hvcpd.evaluation.sphinx import heard, make_decoder
from hvcpd.language.phrasebook import Phrasebook, Vocabulary
from hvcpd.ports import SAMPLE_RATE_HZ
from hvcpd.synthesis.lexicon import Lexicon
from hvcpd.synthesis.natural import recorded
from hvcpd.synthesis.speaker import Speaker
from hvcpd.synthesis.unit_cache import UnitCache
from hvcpd.synthesis.voices import VOICES

VOCABULARY = Vocabulary(
    names=("Rob", "Bot", "Max", "Zoe"),
    teams=("plant",),
    tasks=tuple(f"water the {colour} rose" for colour in ("green", "violet", "indigo", "orange", "yellow", "red")),
    numbers=tuple(range(1, 11)),
)


Sentence = tuple[tuple[str, ...], ...]


def print_speed(lexicon: Lexicon, sentences: Sequence[Sentence]) -> None:
    """Processor time that our voices need: nothing kept from one sentence to the next, and all units on disk."""
    for kind in ("formant", "natural"):
        spent_s = length_s = 0.0
        waits_s = []
        with tempfile.TemporaryDirectory() as folder:
            cache = UnitCache(Path(folder))
            Speaker(replace(VOICES[0], natural=kind == "natural"), lexicon).render((("warm",),))
            for number, phrases in enumerate(sentences):
                voice = replace(VOICES[number % len(VOICES)], natural=kind == "natural")
                recorded.cache_clear()
                started = time.process_time()
                sound = Speaker(voice, lexicon).render(phrases)
                spent_s += time.process_time() - started
                length_s += len(sound) / SAMPLE_RATE_HZ
                Speaker(voice, lexicon, cache).render(phrases)
                again = Speaker(voice, lexicon, cache)
                started = time.process_time()
                again.render(phrases)
                waits_s.append(time.process_time() - started)
        print(f"{kind}: processor time, uncached: {spent_s / length_s:.4f} of real time;", end=" ")
        print(f"until the first sample of a cached sentence: {1e3 * np.median(waits_s):.1f} ms (median),", end=" ")
        print(f"{1e3 * max(waits_s):.1f} ms (longest of {len(waits_s)})")
    said_s = sorted(processor_s(SAY) for _ in range(7))
    print(f"hvcpctl say, words cached: {said_s[0]:.3f} s of processor (least of 7; median {said_s[3]:.3f} s)", end=", ")
    print(f"of that Python {processor_s(('-c', 'pass')):.3f} s, with numpy {processor_s(('-c', 'import numpy')):.3f} s")


SAY = ("-m", "hvcpd.control.cli", "say", "--local", "Hi Rob, I am Bot, water the yellow rose", "-o", "/dev/null")


def processor_s(arguments: Sequence[str]) -> float:
    """Return the processor time that a Python with these arguments takes, from its start to its end."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run([sys.executable, *arguments], check=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sentences", type=int, default=40)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", default="", help="names of talkers, separated by commas")
    parser.add_argument("--wrong", action="store_true", help="print what was misheard")
    parser.add_argument("--cost", action="store_true", help="print what our voices cost, and no more")
    options = parser.parse_args()
    lexicon = Lexicon.load()
    book = Phrasebook(VOCABULARY)
    chooser = random.Random(options.seed)
    sentences = [book.phrases(book.sample(chooser)) for _ in range(options.sentences)]
    print_speed(lexicon, sentences)
    if options.cost:
        return
    conditions: dict[str, float | None] = {"quiet": None, "20 dB": 20.0}
    with tempfile.TemporaryDirectory() as folder:
        decoder = make_decoder(book.graph, Path(folder), lexicon)
    print(f"{'talker':12}" + "".join(f"{name:>8}" for name in conditions) + f"{'length':>9}")
    for name, talker in talkers(lexicon).items():
        if options.only and name not in options.only.split(","):
            continue
        sounds = [talker.speak(phrases) for phrases in sentences]
        length_s = sum(map(len, sounds)) / SAMPLE_RATE_HZ
        row = f"{name:12}"
        misheard = []
        for condition, snr_db in conditions.items():
            right = 0
            for seed, (phrases, sound) in enumerate(zip(sentences, sounds, strict=True)):
                wanted = " ".join(word for phrase in phrases for word in phrase)
                got = heard(decoder, in_noise(sound, snr_db, seed))
                right += got == wanted
                if got != wanted:
                    misheard.append(f"    {condition}: {wanted}\n       -> {got}")
            row += f"{100.0 * right / len(sentences):7.1f}%"
        print(row + f"{length_s / len(sentences):8.2f}s", flush=True)
        if options.wrong:
            print("\n".join(misheard))


if __name__ == "__main__":
    main()
