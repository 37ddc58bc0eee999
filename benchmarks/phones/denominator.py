"""How likely the phones that a net hears are to be any speech at all: the denominator of training by maximum mutual
information (MMI), without lattices (D. Povey et al., Interspeech 2016), over paths as in connectionist temporal
classification (H. Xiang & Z. Ou, "CRF-based single-stage acoustic modeling with CTC topology", ICASSP 2019)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor
from torch.nn.functional import pad

from hvcpd.people.phones import PHONES

N = len(PHONES)
DISCOUNT = 0.7
"""Of each count; what is taken goes to the shorter context (Kneser-Ney's absolute discounting)."""
UNSEEN = 0.5
"""Added to the shorter context's share, so that no trigram is impossible."""


def trigrams(texts: Sequence[NDArray[np.int64]]) -> NDArray[np.float32]:
    """The probability of a phone after two others, shape (N + 1, N + 1, N); number N stands for the beginning."""
    counts = np.zeros((N + 1, N + 1, N))
    for phones in texts:
        begun = np.concatenate(([N, N], phones))
        np.add.at(counts, (begun[:-2], begun[1:-1], begun[2:]), 1)
    alone = counts.sum((0, 1)) + 1.0
    after_one = _smoothed(counts.sum(0), alone / alone.sum())
    return _smoothed(counts, after_one).astype(np.float32)


def _smoothed(counts: NDArray[np.float64], shorter: NDArray[np.float64]) -> NDArray[np.float64]:
    shared = DISCOUNT * (counts > 0).sum(-1, keepdims=True) + UNSEEN
    found = np.maximum(counts - DISCOUNT, 0.0) + shared * shorter
    return np.asarray(found / found.sum(-1, keepdims=True))


def log_denominator(log_posteriors: Tensor, n_frames: Tensor, after_two: Tensor) -> Tensor:
    """The log of the sum, over all strings of phones, of a string's probability by its trigrams times its likelihood
    summed over all alignments, shape (takes,).

    `log_posteriors`: shape (frames, takes, N + 1), the blank last; `n_frames`: of each take, shape (takes,)."""
    posteriors = log_posteriors.exp()
    other = after_two[:, :N] * (1.0 - torch.eye(N))  # a phone follows itself only after a blank
    from_blank, from_phone = after_two.permute(1, 0, 2), other.permute(1, 0, 2)
    takes = log_posteriors.shape[1]
    # last but one and last phone; either the last one goes on, or the blank after it
    phone, blank = torch.zeros(takes, N + 1, N), torch.zeros(takes, N + 1, N + 1)
    blank[:, N, N] = 1.0
    total = torch.zeros(takes)
    for frame, now in enumerate(posteriors):
        begun = torch.bmm(blank.permute(2, 0, 1), from_blank)
        begun = begun + pad(torch.bmm(phone.permute(2, 0, 1), from_phone), (0, 0, 0, 0, 0, 1))
        next_phone = (begun.permute(1, 0, 2) + phone) * now[:, None, :N]
        next_blank = (blank + pad(phone, (0, 1))) * now[:, N, None, None]
        lasts = frame < n_frames
        mass = torch.where(lasts, next_phone.sum((1, 2)) + next_blank.sum((1, 2)), 1.0)
        total = total + mass.log()
        kept = lasts[:, None, None]
        phone = torch.where(kept, next_phone / mass[:, None, None], phone)
        blank = torch.where(kept, next_blank / mass[:, None, None], blank)
    return total
