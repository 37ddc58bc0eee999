"""Trains the net of `hvcpd.recognition.keyword` (needs PyTorch: pip install torch) and writes its weights.

    nice python -m benchmarks.keyword.train material.npz... --check validation.npz --out stop.npz [--steps 7500]
        [--seed 1] [--start stop.npz] [--keep 0,0.2,0.4] [--rate 0.003]

Two curves: that the word was said, which may be told at any time within 0.2 s of its end, and that it was a call and no
part of a sentence, for which there are 0.75 s. What is told while the word ends, and soon after, does not count. Takes
that are easy are passed over more often than not (A. Shrivastava et al., "Training region-based object detectors with
online hard example mining", CVPR 2016).
"""

from __future__ import annotations

import argparse
import datetime
from pathlib import Path

import numpy as np
import torch
from torch import Tensor, nn

from benchmarks.keyword.model import Folded, Net, averaged, folded, save, started, stored
from benchmarks.keyword.score import calibrated, check
from benchmarks.keyword.takes import NOTHING, TOLD, Data

EASY = 0.03
"""A take whose loss was below this is easy."""
PASSED_OVER = 0.7
"""Share of the easy takes that are passed over."""
AT_RATE = 10.0
"""False ones an hour at which the best mean of weights is chosen."""
PRINTED = 500
"""Steps from one check to the next."""


def loss_of(logits: Tensor, labels: Tensor, weight: float) -> Tensor:
    """Loss of each take: each word must be detected twice within its time, and nothing elsewhere."""
    is_told = labels == TOLD
    window = torch.where(is_told, logits[:, :, None], torch.tensor(-40.0))
    best = window.topk(2, dim=-1).values.mean(dim=-1)
    found = (nn.functional.softplus(-best) * is_told.any(dim=-1)).sum(dim=(1, 2))
    wrong = (nn.functional.softplus(logits) * (labels == NOTHING).all(dim=2)).sum(dim=(1, 2))
    return found + weight * wrong


def trained(net: Net, data: Data, validation: Data, o: argparse.Namespace) -> None:
    """Train the net for `o.steps` batches."""
    rng = np.random.default_rng(o.seed)
    optimizer = torch.optim.AdamW(net.parameters(), lr=o.rate, weight_decay=0.01)
    losses, last = list[float](), np.full(len(data.logs), np.inf)
    while len(losses) < o.steps:
        takes = np.flatnonzero((last > EASY) | (rng.random(len(last)) > PASSED_OVER))
        for some, sound, labels in data.batches(rng, takes):
            share = len(losses) / o.steps
            for group in optimizer.param_groups:
                group["lr"] = o.rate * min(share / 0.03 + 0.05, 1.0) * 0.5 * (1.0 + np.cos(np.pi * share)) + 1e-5
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
            if len(losses) % PRINTED == 0:
                score = " | ".join(map(str, check(net, validation)))
                print(f"{len(losses):6d} {len(takes)} {np.mean(losses[-PRINTED:]):.3f} {score}", flush=True)
            if len(losses) == o.steps:
                return


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("material", type=Path, nargs="+")
    parser.add_argument("--check", type=Path, required=True)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--steps", type=int, default=7500)
    parser.add_argument("--weight", type=float, default=0.5, help="of what is told in error")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--rate", type=float, default=3e-3)
    parser.add_argument("--start", type=Path, help="go on from these weights")
    parser.add_argument("--keep", default="0,0.2,0.4", help="shares of those to try in what is written")
    o = parser.parse_args()
    torch.manual_seed(o.seed)
    torch.set_num_threads(1)
    data, validation = Data.load(o.material), Data.load([o.check])
    some = np.arange(0, len(data.logs), 20)
    net = Net()
    if o.start is not None:
        net = started(o.start, torch.cat([sound for _, sound, _ in data.batches(None, some)]))
    trained(net, data, validation, o)
    pairs, shares = folded(net), [0.0]
    if o.start is not None:
        shares = [float(share) for share in o.keep.split(",")]
    means = {share: averaged(stored(o.start), pairs, share) if share else pairs for share in shares}
    scores = {share: check(Folded(mean), validation) for share, mean in means.items()}
    for share, found in scores.items():
        print(f"{share:.1f} kept:", " | ".join(map(str, found)), flush=True)
    best = max(shares, key=lambda share: sum(each.told_at(AT_RATE) for each in scores[share]))
    found = scores[best]
    today = datetime.date.today().isoformat()
    score, kept = " | ".join(map(str, found)), f", {best} of {o.start.name} kept" if best else ""
    notes = f"{today}, {len(data.logs)} takes, seed {o.seed}, {o.steps} steps{kept}; validation: {score}"
    save(o.out, means[best], [calibrated(each.words, each.others) for each in found], notes)


if __name__ == "__main__":
    main()
