"""How nets hear material that they did not learn from: phones wrong on the best path, and how often the text that was
said is likelier than 99 others of about as many phones.

    python -m benchmarks.phones.score FILE.npz... [--near NET.npz...] [--far NET.npz...]

The material is `benchmarks.phones.material`'s (`--part calibration` or `test`). Without nets: the shipped ones. What a
robot hears with is a pair, a far and a near net; here each is heard alone, and each pair. Needs PyTorch.
"""

from __future__ import annotations

import argparse
import itertools
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import torch
from numpy.typing import NDArray

from benchmarks.phones.train import BLANK, Data, begun, errors_of
from hvcpd.evaluation.statistics import wilson
from hvcpd.people import phones as shipped
from hvcpd.people.phones import PhoneNet

TEXTS = 100
TAKES = 300
"""The first ones of each file."""
FOLDER = Path(shipped.__file__).parent


def others_of(said: Sequence[NDArray[np.int64]], number: int) -> list[NDArray[np.int64]]:
    """Text `number`, first, and those other ones of which the number of phones is nearest to its."""
    texts = {text.tobytes(): text for text in said if len(text)}
    own = texts.pop(said[number].tobytes())
    nearest = sorted(texts.values(), key=lambda text: (abs(len(text) - len(own)), text.tobytes()))
    return [own, *nearest[: TEXTS - 1]]


def losses_of(net: PhoneNet, logs: NDArray[np.float32], texts: Sequence[NDArray[np.int64]]) -> NDArray[np.float64]:
    """Negative log likelihood of each text in a take."""
    heard = torch.from_numpy(net.log_posteriors(logs))[:, None].repeat(1, len(texts), 1)
    lengths = torch.tensor([len(text) for text in texts])
    frames = torch.full((len(texts),), len(heard))
    found = torch.nn.functional.ctc_loss(
        heard, torch.from_numpy(np.concatenate(texts)), frames, lengths, BLANK, reduction="none"
    )
    return np.asarray(found.numpy(), np.float64)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("material", type=Path, nargs="+")
    parser.add_argument("--near", type=Path, nargs="+", default=[FOLDER / "phones_near.npz"])
    parser.add_argument("--far", type=Path, nargs="+", default=[FOLDER / "phones_far.npz"])
    o = parser.parse_args()
    torch.set_num_threads(1)
    for path in o.material:
        data = Data([path])
        for net in (*o.far, *o.near):
            print(f"{path.stem}: {net.stem}: {errors_of(begun(net), data)[1]:.1%} of the phones wrong", flush=True)
        numbers = [n for n, text in enumerate(data.phones) if len(text)][:TAKES]
        texts = [others_of(data.phones, n) for n in numbers]
        losses = {}
        for net in (*o.far, *o.near):
            loaded = PhoneNet.of(dict(np.load(net)))  # a file would be unpacked for each take
            takes = zip(numbers, texts, strict=True)
            losses[net] = [losses_of(loaded, data.logs[n].astype(np.float32), t) for n, t in takes]
        for far, near in itertools.product(o.far, o.near):
            right = sum(int(np.argmin(a + b)) == 0 for a, b in zip(losses[far], losses[near], strict=True))
            low, high = wilson(right, len(numbers))
            print(
                f"{path.stem}: {far.stem} and {near.stem}: the likeliest of {TEXTS} is what was said in {right} of "
                f"{len(numbers)} [{low:.0%}, {high:.0%}]",
                flush=True,
            )


if __name__ == "__main__":
    main()
