"""How often words that sound like the keyword are taken for it: by robots in their eight voices, formant and natural,
and by synthesizers that the net has not learned from.

    nice python -m benchmarks.keyword.near [--net stop.npz ...] [--part test] [--words 40] [--seed 0]
        [--sources formant,natural,espeak-ng,flite] [--ear] [--text "top,shop,i have stopped"]

Nothing but the nets listen, all to the same words, in a quiet room, at -45 to -25 dBFS; --ear: also whole ears that
understand strangers. `--part test`: words that no voice said in the training, and none with the keyword in it
("stopper"); --text: these instead. Halts and latches are as in `benchmarks.keyword.curve`, at the thresholds of the
robot; intervals are Wilson's, 95 %.
"""

from __future__ import annotations

import argparse
import random
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks.keyword.curve import called
from benchmarks.keyword.texts import alike, includes, near_part_of
from benchmarks.people_material import RATES_WPM, foreigners
from benchmarks.phones.texts import common_words
from benchmarks.stop import SPEECH_DBFS, Listener, Stage, at_level, room
from benchmarks.stop_callers import HELD_OUT_VOICES
from hvcpd.evaluation.statistics import wilson
from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from hvcpd.recognition.keyword.net import HOLD_PROBABILITY, WEIGHTS, Weights
from hvcpd.recognition.keyword.verification import ACCEPT_PROBABILITY
from hvcpd.synthesis.lexicon import Lexicon
from hvcpd.synthesis.speaker import Speaker
from hvcpd.synthesis.voices import VOICES

ROBOTS = ("formant", "natural")
EAR_S = 4
"""A whole ear listens for so long to a word, which begins after 1 s."""
CURVES = {"halt": HOLD_PROBABILITY, "latch": ACCEPT_PROBABILITY}


def said(source: str, texts: Sequence[str], chooser: random.Random) -> Iterator[Samples]:
    """Each text in each of the robots' voices, or by one of that synthesizer's."""
    if source in ROBOTS:
        lexicon = Lexicon.load()
        for voice in VOICES:
            speaker = Speaker(replace(voice, natural=source == "natural"), lexicon)
            yield from (speaker.render([text.split()]) for text in texts)
        return
    voices = [f for f in foreigners() if f.name.startswith(source) and f.name.startswith(HELD_OUT_VOICES)]
    yield from (chooser.choice(voices).say([text.split()], chooser.choice(RATES_WPM)) for text in texts)


def report(chances: NDArray[np.float64], said_texts: Sequence[str], names: Sequence[str], source: str) -> None:
    """Print a line for each curve and net; `chances`: shape (words, nets, curves)."""
    for curve, (what, threshold) in enumerate(CURVES.items()):
        taken = chances[:, :, curve] >= threshold
        for net, name in enumerate(names):
            n, (low, high) = int(taken[:, net].sum()), wilson(int(taken[:, net].sum()), len(taken))
            alone = int((taken[:, net] & ~np.delete(taken, net, axis=1).any(axis=1)).sum())
            line = f"{what:6}{source:10}{name:12} {n} of {len(taken)} ({100 * low:.0f} to {100 * high:.0f} %)"
            often = Counter(text for text, is_taken in zip(said_texts, taken[:, net], strict=True) if is_taken)
            most = "; most often: " + ", ".join(f"{text} {k}" for text, k in often.most_common(5)) if often else ""
            print(line + (f", {alone} for this net alone" if len(names) > 1 else "") + most, flush=True)


def whole(sounds: Sequence[Samples], texts: Sequence[str]) -> str:
    """How often a whole ear is stopped for good by words said alone, and by which most often."""
    stage, stopped = Stage(("Rob", "Bot")), Counter[str]()
    for k, sound in enumerate(sounds):
        listener = Listener(stage.recogniser())
        heard = room(EAR_S * SAMPLE_RATE_HZ + len(sound), k)
        heard[SAMPLE_RATE_HZ : SAMPLE_RATE_HZ + len(sound)] += at_level(sound, SPEECH_DBFS)
        listener.listen(heard)
        stopped[texts[k % len(texts)]] += bool(listener.stopped_s)
    n, often = stopped.total(), ", ".join(f"{text} {k}" for text, k in (+stopped).most_common(5))
    low, high = wilson(n, len(sounds))
    return f"{n} of {len(sounds)} stop it ({100 * low:.0f} to {100 * high:.0f} %); most often: {often or 'none'}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--net", type=Path, nargs="+", default=[WEIGHTS])
    parser.add_argument("--part", default="test")
    parser.add_argument("--words", type=int, default=40)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--sources", default=",".join((*ROBOTS, "espeak-ng", "flite")))
    parser.add_argument("--ear", action="store_true")
    parser.add_argument("--text", help="words or phrases, separated by commas")
    o = parser.parse_args()
    nets, chooser = [Weights.load(path) for path in o.net], random.Random(o.seed)
    known = common_words()
    near = sorted({" ".join(words) for words in alike(known)})
    near = [text for text in near if near_part_of(text) == o.part and not includes(text, known)]
    texts = o.text.split(",") if o.text else near
    texts = chooser.sample(texts, min(o.words, len(texts)))
    for source in o.sources.split(","):
        sounds, heard = [], []
        for k, sound in enumerate(said(source, texts, chooser)):
            sounds.append(sound)
            heard.append(called(nets, sound, None, chooser.uniform(-10.0, 10.0), o.seed + k))
        if o.ear:
            print(f"whole ear {source}: {whole(sounds, texts)}", flush=True)
        report(np.array(heard), texts * (len(heard) // len(texts)), [path.stem for path in o.net], source)


if __name__ == "__main__":
    main()
