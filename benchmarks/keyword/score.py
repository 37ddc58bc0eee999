"""Scores the keyword's nets on words of takes outside their training, and calibrates their outputs to odds.

    python -m benchmarks.keyword.score clips.npz --data DIR --net stop.npz ... [--part test] [--batches 40] [--seed 19]

Of each curve: per cent of the words heard, and times an hour that something else is taken for one, at each chance.
"""

from __future__ import annotations

import argparse
import datetime
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from benchmarks.keyword.clips import Clip, load
from benchmarks.keyword.model import Folded, save, stored
from benchmarks.keyword.takes import NOTHING, TOLD, TOLD_S, Data
from benchmarks.phones.stored import Pairs
from hvcpd.ports import SAMPLE_RATE_HZ
from hvcpd.recognition.frontend import HOP_SAMPLES
from hvcpd.recognition.keyword.net import WEIGHTS
from hvcpd.recognition.stream import CHUNK_FRAMES

RATES = (100.0, 30.0, 10.0, 3.0)
"""Of what else is told for a word, an hour."""
VALIDATION_BATCHES, VALIDATION_SEED = 30, 9
"""Of the takes that weights are calibrated by."""
CHANCES = (0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9)


@dataclass(frozen=True, eq=False)
class Told:
    """Of one curve: the logit that counts of each word; each highest logit of 1.2 s without one; hours of that."""

    words: NDArray[np.float64]
    others: NDArray[np.float64]
    hours: float

    def told_at(self, rate: float) -> float:
        """The share of words that are heard where so much else an hour is taken for one."""
        return float(np.mean(self.words > self._least(rate)))

    def _least(self, rate: float) -> float:
        return float(np.sort(self.others)[::-1][min(int(rate * self.hours), len(self.others) - 1)])

    def __str__(self) -> str:
        """How many words are heard at several rates."""
        return ", ".join(f"{100 * self.told_at(r):.1f} % at {r:.0f}/h ({self._least(r):.1f})" for r in RATES)


def validation_of(clips: Sequence[Clip], data: Path | None) -> Data:
    """The takes that weights are chosen and calibrated by."""
    return Data.drawn(clips, data, "validate", VALIDATION_BATCHES, VALIDATION_SEED)


def check(net: nn.Module, data: Data) -> list[Told]:
    """Each curve's accuracy on the word, without takes in which it is part of a sentence."""
    net.eval()
    words, others = [list[float]() for _ in TOLD_S], [list[float]() for _ in TOLD_S]
    chunks = [0 for _ in TOLD_S]
    with torch.no_grad():
        for sound, labels in data.batches(np.flatnonzero(~data.inside)):
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


def save_scored(path: Path, pairs: Pairs, validation: Data, how: str, origin: str | None = None) -> None:
    """Calibrate weights and save them, with the date, how they were made, their score, and what they were made of."""
    found = check(Folded(pairs), validation)
    score = " | ".join(map(str, found))
    print(score, flush=True)
    notes = f"{datetime.date.today().isoformat()}, {how}; validation: {score}"
    notes += f"; {origin}" if origin is not None else ""
    save(path, pairs, [calibrated(each.words, each.others) for each in found], notes)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("clips", type=Path)
    parser.add_argument("--data", type=Path, required=True)
    parser.add_argument("--net", type=Path, nargs="+", default=[WEIGHTS])
    parser.add_argument("--part", default="test")
    parser.add_argument("--batches", type=int, default=40)
    parser.add_argument("--seed", type=int, default=19)
    o = parser.parse_args()
    torch.set_num_threads(1)
    data = Data.drawn(load(o.clips), o.data, o.part, o.batches, o.seed)
    for path in o.net:
        with np.load(path) as file:
            lines = list(zip(file["slopes"], file["intercepts"], strict=True))
        for what, (slope, intercept), found in zip(
            ("halt", "latch"), lines, check(Folded(stored(path)), data), strict=True
        ):
            print(f"{path.stem}, {what}, {len(found.words)} words: {found}")
            least = [(np.log(chance / (1.0 - chance)) - intercept) / slope for chance in CHANCES]
            rows = (
                [(found.words >= x).mean() * 100.0 for x in least],
                [(found.others >= x).sum() / found.hours for x in least],
            )
            for label, row in zip(("% heard", "false/h"), rows, strict=True):
                print(f"    {label}", *(f"{chance}: {value:.1f}" for chance, value in zip(CHANCES, row, strict=True)))


if __name__ == "__main__":
    main()
