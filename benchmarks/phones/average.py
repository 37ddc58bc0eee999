"""Writes the mean of two nets of phones, the second of which was trained on from the first.

    python -m benchmarks.phones.average FIRST.npz SECOND.npz --out FILE.npz [--share 0.5]

Weights on the way from one to the other keep most of what either can do (M. Wortsman et al., "Robust fine-tuning of
zero-shot models", CVPR 2022).
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from benchmarks.phones.train import stored
from hvcpd.people.phones import whole_weights


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("nets", type=Path, nargs=2)
    parser.add_argument("--share", type=float, default=0.5, help="of the second one")
    parser.add_argument("--out", type=Path, required=True)
    o = parser.parse_args()
    first, second = (whole_weights(dict(np.load(path))) for path in o.nets)
    mean = {name: (1.0 - o.share) * values + o.share * second[name] for name, values in first.items()}
    written = {}
    for layer in (name.removeprefix("weights") for name in mean if name.startswith("weights")):
        written |= stored(layer, mean[f"weights{layer}"], mean[f"bias{layer}"])
    np.savez_compressed(o.out, **written)


if __name__ == "__main__":
    main()
