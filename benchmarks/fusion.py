"""Fits how the listeners of the second look are weighed (`hvcpd/people/fusion.py`), and prints what comes of it.

    python -m benchmarks.fusion [--data DIR] [--sentences 30] [--seed 1]

`python -m benchmarks.fit` writes the weights. By synthetic voices that neither the net was trained on nor
`benchmarks.people` hears: sentences of the phrasebook, calls and other short sentences, by strangers and, some, by
enrolled. With DIR: people's digits, takes 0 to 4, and people's talk that addresses nobody, every other recording; the
rest of that talk is only judged. Needs espeak-ng, festival, flite, and sox.
"""

from __future__ import annotations

import argparse
import itertools
import random
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from benchmarks.judging import Phrases, program
from benchmarks.people import BLOCK, NAMES, SNR_DB, Stage
from benchmarks.people_material import (
    CALLS,
    DIGITS,
    FIRST_WORDS,
    ONE_DIGIT,
    alone,
    digits,
    enrol,
    levelled,
    sentences,
    stream,
)
from benchmarks.phones.material import common_words
from benchmarks.phones.texts import Texts
from benchmarks.phones.voices import calibrators
from hvcpd.assembly.make import make_recogniser
from hvcpd.hardware.soundfile import read_wav
from hvcpd.people import fusion
from hvcpd.people.fusion import Hypotheses, evidence, supporting
from hvcpd.people.second_pass import MIN_STRANGERS_PROBABILITY, SecondPassRecogniser
from hvcpd.ports import Samples
from hvcpd.recognition.second_look import Finding, LooksAgain, Piece, SecondEars

Talk = Callable[[Phrases], Samples]
Floats = NDArray[np.float64]

SHORT = tuple(
    "stop,rob stop,all stop,bot stop,team a stop,team plant stop,turn around,move forward,report,resume,who is here,"
    "what is left,hi rob,hi all,come back,turn left,turn right,rob resume,say again,bot report,hi bot".split(",")
)
RIDGE = 0.05
KEPT = ((0,), (4,), (0, 1, 2), (2, 3, 4))
"""Takes of digits that are enrolled."""
KNOWN_TO_TALK = ("espeak-ng en-gb-x-rp", "festival kal")
"""Whose voices are enrolled where people talk."""
AGAIN = 0.25
"""What talk counts that is judged once more, with somebody enrolled."""
SUPPORT_SIGNS = "---"
PROBABILITY_SIGNS = "?-?+????+"
"""Of each weight, where it is known which it must have."""
SUPPORTING = ("loss", "farther_by_cepstra", "farther_by_net")
EVIDENCE = (
    "bias",
    "loss_a_frame",
    "is_nearest",
    "nearest_logit",
    "is_nearest_by_net",
    "log_words",
    "words_a_second",
    "log_seconds",
    "lead",
)
"""Names of the weights of `fusion.supporting` and `fusion.evidence`."""


@dataclass(frozen=True, eq=False)
class Case:
    """What was said, empty if nothing to the robots, and what the listeners make of it.

    `weight`: in the fit of what is chosen (who is enrolled speaks oftener than others where somebody is), and
    `counts` in that of how sure it is, where digits should not be most of all.
    """

    kind: str
    words: tuple[str, ...]
    hypotheses: Hypotheses
    weight: float = 1.0
    counts: float = 1.0


def talkers(seed: int) -> dict[str, Talk]:
    """The voices kept for calibration, and flite's narrow one."""
    chooser = random.Random(seed)

    def flite(phrases: Phrases) -> Samples:
        stretch = f"duration_stretch={chooser.uniform(0.85, 1.2):.2f}"
        return program(("flite", "-voice", "kal", "--setf", stretch, "-t", "{text}", "-o", "{wav}"))(phrases)

    def drawn(talker: Callable[[Phrases, random.Random], Samples]) -> Talk:
        return lambda phrases: talker(phrases, chooser)

    names = ("espeak-ng en-us", "espeak-ng en-gb-x-rp", "espeak-ng en-029", "festival kal")
    return {**{name: drawn(t) for name, t in zip(names, calibrators(), strict=True)}, "flite kal": flite}


def said(talk: Talk, phrases: Phrases, seed: int) -> tuple[tuple[str, ...], Piece]:
    """One sentence in white noise."""
    words = tuple(word for phrase in phrases for word in phrase)
    return words, alone(talk(phrases), SNR_DB, "white", seed)


def by_voices(stage: Stage, n: int, seed: int) -> Iterator[Case]:
    nobody = stage.opinion(stage.book.people_graph, ())
    for number, (name, talk) in enumerate(talkers(seed).items()):
        spoken: list[Phrases] = [*sentences(stage.book, n, seed + number), *([c.split()] for c in FIRST_WORDS + CALLS)]
        for k, phrases in enumerate(spoken):
            yield heard("strangers", nobody, said(talk, phrases, 1000 * number + k))
        for k, text in enumerate(SHORT):
            kind = "calls" if text.endswith("stop") else "short sentences"
            yield heard(kind, nobody, said(talk, [text.split()], 2000 * number + k))
        known = enrolled_by(stage, talk)
        for k, phrases in enumerate(
            [*sentences(stage.book, n // 2, seed + 50 + number), *([c.split()] for c in CALLS)]
        ):
            yield heard("enrolled", known, said(talk, phrases, 3000 * number + k))
        print(f"{name} has spoken", flush=True)


def enrolled_by(stage: Stage, talk: Talk) -> SecondPassRecogniser:
    """Of somebody who knows a voice by three takes of each word."""
    words = {w: [levelled(talk([[w]])) for _ in range(3)] for w in stage.book.people_graph.words}
    return stage.opinion(stage.book.people_graph, [enrol("Anna", words)])


def heard(kind: str, opinion: SecondPassRecogniser, one: tuple[tuple[str, ...], Piece]) -> Case:
    """What the listeners make of a sentence."""
    words, piece = one
    return Case(kind, words, opinion.hypotheses(piece))


def by_digits(stage: Stage, folder: Path) -> Iterator[Case]:
    """Some takes enrolled, others heard; and with the other speakers alone enrolled."""
    takes = digits(folder)
    speakers = sorted({who for who, _ in takes})
    enrolled = {}
    for kept in KEPT:
        people = {w: enrol(w, {DIGITS[d]: [takes[w, d][k] for k in kept] for d in range(10)}) for w in speakers}
        others = {w: stage.opinion(ONE_DIGIT, [p for o, p in people.items() if o != w]) for w in speakers}
        enrolled[kept] = stage.opinion(ONE_DIGIT, list(people.values())), others
    nobody = stage.opinion(ONE_DIGIT, ())
    for key, (who, digit) in enumerate(sorted(takes)):
        for n, (label, snr_db) in itertools.product(range(5), (("clean", None), ("10 dB", 10.0))):
            piece = alone(takes[who, digit][n], snr_db, "pink", 100 * key + n)
            by_nobody = nobody.hypotheses(piece)
            for kept in (kept for kept in KEPT if n not in kept):
                everybody, others = enrolled[kept]
                for kind, ears in (("enrolled", everybody), ("not enrolled", others[who])):
                    hypotheses = replace(by_nobody, known=ears.hypotheses(piece).known)
                    name = f"digits, {len(kept)} takes, {kind}, {label}"
                    weight = 3.0 if kind == "enrolled" else 1.0
                    yield Case(name, (DIGITS[digit],), hypotheses, weight, 0.1)


class Kept:
    """Keeps pieces that a second look is asked for."""

    def __init__(self) -> None:
        self.pieces: list[Piece] = []

    def submit(self, piece: Piece, _listener: LooksAgain) -> bool:
        self.pieces.append(piece)
        return True

    def findings(self) -> Sequence[Finding]:
        return ()


def pieces_of(stage: Stage, sound: Samples) -> list[Piece]:
    """What the robots' recogniser rejects."""
    kept, nobody = Kept(), stage.opinion(stage.book.people_graph, ())
    ears = SecondEars(make_recogniser(stage.book, NAMES[:2], stage.sound), nobody, kept)
    for at in range(0, len(sound), BLOCK):
        ears.push(sound[at : at + BLOCK])
    return kept.pieces


def talk_to_nobody(stage: Stage, folder: Path | None, seed: int) -> Iterator[Case]:
    """By people, where a synthetic voice is enrolled and where nobody is; and by synthetic voices, likewise."""
    nobody = stage.opinion(stage.book.people_graph, ())
    voices = talkers(seed + 1)
    known = {name: enrolled_by(stage, talk) for name, talk in voices.items()}
    paths = sorted(folder.rglob("*.wav")) if folder is not None else []
    for label, some in (("people's talk", paths[1::2]), ("people's talk, not fitted", paths[::2])):
        sound = np.concatenate([np.zeros(1600), *(read_wav(path) for path in some)]).astype(np.float32)
        counts = float("not" not in label)
        for piece in pieces_of(stage, sound):
            yield Case(label, (), nobody.hypotheses(piece), counts=counts)
            for name in KNOWN_TO_TALK:
                yield Case(f"{label}, one enrolled", (), known[name].hypotheses(piece), counts=AGAIN * counts)
    texts = Texts(common_words(), seed)
    for name, talk in voices.items():
        spoken = []
        while len(spoken) < 40:
            text = texts.prose()
            if len(text.words) >= 4:
                spoken.append((text.words, talk(text.phrases)))
        sound, _ = stream(spoken, SNR_DB, "white", seed)
        for piece in pieces_of(stage, sound):
            yield Case("prose", (), nobody.hypotheses(piece))
            yield Case("prose, enrolled", (), known[name].hypotheses(piece), counts=AGAIN)
        print(f"{name} has talked", flush=True)


def fit_support(cases: Sequence[Case]) -> Floats:
    """Conditional logit: of the sentences that were found, the one that was said."""
    choices = []
    for case in cases:
        found = case.hypotheses.sentences
        if len(found) > 1 and case.words in found:
            values = np.array([supporting(case.hypotheses, words) for words in found])
            choices.append((case.weight, values - values[found.index(case.words)]))
    scale = np.maximum(np.concatenate([values for _, values in choices]).std(axis=0), 1e-6)

    def cost(weights: Floats) -> float:
        losses = (w * np.log(np.exp(np.minimum(each / scale @ weights, 500.0)).sum()) for w, each in choices)
        return float(sum(losses) + RIDGE * (weights**2).sum())

    print(f"{len(choices)} choices")
    return np.asarray(minimize(cost, np.zeros(len(scale)), bounds=_bounds(SUPPORT_SIGNS)).x / scale)


def _bounds(signs: str) -> list[tuple[float | None, float | None]]:
    """That what speaks against a sentence never counts for it, however far from all that was fitted to."""
    return [(0.0 if sign == "+" else None, 0.0 if sign == "-" else None) for sign in signs]


def fit_probability(values: Floats, right: Floats, case_weights: Floats) -> Floats:
    """Logistic regression; the first column of the values is 1."""
    scale = np.maximum(values.std(axis=0), 1e-6)
    scale[0] = 1.0

    def cost(weights: Floats) -> float:
        logits = values / scale @ weights
        return float(
            np.sum(case_weights * (np.logaddexp(0.0, logits) - right * logits)) + RIDGE * (weights[1:] ** 2).sum()
        )

    return np.asarray(minimize(cost, np.zeros(len(scale)), bounds=_bounds(PROBABILITY_SIGNS)).x / scale)


def winners(cases: Sequence[Case]) -> list[tuple[tuple[str, ...], Sequence[float]]]:
    """The sentence that is supported best in each case, and what tells whether it is right."""
    found = []
    for case in cases:
        scored = fusion.ranked(case.hypotheses)
        words = scored[0][1]
        found.append((words, evidence(case.hypotheses, words, fusion.lead_of(scored))))
    return found


def tell(cases: Sequence[Case], found: Sequence[tuple[str, ...]], probabilities: Floats) -> None:
    """Right and wrong ones that are surer than some thresholds."""
    levels = (0.0, 0.5, 0.7, 0.8, 0.95)
    print(f"{'':44} {'right, at least as sure as':>34}   wrong   (the surest stops)")
    print(f"{'':44} " + "".join(f"{level:>6}" for level in levels) + "   " + "".join(f"{level:>6}" for level in levels))
    for kind in dict.fromkeys(case.kind for case in cases):
        mine = [k for k, case in enumerate(cases) if case.kind == kind]
        right = [k for k in mine if found[k] == cases[k].words]
        wrong = [k for k in mine if found[k] != cases[k].words]
        halts = [k for k in wrong if found[k][-1] == "stop" and cases[k].words[-1:] != ("stop",)]
        stops = " ".join(f"{probabilities[k]:.2f}" for k in sorted(halts, key=lambda k: -probabilities[k])[:4])
        counts = [
            "".join(f"{sum(probabilities[k] >= level for k in each):6d}" for level in levels) for each in (right, wrong)
        ]
        print(f"{kind:44} {counts[0]}   {counts[1]}   ({stops})")


def fitted(o: argparse.Namespace) -> dict[str, object]:
    """Weights of both curves, and what they were fitted to."""
    stage = Stage(False)
    cases = list(by_voices(stage, o.sentences, o.seed))
    cases += list(by_digits(stage, o.data / "digits")) if o.data is not None else []
    cases += list(talk_to_nobody(stage, o.data / "negatives" if o.data is not None else None, o.seed))
    cases = [case for case in cases if case.hypotheses.sentences]
    fusion.SUPPORT = tuple(round(w, 4) for w in fit_support(cases).tolist())
    found = winners(cases)
    values = np.array([each for _, each in found])
    right = np.array([words == case.words for case, (words, _) in zip(cases, found, strict=True)], float)
    weights = fit_probability(values, right, np.array([case.counts for case in cases]))
    probabilities = 1.0 / (1.0 + np.exp(-values @ weights))
    tell(cases, [words for words, _ in found], probabilities)
    sure = probabilities >= MIN_STRANGERS_PROBABILITY
    people = ", digits of four people, people's talk" if o.data is not None else ""
    return {
        "data": f"{o.sentences} sentences by each of five synthetic voices, calls, enrolled voices, prose{people}; "
        f"seed {o.seed}",
        "score": f"at {MIN_STRANGERS_PROBABILITY}: {int((sure * right).sum())} of {int(right.sum())} right ones, "
        f"{int((sure * (1 - right)).sum())} of {int((1 - right).sum())} wrong ones",
        "weights": {
            "support": dict(zip(SUPPORTING, fusion.SUPPORT, strict=True)),
            "probability": {name: round(float(w), 3) for name, w in zip(EVIDENCE, weights, strict=True)},
        },
    }


def parser() -> argparse.ArgumentParser:
    """What can be chosen."""
    out = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    out.add_argument("--data", type=Path, help="folder with digits/ and negatives/")
    out.add_argument("--sentences", type=int, default=30, help="of each voice")
    out.add_argument("--seed", type=int, default=1)
    return out


if __name__ == "__main__":
    print(fitted(parser().parse_args()))
