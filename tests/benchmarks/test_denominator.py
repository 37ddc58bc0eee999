"""Against the sum over each string of phones, one by one."""

from __future__ import annotations

from itertools import product
from typing import Any

import numpy as np
import pytest

torch = pytest.importorskip("torch", reason="needs PyTorch, with which phone nets are trained")

from benchmarks.phones.denominator import N, log_denominator, trigrams  # noqa: E402

RNG = np.random.default_rng(5)
AFTER_TWO = trigrams([RNG.integers(0, N, 12) for _ in range(50)])
N_FRAMES = 3


def log_posteriors(takes: int) -> Any:
    return torch.log_softmax(torch.from_numpy(RNG.normal(0, 2, (N_FRAMES, takes, N + 1)).astype(np.float32)), 2)


def likelihood(posteriors: np.ndarray, phones: tuple[int, ...]) -> float:
    """Of one take's posteriors, shape (frames, N + 1), over all alignments."""
    total = 0.0
    for path in product((*set(phones), N), repeat=len(posteriors)):
        changes = [each for at, each in enumerate(path) if each != N and (at == 0 or path[at - 1] != each)]
        if tuple(changes) == phones:
            total += float(np.prod([frame[each] for frame, each in zip(posteriors, path, strict=True)]))
    return total


def test_probabilities_after_two_phones_add_up_to_one() -> None:
    assert AFTER_TWO.shape == (N + 1, N + 1, N)
    assert np.allclose(AFTER_TWO.sum(2), 1.0, atol=1e-5)
    assert AFTER_TWO.min() > 0.0


def test_the_denominator_is_the_sum_over_all_strings() -> None:
    given = log_posteriors(1)[:2]
    posteriors = given[:, 0].exp().numpy()
    expected = sum(
        float(AFTER_TWO[N, N, first] if phones else 1.0)
        * (float(AFTER_TWO[N, first, phones[1]]) if len(phones) > 1 else 1.0)
        * likelihood(posteriors, phones)
        for length in range(3)
        for phones in product(range(N), repeat=length)
        for first in phones[:1] or (0,)
    )
    found = log_denominator(given, torch.tensor([2]), torch.from_numpy(AFTER_TWO))
    assert float(found[0]) == pytest.approx(np.log(expected), abs=1e-3)


def test_frames_after_a_takes_end_do_not_count() -> None:
    given = log_posteriors(2)
    after_two = torch.from_numpy(AFTER_TWO)
    found = log_denominator(given, torch.tensor([N_FRAMES, 1]), after_two)
    alone = log_denominator(given[:1, 1:], torch.tensor([1]), after_two)
    assert float(found[1]) == pytest.approx(float(alone[0]), abs=1e-4)


def test_the_gradient_is_that_of_small_differences() -> None:
    given, n_frames = log_posteriors(2), torch.tensor([N_FRAMES, 2])
    after_two = torch.from_numpy(AFTER_TWO)
    exact = given.clone().requires_grad_()
    log_denominator(exact, n_frames, after_two).sum().backward()
    for place in ((0, 0, 3), (2, 0, N), (1, 1, 7), (2, 1, 4)):
        moved = [given.clone(), given.clone()]
        moved[0][place] += 0.05
        moved[1][place] -= 0.05
        up, down = (float(log_denominator(each, n_frames, after_two).sum()) for each in moved)
        assert float(exact.grad[place]) == pytest.approx((up - down) / 0.1, abs=2e-4)
