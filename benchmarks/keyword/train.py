"""Trains the net of `hvcpd.recognition.keyword` (needs PyTorch: pip install torch) and writes its weights.

    nice python -m benchmarks.keyword.train material.npz... --check validation.npz --out stop.npz [--minutes 12]
        [--seed 1] [--state FILE] [--rate 0.003]

The word may be told at any time within 0.2 s of its end; what is told while it ends, and soon after, does not count.
"""

from __future__ import annotations

import argparse
import datetime
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
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
TOLD_S = (0.02, 0.22)
"""When the word should be told, after its end."""
SPARED_S = (-0.16, 0.6)
"""When it may be told, too, or not."""
BATCH = 64
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
        self.out = nn.Conv1d(width, 1, 1)
        self.drop = nn.Dropout(0.1)

    def forward(self, sound: Tensor) -> Tensor:
        """From (batch, N_INPUTS, frames) to logits (batch, chunks)."""
        for number, (layer, norm) in enumerate(zip(self.layers, self.norms, strict=True)):
            before = SIZES[number] - 2 if number < len(SIZES) else (SIZE - 1) * GAPS[number - len(SIZES)]
            found = torch.relu(norm(layer(nn.functional.pad(sound, (before, 0)))))
            sound = found if number < len(SIZES) else sound + self.drop(found)
        logits: Tensor = self.out(sound)[:, 0]
        return logits


@dataclass(frozen=True, eq=False)
class Data:
    """`logs`: shape (takes, frames, N_BANDS); `labels`: shape (takes, words, chunks), how each chunk stands to each."""

    logs: NDArray[np.float16]
    labels: NDArray[np.int8]

    @classmethod
    def load(cls, paths: Sequence[Path]) -> Data:
        files = [np.load(path) for path in paths]
        logs, ends = (np.concatenate([file[key] for file in files]) for key in ("logs", "ends"))
        n_chunks = logs.shape[1] // CHUNK_FRAMES
        known = (np.arange(1, n_chunks + 1) * CHUNK_FRAMES - 1) * HOP_SAMPLES + WINDOW_SAMPLES
        late_s = (known[None, None] - ends[:, :, None] * HOP_SAMPLES) / SAMPLE_RATE_HZ
        labels = np.full(late_s.shape, NOTHING, np.int8)
        labels[(late_s >= SPARED_S[0]) & (late_s < SPARED_S[1])] = SPARED
        labels[(late_s >= TOLD_S[0]) & (late_s < TOLD_S[1])] = TOLD
        labels[ends < 0] = NOTHING
        return cls(logs, labels)

    def batches(self, rng: np.random.Generator | None) -> Iterator[tuple[Tensor, Tensor]]:
        """All takes; with `rng`, in any order, some after something louder, and with parts left out."""
        order = rng.permutation(len(self.logs)) if rng is not None else np.arange(len(self.logs))
        for at in range(0, len(order), BATCH):
            some = np.sort(order[at : at + BATCH])
            energies = np.exp(self.logs[some].astype(np.float32))
            if rng is not None:
                energies = self._varied(energies, rng)
            sound = inputs(energies, rng)
            if rng is not None:
                _leave_out(sound, rng)
            yield torch.from_numpy(sound.transpose(0, 2, 1).copy()), torch.from_numpy(self.labels[some])

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
        has_word = (self.labels != NOTHING).any(axis=(1, 2))
        others = rng.integers(len(self.logs), size=n)
        others = others[~has_word[others]]
        other = np.exp(self.logs[others].astype(np.float32))
        ratio = moved[: len(other)].mean(axis=(1, 2)) / other.mean(axis=(1, 2))
        gains = ratio * 10.0 ** (-rng.uniform(0.3, 2.5, len(other))) * (rng.random(len(other)) < 0.5)
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
    """Each word must be told twice within its time, and nothing elsewhere."""
    is_told = labels == TOLD
    window = torch.where(is_told, logits[:, None], torch.tensor(-40.0))
    best = window.topk(2, dim=-1).values.mean(dim=-1)
    found = nn.functional.softplus(-best[is_told.any(dim=-1)]).sum()
    nothing = (labels == NOTHING).all(dim=1)
    wrong = nn.functional.softplus(logits[nothing])
    return (found + weight * wrong.sum()) / len(logits)


def check(net: Net, data: Data) -> tuple[NDArray[np.float64], NDArray[np.float64], float]:
    """The best logit of each word; each highest logit of 1.2 s without one; hours of that."""
    net.eval()
    words, others, chunks = [], [], 0
    with torch.no_grad():
        for sound, labels in data.batches(None):
            logits = net(sound)
            window = torch.where(labels == TOLD, logits[:, None], torch.tensor(-40.0))
            best = window.topk(2, dim=-1).values.max(dim=-1).values
            words += best[(labels == TOLD).any(dim=-1)].tolist()
            nothing = (labels == NOTHING).all(dim=1)
            rest = torch.where(nothing, logits, torch.tensor(-40.0))[:, 10:]
            chunks += int(nothing[:, 10:].sum())
            n = rest.shape[1] // 30 * 30
            others += rest[:, :n].reshape(len(rest), -1, 30).max(dim=-1).values.flatten().tolist()
    net.train()
    return np.array(words), np.array(others), chunks * CHUNK_FRAMES * HOP_SAMPLES / SAMPLE_RATE_HZ / 3600.0


def told(words: NDArray[np.float64], others: NDArray[np.float64], hours: float) -> str:
    """How many words are heard at a given rate of false alarms."""
    parts = []
    for rate in (100.0, 30.0, 10.0, 3.0):
        least = np.sort(others)[::-1][min(int(rate * hours), len(others) - 1)]
        parts.append(f"{100 * np.mean(words > least):.1f} % at {rate:.0f}/h ({least:.1f})")
    return ", ".join(parts)


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


def save(path: Path, net: Net, line: tuple[float, float], notes: str) -> None:
    """In bytes, with a scale for each output; normalisation becomes part of the weights."""
    net.eval()
    arrays: dict[str, Any] = {"slope": line[0], "offset": line[1], "notes": notes}
    pairs = [(layer, norm) for layer, norm in zip(net.layers, net.norms, strict=True)]
    for number, (layer, norm) in enumerate([*pairs, (net.out, None)]):
        weights, offsets = layer.weight.detach().numpy(), layer.bias.detach().numpy()
        if norm is not None:
            gain = (norm.weight / torch.sqrt(norm.running_var + norm.eps)).detach().numpy()
            weights = weights * gain[:, None, None]
            offsets = (offsets - norm.running_mean.numpy()) * gain + norm.bias.detach().numpy()
        matrix = weights.transpose(2, 1, 0).reshape(-1, weights.shape[0])
        scale = np.abs(matrix).max(axis=0) / 127.0
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
    parser.add_argument("--state", type=Path, help="go on from, and keep, the net as it is in PyTorch")
    o = parser.parse_args()
    torch.manual_seed(o.seed)
    torch.set_num_threads(1)
    rng = np.random.default_rng(o.seed)
    data, validation = Data.load(o.material), Data.load([o.check])
    net = Net()
    if o.state is not None and o.state.exists():
        net.load_state_dict(torch.load(o.state))
    optimizer = torch.optim.AdamW(net.parameters(), lr=o.rate, weight_decay=0.01)
    began, losses, next_told = time.monotonic(), list[float](), 60.0
    share = 0.0
    while share < 1.0:
        for sound, labels in data.batches(rng):
            share = (time.monotonic() - began) / (60.0 * o.minutes)
            if share >= 1.0:
                break
            rate = o.rate * min(share / 0.03 + 0.05, 1.0) * 0.5 * (1.0 + np.cos(np.pi * share)) + 1e-5
            for group in optimizer.param_groups:
                group["lr"] = rate
            optimizer.zero_grad()
            with torch.autocast("cpu", torch.bfloat16):  # half the time where the processor has it
                logits = net(sound)
            loss = loss_of(logits.float(), labels, o.weight)
            loss.backward()  # type: ignore[no-untyped-call]
            nn.utils.clip_grad_norm_(net.parameters(), 5.0)
            optimizer.step()
            losses.append(float(loss.detach()))
            if time.monotonic() - began > next_told:
                next_told += 60.0
                print(f"{len(losses):6d} {np.mean(losses[-200:]):.3f} {told(*check(net, validation))}", flush=True)
    words, others, hours = check(net, validation)
    score = told(words, others, hours)
    print(score)
    today = datetime.date.today().isoformat()
    notes = f"{today}, {len(data.logs)} takes, seed {o.seed}, {len(losses)} steps; validation: {score}"
    save(o.out, net, calibrated(words, others), notes)
    if o.state is not None:
        torch.save(net.state_dict(), o.state)


if __name__ == "__main__":
    main()
