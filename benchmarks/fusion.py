"""Fits the weights of the listeners of the second pass (`hvcpd/people/fusion.py`), and prints the results.

    python -m benchmarks.fusion [--data DIR] [--sentences 25] [--seed 1]

`python -m benchmarks.fit` writes the weights. What they are fitted to is `benchmarks.fusion_cases`; the table of how
many sentences of each confidence were right is of a fifth of the cases, to which a second fit was blind. Needs
espeak-ng, festival, flite, and sox.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from benchmarks.fusion_cases import Case, all_cases
from benchmarks.judging import reliability, tell_reliability
from benchmarks.people_stage import Stage
from hvcpd.language.wordings import same_meaning
from hvcpd.people import fusion
from hvcpd.people.fusion import confidence_features
from hvcpd.people.second_pass import MIN_STRANGERS_PROBABILITY

Floats = NDArray[np.float64]

RIDGE = 0.05
FOLDS = 5
PROBABILITY_SIGNS = "?+?+"
"""Of each weight, where it is known which it must have."""
EVIDENCE = (
    "bias",
    "log_odds",
    "is_nearest",
    "nearest_logit",
)
"""Names of the weights of `fusion.confidence_features`."""
LEVELS = (0.0, 0.1, 0.3, 0.5, 0.7, 0.8, 0.9, 0.95, 1.0)


def _bounds(signs: str) -> list[tuple[float | None, float | None]]:
    """Evidence against a sentence never counts for it, however far from the fitted data."""
    return [(0.0 if sign == "+" else None, 0.0 if sign == "-" else None) for sign in signs]


def fit_probability(values: Floats, right: Floats, case_weights: Floats) -> Floats:
    """Logistic regression; the first column of the values is 1. The weight of a constant feature stays as it was."""
    varies = values.std(axis=0) > 1e-9
    scale = np.where(varies, values.std(axis=0), 1.0)

    scaled = values / scale

    def cost(weights: Floats) -> float:
        logits = scaled @ weights
        return float(
            np.sum(case_weights * (np.logaddexp(0.0, logits) - right * logits)) + RIDGE * (weights[1:] ** 2).sum()
        )

    found = minimize(cost, np.zeros(len(scale)), bounds=_bounds(PROBABILITY_SIGNS)).x / scale
    varies[0] = True
    return np.where(varies, found, fusion.WEIGHTS)


def winners(cases: Sequence[Case]) -> list[tuple[tuple[str, ...], Sequence[float]]]:
    """The likeliest sentence in each case by the weights as they are, and the features that tell whether it is
    right."""
    found = ([(words, confidence_features(c.hypotheses, words)) for words in c.hypotheses.sentences] for c in cases)
    return [max(each, key=lambda one: fusion.probability(one[1])) for each in found]


def tell(cases: Sequence[Case], found: Sequence[tuple[str, ...]], probabilities: Floats) -> None:
    """Right and wrong ones that are surer than some thresholds."""
    levels = (0.0, 0.5, 0.7, 0.8, 0.95)
    print(f"{'':44} {'right, at least as sure as':>34}   wrong   (the surest stops)")
    print(f"{'':44} " + "".join(f"{level:>6}" for level in levels) + "   " + "".join(f"{level:>6}" for level in levels))
    for kind in dict.fromkeys(case.kind for case in cases):
        mine = [k for k, case in enumerate(cases) if case.kind == kind]
        right = [k for k in mine if same_meaning(found[k], cases[k].words)]
        wrong = [k for k in mine if k not in right]
        halts = [k for k in wrong if found[k][-1] == "stop" and cases[k].words[-1:] != ("stop",)]
        stops = " ".join(f"{probabilities[k]:.2f}" for k in sorted(halts, key=lambda k: -probabilities[k])[:4])
        counts = [
            "".join(f"{sum(probabilities[k] >= level for k in each):6d}" for level in levels) for each in (right, wrong)
        ]
        print(f"{kind:44} {counts[0]}   {counts[1]}   ({stops})")


def cross_validate(values: Floats, right: Floats, counts: Floats) -> None:
    """How many of the sentences of each confidence were right, each judged by a fit that did not see it."""
    fold = np.arange(len(values)) % FOLDS
    probability = np.zeros(len(values))
    for number in range(FOLDS):
        seen = fold != number
        weights = fit_probability(values[seen], right[seen], counts[seen])
        probability[~seen] = 1.0 / (1.0 + np.exp(-values[~seen] @ weights))
    whole = counts >= 1.0
    tell_reliability(reliability(zip(probability[whole], right[whole] > 0.0, strict=True), LEVELS))


def fitted(o: argparse.Namespace) -> dict[str, object]:
    """The weights, and the data that they were fitted to."""
    cases = all_cases(Stage(False), o.data, o.sentences, o.seed)
    found = winners(cases)
    values = np.array([each for _, each in found])
    right = np.array([same_meaning(words, case.words) for case, (words, _) in zip(cases, found, strict=True)], float)
    counts = np.array([case.counts for case in cases])
    weights = fit_probability(values, right, counts)
    probabilities = 1.0 / (1.0 + np.exp(-values @ weights))
    tell(cases, [words for words, _ in found], probabilities)
    cross_validate(values, right, counts)
    sure = probabilities >= MIN_STRANGERS_PROBABILITY
    people = ", words of 20 people, people's talk, sounds, digits" if o.data is not None else ""
    people += ", lines of games" if any(case.kind == "actors' lines" for case in cases) else ""
    return {
        "data": f"{o.sentences} sentences by each of eight synthetic voices, calls, robots, words and prose that are "
        f"no sentence, enrolled voices{people}; in rooms and noises; seed {o.seed}",
        "score": f"at {MIN_STRANGERS_PROBABILITY}: {int((sure * right).sum())} of {int(right.sum())} right ones, "
        f"{int((sure * (1 - right)).sum())} of {int((1 - right).sum())} wrong ones",
        "weights": {"probability": {name: round(float(w), 3) for name, w in zip(EVIDENCE, weights, strict=True)}},
    }


def parser() -> argparse.ArgumentParser:
    """The options."""
    out = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    out.add_argument("--data", type=Path, help="folder of recordings of people, rooms and noises")
    out.add_argument("--sentences", type=int, default=25, help="of each voice")
    out.add_argument("--seed", type=int, default=1)
    return out


if __name__ == "__main__":
    print(fitted(parser().parse_args()))
