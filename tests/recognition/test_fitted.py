"""The file of fitted weights."""

from __future__ import annotations

from datetime import date

import pytest

from hvcpd.people.fusion import PROBABILITY
from hvcpd.recognition.confidence import ConfidenceCurve
from hvcpd.recognition.fitted import fitted

MODELS = (
    "steady_noise",
    "sentence_confidence",
    "people_fusion",
    "enrolled_confidence",
    "confusion",
    "channel_confidence",
)


@pytest.mark.parametrize("model", MODELS)
def test_weights_tell_where_they_come_from(model: str) -> None:
    section = fitted(model)
    date.fromisoformat(section["fitted"])
    assert section["by"]
    assert section["data"]
    assert section["score"]


def test_what_speaks_against_a_sentence_never_counts_for_it() -> None:
    weights = ConfidenceCurve().weights
    assert max(weights.deficit, weights.worst, weights.slowness, weights.haste) < 0.0
    assert min(weights.log_margin, weights.log_gain, weights.log_fit, weights.word_fit) > 0.0
    against, for_it = PROBABILITY[1:4], (PROBABILITY[4], *PROBABILITY[6:9])
    assert max(against) <= 0.0 <= min(for_it)
    assert min(against) < 0.0 < max(for_it)


def test_there_is_no_model_of_another_name() -> None:
    with pytest.raises(KeyError):
        fitted("nothing")
