"""Trains a net of `hvcpd.people.phones` (needs PyTorch) and writes its weights.

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
from collections.abc import Iterator, Mapping, Sequence
from datetime import UTC, datetime
from itertools import islice
from pathlib import Path

import numpy as np
import torch
from torch import Tensor, nn

from benchmarks.phones.denominator import log_denominator, trigrams
from benchmarks.phones.stored import stored
from benchmarks.transcripts import edits
from hvcpd.people.bands import N_BANDS
from hvcpd.people.phones import KERNEL_SIZES, PHONES

BLANK = len(PHONES)
WIDTH = 320
BATCH_FRAMES = 6000
WARP = (0.9, 1.1)
MEASURED = 10
"""Batches by which a layer's sums are measured."""
PRINTED = 2000
"""Steps from one check to the next."""


class Net(nn.Module):
    """As `hvcpd.people.phones.PhoneNet`, with a normalisation of each layer's sums."""

    def __init__(self, apart: Sequence[int]) -> None:
        super().__init__()
        first, second = KERNEL_SIZES
        self.apart = tuple(apart)
        inputs = [first * N_BANDS, second * WIDTH, *[WIDTH] * len(self.apart)]
        self.layers = nn.ModuleList(nn.Linear(n, WIDTH) for n in inputs)
        self.norms = nn.ModuleList(nn.BatchNorm1d(WIDTH) for _ in inputs)
        self.out = nn.Linear(WIDTH, BLANK + 1)
        self.drop = nn.Dropout(0.1)

    def forward(self, sound: Tensor) -> Tensor:
        """From (batch, bands, frames) to logits (batch, phones, half the frames)."""
        sound = sound.transpose(1, 2)
        for number, size in enumerate(KERNEL_SIZES):
            sound = self.dropped(torch.relu(self.sums(number, beside(sound, size, number + 1))))
        for number, apart in enumerate(self.apart, len(KERNEL_SIZES)):
            sound = torch.relu(sound + self.dropped(self.sums(number, shifted(sound, apart))))
        logits: Tensor = self.out(sound)
        return logits.transpose(1, 2)

    def sums(self, number: int, seen: Tensor) -> Tensor:
        """A layer's weighted sums of (batch, frames, inputs), normalised."""
        found: Tensor = self.layers[number](seen)
        normalised: Tensor = self.norms[number](found.flatten(0, 1))
        return normalised.view(found.shape)

    def dropped(self, found: Tensor) -> Tensor:
        """Units left out at random, the same in all of a take: faster than in each frame."""
        kept: Tensor = self.drop(torch.ones(len(found), 1, WIDTH, dtype=found.dtype))
        return found * kept


def beside(sound: Tensor, size: int, step: int) -> Tensor:
    """Every `step`-th frame of (batch, frames, units) with those around it, `size` in all."""
    n, padded = sound.shape[1], nn.functional.pad(sound, (0, 0, size // 2, size // 2))
    return torch.cat([padded[:, k : k + n : step] for k in range(size)], dim=2)


def shifted(sound: Tensor, apart: int) -> Tensor:
    """The first third of the units from `apart` frames earlier, the last from as many later."""
    n, third, padded = sound.shape[1], WIDTH // 3, nn.functional.pad(sound, (0, 0, apart, apart))
    earlier, later = padded[:, :n, :third], padded[:, 2 * apart :, 2 * third :]
    return torch.cat((earlier, sound[:, :, third : 2 * third], later), dim=2)


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


def loss_of(
    net: Net, batch: tuple[Tensor, Tensor, Tensor, Tensor], mmi: float = 0.0, after_two: Tensor | None = None
) -> Tensor:
    """Per phone; with the log likelihood of any speech by its trigrams (`denominator.py`), times `mmi`."""
    sound, n_frames, phones, n_phones = batch
    with torch.autocast("cpu", torch.bfloat16, enabled=net.training):  # half the time
        logits = net(sound)
    log_posteriors = torch.log_softmax(logits.float(), 1).permute(2, 0, 1)
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
    """Of each layer, its norm folded in: `weights0`, shape (inputs, outputs), bytes, with a scale for each output,
    `scale0`, and `bias0`, ...; the last layer's end in "_out"."""
    found: dict[str, np.ndarray] = {}
    for number, (layer, norm) in enumerate(zip(net.layers, net.norms, strict=True)):
        gain = (norm.weight / torch.sqrt(norm.running_var + norm.eps)).detach()
        bias = ((layer.bias.detach() - norm.running_mean) * gain + norm.bias.detach()).numpy()
        found |= stored(f"{number}", (layer.weight.detach() * gain[:, None]).T.numpy(), bias)
    found |= stored("_out", net.out.weight.detach().T.numpy(), net.out.bias.detach().numpy())
    return found | {"apart": np.array(net.apart, np.int64)}


def begun(path: Path, data: Data, rng: np.random.Generator) -> Net:
    """The net in a file. Its norms, folded into its weights there, are taken out again: each layer's sums have the mean
    and the deviation that they have in some of the data."""
    file = np.load(path)
    net = Net(file["apart"].tolist())
    net.eval()
    for number, (layer, norm) in enumerate(zip(net.layers, net.norms, strict=True)):
        _set(layer, f"{number}", file)
        norm.bias.data, layer.bias.data = layer.bias.data, torch.zeros(WIDTH)
        norm.running_var.fill_(1.0 - norm.eps)
    _set(net.out, "_out", file)
    for norm in net.norms:
        seen: list[Tensor] = []
        hook = norm.register_forward_pre_hook(lambda _, inputs, seen=seen: seen.append(inputs[0]))
        with torch.no_grad():
            for numbers in islice(data.batches(rng), MEASURED):
                net(data.batch(numbers, rng)[0])
        hook.remove()
        variance, mean = torch.var_mean(torch.cat(seen), 0)
        norm.running_mean, norm.running_var = mean, variance
        norm.bias.data += mean
        norm.weight.data = torch.sqrt(variance + norm.eps)
    net.train()
    return net


def _set(layer: nn.Linear, name: str, file: Mapping[str, np.ndarray]) -> None:
    layer.weight.data = torch.from_numpy((file[f"weights{name}"] * file[f"scale{name}"]).T.copy())
    layer.bias.data = torch.from_numpy(file[f"bias{name}"].copy())


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
    net = Net(o.apart) if o.begun is None else begun(o.begun, data, rng)
    print("check:", [errors_of(net, check) for check in checks], flush=True)
    after_two = torch.from_numpy(trigrams(data.phones)) if o.mmi > 0.0 else None
    optimizer = torch.optim.AdamW(net.parameters(), o.rate, weight_decay=0.01)
    begin, step, losses = time.process_time(), 0, []
    while (done := (time.process_time() - begin) / 60.0 / o.minutes) < 1.0:
        for numbers in data.batches(rng):
            done = (time.process_time() - begin) / 60.0 / o.minutes
            for group in optimizer.param_groups:
                falling = max(0.5 * (1 + np.cos(np.pi * min(done, 1.0))), 0.003)
                group["lr"] = o.rate * min(1.0, (step + 1) / 200) * falling
            loss = loss_of(net, data.batch(numbers, rng), o.mmi, after_two)
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
