"""Trains a net of `hvcpd.people.phones` (needs PyTorch 2.9 or later) and writes its weights.

    python -m benchmarks.phones.train FILE.npz... --check FILE.npz... --apart 1 2 3 ... --out FILE.npz
        [--minutes 82] [--seed 1] [--rate 2e-3] [--from FILE.npz] [--mmi 1]

With `--from` it goes on from the weights in a file, and `--apart` is that net's. With `--mmi` it learns to tell what
was said from all other speech, too (`denominator.py`), as the confidence of a sentence does. From then on the best
path's phones mean less: those that are likely anyway need not be clear.

Connectionist temporal classification: A. Graves, S. Fernandez, F. Gomez & J. Schmidhuber, ICML 2006. Bands and
stretches of time are left out at random as in SpecAugment (D. S. Park et al., Interspeech 2019), and bands are moved as
by a longer or shorter vocal tract (N. Jaitly & G. Hinton, "Vocal tract length perturbation", ICML 2013).
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Iterator, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor, nn

from benchmarks.phones.denominator import log_denominator, trigrams
from benchmarks.phones.muon import Muon
from benchmarks.phones.precision import TRAINED_IN
from benchmarks.phones.stored import stored
from benchmarks.transcripts import edits
from hvcpd.people.bands import N_BANDS
from hvcpd.people.phones import KERNEL_SIZES, PHONES

BLANK = len(PHONES)
WIDTH = 320
BATCH_FRAMES = 10000
PADDED = 32
"""Takes are padded to multiples of so many frames."""
WARP = (0.9, 1.1)
DECAY = 0.01
"""Of weights, times the rate of learning."""
PRINTED = 2000
"""Steps from one check to the next."""


class Residual(torch.autograd.Function):
    """`relu(x + shifted(x) weights + bias)` as one operation, shape (batch, frames, units): a third of the units of
    `shifted(x)` are `apart` frames earlier, a third as many later. As several, most of the time goes into copies."""

    @staticmethod
    def forward(ctx: Any, sound: Tensor, weights: Tensor, bias: Tensor, apart: int) -> Tensor:
        third, seen = sound.shape[2] // 3, sound.clone()
        seen[:, :apart, :third] = 0.0
        seen[:, apart:, :third] = sound[:, :-apart, :third]
        seen[:, -apart:, 2 * third :] = 0.0
        seen[:, :-apart, 2 * third :] = sound[:, apart:, 2 * third :]
        out = torch.addmm(bias, seen.flatten(0, 1), weights).add_(sound.flatten(0, 1)).relu_()
        ctx.save_for_backward(seen, out, weights)
        ctx.apart = apart
        return out.view(sound.shape)

    @staticmethod
    def backward(ctx: Any, grad: Tensor) -> tuple[Tensor, Tensor, Tensor, None]:  # type: ignore[override]
        seen, out, weights = ctx.saved_tensors
        third, apart = seen.shape[2] // 3, ctx.apart
        flat = torch.ops.aten.threshold_backward(grad.flatten(0, 1), out, 0)
        of_weights, of_bias = seen.flatten(0, 1).T @ flat, flat.sum(0)
        of_seen = (flat @ weights.T).view(grad.shape)
        of_sound = flat.view(grad.shape)
        of_sound[:, :-apart, :third] += of_seen[:, apart:, :third]
        of_sound[:, :, third : 2 * third] += of_seen[:, :, third : 2 * third]
        of_sound[:, apart:, 2 * third :] += of_seen[:, :-apart, 2 * third :]
        return of_sound, of_weights, of_bias, None


class Net(nn.Module):
    """As `hvcpd.people.phones.PhoneNet`."""

    def __init__(self, apart: Sequence[int]) -> None:
        super().__init__()
        first, second = KERNEL_SIZES
        self.apart = tuple(apart)
        inputs = [first * N_BANDS, second * WIDTH, *[WIDTH] * len(self.apart)]
        # the residual layers begin with little to add, so that the sum of many stays small
        deviations = [(2.0 / n) ** 0.5 for n in inputs[:2]] + [0.5 * WIDTH**-0.5] * len(self.apart)
        self.weights = nn.ParameterList(
            nn.Parameter(torch.randn(n, WIDTH) * each) for n, each in zip(inputs, deviations, strict=True)
        )
        self.biases = nn.ParameterList(nn.Parameter(torch.zeros(WIDTH)) for _ in inputs)
        self.out = nn.Linear(WIDTH, BLANK + 1)

    def forward(self, sound: Tensor) -> Tensor:
        """From (batch, bands, frames) to logits (batch, phones, half the frames); while it is trained, in half of the
        precision and of the time where the processor can."""
        kind = TRAINED_IN if self.training else torch.float32
        sound = sound.transpose(1, 2).to(kind)
        layers = [(weights.to(kind), bias.to(kind)) for weights, bias in zip(self.weights, self.biases, strict=True)]
        for number, size in enumerate(KERNEL_SIZES):
            weights, bias = layers[number]
            sound = torch.relu(beside(sound, size, number + 1) @ weights + bias)
        for apart, (weights, bias) in zip(self.apart, layers[len(KERNEL_SIZES) :], strict=True):
            sound = Residual.apply(sound, weights, bias, apart)
        logits: Tensor = self.out(sound.float())
        return logits.transpose(1, 2)


def beside(sound: Tensor, size: int, step: int) -> Tensor:
    """Every `step`-th frame of (batch, frames, units) with those around it, `size` in all."""
    n, padded = sound.shape[1], nn.functional.pad(sound, (0, 0, size // 2, size // 2))
    return torch.cat([padded[:, k : k + n : step] for k in range(size)], dim=2)


class Data:
    """Takes, in batches of about equal length."""

    def __init__(self, paths: Sequence[Path]) -> None:
        self.logs: list[np.ndarray] = []
        self.phones: list[np.ndarray] = []
        for path in paths:
            file = np.load(path)
            self.logs += np.split(file["logs"], np.cumsum(file["n_frames"])[:-1])
            self.phones += np.split(file["phones"].astype(np.int64), np.cumsum(file["n_phones"])[:-1])

    def batches(self, rng: np.random.Generator) -> Iterator[list[int]]:
        """Numbers of takes, each once."""
        padded = np.array([_padded(len(each)) for each in self.logs])
        batches: list[list[int]] = []
        for length in np.unique(padded):
            numbers = rng.permutation(np.flatnonzero(padded == length)).tolist()
            size = max(BATCH_FRAMES // int(length), 1)
            batches += [numbers[begin : begin + size] for begin in range(0, len(numbers), size)]
        rng.shuffle(batches)  # type: ignore[arg-type]
        yield from batches

    def batch(self, numbers: Sequence[int], rng: np.random.Generator | None) -> tuple[Tensor, Tensor, Tensor, Tensor]:
        """Sound, frames that the net makes of it, phones, and how many; with `rng`, with parts left out."""
        n_frames = np.array([len(self.logs[n]) for n in numbers])
        sound = np.zeros((len(numbers), N_BANDS, _padded(n_frames.max())), np.float32)
        for row, number in enumerate(numbers):
            logs = self.logs[number].T.astype(np.float32)
            if rng is not None:
                logs = _warped(logs, float(rng.uniform(*WARP)))
            sound[row, :, : logs.shape[1]] = logs
            if rng is not None:
                _mask(sound[row], logs.shape[1], rng)
        phones = np.concatenate([self.phones[n] for n in numbers])
        n_phones = np.array([len(self.phones[n]) for n in numbers])
        return (
            torch.from_numpy(sound),
            torch.from_numpy((n_frames + 1) // 2),
            torch.from_numpy(phones),
            torch.from_numpy(n_phones),
        )


def _padded(n_frames: int) -> int:
    """Few lengths, since PyTorch prepares a product of matrices anew for each."""
    return -(-n_frames // PADDED) * PADDED


def _warped(logs: np.ndarray, factor: float) -> np.ndarray:
    """Bands read at `factor` times their place, shape (bands, frames)."""
    place = np.minimum(np.arange(N_BANDS) * factor, N_BANDS - 1)
    low = np.minimum(place.astype(np.int64), N_BANDS - 2)
    share = (place - low).astype(np.float32)[:, None]
    return np.asarray((1.0 - share) * logs[low] + share * logs[low + 1])


def _mask(logs: np.ndarray, n_frames: int, rng: np.random.Generator) -> None:
    for _ in range(2):
        width = int(rng.integers(0, 5))
        band = int(rng.integers(0, N_BANDS - width))
        logs[band : band + width] = 0.0
        width = int(rng.integers(0, 8))
        at = int(rng.integers(0, max(n_frames - width, 1)))
        logs[:, at : at + width] = 0.0
    logs += rng.normal(0, 0.5)
    logs += rng.normal(0, 0.6) * np.linspace(-1, 1, N_BANDS, dtype=np.float32)[:, None]


def loss_of(
    net: Net, batch: tuple[Tensor, Tensor, Tensor, Tensor], mmi: float = 0.0, after_two: Tensor | None = None
) -> Tensor:
    """Per phone; with the log likelihood of any speech by its trigrams (`denominator.py`), times `mmi`."""
    sound, n_frames, phones, n_phones = batch
    log_posteriors = torch.log_softmax(net(sound), 1).permute(2, 0, 1)
    total = nn.functional.ctc_loss(log_posteriors, phones, n_frames, n_phones, BLANK, "sum", zero_infinity=True)
    if after_two is not None:
        total = total + mmi * log_denominator(log_posteriors, n_frames, after_two).sum()
    loss: Tensor = total / max(int(n_phones.sum()), 1)
    return loss


def errors_of(net: Net, data: Data) -> tuple[float, float]:
    """The mean loss, and phones wrong over phones said, of the best path."""
    net.eval()
    losses, wrong, said = [], 0, 0
    rng = np.random.default_rng(0)
    with torch.no_grad():
        for numbers in data.batches(rng):
            batch = data.batch(numbers, None)
            losses.append(float(loss_of(net, batch)))
            best = net(batch[0]).argmax(1).numpy()
            for row, number in enumerate(numbers):
                path = best[row, : int(batch[1][row])]
                kept = path[(path != BLANK) & (path != np.concatenate(([BLANK], path[:-1])))]
                wrong += edits(kept.tolist(), data.phones[number].tolist())
                said += len(data.phones[number])
    net.train()
    return float(np.mean(losses)), wrong / said


def weights_of(net: Net) -> dict[str, np.ndarray]:
    """Of each layer `weights0`, shape (inputs, outputs), bytes, with a scale for each output, `scale0`, and `bias0`,
    ...; the last layer's end in "_out"."""
    found: dict[str, np.ndarray] = {}
    for number, (weights, bias) in enumerate(zip(net.weights, net.biases, strict=True)):
        found |= stored(f"{number}", weights.detach().numpy(), bias.detach().numpy())
    found |= stored("_out", net.out.weight.detach().T.numpy(), net.out.bias.detach().numpy())
    return found | {"apart": np.array(net.apart, np.int64)}


def begun(path: Path) -> Net:
    """The net in a file."""
    file = np.load(path)
    net = Net(file["apart"].tolist())

    def weights(name: str) -> Tensor:
        return torch.from_numpy(file[f"weights{name}"] * file[f"scale{name}"])

    for number, (matrix, bias) in enumerate(zip(net.weights, net.biases, strict=True)):
        matrix.data, bias.data = weights(f"{number}"), torch.from_numpy(file[f"bias{number}"])
    net.out.weight.data, net.out.bias.data = weights("_out").T.contiguous(), torch.from_numpy(file["bias_out"])
    return net


def optimizers_of(net: Net, rate: float) -> tuple[torch.optim.Optimizer, torch.optim.Optimizer]:
    """Muon for matrices, whose steps are made orthogonal; Adam for what is left."""
    matrices = list(net.weights)
    rest = [*net.biases, *net.out.parameters()]
    return (
        Muon(matrices, rate, DECAY),
        torch.optim.AdamW(rest, rate, weight_decay=0.0),
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("data", type=Path, nargs="+")
    parser.add_argument("--check", type=Path, nargs="+", required=True, help="voices that are not trained on")
    net_is = parser.add_mutually_exclusive_group(required=True)
    net_is.add_argument("--apart", type=int, nargs="+", help="frames, of each residual layer of a new net")
    net_is.add_argument("--from", type=Path, dest="begun", help="go on from these weights")
    parser.add_argument("--mmi", type=float, default=0.0, help="weight of the denominator, 1 for MMI alone")
    parser.add_argument("--rate", type=float, default=2e-3, help="of learning, at most")
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--minutes", type=float, default=82.0, help="of a processor")
    parser.add_argument("--seed", type=int, default=1)
    o = parser.parse_args()
    torch.manual_seed(o.seed)
    torch.set_num_threads(1)
    rng = np.random.default_rng(o.seed)
    data, checks = Data(o.data), [Data([path]) for path in o.check]
    net = Net(o.apart) if o.begun is None else begun(o.begun)
    print("check:", [errors_of(net, check) for check in checks], flush=True)
    after_two = torch.from_numpy(trigrams(data.phones)) if o.mmi > 0.0 else None
    optimizers = optimizers_of(net, o.rate)
    begin, step, losses = time.process_time(), 0, []
    while (done := (time.process_time() - begin) / 60.0 / o.minutes) < 1.0:
        for numbers in data.batches(rng):
            done = (time.process_time() - begin) / 60.0 / o.minutes
            falling = max(0.5 * (1 + np.cos(np.pi * min(done, 1.0))), 0.003)
            loss = loss_of(net, data.batch(numbers, rng), o.mmi, after_two)
            net.zero_grad()
            loss.backward()
            nn.utils.clip_grad_norm_(net.parameters(), 5.0)
            for optimizer in optimizers:
                for group in optimizer.param_groups:
                    group["lr"] = o.rate * min(1.0, (step + 1) / 200) * falling
                optimizer.step()
            losses.append(float(loss.detach()))
            step += 1
            if step % PRINTED == 0:
                errors = [errors_of(net, check) for check in checks]
                print(f"{done:.2f} step {step}: {np.mean(losses[-PRINTED:]):.3f}; check {errors}", flush=True)
            if done >= 1.0:
                break
    last = {path.stem: errors_of(net, check) for path, check in zip(o.check, checks, strict=True)}
    print(f"step {step}; check: loss, phone errors {last}")
    net.eval()
    about = {
        "date": datetime.now(UTC).date().isoformat(),
        "data": [path.name for path in o.data],
        "from": None if o.begun is None else str(o.begun),
        "seed": o.seed,
        "mmi": o.mmi,
        "minutes": o.minutes,
        "steps": step,
        "loss and phone errors": last,
    }
    np.savez(o.out, about=np.array(json.dumps(about)), **weights_of(net))  # type: ignore[arg-type]


if __name__ == "__main__":
    main()
