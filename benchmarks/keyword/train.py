"""Trains the net of `hvcpd.recognition.keyword` (needs PyTorch: pip install torch) and writes its weights.

    nice python -m benchmarks.keyword.train clips.npz --data DIR --out stop.npz [--steps 7500] [--seed 1]
        [--start stop.npz] [--rate 0.003]

Two curves: that the word was said, which may be told at any time within 0.2 s of its end, and that it was a call and no
part of a sentence, for which there are 0.75 s. What is told while the word ends, and soon after, does not count. Takes
are mixed anew for each batch; clips that were hard are drawn more often (after A. Shrivastava et al., "Training
region-based object detectors with online hard example mining", CVPR 2016).
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import torch
from torch import Tensor, nn
from torch.optim.swa_utils import AveragedModel, get_ema_multi_avg_fn

from benchmarks.keyword.clips import load
from benchmarks.keyword.mixing import EnergyMixer, Takes
from benchmarks.keyword.model import Net, folded, started
from benchmarks.keyword.score import save_scored, validation_of
from benchmarks.keyword.takes import BATCH, NOTHING, TOLD, inputs, labels_of, leave_out
from benchmarks.phones.precision import TRAINED_IN
from hvcpd.recognition.stream import CHUNK_FRAMES

AVERAGED = 0.99
"""Weight of the earlier ones in the running mean of weights: of about 100 steps."""
WARM_UP = 50
"""Steps until the rate is reached."""
FALL = 0.4
"""Share of the steps, the last ones, in which the rate falls to nothing."""
PRINTED = 500
"""Steps from one check, and one file written, to the next."""


def loss_of(logits: Tensor, labels: Tensor, weight: float) -> Tensor:
    """Loss of each take: each word must be detected twice within its time, and nothing elsewhere."""
    is_told = labels == TOLD
    window = torch.where(is_told, logits[:, :, None], torch.tensor(-40.0))
    best = window.topk(2, dim=-1).values.mean(dim=-1)
    found = (nn.functional.softplus(-best) * is_told.any(dim=-1)).sum(dim=(1, 2))
    wrong = (nn.functional.softplus(logits) * (labels == NOTHING).all(dim=2)).sum(dim=(1, 2))
    return found + weight * wrong


def batch(mixer: EnergyMixer, rng: np.random.Generator) -> tuple[Takes, Tensor, Tensor]:
    """Takes, their inputs and their labels."""
    takes = mixer.draw(BATCH)
    sound = inputs(takes.energies, rng)
    leave_out(sound, rng)
    labels = labels_of(takes.ends, takes.inside, sound.shape[1] // CHUNK_FRAMES)
    return takes, torch.from_numpy(sound.transpose(0, 2, 1).copy()), torch.from_numpy(labels)


def trained(net: Net, mixer: EnergyMixer, o: argparse.Namespace) -> Iterator[tuple[int, float, Net]]:
    """Train the net for `o.steps` batches; now and then, the steps so far, the mean loss since, and the net
    of the running mean of weights (B. Polyak & A. Juditsky, "Acceleration of stochastic approximation by averaging",
    SIAM J. Control Optim. 30(4), 1992)."""
    rng = np.random.default_rng(o.seed)
    optimizer = torch.optim.AdamW(net.parameters(), lr=o.rate, weight_decay=0.01)
    mean = AveragedModel(net, multi_avg_fn=get_ema_multi_avg_fn(AVERAGED), use_buffers=True)
    losses = list[float]()
    for step in range(1, o.steps + 1):
        takes, sound, labels = batch(mixer, rng)
        for group in optimizer.param_groups:
            group["lr"] = o.rate * min(step / WARM_UP, 1.0, (o.steps - step + 1) / (FALL * o.steps))
        optimizer.zero_grad()
        with torch.autocast("cpu", torch.bfloat16, enabled=TRAINED_IN is torch.bfloat16):
            logits = net(sound)
        each = loss_of(logits.float(), labels, o.weight)
        mixer.learned(takes, each.detach().numpy())
        loss = each.mean()
        loss.backward()  # type: ignore[no-untyped-call]
        nn.utils.clip_grad_norm_(net.parameters(), 5.0)
        optimizer.step()
        mean.update_parameters(net)
        losses.append(float(loss.detach()))
        if step % PRINTED == 0 or step == o.steps:
            yield step, float(np.mean(losses[-PRINTED:])), mean.module


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("clips", type=Path)
    parser.add_argument("--data", type=Path, required=True)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--steps", type=int, default=7500)
    parser.add_argument("--weight", type=float, default=0.5, help="of what is told in error")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--rate", type=float, default=1e-3)
    parser.add_argument("--start", type=Path, help="go on from these weights")
    o = parser.parse_args()
    torch.manual_seed(o.seed)
    torch.set_num_threads(1)
    clips = load(o.clips)
    validation = validation_of(clips, o.data)
    mixer = EnergyMixer(clips, o.data, "train", o.seed)
    net, origin = Net(), None
    if o.start is not None:
        origin = f"started from: {np.load(o.start)['notes']}"
        net = started(o.start, torch.cat([batch(mixer, np.random.default_rng(k))[1] for k in range(8)]))
    for step, loss, mean in trained(net, mixer, o):
        print(f"{step:6d} {loss:.3f}", flush=True)
        how = f"{BATCH * step} takes at rate {o.rate:g}, seed {o.seed}"
        save_scored(o.out, folded(mean), validation, how, origin)


if __name__ == "__main__":
    main()
