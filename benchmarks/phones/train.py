"""Trains the net of `hvcpd.people.phones` (needs PyTorch) and writes its weights.

    python -m benchmarks.phones.train FILE.npz... --check FILE.npz... --out FILE.npz [--minutes 40] [--seed 1]
        [--start FILE.npz] [--width 320] [--rate 2e-3]

Connectionist temporal classification: A. Graves, S. Fernandez, F. Gomez & J. Schmidhuber, ICML 2006. Bands and
stretches of time are left out at random as in SpecAugment (D. S. Park et al., Interspeech 2019), and bands are moved as
by a longer or shorter vocal tract (N. Jaitly & G. Hinton, "Vocal tract length perturbation", ICML 2013).

With --start the net goes on from other weights, of as many units or fewer.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
import torch
from torch import Tensor, nn

from benchmarks.keyword.model import in_bytes
from benchmarks.transcripts import edits
from hvcpd.people.bands import N_BANDS
from hvcpd.people.phones import APART, HALVES, PHONES, whole_weights

BLANK = len(PHONES)
WIDTH = 320
LAYERS = tuple((3 if number else 5, 2 if number == HALVES else 1, apart) for number, apart in enumerate(APART))
"""Of each layer: how many frames it sees, its step, and how far apart they are."""
MOST = 31
"""The largest weight as it is stored: six bits, which pack into three quarters of the space of eight."""
BATCH_FRAMES = 6000
WARP = (0.93, 1.07)
PRINTED = 400
"""Steps from one check to the next."""


class Net(nn.Module):
    """Convolutions in time; after HALVES what a layer finds is added to what it was given.

    Each is one product of matrices, its inputs side by side: two thirds of the time of `nn.Conv1d`.
    """

    def __init__(self, width: int = WIDTH) -> None:
        super().__init__()
        self.width = width
        inputs = [N_BANDS, *[width] * (len(LAYERS) - 1)]
        self.layers = nn.ModuleList(nn.Linear(size * n, width) for n, (size, _, _) in zip(inputs, LAYERS, strict=True))
        self.norms = nn.ModuleList(nn.BatchNorm1d(width) for _ in LAYERS)
        self.out = nn.Linear(width, BLANK + 1)
        self.drop = nn.Dropout(0.1)

    def forward(self, sound: Tensor) -> Tensor:
        """From (batch, bands, frames) to logits (batch, phones, half the frames)."""
        sound = sound.transpose(1, 2)
        for number in range(len(LAYERS)):
            sums = self.sums(number, sound)
            found = torch.relu(self.norms[number](sums.flatten(0, 1)).view(sums.shape))
            kept = self.drop(
                torch.ones(len(found), 1, self.width, dtype=found.dtype)
            )  # the same in all of a take: faster
            found = found * kept
            sound = found if number <= HALVES else sound + found
        logits: Tensor = self.out(sound)
        return logits.transpose(1, 2)

    def sums(self, number: int, sound: Tensor) -> Tensor:
        """A layer's weighted sums of (batch, frames, inputs), with silence at both ends."""
        size, step, apart = LAYERS[number]
        reach, n = (size - 1) // 2 * apart, sound.shape[1]
        padded = nn.functional.pad(sound, (0, 0, reach, reach))
        seen = torch.cat([padded[:, k * apart : k * apart + n : step] for k in range(size)], dim=2)
        found: Tensor = self.layers[number](seen)
        return found


def started(net: Net, path: Path, sound: Tensor) -> None:
    """Give the net the weights of a file that `weights_of` wrote, of as many units or fewer.

    Units that the file does not have begin with random weights, and nothing listens to them yet. In the file the norms
    are folded in. Here each gets the mean and variance that its layer has for `sound`, a batch, and is scaled so that
    it changes nothing at first.
    """
    file = {name: torch.from_numpy(values) for name, values in whole_weights(dict(np.load(path))).items()}
    old = len(file["bias0"])
    with torch.no_grad():
        sound = sound.transpose(1, 2)
        for number, (layer, norm) in enumerate(zip(net.layers, net.norms, strict=True)):
            weights = file[f"weights{number}"]
            size, inputs, _ = weights.shape
            given = layer.weight.view(net.width, size, -1)
            given[:old, :, :inputs] = weights.permute(2, 0, 1)
            given[:old, :, inputs:] = 0.0
            layer.bias[:old] = file[f"bias{number}"]
            found = net.sums(number, sound)
            norm.running_mean.copy_(found.mean(dim=(0, 1)))
            norm.running_var.copy_(found.var(dim=(0, 1)))
            norm.weight.copy_(torch.sqrt(norm.running_var + norm.eps))
            norm.bias.copy_(norm.running_mean)
            found = torch.relu(found)
            sound = found if number <= HALVES else sound + found
        net.out.weight.zero_()
        net.out.weight[:, :old] = file["weights_out"].T
        net.out.bias.copy_(file["bias_out"])


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
        length = np.array([len(each) for each in self.logs]) * rng.uniform(0.9, 1.1, len(self.logs))
        batches: list[list[int]] = [[]]
        for number in np.argsort(length):
            if (len(batches[-1]) + 1) * len(self.logs[number]) > BATCH_FRAMES:
                batches.append([])
            batches[-1].append(int(number))
        rng.shuffle(batches)  # type: ignore[arg-type]
        yield from (batch for batch in batches if batch)

    def batch(self, numbers: Sequence[int], rng: np.random.Generator | None) -> tuple[Tensor, Tensor, Tensor, Tensor]:
        """Sound, frames that the net makes of it, phones, and how many; with `rng`, with parts left out."""
        n_frames = np.array([len(self.logs[n]) for n in numbers])
        sound = np.zeros((len(numbers), N_BANDS, n_frames.max()), np.float32)
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


def loss_of(net: Net, batch: tuple[Tensor, Tensor, Tensor, Tensor]) -> Tensor:
    """Per phone."""
    sound, n_frames, phones, n_phones = batch
    with torch.autocast("cpu", torch.bfloat16, enabled=net.training):  # half the time
        logits = net(sound)
    log_posteriors = torch.log_softmax(logits.float(), 1).permute(2, 0, 1)
    total = nn.functional.ctc_loss(log_posteriors, phones, n_frames, n_phones, BLANK, "sum", zero_infinity=True)
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
    """Of each layer, its norm folded in: `weights0`, shape (size, inputs, outputs), bytes, with a scale for each
    output, `scale0`, and `bias0`, ...; the last layer's end in "_out"."""
    found = {}
    for number, (layer, norm) in enumerate(zip(net.layers, net.norms, strict=True)):
        gain = (norm.weight / torch.sqrt(norm.running_var + norm.eps)).detach()
        weights = (
            (layer.weight.detach() * gain[:, None]).view(net.width, LAYERS[number][0], -1).permute(1, 2, 0).numpy()
        )
        bias = ((layer.bias.detach() - norm.running_mean) * gain + norm.bias.detach()).numpy()
        found |= stored(f"{number}", weights, bias)
    return found | stored("_out", net.out.weight.detach().T.numpy(), net.out.bias.detach().numpy())


def stored(name: str, weights: np.ndarray, bias: np.ndarray) -> dict[str, np.ndarray]:
    """The arrays of one layer in a file, whose names end in `name`."""
    whole, scale = in_bytes(weights, MOST)
    return {f"weights{name}": whole, f"scale{name}": scale, f"bias{name}": bias.astype(np.float32)}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("data", type=Path, nargs="+")
    parser.add_argument("--check", type=Path, nargs="+", required=True, help="voices that are not trained on")
    parser.add_argument("--start", type=Path, help="weights to begin with, else random ones")
    parser.add_argument("--width", type=int, default=WIDTH, help="units of a layer")
    parser.add_argument("--rate", type=float, default=2e-3, help="of learning, at most")
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--minutes", type=float, default=40.0, help="of a processor")
    parser.add_argument("--seed", type=int, default=1)
    o = parser.parse_args()
    torch.manual_seed(o.seed)
    torch.set_num_threads(1)
    rng = np.random.default_rng(o.seed)
    data, checks, net = Data(o.data), [Data([path]) for path in o.check], Net(o.width)
    if o.start is not None:
        first = next(iter(data.batches(rng)))
        started(net, o.start, data.batch(first, None)[0])
    print("check:", [errors_of(net, check) for check in checks], flush=True)
    optimizer = torch.optim.AdamW(net.parameters(), o.rate, weight_decay=0.01)
    begin, step, losses = time.process_time(), 0, []
    while (done := (time.process_time() - begin) / 60.0 / o.minutes) < 1.0:
        for numbers in data.batches(rng):
            done = (time.process_time() - begin) / 60.0 / o.minutes
            for group in optimizer.param_groups:
                falling = max(0.5 * (1 + np.cos(np.pi * min(done, 1.0))), 0.003)
                group["lr"] = o.rate * min(1.0, (step + 1) / 200) * falling
            loss = loss_of(net, data.batch(numbers, rng))
            optimizer.zero_grad()
            loss.backward()
            nn.utils.clip_grad_norm_(net.parameters(), 5.0)
            optimizer.step()
            losses.append(float(loss.detach()))
            step += 1
            if step % PRINTED == 0:
                errors = [errors_of(net, check) for check in checks]
                print(f"{done:.2f} step {step}: {np.mean(losses[-PRINTED:]):.3f}; check {errors}", flush=True)
            if done >= 1.0:
                break
    print(f"step {step}; check: loss, phone errors {[errors_of(net, check) for check in checks]}")
    net.eval()
    np.savez_compressed(o.out, **weights_of(net))  # type: ignore[arg-type]


if __name__ == "__main__":
    main()
