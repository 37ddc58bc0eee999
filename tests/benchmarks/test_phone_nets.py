"""The mean of two phone nets' files."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.phones.mean import mean_of
from hvcpd.people.phones import PhoneNet, far_net, near_net

SOUND = np.random.default_rng(5).standard_normal((60, 25)).astype(np.float32)
FAR, NEAR = far_net().arrays, near_net().arrays


@pytest.mark.parametrize("share", [0.0, 1.0])
def test_a_share_of_nothing_or_all_is_one_of_the_nets(share: float) -> None:
    mean = PhoneNet.of(mean_of(FAR, NEAR, share))
    one = far_net() if share == 0.0 else PhoneNet.of({**NEAR, "apart": FAR["apart"]})
    assert np.allclose(mean.log_posteriors(SOUND), one.log_posteriors(SOUND), atol=1e-3)
    assert not np.allclose(mean.log_posteriors(SOUND), near_net().log_posteriors(SOUND), atol=1e-3)


def test_weights_lie_halfway_within_a_step_of_their_scale() -> None:
    mean = mean_of(FAR, NEAR, 0.5)
    weights = {name: net["weights0"] * net["scale0"] for name, net in (("far", FAR), ("near", NEAR), ("mean", mean))}
    halfway = (weights["far"] + weights["near"]) / 2.0
    assert np.all(np.abs(weights["mean"] - halfway) <= 0.51 * mean["scale0"])
    assert np.abs(mean["weights0"]).max() == 31
