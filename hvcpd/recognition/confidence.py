"""Confidence of the template decoder's sentences: logistic regression, fitted by `python -m benchmarks.fit`.

A word's gain over the filler says little by itself: near the noise level even the right word gains hardly anything. So
the gain is divided by the gain expected of the right word in this noise (`Scorer.expected_gain`).
"""

from __future__ import annotations

import math
from dataclasses import astuple, dataclass

from hvcpd.recognition.decoder_session import Sentence
from hvcpd.recognition.fitted import curve, fitted

LEAST_MARGIN, MOST_MARGIN = 0.3, 12.0
"""Range of the cost of the closest other word; values beyond it carry no more information."""
LEAST_FIT, MOST_FIT = 0.05, 1.0
"""Gains relative to the right word's; the quietest voices gain twice as much by chance."""
LEAST_WORD_FIT = -1.0
SLOW, SLOWEST = 1.4, 2.4
"""Frames of a word over its template's: right words have 1.25 at most, slow ones 1.4; a false alarm may have any
value."""
FAST = 0.9


@dataclass(frozen=True)
class ConfidenceFeatures:
    """Features that describe how well a sentence, or one word of it, fits."""

    log_margin: float
    """Logarithm of the cost of the closest other word in the same place, for the word where that is least."""
    deficit: float
    """The words' mean distance beyond the frames' best templates (`Sentence.deficits`)."""
    worst: float
    """Deficit of the worst word: a word that nobody knows hides in a long sentence that is right otherwise."""
    log_gain: float
    """Logarithm of the sentence's gain over the filler: long sentences do not come about by chance."""
    log_fit: float
    """Logarithm of the sentence's gain, relative to the right sentence's."""
    word_fit: float
    """Gain of a word, relative to the right word's, where that is least."""
    slowness: float
    """Stretch of the slowest word, beyond SLOW: words matched to a steady sound last long."""
    haste: float
    """Stretch of the fastest word, below FAST."""

    @property
    def probability(self) -> float:
        """The probability, 0 to 1, that a hypothesis with these features is right."""
        weights = fitted("sentence_confidence")
        return curve(weights["bias"], astuple(ConfidenceFeatures(**weights["weights"])), astuple(self))


def confidence_features(sentence: Sentence, word: int | None = None) -> ConfidenceFeatures:
    """Features of a sentence, or of one word of it, by its number."""
    words = range(len(sentence.steps)) if word is None else [word]
    gain = max(-sentence.cost, 1.0)
    margin = min(sentence.steps[k].margin for k in words)
    deficits = [sentence.deficits[k] for k in words]
    word_fit = min(-sentence.steps[k].cost / sentence.expected_gains[k] for k in words)
    stretches = [sentence.stretches[k] for k in words]
    return ConfidenceFeatures(
        math.log(min(max(margin, LEAST_MARGIN), MOST_MARGIN)),
        sum(deficits) / len(deficits),
        max(deficits),
        math.log(gain),
        math.log(max(gain / sum(sentence.expected_gains), LEAST_FIT)),
        min(max(word_fit, LEAST_WORD_FIT), MOST_FIT),
        min(max(max(stretches), SLOW), SLOWEST) - SLOW,
        max(FAST - min(stretches), 0.0),
    )
