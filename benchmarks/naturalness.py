"""How natural our voices sound to predictors of people's opinions, beside espeak-ng, flite and pico where installed.

Two networks that were trained on listening tests predict the mean opinion score, 1 (bad) to 5 (excellent), of random
sentences of the phrasebook: DistillMOS (pip install distillmos) and DNSMOS P.808 (pip install speechmos). Both were
made for transmitted speech, and not for synthesizers: compare talkers and builds with the same seed, and believe what
both say. The intervals (95 %) are over sentences; in the last two rows over the means of eight voices.

    python -m benchmarks.naturalness [--sentences 12] [--seed 1] [--only oak,oak-n,flite]
"""

from __future__ import annotations

import argparse
import contextlib
import io
import random
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import numpy as np

from benchmarks.judging import talkers
from benchmarks.transcripts import on_air
from benchmarks.voice import VOCABULARY
from hvcpd.language.phrasebook import Phrasebook
from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from hvcpd.synthesis.lexicon import Lexicon

Judge = Callable[[Samples], float]

P808_SAMPLES = round(9.01 * SAMPLE_RATE_HZ)
"""Length of the sound that DNSMOS judges; shorter sound is repeated (as `speechmos` does)."""


def distillmos() -> Judge:
    """DistillMOS (Stahl and Gamper, "Distillation and pruning for scalable self-supervised representation-based speech
    quality assessment", ICASSP 2025). ImportError without it."""
    import torch
    from distillmos import ConvTransformerSQAModel

    torch.set_num_threads(1)
    with contextlib.redirect_stdout(io.StringIO()):
        model = ConvTransformerSQAModel()
    model.eval()

    def score(sound: Samples) -> float:
        with torch.no_grad():
            return float(model(torch.from_numpy(sound)[None])[0])

    return score


def dnsmos() -> Judge:
    """DNSMOS P.808 (Reddy, Gopal and Cutler, ICASSP 2021). ImportError without it."""
    from speechmos import dnsmos

    folder = Path(dnsmos.__file__).parent / "dnsmos_models"
    model = dnsmos.DNSMOS(str(folder / "sig_bak_ovr.onnx"), str(folder / "model_v8.onnx"))

    def score(sound: Samples) -> float:
        mel = model.audio_melspec(np.resize(sound, P808_SAMPLES)[:-160]).astype(np.float32)
        return float(model.p808_onnx_sess.run(None, {"input_1": mel[None]})[0][0, 0])

    return score


def judges() -> dict[str, Judge]:
    """The predictors that are installed; a line tells which are not."""
    found = {}
    for name, package, make in (("DistillMOS", "distillmos", distillmos), ("DNSMOS P.808", "speechmos", dnsmos)):
        try:
            found[name] = make()
        except ImportError as error:
            print(f"{name}: skipped, needs `pip install {package}` ({error})")
    return found


def row(name: str, scores: Mapping[str, Sequence[float]]) -> str:
    """A line of the table: each judge's mean and half of its 95 % interval."""
    cells = []
    for values in scores.values():
        spread = 1.96 * float(np.std(values, ddof=1)) / len(values) ** 0.5 if len(values) > 1 else float("nan")
        cells.append(f"{np.mean(values):9.2f} ± {spread:.2f}")
    return f"{name:14}" + "".join(f"{cell:>18}" for cell in cells)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sentences", type=int, default=12)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", default="", help="names of talkers, separated by commas")
    options = parser.parse_args()
    present = judges()
    if not present:
        return
    book, rng = Phrasebook(VOCABULARY), random.Random(options.seed)
    sentences = [book.phrases(book.sample(rng)) for _ in range(options.sentences)]
    chosen = [each for each in options.only.split(",") if each]
    groups: dict[str, list[dict[str, list[float]]]] = {"formant, mean": [], "natural, mean": []}
    print(f"{'talker':14}" + "".join(f"{name:>18}" for name in present))
    for name, talker in talkers(Lexicon.load()).items():
        if chosen and name not in chosen:
            continue
        sounds = [on_air(talker.speak(phrases), seed) for seed, phrases in enumerate(sentences)]
        scores = {judge: [score(sound) for sound in sounds] for judge, score in present.items()}
        print(row(name, scores), flush=True)
        if talker.own:
            groups["natural, mean" if name.endswith("-n") else "formant, mean"].append(scores)
    for name, rows in groups.items():
        if len(rows) > 1:
            means = {judge: np.mean([scores[judge] for scores in rows], axis=0).tolist() for judge in present}
            print(row(name, means))


if __name__ == "__main__":
    main()
