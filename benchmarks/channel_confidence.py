"""How likely a sentence of the channel search is right: fits `hvcpd/recognition/channel/recogniser.py`'s curve.

    python -m benchmarks.channel_confidence [--data DIR] [--sentences 8] [--seed 401] [--names Mia,Ted,Gus,Rex]
        [--conditions chain,small-vacuum,...] [--minutes 15] [--check]

Sentences of the worlds of `benchmarks.hearing`, each sought where it is. A search gives two cases: the sentence that it
would report; and the one that it would report if the right one were not there, which is wrong. The second ones count as
much in all as searches are wrong in fact, and at least half a search. Every sentence is wrong that is made of what
robots say whom the listener does not know, of made sounds, or, with --data, of recorded sounds and people's talk to
each other: of each sound the likeliest sentence of those that a robot's ears search for. `--check` prints how the
weights in use fare, instead of fitting: use other seeds, names and conditions than they were fitted with.
"""

from __future__ import annotations

import argparse
import random
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from benchmarks.hearing.material import Team, make_team
from benchmarks.hearing.worlds import sounds
from benchmarks.hearing.worlds.conditions import conditions
from benchmarks.hearing.worlds.trials import Trial, hear, make_trial
from benchmarks.keyword.clips import part_of
from hvcpd.assembly.make import make_speech_recogniser, make_waveform_books
from hvcpd.assembly.plan import HearingPlan
from hvcpd.hardware.soundfile import read_wav
from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from hvcpd.recognition.channel.estimation import WhitenedSound
from hvcpd.recognition.channel.path import Path as Sentence
from hvcpd.recognition.channel.recogniser import ChannelRecogniser, Evidence, noise_sample
from hvcpd.recognition.channel.search import ChannelSearch, ChannelSegment, SearchResult
from hvcpd.recognition.fitted import fitted as weights_of
from hvcpd.recognition.frontend import power_ratio
from hvcpd.recognition.stages import SynchronousWorker

CONDITIONS = (
    "chain,small-vacuum,good-vacuum,ideal-vacuum,doppler,measured+0,measured-5,chapel,"
    "living-room+0,living-room-5,next-room+0,classroom+0,chapel+0,chapel-5"
)
TALK_DB = (30.0, 10.0, 0.0)
"""People's talk over white noise."""
TALK_DBFS = -26.0
LEAST_PRECEDING, AFTER = 3 * SAMPLE_RATE_HZ, SAMPLE_RATE_HZ // 2
LEAST = (0.95, 0.7, 0.5)
"""Confidences that are told."""
RIDGE = 0.001
"""Of the weights' squares, of standardised features, a case: few searches are wrong."""


@dataclass(frozen=True)
class Case:
    """A sentence that might be reported: its features; whether it is right; whether the right one was left out."""

    features: tuple[float, ...]
    right: bool
    left_out: bool
    talk: bool = False
    """Whether no robot that the listener knows said anything."""


class Searched(SynchronousWorker[ChannelSegment, SearchResult]):
    """A worker that keeps its jobs."""

    def __init__(self) -> None:
        super().__init__()
        self.jobs: list[ChannelSegment] = []

    def submit(self, job: ChannelSegment, search: Callable[[ChannelSegment], SearchResult]) -> bool:
        """As `Worker.submit`."""
        self.jobs.append(job)
        return super().submit(job, search)


class Bench:
    """Searches trials."""

    def __init__(self, team: Team) -> None:
        self.team = team
        self.books = books = make_waveform_books(team.book, team.names, team.sound)
        self.listener = ChannelRecogniser(team.book.robots_graph, books)
        self.search = ChannelSearch(team.book.robots_graph, books[: len({book.voice for book in books})])

    def paths(self, sound: Samples, lead: int) -> tuple[WhitenedSound, list[Sentence]]:
        """Those in a sound, shape (n,), whose first `lead` samples are from before the speech."""
        heard = sound[lead - SAMPLE_RATE_HZ // 2 :]
        weighted = WhitenedSound(heard, noise_sample(sound[:lead], heard))
        return weighted, self.search.paths(weighted)

    def cases(self, trial: Trial) -> Iterator[Case]:
        """One or two of the first sentence of a trial; none if nothing was found."""
        said = trial.said[0]
        begin = max(said.start - LEAST_PRECEDING, 0)
        sound = trial.sound[begin : said.end + AFTER]
        weighted, paths = self.paths(sound, said.start - begin)
        found = self.listener.evidence(weighted, paths)
        if found is not None:
            yield case(found, said.words, False)
        others = [path for path in paths if path.words != said.words]
        if len(others) < len(paths):
            wrong = self.listener.evidence(weighted, others)
            if wrong is not None:
                yield case(wrong, said.words, True)

    def sounds(self, clips: Iterator[tuple[str, Samples]]) -> Iterator[Case]:
        """The likeliest sentence that a robot's ears search for in each clip, if any, heard one after the other."""
        searched = Searched()
        plan = HearingPlan(channel=searched)
        recogniser = make_speech_recogniser(self.team.book, self.team.names, self.team.sound, plan, books=self.books)
        for _, clip in clips:
            searched.jobs.clear()
            hear(recogniser, clip)
            found = []
            for job in searched.jobs:
                weighted, paths = self.paths(job.sound, job.lead)
                evidence = self.listener.evidence(weighted, paths)
                found += [evidence] if evidence is not None else []
            if found:
                likeliest = max(found, key=lambda each: each.confidence)
                yield replace(case(likeliest, (), False), talk=True)

    def talk(self, talk: Samples, seed: int, snr_db: float) -> Iterator[Case]:
        """The sentence made of talk that no known robot said, shape (n,), if any, in white noise."""
        rms = float(np.sqrt(np.mean(np.square(talk, dtype=np.float64)))) + 1e-9
        level = power_ratio(TALK_DBFS) ** 0.5
        rng = np.random.default_rng(seed)
        noise = rng.standard_normal(LEAST_PRECEDING + len(talk)) * level * power_ratio(-snr_db) ** 0.5
        sound = np.asarray(np.pad(talk * (level / rms), (LEAST_PRECEDING, 0)) + noise, np.float32)
        weighted, paths = self.paths(sound, LEAST_PRECEDING)
        found = self.listener.evidence(weighted, paths)
        if found is not None:
            yield replace(case(found, (), False), talk=True)


def case(evidence: Evidence, words: tuple[str, ...], left_out: bool) -> Case:
    path: Sentence = evidence.path
    return Case(evidence.features, path.words == words, left_out)


def people(o: argparse.Namespace) -> Iterator[Samples]:
    """People's talk to each other: one half to fit, the other half to check."""
    files = sorted((o.data / "negatives").glob("*.wav")) if o.data is not None else []
    part = [path for path in files if (part_of(path.stem, half=True) == "test") == o.check]
    for path in part[: 8 * o.sentences]:
        yield np.asarray(read_wav(path), np.float32)


def ordinary_sounds(o: argparse.Namespace) -> Iterator[tuple[str, Samples]]:
    """Made ones, and half of the recordings to fit, the other half to check."""
    yield from sounds.made(o.minutes, o.seed)
    if o.data is not None:
        for name, clip in sounds.recorded(o.data):
            if (part_of(name, half=True) == "test") == o.check:
                yield name, clip


def unknown_robots(o: argparse.Namespace) -> Iterator[Samples]:
    """Sentences of robots whose names, and so whose voices, nobody knows."""
    known = make_team(o.names.split(","))
    voices = {known.sound.voice_of(name).name for name in known.names}
    others = [voice for voice in known.sound.every_voice() if voice.name not in voices]
    chooser = random.Random(o.seed)
    for number in range(4 * o.sentences):
        speaker = known.sound.speaker_in(others[number % len(others)])
        yield np.asarray(speaker.render(known.book.phrases(known.book.sample(chooser))), np.float32)


def collect(o: argparse.Namespace) -> list[Case]:
    """The cases of all sentences, printed line by line."""
    bench = Bench(make_team(o.names.split(",")))
    named = {condition.name: condition for condition in conditions(o.rooms, o.data)}
    found: list[Case] = []
    for name in o.conditions.split(","):
        for number in range(o.sentences) if name in named else ():
            new = list(bench.cases(make_trial(bench.team, named[name], number, o.seed, False, o.data)))
            for each in new:
                print(name, number, "right" if each.right else "left out" if each.left_out else "wrong", end=" ")
                print(*(f"{value:.3f}" for value in each.features), flush=True)
            found += new
    for number, talk in enumerate((*unknown_robots(o), *people(o))):
        for snr_db in TALK_DB:
            for each in bench.talk(talk, o.seed + number, snr_db):
                print("talk", number, snr_db, *(f"{value:.3f}" for value in each.features), flush=True)
                found.append(each)
    for each in bench.sounds(ordinary_sounds(o)):
        print("sound", *(f"{value:.3f}" for value in each.features), flush=True)
        found.append(each)
    return found


def fit(x: NDArray[np.float64], right: NDArray[np.bool_], counts: NDArray[np.float64]) -> NDArray[np.float64]:
    """Logistic regression with a ridge: the weights of the columns of `x`, shape (n, k), none negative, as each speaks
    for a sentence; and last the bias. `counts`: how much each row counts, shape (n,)."""
    mean, spread = x.mean(axis=0), x.std(axis=0) + 1e-9
    z = np.column_stack([(x - mean) / spread, np.ones(len(x))])
    sign = np.where(right, -1.0, 1.0)

    def cost(w: NDArray[np.float64]) -> float:
        return float(counts @ np.logaddexp(0.0, sign * (z @ w)) / counts.sum() + RIDGE * (w[:-1] @ w[:-1]))

    bounds = [(0.0, None)] * x.shape[1] + [(None, None)]
    w = np.asarray(minimize(cost, np.zeros(x.shape[1] + 1), bounds=bounds).x)
    weights = w[:-1] / spread
    return np.append(weights, w[-1] - weights @ mean)


def counted(cases: list[Case]) -> NDArray[np.float64]:
    """How much each case counts."""
    found = [each for each in cases if not each.left_out and not each.talk]
    wrong = sum(not each.right for each in found) + 0.5
    left_out = sum(each.left_out for each in cases)
    return np.array([wrong / max(left_out, 1) if each.left_out else 1.0 for each in cases])


def tell(cases: list[Case], p: NDArray[np.float64]) -> str:
    """How the probabilities fare."""
    right = np.array([each.right for each in cases])
    left_out = np.array([each.left_out for each in cases])
    found = ~left_out
    told = [f"{int(right[found & (p >= least)].sum())} of {int((found & (p >= least)).sum())}" for least in LEAST]
    low = int((left_out & (p < 0.5)).sum())
    return (
        f"{int(right.sum())} of {int(found.sum())} sentences right; of those with 0.95 and more {told[0]}, "
        f"with 0.7 and more {told[1]}, with 0.5 and more {told[2]}; without the right one {low} of "
        f"{int(left_out.sum())} below 0.5, {int((left_out & (p >= 0.95)).sum())} with 0.95 and more"
    )


def fitted(o: argparse.Namespace) -> dict[str, object]:
    """The section of `fitted.json`."""
    cases = collect(o)
    x, right = np.array([each.features for each in cases]), np.array([each.right for each in cases])
    weights = fit(x, right, counted(cases))
    p = 1.0 / (1.0 + np.exp(-(x @ weights[:-1] + weights[-1])))
    score = tell(cases, p)
    print(score)
    rounded = [float(f"{value:.5g}") for value in weights]
    people_too = f" and {8 * o.sentences} people" if o.data is not None else ""
    talk = f"; talk of {4 * o.sentences} unknown robots{people_too}; {o.minutes:g} min of sounds, and recorded ones"
    data = f"{o.sentences} sentences each of {o.conditions.replace(',', ', ')}; names {o.names}; seed {o.seed}{talk}"
    names = ("log_lead", "fit", "log_words")
    return {"data": data, "score": score, "bias": rounded[-1], "weights": dict(zip(names, rounded[:-1], strict=True))}


def parser() -> argparse.ArgumentParser:
    """The options."""
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--data", type=Path, help="folder of rooms and noises")
    options.add_argument("--sentences", type=int, default=8, help="of each condition")
    options.add_argument("--seed", type=int, default=401)
    options.add_argument("--rooms", type=int, default=101, help="seed of the rooms that are simulated")
    options.add_argument("--minutes", type=float, default=15.0, help="of made sounds")
    options.add_argument("--names", default="Mia,Ted,Gus,Rex")
    options.add_argument("--conditions", default=CONDITIONS)
    options.add_argument("--check", action="store_true", help="how the weights in use fare")
    return options


def main() -> None:
    o = parser().parse_args()
    if not o.check:
        found = fitted(o)
        print(found["bias"], found["weights"])
        return
    cases, model = collect(o), weights_of("channel_confidence")
    logits = np.array([each.features for each in cases]) @ [*model["weights"].values()] + model["bias"]
    print(tell(cases, 1.0 / (1.0 + np.exp(-logits))))


if __name__ == "__main__":
    main()
