"""How sure the recogniser may be: whether sentences are right, against how they fared, and the curve that fits it.

Random sentences of two teams in white and pink noise; what the recogniser found, before it decides. Prints how many of
the sentences of each confidence were right, and the constants for `ConfidenceCurve`.

    python -m benchmarks.confidence [--sentences 40] [--snr 20,0,-5,-8,-10] [--seed 21]
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from benchmarks.hearing import BLOCK, Spoken, add_noise, make_stream
from hvcpd.assembly import DEFAULT_TEAMS, make_phrasebook, make_sound, templates, user_cache_folder
from hvcpd.config.task_file import load_tasks
from hvcpd.config.tasks import default_tasks_path
from hvcpd.ports import Samples
from hvcpd.recognition.events import Recognised
from hvcpd.recognition.frontend import HOP_SAMPLES
from hvcpd.recognition.recogniser import ConfidenceCurve, Recogniser
from hvcpd.recognition.spotter import Sentence
from hvcpd.synthesis.speaker import Speaker
from hvcpd.synthesis.voices import voice_for

TEAMS = (("Rob", "Bot"), ("Max", "Ann"))
STEPS = 4000
RATE = 0.5


class Watched(Recogniser):
    """Keeps every sentence that it judges."""

    def __init__(self, *args: object) -> None:
        super().__init__(*args)  # type: ignore[arg-type]
        self.judged: list[tuple[Sentence, tuple[str, ...]]] = []

    def _judge(self, sentence: Sentence) -> Recognised | None:
        words = tuple(self._spotter.word_of(step) for step in sentence.steps)
        self.judged.append((sentence, words))
        return super()._judge(sentence)


def row(sentence: Sentence) -> tuple[float, float, float]:
    """Margin, deficit and gain, as `ConfidenceCurve` takes them."""
    frames = sentence.steps[-1].end_frame - sentence.steps[0].start_frame
    margin = min(min(step.margin for step in sentence.steps), ConfidenceCurve().most_margin)
    return margin, max(sentence.deficits), -sentence.cost / max(frames, 1)


def is_right(sentence: Sentence, words: tuple[str, ...], spoken: Sequence[Spoken]) -> bool:
    start, end = sentence.steps[0].start_frame * HOP_SAMPLES, sentence.steps[-1].end_frame * HOP_SAMPLES
    return any(start < s.end and end > s.start and words == s.words for s in spoken)


def listen(recogniser: Watched, sound: Samples) -> None:
    for start in range(0, len(sound), BLOCK):
        recogniser.push(sound[start : start + BLOCK])


def fit(x: NDArray[np.float64], y: NDArray[np.bool_]) -> NDArray[np.float64]:
    """Weights of the columns of `x` and, last, the bias: logistic regression by gradient ascent."""
    mean, spread = x.mean(axis=0), x.std(axis=0) + 1e-9
    z = np.column_stack([(x - mean) / spread, np.ones(len(x))])
    w = np.zeros(z.shape[1])
    for _ in range(STEPS):
        w += RATE * z.T @ (y - 1.0 / (1.0 + np.exp(-z @ w))) / len(y) - 5e-4 * w
    weights = w[:-1] / spread
    return np.append(weights, w[-1] - float(weights @ mean))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sentences", type=int, default=40)
    parser.add_argument("--snr", default="20,0,-5,-8,-10")
    parser.add_argument("--seed", type=int, default=21)
    o = parser.parse_args()
    rows, right = [], []
    sound = make_sound(None, user_cache_folder())
    for k, names in enumerate(TEAMS):
        book = make_phrasebook(names, DEFAULT_TEAMS, load_tasks(default_tasks_path()))
        speakers = {name: Speaker(voice_for(name), sound.lexicon, sound.cache) for name in names}
        bank = {voice_for(name).name: templates(book, voice_for(name), sound) for name in names}
        clean, spoken = make_stream(book, speakers, o.sentences, o.seed + k)
        for colour in ("white", "pink"):
            for snr in (float(s) for s in o.snr.split(",")):
                recogniser = Watched(book.graph, bank)
                listen(recogniser, add_noise(clean, spoken, snr, colour, -30.0, o.seed))
                kept = [(s, w) for s, w in recogniser.judged if s.cost < -16.0 and s.lead_in < 0.5]
                rows += [row(s) for s, _w in kept]
                right += [is_right(s, w, spoken) for s, w in kept]
    x, y = np.array(rows), np.array(right)
    w = fit(x, y)
    print(f"{len(y)} sentences, {(~y).sum()} wrong")
    print(f"bias {w[-1]:.2f}, per_margin {w[0]:.3f}, per_deficit {w[1]:.2f}, per_gain {w[2]:.2f}")
    chance = 1.0 / (1.0 + np.exp(-(x @ w[:-1] + w[-1])))
    for low, high in ((0.0, 0.5), (0.5, 0.7), (0.7, 0.8), (0.8, 0.9), (0.9, 0.95), (0.95, 1.0)):
        there = (chance >= low) & (chance < high)
        share = f"{y[there].mean():.3f} right" if there.any() else "-"
        print(f"confidence {low:.2f} to {high:.2f}: {there.sum():4d} sentences, {share}")


if __name__ == "__main__":
    main()
