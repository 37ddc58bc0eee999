"""The file of fitted weights."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import astuple
from datetime import date
from pathlib import Path

import numpy as np
import pytest

from hvcpd.errors import ConfigError
from hvcpd.people.fusion import WEIGHTS
from hvcpd.recognition.arrays import mapped_arrays
from hvcpd.recognition.decoder_session import ConfidenceFeatures
from hvcpd.recognition.fitted import fitted
from hvcpd.recognition.keyword.net import Weights

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
    weights = ConfidenceFeatures(**fitted("sentence_confidence")["weights"])
    assert list(fitted("sentence_confidence")["weights"].values()) == list(astuple(weights))  # in the same order
    assert max(weights.deficit, weights.worst, weights.slowness, weights.haste) < 0.0
    assert min(weights.log_margin, weights.log_gain, weights.log_fit, weights.word_fit) > 0.0
    log_odds, _, nearest_logit = WEIGHTS[1:]
    assert log_odds > 0.0
    assert nearest_logit >= 0.0


@pytest.mark.parametrize("read", [mapped_arrays, Weights.load])
def test_a_damaged_net_is_named_with_the_remedy(read: Callable[[Path], object], tmp_path: Path) -> None:
    path = tmp_path / "net.npz"
    np.savez(path, weights=np.zeros(100))
    path.write_bytes(path.read_bytes()[:-10])
    with pytest.raises(ConfigError, match=r"net\.npz: this file of hvcpd is missing or damaged .*install"):
        read(path)


def test_there_is_no_model_of_another_name() -> None:
    with pytest.raises(KeyError):
        fitted("nothing")
