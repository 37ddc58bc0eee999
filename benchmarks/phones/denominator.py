"""How likely the phones that a net hears are to be any speech at all: the denominator of training by maximum mutual
information (MMI), without lattices (D. Povey et al., Interspeech 2016), over paths as in connectionist temporal
classification (H. Xiang & Z. Ou, "CRF-based single-stage acoustic modeling with CTC topology", ICASSP 2019)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

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


class _LogDenominator(torch.autograd.Function):
    """The forward algorithm, and for the gradient the backward one: a third of the time of PyTorch's own.

    A state is the last but one and the last phone, and whether the last one goes on or a blank follows it. Arrays of
    states have the shape (last, takes, last but one)."""

    @staticmethod
    def forward(ctx: Any, log_posteriors: Tensor, n_frames: Tensor, after_two: Tensor) -> Tensor:
        frames, takes, _ = log_posteriors.shape
        ended = torch.arange(frames)[:, None] >= n_frames
        # after a take's end comes a certain blank, which leaves all sums as they are
        posteriors = log_posteriors.exp().masked_fill(ended[:, :, None], 0.0)
        posteriors[:, :, N].masked_fill_(ended, 1.0)
        from_blank = after_two.permute(1, 0, 2).contiguous()
        # a phone follows itself only after a blank
        from_phone = (after_two[:, :N] * (1.0 - torch.eye(N))).permute(1, 0, 2).contiguous()
        phone = torch.empty(frames + 1, N, takes, N + 1)
        blank = torch.empty(frames + 1, N + 1, takes, N + 1)
        phone[0], blank[0] = 0.0, 0.0
        blank[0, N, :, N] = 1.0
        mass = torch.empty(frames, takes)
        for frame, now in enumerate(posteriors):
            begun = torch.bmm(blank[frame], from_blank)
            begun[:N].baddbmm_(phone[frame], from_phone)
            next_phone = phone[frame + 1].copy_(begun.permute(2, 1, 0)).add_(phone[frame])
            next_blank = blank[frame + 1].copy_(blank[frame])
            next_blank[:N].add_(phone[frame])
            mass[frame] = (next_phone.sum(2).T * now[:, :N]).sum(1) + next_blank.sum((0, 2)) * now[:, N]
            share = now / mass[frame][:, None]
            next_phone.mul_(share[:, :N].T[:, :, None])
            next_blank.mul_(share[:, N, None])
        ctx.save_for_backward(posteriors / mass[:, :, None], phone, blank, from_blank, from_phone, ended)
        return mass.log().sum(0)

    @staticmethod
    def backward(ctx: Any, grad: Tensor) -> tuple[Tensor, None, None]:  # type: ignore[override]
        shares, phone, blank, from_blank, from_phone, ended = ctx.saved_tensors
        to_blank, to_phone = from_blank.transpose(1, 2).contiguous(), from_phone.transpose(1, 2).contiguous()
        occupied = torch.empty(shares.shape)
        after_phone, after_blank = torch.ones(phone.shape[1:]), torch.ones(blank.shape[1:])
        for frame in range(len(shares) - 1, -1, -1):
            occupied[frame, :, :N] = (phone[frame + 1] * after_phone).sum(2).T
            occupied[frame, :, N] = (blank[frame + 1] * after_blank).sum((0, 2))
            after_phone.mul_(shares[frame, :, :N].T[:, :, None])
            after_blank.mul_(shares[frame, :, N, None])
            begun = after_phone.permute(2, 1, 0).contiguous()
            after_phone.add_(after_blank[:N]).baddbmm_(begun[:N], to_phone)
            after_blank.baddbmm_(begun, to_blank)
        return occupied.masked_fill_(ended[:, :, None], 0.0) * grad[:, None], None, None


def log_denominator(log_posteriors: Tensor, n_frames: Tensor, after_two: Tensor) -> Tensor:
    """The log of the sum, over all strings of phones, of a string's probability by its trigrams times its likelihood
    summed over all alignments, shape (takes,).

    `log_posteriors`: shape (frames, takes, N + 1), the blank last; `n_frames`: of each take, shape (takes,)."""
    found: Tensor = _LogDenominator.apply(log_posteriors, n_frames, after_two)
    return found
