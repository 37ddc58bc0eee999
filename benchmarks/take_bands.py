"""Makes `hvcpd/people/take_bands.npz`, which predicts the net's mel bands from the front end's, and `tandem.npz`, the
principal axes of the net's activations.

    python -m benchmarks.take_bands [--sentences 12] [--seed 1] [--out hvcpd/people]

Ridge regression of logarithms, and singular vectors of directions, which are not centred; over sentences by our own
synthesizer's voices and, where it is installed, by voices of espeak-ng that no other benchmark listens to. Prints how
far the bands are off, dB, and how much of the directions the axes tell. Nothing is learned from people's recordings.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from benchmarks.upper_bands import regression, spoken
from hvcpd.people.bands import levelled, logs_of, masked_logs
from hvcpd.people.enrolled_listener import directions_of
from hvcpd.people.phones import centred, phones_of
from hvcpd.recognition.frontend import energies_of, smoothed

AXES = 64


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sentences", type=int, default=12, help="of each voice")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--out", type=Path, default=Path("hvcpd/people"))
    o = parser.parse_args()
    ours, nets, activations = [], [], []
    for sound in spoken(o.sentences, o.seed):
        logs = logs_of(levelled(sound, sound)[1], np.zeros(1))
        kept = masked_logs(smoothed(np.pad(energies_of(sound), ((1, 1), (0, 0)), mode="edge")))
        n = min(len(logs), len(kept))  # the windows are not of one length
        ours.append(kept[:n])
        nets.append(logs[:n])
        activations.append(directions_of(phones_of(centred(logs)).activations))
    wanted = np.concatenate(nets)
    weights, guessed = regression(np.concatenate(ours), wanted)
    off_db = 10.0 / np.log(10.0) * np.sqrt(np.mean((wanted - guessed) ** 2, axis=0))
    np.savez_compressed(o.out / "take_bands.npz", weights=weights.astype(np.float32))
    _, sizes, axes = np.linalg.svd(np.concatenate(activations), full_matrices=False)
    np.savez_compressed(o.out / "tandem.npz", axes=axes[:AXES].T.astype(np.float32))
    told = np.sum(sizes[:AXES] ** 2) / np.sum(sizes**2)
    print(f"{len(wanted)} frames, off by {off_db.min():.1f} to {off_db.max():.1f} dB; {AXES} axes tell {told:.0%}")


if __name__ == "__main__":
    main()
