"""Writes the mean of two phone nets, one of which was trained on from the other.

    python -m benchmarks.phones.mean FIRST.npz SECOND.npz --out FILE.npz [--share 0.5]

Their weights are averaged ("model soups": M. Wortsman et al., ICML 2022).
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterable, Mapping
from pathlib import Path

import numpy as np

from benchmarks.phones.stored import Pairs, averaged, stored

Arrays = Mapping[str, np.ndarray]


def mean_of(first: Arrays, second: Arrays, share: float) -> dict[str, np.ndarray]:
    """The arrays of a net's file; `share`: of the second, from 0 to 1."""
    names = [key.removeprefix("weights") for key in first if key.startswith("weights")]
    layers = averaged(_layers(first, names), _layers(second, names), 1.0 - share)
    found = {"apart": first["apart"]}
    for name, (weights, bias) in zip(names, layers, strict=True):
        found |= stored(name, weights, bias)
    return found


def _layers(net: Arrays, names: Iterable[str]) -> Pairs:
    return [(net[f"weights{name}"] * net[f"scale{name}"], net[f"bias{name}"]) for name in names]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("nets", type=Path, nargs=2)
    parser.add_argument("--share", type=float, default=0.5, help="of the second")
    parser.add_argument("--out", type=Path, required=True)
    o = parser.parse_args()
    first, second = (dict(np.load(path)) for path in o.nets)
    about = {"mean of": [json.loads(str(file["about"])) for file in (first, second)], "share of the second": o.share}
    np.savez(o.out, about=np.array(json.dumps(about)), **mean_of(first, second, o.share))  # type: ignore[arg-type]


if __name__ == "__main__":
    main()
