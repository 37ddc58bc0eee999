"""The net of `hvcpd.recognition.keyword` in PyTorch, its weights in a file, and means of weights."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor, nn

from benchmarks.phones.stored import Pairs, in_bytes
from hvcpd.recognition.keyword.net import DILATIONS, KERNEL_SIZE, KERNEL_SIZES, N_INPUTS

WIDTHS = (64, 96)
N_CURVES = 2


class Net(nn.Module):
    """As `KeywordNet`, for whole takes."""

    def __init__(self) -> None:
        super().__init__()
        first, width = WIDTHS
        self.layers = nn.ModuleList(
            [
                nn.Conv1d(N_INPUTS, first, KERNEL_SIZES[0], 2),
                nn.Conv1d(first, width, KERNEL_SIZES[1], 2),
                *(nn.Conv1d(width, width, KERNEL_SIZE, dilation=gap) for gap in DILATIONS),
            ]
        )
        self.norms = nn.ModuleList(nn.BatchNorm1d(n) for n in (first, *[width] * (len(DILATIONS) + 1)))
        self.out = nn.Conv1d(width, N_CURVES, 1)
        self.drop = nn.Dropout(0.1)

    def forward(self, sound: Tensor) -> Tensor:
        """From (batch, N_INPUTS, frames) to logits (batch, curves, chunks)."""
        for number, (layer, norm) in enumerate(zip(self.layers, self.norms, strict=True)):
            before = (
                KERNEL_SIZES[number] - 2
                if number < len(KERNEL_SIZES)
                else (KERNEL_SIZE - 1) * DILATIONS[number - len(KERNEL_SIZES)]
            )
            found = torch.relu(norm(layer(nn.functional.pad(sound, (before, 0)))))
            sound = found if number < len(KERNEL_SIZES) else sound + self.drop(found)
        logits: Tensor = self.out(sound)
        return logits


def stored(path: Path) -> Pairs:
    """Those in a file that `save` wrote."""
    with np.load(path) as file:
        n_layers = sum(name.startswith("weights") for name in file)
        return [(file[f"weights{n}"] * file[f"scale{n}"], file[f"offsets{n}"]) for n in range(n_layers)]


def folded(net: Net) -> Pairs:
    """Those of a net; normalisation becomes part of them."""
    pairs: Pairs = []
    for layer, norm in zip((*net.layers, net.out), (*net.norms, None), strict=True):
        weights, offsets = layer.weight.detach().numpy(), layer.bias.detach().numpy()
        if norm is not None:
            gain = (norm.weight / torch.sqrt(norm.running_var + norm.eps)).detach().numpy()
            weights = weights * gain[:, None, None]
            offsets = (offsets - norm.running_mean.numpy()) * gain + norm.bias.detach().numpy()
        pairs.append((weights.transpose(2, 1, 0).reshape(-1, weights.shape[0]), offsets))
    return pairs


class Folded(nn.Module):
    """The net of such weights, not to be trained."""

    def __init__(self, pairs: Pairs) -> None:
        super().__init__()
        self._pairs = [(torch.from_numpy(matrix), torch.from_numpy(offsets)) for matrix, offsets in pairs]

    def forward(self, sound: Tensor) -> Tensor:
        """As `Net.forward`."""
        *layers, (matrix, offsets) = self._pairs
        for number, (weights, off) in enumerate(layers):
            size, gap = (
                (KERNEL_SIZES[number], 1)
                if number < len(KERNEL_SIZES)
                else (KERNEL_SIZE, DILATIONS[number - len(KERNEL_SIZES)])
            )
            step = 2 if number < len(KERNEL_SIZES) else 1
            kernel = weights.reshape(size, -1, weights.shape[1]).permute(2, 1, 0)
            padded = nn.functional.pad(sound, (size - 2 if step == 2 else (size - 1) * gap, 0))
            found = torch.relu(nn.functional.conv1d(padded, kernel, off, step, dilation=gap))
            sound = found if step == 2 else sound + found
        return nn.functional.conv1d(sound, matrix.T[:, :, None], offsets)


def save(path: Path, pairs: Pairs, lines: Sequence[tuple[float, float]], notes: str) -> None:
    """In bytes, with a scale for each output."""
    slopes, intercepts = np.array(lines, np.float32).T
    arrays: dict[str, Any] = {"slopes": slopes, "intercepts": intercepts, "notes": notes}
    for number, (matrix, offsets) in enumerate(pairs):
        arrays[f"weights{number}"], arrays[f"scale{number}"] = in_bytes(matrix)
        arrays[f"offsets{number}"] = offsets.astype(np.float32)
    np.savez_compressed(path, **arrays)


def started(path: Path, sound: Tensor) -> Net:
    """A net that tells what the weights in the file tell, to go on from; `sound`: inputs like those of training."""
    net, (*pairs, out) = Net(), stored(path)
    with torch.no_grad():
        for layer, size, (matrix, offsets) in zip(
            net.layers, (*KERNEL_SIZES, *[KERNEL_SIZE] * len(DILATIONS)), pairs, strict=True
        ):
            layer.weight.copy_(torch.from_numpy(matrix.reshape(size, -1, matrix.shape[1]).transpose(2, 1, 0).copy()))
            layer.bias.copy_(torch.from_numpy(offsets))
        net.out.weight.copy_(torch.from_numpy(out[0].T.copy())[:, :, None])
        net.out.bias.copy_(torch.from_numpy(out[1]))
        hooks = [norm.register_forward_pre_hook(_undo) for norm in net.norms]
        net(sound)  # each normalisation is undone in turn: what follows sees what it learned with
    for hook in hooks:
        hook.remove()
    return net


def _undo(norm: nn.Module, given: tuple[Tensor]) -> None:
    norm.weight.copy_(torch.sqrt(given[0].var(dim=(0, 2)) + norm.eps))
    norm.bias.copy_(given[0].mean(dim=(0, 2)))
