"""Writes the mean of two nets of phones, the second of which was trained on from the first.

    python -m benchmarks.phones.average FIRST.npz SECOND.npz --out FILE.npz [--share 0.5] [--seed 1]

Weights on the way from one to the other keep most of what either can do (M. Wortsman et al., "Robust fine-tuning of
zero-shot models", CVPR 2022). If the second has more units, the first is given those with which its training began:
`--seed` is that training's.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
import torch
from numpy.typing import NDArray

from benchmarks.phones.train import Net, started, stored, weights_of
from hvcpd.people.bands import N_BANDS
from hvcpd.people.phones import whole_weights


def grown(path: Path, width: int, seed: int) -> dict[str, NDArray[np.float32]]:
    """The weights of a file as a training begins with them."""
    torch.manual_seed(seed)
    net = Net(width)
    started(net, path, torch.zeros(1, N_BANDS, 64))
    return whole_weights(weights_of(net))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("nets", type=Path, nargs=2)
    parser.add_argument("--share", type=float, default=0.5, help="of the second one")
    parser.add_argument("--seed", type=int, default=1, help="of the second one's training")
    parser.add_argument("--out", type=Path, required=True)
    o = parser.parse_args()
    second = whole_weights(dict(np.load(o.nets[1])))
    first = grown(o.nets[0], len(second["bias0"]), o.seed)
    mean = {name: (1.0 - o.share) * values + o.share * second[name] for name, values in first.items()}
    written = {}
    for layer in (name.removeprefix("weights") for name in mean if name.startswith("weights")):
        written |= stored(layer, mean[f"weights{layer}"], mean[f"bias{layer}"])
    np.savez_compressed(o.out, **written)


if __name__ == "__main__":
    main()
