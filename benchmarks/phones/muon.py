"""Muon, which makes a matrix's steps orthogonal (K. Jordan and others, "Muon: an optimizer for hidden layers in neural
networks", 2024), in the numbers that the processor is fast with: `torch.optim.Muon` uses two bytes always."""

from __future__ import annotations

from collections.abc import Iterable

import torch
from torch import Tensor, nn

from benchmarks.phones.precision import TRAINED_IN

MOMENTUM = 0.95
RMS = 0.2
"""Of a step, times the rate, whatever the matrix's shape: as of AdamW's steps (J. Liu and others, "Muon is scalable for
LLM training", 2025)."""
ITERATIONS = 5
COEFFICIENTS = (3.4445, -4.7750, 2.0315)
"""Jordan's, of the polynomial that brings all singular values near 1."""


def orthogonal(matrix: Tensor, kind: torch.dtype = TRAINED_IN) -> Tensor:
    """About U V' of the matrix's singular value decomposition, by Newton and Schulz's iteration."""
    wide = matrix.shape[0] <= matrix.shape[1]
    found = (matrix if wide else matrix.T).to(kind)
    found = found / found.norm().clamp(min=1e-7)
    first, second, third = COEFFICIENTS
    for _ in range(ITERATIONS):
        gram = found @ found.T
        found = torch.addmm(found, torch.addmm(gram, gram, gram, beta=second, alpha=third), found, beta=first)
    return (found if wide else found.T).float()


class Muon(torch.optim.Optimizer):
    """With Nesterov's momentum and decay of the weights, times the rate."""

    def __init__(self, matrices: Iterable[nn.Parameter], lr: float, decay: float) -> None:
        super().__init__(matrices, {"lr": lr, "decay": decay})

    @torch.no_grad()  # type: ignore[untyped-decorator]
    def step(self) -> None:  # type: ignore[override]
        """Step by the gradients."""
        for group in self.param_groups:
            for matrix in group["params"]:
                mean = self.state[matrix].setdefault("mean", torch.zeros_like(matrix))
                mean.lerp_(matrix.grad, 1.0 - MOMENTUM)
                step = orthogonal(matrix.grad.lerp(mean, MOMENTUM))
                matrix.mul_(1.0 - group["lr"] * group["decay"])
                matrix.add_(step, alpha=-group["lr"] * RMS * max(matrix.shape) ** 0.5)
