"""Fits the recogniser's confidence: the share of right sentences as a function of their score.

Random sentences of two teams in noises and, with pyroomacoustics installed, in rooms (image sources); with --data also
people who talk to each other, near and far. These are the recogniser's hypotheses before its decision. Prints how many
of the sentences of each confidence were right. `python -m benchmarks.fit` writes the weights.

python -m benchmarks.confidence [--sentences 25] [--snr 20,0,-5,-10] [--data DIR] [--seed 21]
"""

from __future__ import annotations

import argparse
import random
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import astuple, fields
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.signal import fftconvolve

from benchmarks.hearing.material import BLOCK, GAP_S, Spoken, Team, make_stream
from benchmarks.hearing.mixing import add_noise, mix
from benchmarks.hearing.noises import KINDS, make_noise
from benchmarks.judging import reliability, tell_reliability
from hvcpd.assembly.make import word_bank
from hvcpd.assembly.sound import make_phrasebook, make_sound, user_cache_folder
from hvcpd.config.settings import DEFAULT_TEAMS
from hvcpd.config.task_file import load_tasks
from hvcpd.config.tasks import default_tasks_path
from hvcpd.hardware.soundfile import read_wav
from hvcpd.language.phrasebook import Phrasebook
from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from hvcpd.recognition.decoder_session import ConfidenceFeatures, Sentence, confidence_features
from hvcpd.recognition.events import Recognised
from hvcpd.recognition.frontend import HOP_SAMPLES
from hvcpd.recognition.template_recogniser import RecogniserSettings, TemplateRecogniser
from hvcpd.synthesis.speaker import Speaker
from hvcpd.synthesis.voices import voice_for

TEAMS = (("Rob", "Bot"), ("Max", "Ann"))
ROOM_M = [14.0, 6.0, 3.0]
FOREIGN = tuple(
    "basket window grape strawberry maximum yes banana chair elephant paper quickly monday kitchen river table "
    "juice hello please dancing mountain computer garden bottle silver library music potato".split()
)
"""Words that nobody is to understand, some of them near to some that are."""
TALK_GAINS_DB = (0.0, -12.0)
STEPS = 6000
RATE = 0.5


class Watched(TemplateRecogniser):
    """Keeps every sentence that it judges and that follows silence."""

    def __init__(self, *args: object) -> None:
        super().__init__(*args)  # type: ignore[arg-type]
        self.judged: list[tuple[Sentence, tuple[str, ...]]] = []

    def _accepted(self, sentence: Sentence) -> Recognised | None:
        words = tuple(word.text for word in sentence.words)
        if self.session.lead_in(sentence.words[0].step.start_frame) < self._settings.max_lead_in:
            self.judged.append((sentence, words))
        return super()._accepted(sentence)


def foreign(book: Phrasebook, speakers: Mapping[str, Speaker], n: int, seed: int) -> Samples:
    """`n` sentences, each with one word that the phrasebook does not have, so that none of them is right."""
    chooser = random.Random(seed)
    pieces = [np.zeros(2 * SAMPLE_RATE_HZ, np.float32)]
    for _ in range(n):
        utterance = book.sample(chooser)
        phrases = [list(phrase) for phrase in book.phrases(utterance)]
        phrase = chooser.choice(phrases)
        phrase[chooser.randrange(len(phrase))] = chooser.choice(FOREIGN)
        speaker = speakers[utterance.speaker or chooser.choice(list(speakers))]
        pieces += [speaker.render(phrases), np.zeros(round(chooser.uniform(*GAP_S) * SAMPLE_RATE_HZ), np.float32)]
    sound = np.concatenate(pieces)
    return sound + 1e-3 * np.random.default_rng(seed).standard_normal(len(sound)).astype(np.float32)


def is_right(sentence: Sentence, words: tuple[str, ...], spoken: Sequence[Spoken]) -> bool:
    first, last = sentence.words[0].step, sentence.words[-1].step
    start, end = first.start_frame * HOP_SAMPLES, last.end_frame * HOP_SAMPLES
    return any(start < s.end and end > s.start and words == s.words for s in spoken)


def listen(recogniser: Watched, sound: Samples) -> None:
    for start in range(0, len(sound), BLOCK):
        recogniser.push(sound[start : start + BLOCK])


def rooms() -> Iterator[Samples]:
    """Impulse responses of a long room (14 by 6 by 3 m) at 1 to 10 m, RT60 0.3 to 0.6 s; none without the library."""
    try:
        import pyroomacoustics as pra
    except ImportError:
        print("(no rooms: pip install pyroomacoustics)")
        return
    for rt60_s, distance_m in ((0.3, 2.0), (0.3, 10.0), (0.45, 1.0), (0.45, 5.0), (0.45, 10.0), (0.6, 1.0), (0.6, 2.0)):
        absorption, order = pra.inverse_sabine(rt60_s, ROOM_M)
        room = pra.ShoeBox(
            ROOM_M, fs=SAMPLE_RATE_HZ, materials=pra.Material(absorption), max_order=min(order, 40), air_absorption=True
        )
        room.add_source([2.0, 2.7, 0.25])
        room.add_microphone([2.0 + distance_m, 3.1, 0.25])
        room.compute_rir()
        yield np.asarray(room.rir[0][0], np.float32)


def fit(x: NDArray[np.float64], y: NDArray[np.bool_]) -> NDArray[np.float64]:
    """Weights of the columns of `x` and, last, the bias: logistic regression by gradient ascent."""
    mean, spread = x.mean(axis=0), x.std(axis=0) + 1e-9
    z = np.column_stack([(x - mean) / spread, np.ones(len(x))])
    w = np.zeros(z.shape[1])
    for _ in range(STEPS):
        w += RATE * z.T @ (y - 1.0 / (1.0 + np.exp(-z @ w))) / len(y) - 5e-4 * w
    weights = w[:-1] / spread
    return np.append(weights, w[-1] - float(weights @ mean))


def collect(o: argparse.Namespace, names: tuple[str, ...], seed: int) -> Iterator[tuple[Sentence, bool]]:
    """Every candidate of one team in all conditions, and whether it was right."""
    sound = make_sound(None, user_cache_folder())
    book = make_phrasebook(names, DEFAULT_TEAMS, load_tasks(default_tasks_path()))
    speakers = {name: sound.speaker_in(voice_for(name)) for name in names}
    bank = {voice_for(name).name: dict(word_bank(book, speaker)) for name, speaker in speakers.items()}
    clean, spoken = make_stream(book, speakers, o.sentences, seed)
    noises = [make_noise(kind, len(clean), seed, Team(names, book, sound)) for kind in KINDS]
    streams = [(mix(clean, spoken, noise, float(snr), -30.0), spoken) for noise in noises for snr in o.snr.split(",")]
    for response in rooms():
        far = fftconvolve(clean, response / np.abs(response).max())[: len(clean)].astype(np.float32)
        streams.append((add_noise(far, spoken, 20.0, "white", -35.0, seed), spoken))
    streams += [(foreign(book, speakers, o.sentences, seed), [])]
    if o.data:
        talk = np.concatenate([read_wav(path) for path in sorted(o.data.rglob("*.wav"))])
        streams += [(np.asarray(talk * 10.0 ** (gain_db / 20.0), np.float32), []) for gain_db in TALK_GAINS_DB]
    for stream, truth in streams:
        recogniser = Watched(book.graph, bank)
        listen(recogniser, stream)
        for sentence, words in recogniser.judged:
            if sentence.cost < -12.0:
                yield sentence, is_right(sentence, words, truth)


def fitted(o: argparse.Namespace) -> dict[str, object]:
    """Bias and weights of the curve, and the data that they were fitted to."""
    found = [pair for k, names in enumerate(TEAMS) for pair in collect(o, names, o.seed + k)]
    y = np.array([right for _, right in found])
    features = np.array([astuple(confidence_features(sentence)) for sentence, _ in found])
    *weights, bias = fit(features, y)
    probability = 1.0 / (1.0 + np.exp(-(features @ weights + bias)))
    tell_reliability(reliability(zip(probability, y, strict=True), (0.0, 0.5, 0.7, 0.8, 0.9, 0.95, 1.0)))
    sure = probability >= RecogniserSettings.min_confidence
    talk = ", people's talk" if o.data else ""
    return {
        "data": f"{len(TEAMS)} teams, {o.sentences} sentences each in {len(KINDS)} noises at {o.snr} dB, in rooms, "
        f"with a foreign word{talk}; seed {o.seed}",
        "score": f"at {RecogniserSettings.min_confidence}: {(sure & y).sum()} of {y.sum()} right ones, "
        f"{(sure & ~y).sum()} of {(~y).sum()} wrong ones",
        "bias": round(float(bias), 2),
        "weights": {f.name: round(float(w), 2) for f, w in zip(fields(ConfidenceFeatures), weights, strict=True)},
    }


def parser() -> argparse.ArgumentParser:
    """The options."""
    out = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    out.add_argument("--sentences", type=int, default=25)
    out.add_argument("--snr", default="20,0,-5,-10")
    out.add_argument("--data", type=Path)
    out.add_argument("--seed", type=int, default=21)
    return out


if __name__ == "__main__":
    print(fitted(parser().parse_args()))
