"""How sure a robot is of what strangers say, and how often it is right: a reliability diagram of the second pass.

    python -m benchmarks.reliability [--kokoro FOLDER] [--part test] [--sentences 4] [--requests 3] [--seed 601]
        [--near NET.npz] [--far NET.npz] [--plot FILE.png]

Sentences of the phrasebook and requests, with two phrasebooks, by Kokoro's voices that nothing learned from (more of
them in FOLDER, see `benchmarks.phones.voices`) and flite's; `--part calibration`: by those of Kokoro's by which the
confidence is fitted. Each is heard close by, in white noise at 20 dB and pink noise at 10 dB, and in white noise in two
simulated rooms (needs pyroomacoustics). The second pass alone is told where it is. A robot does the same for a friend
as for a person whose name it knows, so either is right here.

With `--near` or `--far` another phone net takes the place of the shipped one. Nets are compared by the last line: how
many right ones are surer than all but so many wrong ones.
"""

from __future__ import annotations

import argparse
import random
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import chain, islice
from pathlib import Path

from benchmarks.judging import reliability, tell_reliability
from benchmarks.people_material import alone, sentences
from benchmarks.people_rooms import NOISES, flite_voices, requests, rooms, spoken_by
from benchmarks.people_stage import NAMES, Stage
from benchmarks.phones.voices import KOKORO_CALIBRATION, KOKORO_TESTS, Talker, kokoro
from hvcpd.evaluation.statistics import wilson
from hvcpd.language.addressees import FRIEND
from hvcpd.language.pattern import Words
from hvcpd.language.wordings import by_name, same_meaning
from hvcpd.people.fusion import Hypotheses, fuse
from hvcpd.people.phones import PhoneNet, far_net, near_net, net_inputs
from hvcpd.people.second_pass import MIN_STRANGERS_PROBABILITY
from hvcpd.recognition.arrays import mapped_arrays
from hvcpd.recognition.stages import Segment

PHRASEBOOKS: tuple[tuple[Sequence[str], Path | None], ...] = (
    (NAMES, None),
    (("Hugo", "Kim", "Vera"), Path("examples/tidy_up/tasks.yaml")),
)
LEVELS = (0.0, 0.3, 0.5, 0.7, 0.8, 0.9, 0.95, 1.0)
WRONG = (2, 5, 10, 20, 40)
WITH_ROOMS = 3
"""Of the places of `benchmarks.people_rooms`, the first ones."""


@dataclass(frozen=True)
class Judged:
    """A sentence that was heard at a place: how sure the robot is of what it found, and whether that was said."""

    place: str
    probability: float
    right: bool


def voices(part: str, folder: Path | None) -> Mapping[str, Talker]:
    """Those of Kokoro's that are there, and, to test with, flite's."""
    names = KOKORO_TESTS if part == "test" else KOKORO_CALIBRATION
    found = {**kokoro(), **(kokoro(folder) if folder is not None else {})}
    return {name: found[name] for name in names if name in found} | (flite_voices() if part == "test" else {})


def heard(
    stage: Stage, nets: Sequence[PhoneNet], talkers: Mapping[str, Talker], o: argparse.Namespace
) -> Iterator[Judged]:
    """All sentences with one phrasebook at all places."""
    chooser, [me, _, person] = random.Random(o.seed), stage.names
    said = spoken_by(
        talkers,
        lambda number: [
            *sentences(stage.book, o.sentences, o.seed + number),
            *requests(stage.book, me, person, o.requests, chooser),
        ],
        o.seed,
    )
    second_pass = stage.opinion(stage.book.people_graph, ())
    for number, (label, played) in enumerate(islice(rooms(o.seed), WITH_ROOMS)):
        there = played(said)
        for snr_db, colour in NOISES[:1] if number else NOISES:
            place = f"{label}, {colour} noise at {snr_db:.0f} dB"
            for k, (words, sound) in enumerate(there):
                segment = alone(sound, snr_db, colour, o.seed + k)
                found = fuse(through(nets, second_pass.hypotheses(segment), segment))
                right = found is not None and same_meaning(_anybodys(found.words), _anybodys(words))
                yield Judged(place, found.probability if found is not None else 0.0, right)


def through(nets: Sequence[PhoneNet], hypotheses: Hypotheses, segment: Segment) -> Hypotheses:
    """The same segment, as these nets hear it."""
    inputs = net_inputs(segment)
    return replace(hypotheses, posteriors=[net.layer.log_posteriors(net.activations(inputs)) for net in nets])


def _anybodys(words: Words) -> Words:
    return by_name(words, FRIEND) if "am" in words[:-1] else words


def right_where(judged: Sequence[Judged], wrong: int) -> int:
    """Right ones that are surer than all but so many wrong ones."""
    false = sorted((each.probability for each in judged if not each.right), reverse=True)
    least = false[wrong] if wrong < len(false) else -1.0
    return sum(each.right and each.probability > least for each in judged)


def draw(rows: Sequence[tuple[float, float, int, int]], path: Path) -> None:
    """The shares of right ones with their intervals, against the confidence, and how many there are of each."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    with pyplot.rc_context({"font.size": 9, "axes.spines.top": False, "axes.spines.right": False}):
        figure, axes = pyplot.subplots(figsize=(4.6, 4.2), layout="constrained")
        axes.plot((0, 100), (0, 100), color="black", lw=0.8, ls=":")
        axes.annotate("as often right as it is sure", (34, 24), rotation=42, fontsize=7, color="#444444")
        axes.annotate("sentences:", (1, 5), fontsize=7, color="#444444")
        for low, high, n, right in rows:
            if n:
                middle, share = 50.0 * (low + high), 100.0 * right / n
                ends = [100.0 * end for end in wilson(right, n)]
                axes.plot((100 * low, 100 * high), (share, share), color="#0072b2", lw=2.5)
                axes.plot((middle, middle), ends, color="#0072b2", lw=1.0)
                axes.annotate(str(n), (middle, 1), ha="center", fontsize=7, color="#444444")
        axes.set(xlabel="confidence, %", ylabel="sentences right, %", xlim=(0, 101), ylim=(0, 101))
        axes.grid(alpha=0.25)
        figure.savefig(path, dpi=130)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--kokoro", type=Path, metavar="FOLDER")
    parser.add_argument("--part", choices=("test", "calibration"), default="test")
    parser.add_argument("--sentences", type=int, default=4, help="by each voice")
    parser.add_argument("--requests", type=int, default=3, help="by each voice")
    parser.add_argument("--seed", type=int, default=601)
    parser.add_argument("--near", type=Path)
    parser.add_argument("--far", type=Path)
    parser.add_argument("--plot", type=Path)
    o = parser.parse_args()
    nets = [
        PhoneNet.of(mapped_arrays(path)) if path is not None else shipped()
        for path, shipped in ((o.near, near_net), (o.far, far_net))
    ]
    talkers = voices(o.part, o.kokoro)
    if not talkers:
        raise SystemExit("neither Kokoro nor flite is installed")
    stages = (Stage(False, names, tasks) for names, tasks in PHRASEBOOKS)
    judged = list(chain.from_iterable(heard(stage, nets, talkers, o) for stage in stages))
    for place in dict.fromkeys(each.place for each in judged):
        here = [each for each in judged if each.place == place]
        sure = [each.right for each in here if each.probability >= MIN_STRANGERS_PROBABILITY]
        likeliest = sum(each.right for each in here)
        print(
            f"{place:42} likeliest {likeliest:3} of {len(here)}; sure: right {sum(sure)}, wrong {len(sure) - sum(sure)}"
        )
    rows = reliability(((each.probability, each.right) for each in judged), LEVELS)
    tell_reliability(rows)
    best = ", ".join(str(right_where(judged, wrong)) for wrong in WRONG)
    print(f"right where {', '.join(map(str, WRONG))} wrong ones are told: {best} of {len(judged)}")
    if o.plot is not None:
        draw(rows, o.plot)


if __name__ == "__main__":
    main()
