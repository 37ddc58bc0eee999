"""Averages the weights of two nets, of which one was trained on from the other.

The mean often hears voices that neither has learned from better than the second one does (M. Wortsman et al., "Robust
fine-tuning of zero-shot models", CVPR 2022).

    python -m benchmarks.keyword.average clips.npz --data DIR --nets BEFORE.npz AFTER.npz --share 0.5 --out stop.npz
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
import torch

from benchmarks.keyword.clips import load
from benchmarks.keyword.model import stored
from benchmarks.keyword.score import save_scored, validation_of
from benchmarks.phones.stored import averaged


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("clips", type=Path)
    parser.add_argument("--data", type=Path, required=True)
    parser.add_argument("--nets", type=Path, nargs=2, required=True)
    parser.add_argument("--share", type=float, required=True, help="of the first one")
    parser.add_argument("--out", type=Path, required=True)
    o = parser.parse_args()
    torch.set_num_threads(1)
    first, second = o.nets
    origin = f"first: {np.load(first)['notes']}; second: {np.load(second)['notes']}"
    pairs = averaged(stored(first), stored(second), o.share)
    how = f"a share of {o.share:g} of the first and the rest of the second"
    save_scored(o.out, pairs, validation_of(load(o.clips), o.data), how, origin)


if __name__ == "__main__":
    main()
