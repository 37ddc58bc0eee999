"""Trains the net of `hvcpd.recognition.keyword` (needs PyTorch: pip install torch) and writes its weights.

    nice python -m benchmarks.keyword.train material.npz... --check validation.npz --out stop.npz [--minutes 12]
        [--seed 1] [--start stop.npz] [--rate 0.003]

Two curves: that the word was said, which may be told at any time within 0.2 s of its end, and that it was a call and no
part of a sentence, for which there are 0.75 s. What is told while the word ends, and soon after, does not count. Takes
that are easy are passed over more often than not (A. Shrivastava et al., "Training region-based object detectors with
online hard example mining", CVPR 2016).
"""

from __future__ import annotations

import argparse
import datetime
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from hvcpd.ports import SAMPLE_RATE_HZ
from hvcpd.recognition.frontend import HOP_SAMPLES, N_BANDS, WINDOW_SAMPLES
from hvcpd.recognition.keyword.net import GAPS, N_INPUTS, SIZE, SIZES, Levels
from hvcpd.recognition.stream import CHUNK_FRAMES

WIDTHS = (64, 96)
TOLD_S = ((0.02, 0.22), (0.1, 0.75))
"""When each curve should tell the word, after its end."""
SPARED_S = ((-0.16, 0.6), (-0.16, 1.1))
"""When it may tell it, too, or not."""
EASY = 0.03
"""A take whose loss was below this is easy."""
PASSED_OVER = 0.7
"""Share of the easy takes that are passed over."""
BATCH = 64
KEPT = 0.4
"""The share of what a net began with in what it ends as, where it went on from another: the mean of both tells more
than either (M. Wortsman et al., "Robust fine-tuning of zero-shot models", CVPR 2022)."""
DISTURBED = 0.3
"""Share of takes before which it was louder or quieter."""
DISTURBANCE = (-1.0, 4.0)
"""Range of that change, neper of power."""
TOLD, NOTHING, SPARED = 1, 0, 2


class Net(nn.Module):
    """As `KeywordNet`, for whole takes."""

    def __init__(self) -> None:
        super().__init__()
        first, width = WIDTHS
        self.layers = nn.ModuleList(
            [
                nn.Conv1d(N_INPUTS, first, SIZES[0], 2),
                nn.Conv1d(first, width, SIZES[1], 2),
                *(nn.Conv1d(width, width, SIZE, dilation=gap) for gap in GAPS),
            ]
        )
        self.norms = nn.ModuleList(nn.BatchNorm1d(n) for n in (first, *[width] * (len(GAPS) + 1)))
        self.out = nn.Conv1d(width, len(TOLD_S), 1)
        self.drop = nn.Dropout(0.1)

    def forward(self, sound: Tensor) -> Tensor:
        """From (batch, N_INPUTS, frames) to logits (batch, curves, chunks)."""
        for number, (layer, norm) in enumerate(zip(self.layers, self.norms, strict=True)):
            before = SIZES[number] - 2 if number < len(SIZES) else (SIZE - 1) * GAPS[number - len(SIZES)]
            found = torch.relu(norm(layer(nn.functional.pad(sound, (before, 0)))))
            sound = found if number < len(SIZES) else sound + self.drop(found)
        logits: Tensor = self.out(sound)
        return logits


def started(path: Path, data: Data) -> Net:
    """A net that tells what the weights in the file tell, to go on from."""
    net, (*pairs, out) = Net(), stored(path)
    with torch.no_grad():
        for layer, size, (matrix, offsets) in zip(net.layers, (*SIZES, *[SIZE] * len(GAPS)), pairs, strict=True):
            layer.weight.copy_(torch.from_numpy(matrix.reshape(size, -1, matrix.shape[1]).transpose(2, 1, 0).copy()))
            layer.bias.copy_(torch.from_numpy(offsets))
        net.out.weight.copy_(torch.from_numpy(out[0].T.copy())[:, :, None])
        net.out.bias.copy_(torch.from_numpy(out[1]))
        sound = torch.cat([sound for _, sound, _ in data.batches(None, np.arange(0, len(data.logs), 20))])
        hooks = [norm.register_forward_pre_hook(_undo) for norm in net.norms]
        net(sound)  # each normalisation is undone in turn: what follows sees what it learned with
    for hook in hooks:
        hook.remove()
    return net


def _undo(norm: nn.Module, given: tuple[Tensor]) -> None:
    norm.weight.copy_(torch.sqrt(given[0].var(dim=(0, 2)) + norm.eps))
    norm.bias.copy_(given[0].mean(dim=(0, 2)))


Pairs = list[tuple[NDArray[np.float32], NDArray[np.float32]]]
"""Of each layer a matrix, shape (inputs, outputs), and offsets, as in `Weights`; the last one is `Weights.out`."""


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


def averaged(before: Pairs, after: Pairs) -> Pairs:
    """Between two of the same layers."""
    return [
        (KEPT * was + (1.0 - KEPT) * now, KEPT * was_off + (1.0 - KEPT) * off)
        for (was, was_off), (now, off) in zip(before, after, strict=True)
    ]


class Folded(nn.Module):
    """The net of such weights, not to be trained."""

    def __init__(self, pairs: Pairs) -> None:
        super().__init__()
        self._pairs = [(torch.from_numpy(matrix), torch.from_numpy(offsets)) for matrix, offsets in pairs]

    def forward(self, sound: Tensor) -> Tensor:
        """As `Net.forward`."""
        *layers, (matrix, offsets) = self._pairs
        for number, (weights, off) in enumerate(layers):
            size, gap = (SIZES[number], 1) if number < len(SIZES) else (SIZE, GAPS[number - len(SIZES)])
            step = 2 if number < len(SIZES) else 1
            kernel = weights.reshape(size, -1, weights.shape[1]).permute(2, 1, 0)
            padded = nn.functional.pad(sound, (size - 2 if step == 2 else (size - 1) * gap, 0))
            found = torch.relu(nn.functional.conv1d(padded, kernel, off, step, dilation=gap))
            sound = found if step == 2 else sound + found
        return nn.functional.conv1d(sound, matrix.T[:, :, None], offsets)


@dataclass(frozen=True, eq=False)
class Data:
    """`logs`: shape (takes, frames, N_BANDS); `labels`: shape (takes, curves, words, chunks), how each chunk stands to
    each word."""

    logs: NDArray[np.float16]
    labels: NDArray[np.int8]
    inside: NDArray[np.bool_]

    @classmethod
    def load(cls, paths: Sequence[Path]) -> Data:
        files = [np.load(path) for path in paths]
        logs, ends, inside = (np.concatenate([file[key] for file in files]) for key in ("logs", "ends", "inside"))
        n_chunks = logs.shape[1] // CHUNK_FRAMES
        known = (np.arange(1, n_chunks + 1) * CHUNK_FRAMES - 1) * HOP_SAMPLES + WINDOW_SAMPLES
        late_s = (known[None, None] - ends[:, :, None] * HOP_SAMPLES) / SAMPLE_RATE_HZ
        labels = np.full((len(ends), len(TOLD_S), *late_s.shape[1:]), NOTHING, np.int8)
        for curve, (told_s, spared_s) in enumerate(zip(TOLD_S, SPARED_S, strict=True)):
            labels[:, curve][(late_s >= spared_s[0]) & (late_s < spared_s[1])] = SPARED
            labels[:, curve][(late_s >= told_s[0]) & (late_s < told_s[1])] = TOLD
        labels[np.broadcast_to((ends < 0)[:, None, :, None], labels.shape)] = NOTHING
        labels[inside, 0] = SPARED
        return cls(logs, labels, inside)

    def batches(
        self, rng: np.random.Generator | None, takes: NDArray[np.int64] | None = None
    ) -> Iterator[tuple[NDArray[np.int64], Tensor, Tensor]]:
        """All takes, or those, with their numbers; with `rng`, in any order, some after something louder, and with
        parts left out."""
        order = takes if takes is not None else np.arange(len(self.logs))
        order = rng.permutation(order) if rng is not None else order
        for at in range(0, len(order), BATCH):
            some = np.sort(order[at : at + BATCH])
            energies = np.exp(self.logs[some].astype(np.float32))
            if rng is not None:
                energies = self._varied(energies, rng)
            sound = inputs(energies, rng)
            if rng is not None:
                _leave_out(sound, rng)
            yield some, torch.from_numpy(sound.transpose(0, 2, 1).copy()), torch.from_numpy(self.labels[some])

    @cached_property
    def _without(self) -> NDArray[np.int64]:
        return np.flatnonzero((self.labels == NOTHING).all(axis=(1, 2, 3)))

    def _varied(self, energies: NDArray[np.float32], rng: np.random.Generator) -> NDArray[np.float32]:
        """Other heads, other microphones, and something else fainter in the background."""
        n = len(energies)
        bands = np.arange(N_BANDS) + np.clip(rng.normal(0.0, 0.7, (n, 1)), -2.0, 2.0)
        below = np.clip(np.floor(bands), 0, N_BANDS - 2).astype(int)
        share = np.clip(bands - below, 0.0, 1.0)[:, None].astype(np.float32)
        rows = np.arange(n)[:, None]
        turned = energies.transpose(0, 2, 1)
        moved = (
            turned[rows, below].transpose(0, 2, 1) * (1 - share) + turned[rows, below + 1].transpose(0, 2, 1) * share
        )
        corners = np.cumsum(rng.normal(0.0, 0.4, (n, 6)), axis=1)
        at = np.linspace(0.0, 5.0, N_BANDS)
        moved *= np.exp(np.stack([np.interp(at, np.arange(6), row) for row in corners]))[:, None].astype(np.float32)
        others = rng.choice(self._without, size=n)
        other = np.exp(self.logs[others].astype(np.float32))
        ratio = moved[: len(other)].mean(axis=(1, 2)) / other.mean(axis=(1, 2))
        gains = ratio * 10.0 ** (-rng.uniform(0.1, 2.5, len(other))) * (rng.random(len(other)) < 0.5)
        moved[: len(other)] += gains[:, None, None].astype(np.float32) * other
        return np.asarray(moved, np.float32)


def inputs(energies: NDArray[np.float32], rng: np.random.Generator | None) -> NDArray[np.float32]:
    """What the net is given of takes, shape (takes, frames, N_INPUTS)."""
    levels, found = Levels(), []
    for at in range(0, energies.shape[1], CHUNK_FRAMES):
        found.append(levels.take(energies[:, at : at + CHUNK_FRAMES]))
        if at == 0 and rng is not None:
            some = rng.random((len(energies), 1)) < DISTURBED
            levels.scale(np.exp(some * rng.uniform(*DISTURBANCE, (len(energies), 1))).astype(np.float32))
    return np.concatenate(found, axis=1)


def _leave_out(sound: NDArray[np.float32], rng: np.random.Generator) -> None:
    for row in sound:
        if rng.random() < 0.4:
            band, n = int(rng.integers(N_BANDS)), int(rng.integers(1, 5))
            row[:, band : min(band + n, N_BANDS)] = 0.0
            row[:, N_BANDS + band : N_BANDS + min(band + n, N_BANDS)] = 0.0


def loss_of(logits: Tensor, labels: Tensor, weight: float) -> Tensor:
    """Each word must be told twice within its time, and nothing elsewhere; of each take."""
    is_told = labels == TOLD
    window = torch.where(is_told, logits[:, :, None], torch.tensor(-40.0))
    best = window.topk(2, dim=-1).values.mean(dim=-1)
    found = (nn.functional.softplus(-best) * is_told.any(dim=-1)).sum(dim=(1, 2))
    wrong = (nn.functional.softplus(logits) * (labels == NOTHING).all(dim=2)).sum(dim=(1, 2))
    return found + weight * wrong


@dataclass(frozen=True, eq=False)
class Told:
    """Of one curve: the logit that counts of each word; each highest logit of 1.2 s without one; hours of that."""

    words: NDArray[np.float64]
    others: NDArray[np.float64]
    hours: float

    def __str__(self) -> str:
        """How many words are heard where so much else is taken for one."""
        parts = []
        for rate in (100.0, 30.0, 10.0, 3.0):
            least = np.sort(self.others)[::-1][min(int(rate * self.hours), len(self.others) - 1)]
            parts.append(f"{100 * np.mean(self.words > least):.1f} % at {rate:.0f}/h ({least:.1f})")
        return ", ".join(parts)


def check(net: nn.Module, data: Data) -> list[Told]:
    """How well each curve tells the word, without takes in which it is part of a sentence."""
    net.eval()
    words, others = [list[float]() for _ in TOLD_S], [list[float]() for _ in TOLD_S]
    chunks = [0 for _ in TOLD_S]
    with torch.no_grad():
        for _, sound, labels in data.batches(None, np.flatnonzero(~data.inside)):
            for curve, logits in enumerate(net(sound).unbind(1)):
                is_told = labels[:, curve] == TOLD
                window = torch.where(is_told, logits[:, None], torch.tensor(-40.0))
                words[curve] += window.topk(2, dim=-1).values[..., -1][is_told.any(dim=-1)].tolist()
                nothing = (labels[:, curve] == NOTHING).all(dim=1)
                rest = torch.where(nothing, logits, torch.tensor(-40.0))[:, 10:]
                chunks[curve] += int(nothing[:, 10:].sum())
                n = rest.shape[1] // 30 * 30
                others[curve] += rest[:, :n].reshape(len(rest), -1, 30).topk(2, -1).values[..., -1].flatten().tolist()
    net.train()
    hours = [n * CHUNK_FRAMES * HOP_SAMPLES / SAMPLE_RATE_HZ / 3600.0 for n in chunks]
    return [Told(np.array(w), np.array(o), h) for w, o, h in zip(words, others, hours, strict=True)]


def calibrated(words: NDArray[np.float64], others: NDArray[np.float64]) -> tuple[float, float]:
    """Slope and offset that make logits the odds, words and 1.2 s without one as frequent as in the material (J. Platt,
    1999)."""
    x = torch.tensor(np.concatenate([words, others[others > -39.0]]))
    y = torch.tensor(np.concatenate([np.ones(len(words)), np.zeros(int((others > -39.0).sum()))]))
    line = torch.tensor([1.0, 0.0], dtype=torch.float64, requires_grad=True)
    optimizer = torch.optim.LBFGS([line], max_iter=200)

    def closure() -> Tensor:
        optimizer.zero_grad()
        loss = nn.functional.binary_cross_entropy_with_logits(line[0] * x + line[1], y)
        loss.backward()  # type: ignore[no-untyped-call]
        return loss

    optimizer.step(closure)  # type: ignore[arg-type]
    slope, offset = line.detach().tolist()
    return slope, offset


def save(path: Path, pairs: Pairs, lines: Sequence[tuple[float, float]], notes: str) -> None:
    """In bytes, with a scale for each output."""
    slopes, intercepts = np.array(lines, np.float32).T
    arrays: dict[str, Any] = {"slopes": slopes, "intercepts": intercepts, "notes": notes}
    for number, (matrix, offsets) in enumerate(pairs):
        scale = np.maximum(np.abs(matrix).max(axis=0), 1e-9) / 127.0
        arrays |= {
            f"weights{number}": np.round(matrix / scale).astype(np.int8),
            f"scale{number}": scale.astype(np.float32),
            f"offsets{number}": offsets.astype(np.float32),
        }
    np.savez_compressed(path, **arrays)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("material", type=Path, nargs="+")
    parser.add_argument("--check", type=Path, required=True)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--minutes", type=float, default=12.0)
    parser.add_argument("--weight", type=float, default=0.5, help="of what is told in error")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--rate", type=float, default=3e-3)
    parser.add_argument("--start", type=Path, help="go on from these weights")
    o = parser.parse_args()
    torch.manual_seed(o.seed)
    torch.set_num_threads(2)
    rng = np.random.default_rng(o.seed)
    data, validation = Data.load(o.material), Data.load([o.check])
    net = started(o.start, data) if o.start is not None else Net()
    optimizer = torch.optim.AdamW(net.parameters(), lr=o.rate, weight_decay=0.01)
    began, losses, next_told = time.monotonic(), list[float](), 60.0
    share, last = 0.0, np.full(len(data.logs), np.inf)
    while share < 1.0:
        takes = np.flatnonzero((last > EASY) | (rng.random(len(last)) > PASSED_OVER))
        for some, sound, labels in data.batches(rng, takes):
            share = (time.monotonic() - began) / (60.0 * o.minutes)
            if share >= 1.0:
                break
            rate = o.rate * min(share / 0.03 + 0.05, 1.0) * 0.5 * (1.0 + np.cos(np.pi * share)) + 1e-5
            for group in optimizer.param_groups:
                group["lr"] = rate
            optimizer.zero_grad()
            with torch.autocast("cpu", torch.bfloat16):  # half the time where the processor has it
                logits = net(sound)
            each = loss_of(logits.float(), labels, o.weight)
            last[some] = each.detach().numpy()
            loss = each.mean()
            loss.backward()  # type: ignore[no-untyped-call]
            nn.utils.clip_grad_norm_(net.parameters(), 5.0)
            optimizer.step()
            losses.append(float(loss.detach()))
            if time.monotonic() - began > next_told:
                next_told += 60.0
                score = " | ".join(map(str, check(net, validation)))
                print(f"{len(losses):6d} {len(takes)} {np.mean(losses[-200:]):.3f} {score}", flush=True)
    pairs = folded(net)
    if o.start is not None:
        pairs = averaged(stored(o.start), pairs)
    found = check(Folded(pairs), validation)
    score = " | ".join(map(str, found))
    print(score)
    today = datetime.date.today().isoformat()
    notes = f"{today}, {len(data.logs)} takes, seed {o.seed}, {len(losses)} steps; validation: {score}"
    save(o.out, pairs, [calibrated(each.words, each.others) for each in found], notes)


if __name__ == "__main__":
    main()
