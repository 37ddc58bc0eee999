"""Fits the numbers of `hvcpd/recognition/fitted.json`, which is to be reviewed before it is committed: `make fit`.

    python -m benchmarks.fit [--only steady_noise,sentence_confidence,...] [--data DIR] [--quick] [--out FILE]

A section a model, with the date, the command, the data, the score, and the weights. Sections that are not asked for
stay as they are. `--quick`: of less material, to see that it works. All is seeded. The people's part needs espeak-ng,
festival, flite and sox; with --data, it and the confidence of sentences are fitted to people's recordings, too.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Callable
from datetime import date
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks import channel_confidence, confidence, fusion, vocabulary
from hvcpd.recognition.frontend import HOP_SAMPLES, energies_of
from hvcpd.recognition.noise import NOISE_QUANTILE

Section = dict[str, object]
WEIGHTS = Path("hvcpd/recognition/fitted.json")
NOISE_FRAMES = 4000
"""40 s: estimates good to about 1 %."""


def measured(energies: NDArray[np.float32]) -> dict[str, NDArray[np.float32]]:
    """Statistics of steady noise whose mel energies have shape (frames, N_BANDS)."""
    mean = energies.mean(axis=0)
    logs = np.log(energies / mean)
    ratio = np.quantile(energies, NOISE_QUANTILE, axis=0) / mean
    found = {"percentile_ratio": ratio, "mean_log": logs.mean(axis=0), "std_log": logs.std(axis=0)}
    return {name: np.asarray(values, np.float32) for name, values in found.items()}


def steady_noise(_data: Path | None, _quick: bool) -> Section:
    """Of white noise through the front end."""
    white = np.random.default_rng(1).standard_normal(NOISE_FRAMES * HOP_SAMPLES).astype(np.float32)
    found = measured(energies_of(white))
    weights = {name: [float(f"{value:.8g}") for value in values] for name, values in found.items()}
    return {"data": "40 s of white noise through the front end; seed 1", "score": "to about 1 %", "weights": weights}


def sentence_confidence(data: Path | None, quick: bool) -> Section:
    """How likely a sentence of the template decoder is right."""
    arguments = ["--data", str(data / "negatives")] if data is not None else []
    return confidence.fitted(confidence.parser().parse_args([*arguments, *(QUICK if quick else [])]))


def channel_sentences(data: Path | None, quick: bool) -> Section:
    """How likely a sentence of the channel search is right."""
    arguments = ["--data", str(data)] if data is not None else []
    few = ["--sentences", "2", "--conditions", "small-vacuum", "--minutes", "0.5"] if quick else []
    return channel_confidence.fitted(channel_confidence.parser().parse_args([*arguments, *few]))


def people_fusion(data: Path | None, quick: bool) -> Section:
    """Which sentence of the people's second pass is right, and how likely."""
    arguments = ["--data", str(data)] if data is not None else []
    return fusion.fitted(fusion.parser().parse_args([*arguments, *(QUICK if quick else [])]))


def confusion(_data: Path | None, quick: bool) -> Section:
    """How often a phrase is taken for another."""
    return vocabulary.fitted(vocabulary.parser().parse_args(["--seeds", "1", "--voices", "oak"] if quick else []))


QUICK = ["--sentences", "2"]
MODELS: dict[str, Callable[[Path | None, bool], Section]] = {
    "steady_noise": steady_noise,
    "sentence_confidence": sentence_confidence,
    "channel_confidence": channel_sentences,
    "confusion": confusion,
    "people_fusion": people_fusion,
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", default=",".join(MODELS), help=f"of {', '.join(MODELS)}")
    parser.add_argument("--data", type=Path, help="folder of recordings of people")
    parser.add_argument("--quick", action="store_true", help="of less material")
    parser.add_argument("--out", type=Path, default=WEIGHTS)
    o = parser.parse_args()
    unknown = [name for name in o.only.split(",") if name not in MODELS]
    if unknown:
        sys.exit(f"--only: there is no {unknown[0]!r}; there are {', '.join(MODELS)}")
    sections = json.loads(WEIGHTS.read_text(encoding="utf-8"))
    for name in o.only.split(","):
        print(f"== {name}", flush=True)
        command = f"python -m benchmarks.fit --only {name}" + " --quick" * o.quick
        section = MODELS[name](o.data, o.quick)
        sections[name] = {"fitted": date.today().isoformat(), "by": command, **section}
        o.out.write_text(json.dumps(sections, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
