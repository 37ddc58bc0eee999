"""Detections and false alarms of the net of `hvcpd.recognition.keyword` at each threshold.

    nice python -m benchmarks.keyword.curve --data DIR [--net stop.npz ...] [--part test] [--calls 40] [--minutes 20]
        [--more DIR] [--seed 0]

Nothing but the nets listen, all to the same. `--part validate`: what thresholds are chosen by, voices and people that
are neither learned from nor tested with; `test`: what is reported. A call comes alone, or as loud as or louder than a
robot's sentence or somebody who orders coffee. A halt is a chance of the word that reaches the threshold until 0.5 s
after the word's end; a latch, one of a call until 1 s after it. Nobody calls in: people's words, one every 1.5 s;
people ordering coffee; lines of games, if DIR has them; sentences by synthesizers; sounds; robots' sentences, alone and
in a kitchen; sentences with the word in them, which call nobody. There, what follows within 2 s of a halt is the same
halt.
--more: recordings by yet another voice, each ending with the word, and of what else it says (not stop_*.wav).
"""

from __future__ import annotations

import argparse
import random
from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks.judging import in_noise, text_of
from benchmarks.keyword.clips import KEYWORD, part_of, trimmed
from benchmarks.keyword.texts import inside
from benchmarks.keyword.voices import actors
from benchmarks.manner import Manner
from benchmarks.people_material import foreigners
from benchmarks.phones.recorded import half_in
from benchmarks.phones.texts import Texts, common_words
from benchmarks.phones.voices import calibrators, festival, kokoro
from benchmarks.stop import Stage, at_level, kitchen, room
from benchmarks.stop_callers import CALLS, HELD_OUT_VOICES, ended
from hvcpd.hardware.soundfile import read_wav
from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from hvcpd.recognition.keyword.net import SMOOTHING_COLUMNS, WEIGHTS, KeywordNet, Weights
from hvcpd.recognition.stream import CHUNK_SAMPLES, FrameStream

OVER_DB: tuple[float | None, ...] = (None, -6.0, 0.0, 6.0, 12.0)
HALT_S, LATCH_S = 0.5, 1.0
STANDS_S = 2.0
LEVEL_DBFS = -35.0
"""Of talk; calls are as much louder as they are said to be."""
WORD_EVERY_S = 1.5
THRESHOLDS = (0.05, 0.1, 0.15, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95, 0.98)
Speak = Callable[[random.Random], Samples]
Curves = NDArray[np.float64]
Told = list[tuple[float, float]]


@dataclass(frozen=True, eq=False)
class Part:
    """The callers and the other sounds, by kind: endless, or each recording once."""

    callers: dict[str, Speak]
    others: dict[str, Iterator[Samples]]
    over: Sequence[Speak]
    """Over which it is called."""


def _call(say: Callable[..., Samples], chooser: random.Random) -> Samples:
    return say(chooser, [chooser.choice(CALLS).split()])


def part(name: str, stage: Stage, data: Path, more: Path | None) -> Part:
    """Voices, people and recordings of that part."""
    texts, speak, clatter = Texts(common_words(), 77), _voices(name), kitchen(data)
    callers: dict[str, Speak] = {kind: partial(_call, say) for kind, say in speak.items()}
    people = [p for p in sorted((data / "words" / KEYWORD).glob("*.wav")) if part_of(p.name.split("_")[0]) == name]
    callers["people"] = lambda chooser: read(chooser.choice(people))
    callers["robots"] = stage.call
    if more is not None:
        calls = sorted(more.glob("stop_*.wav"))
        callers[more.name] = lambda chooser: read(chooser.choice(calls))
    words = [p for p in sorted((data / "words").rglob("*.wav")) if p.parent.name != KEYWORD]
    words = [p for p in words if part_of(p.name.split("_")[0]) == name]
    coffee, sounds = (half_in(data / folder, name) for folder in ("negatives", "sounds"))
    lines = [clip.sound for clip in actors(data, name)]
    random.Random(76).shuffle(lines)

    def prose() -> Iterator[Samples]:
        chooser = random.Random(78)
        while True:
            phrases = texts.prose().phrases
            if not any(KEYWORD in text_of([phrase]) for phrase in phrases):
                yield speak[chooser.choice(list(speak))](chooser, phrases)

    def parts() -> Iterator[Samples]:
        chooser = random.Random(80)
        while True:
            yield speak[chooser.choice(list(speak))](chooser, inside(chooser))

    def sentences(stage: Stage, snr_db: float | None = None) -> Iterator[Samples]:
        chooser = random.Random(79)
        while True:
            said = stage.sentence(chooser, chooser.choice(stage.names))
            yield said if snr_db is None else in_noise(said, snr_db, chooser.randrange(1 << 30))

    def clattered() -> Iterator[Samples]:
        for k, said in enumerate(sentences(stage)):
            at = k * 7919 * SAMPLE_RATE_HZ // 1000
            yield at_level(said, LEVEL_DBFS) + np.take(clatter, np.arange(at, at + len(said)), mode="wrap")

    others = {
        "people's words": (
            np.pad(s, (0, max(round(WORD_EVERY_S * SAMPLE_RATE_HZ) - len(s), 0))) for s in map(read, words)
        ),
        "people ordering coffee": map(read, coffee),
        "actors in games": iter(lines),
        "sentences by synthesizers": prose(),
        "sounds": map(read, sounds),
        "robots' sentences": sentences(stage),
        "robots' in a kitchen, 0 dB": clattered(),
        "natural ones in noise, 0 dB": sentences(Stage(stage.names, Manner(natural=True)), 0.0),
        "sentences with it inside": parts(),
    }
    if more is not None:
        rest = [p for p in sorted(more.glob("*.wav")) if not p.name.startswith("stop_")]
        others |= {f"sentences by {more.name}": map(read, rest)} if rest else {}
    over = [lambda chooser: stage.sentence(chooser, chooser.choice(stage.names)), lambda c: read(c.choice(coffee))]
    return Part(callers, others, over)


def _voices(name: str) -> dict[str, Callable[..., Samples]]:
    """What synthesizers of that part say, by kind."""
    if name != "test":
        found = calibrators()
        return {"other synthesizers": lambda chooser, phrases: chooser.choice(found)(phrases, chooser)}
    some = [f for f in foreigners() if f.name.startswith(HELD_OUT_VOICES)]
    voices = {kind: [f for f in some if f.name.startswith(kind)] for kind in ("espeak-ng", "flite")}
    speak = {kind: _chosen([_anything(f.say) for f in found]) for kind, found in voices.items()}
    ked, neural = festival("ked_diphone"), list(kokoro().values())
    speak["festival"] = lambda chooser, phrases: ked(phrases, chooser)
    if neural:
        speak["kokoro"] = lambda chooser, phrases: chooser.choice(neural)(phrases, chooser)
    return speak


def _anything(say: Callable[..., Samples]) -> Callable[..., Samples]:
    return lambda chooser, phrases: say(phrases, chooser.choice((150, 175, 200)))


def _chosen(says: Sequence[Callable[..., Samples]]) -> Callable[..., Samples]:
    return lambda chooser, phrases: chooser.choice(says)(chooser, phrases)


def read(path: Path) -> Samples:
    """At 16 kHz."""
    return np.asarray(read_wav(path), np.float32)


def curves(net: KeywordNet, sound: Samples) -> Curves:
    """What counts of each curve, chunk by chunk, shape (chunks, 2)."""
    raw = np.array([net.posteriors(chunk.energies) for chunk in FrameStream().push(sound, False)])
    padded = np.pad(raw, ((SMOOTHING_COLUMNS - 1, 0), (0, 0)))
    return np.sort(np.lib.stride_tricks.sliding_window_view(padded, SMOOTHING_COLUMNS, axis=0), axis=-1)[..., -2]


def called(
    nets: Sequence[Weights], call: Samples, talk: Samples | None, over_db: float, seed: int
) -> list[tuple[float, float]]:
    """The highest chances of each net in time: of a halt and of a latch."""
    chooser, rng = random.Random(seed), np.random.default_rng(seed)
    call = at_level(ended(trimmed(call)), LEVEL_DBFS + over_db)
    at = round(chooser.uniform(2.0, 3.0) * SAMPLE_RATE_HZ)
    sound = room(at + len(call) + 2 * SAMPLE_RATE_HZ, seed)
    if talk is not None:
        talk = at_level(talk, LEVEL_DBFS)
        begin = at - round(rng.uniform(0.0, max(len(talk) - len(call), 1)))
        first, last = max(begin, 0), min(begin + len(talk), len(sound))
        sound[first:last] += talk[first - begin : last - begin]
    sound[at : at + len(call)] += call
    found = []
    for told in (curves(KeywordNet(weights), sound) for weights in nets):
        when = (np.arange(1, len(told) + 1) * CHUNK_SAMPLES + 240) - at - len(call)
        began = when > -len(call)
        halt, latch = (began & (when <= round(s * SAMPLE_RATE_HZ)) for s in (HALT_S, LATCH_S))
        found.append((float(told[halt, 0].max()), float(told[latch, 1].max())))
    return found


def rises(chances: NDArray[np.float64], threshold: float) -> int:
    """How often it reaches the threshold, while it does not stand for the time before."""
    stands, n, last = round(STANDS_S * SAMPLE_RATE_HZ / CHUNK_SAMPLES), 0, -(10**9)
    for at in map(int, np.flatnonzero(chances >= threshold)):
        n += at - last >= stands
        last = at if at - last >= stands else last
    return n


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, required=True)
    parser.add_argument("--net", type=Path, nargs="+", default=[WEIGHTS])
    parser.add_argument("--part", default="test")
    parser.add_argument("--calls", type=int, default=40)
    parser.add_argument("--minutes", type=float, default=20.0)
    parser.add_argument("--more", type=Path)
    parser.add_argument("--seed", type=int, default=0)
    o = parser.parse_args()
    nets, stage = [Weights.load(path) for path in o.net], Stage(("Rob", "Bot"))
    found = part(o.part, stage, o.data, o.more)
    rows = _calls(nets, found, o.calls, o.seed)
    for number, path in enumerate(o.net):
        print(f"{path}: share of calls heard, at", *THRESHOLDS)
        for curve, what in enumerate(("halt", "latch")):
            for (kind, over), chances in rows.items():
                share = [f"{100 * np.mean(np.array(chances)[:, number, curve] >= t):4.0f}" for t in THRESHOLDS]
                print(f"{what:6}{kind:20}{over:>10} n={len(chances):3} ", *share)
    print("times an hour that it is taken for one, at", *THRESHOLDS)
    for kind, stream in found.others.items():
        told, hours = _talk(nets, stream, o.minutes)
        for curve, what in enumerate(("halt", "latch")):
            for path, each in zip(o.net, told, strict=True):
                rates = [f"{rises(each[:, curve], t) / hours:6.1f}" for t in THRESHOLDS]
                print(f"{what:6}{kind:28} {60 * hours:5.1f} min", *rates, path.stem, flush=True)


def _calls(nets: Sequence[Weights], found: Part, n: int, seed: int) -> dict[tuple[str, str], list[Told]]:
    rows: dict[tuple[str, str], list[Told]] = defaultdict(list)
    for kind, call in found.callers.items():
        for k in range(seed, seed + n):
            chooser = random.Random(k)
            sound, talk = call(chooser), chooser.choice(found.over)(chooser)
            for over_db in OVER_DB:
                over = "alone" if over_db is None else f"{over_db:+.0f} dB"
                rows[kind, over].append(called(nets, sound, None if over_db is None else talk, over_db or 0.0, k))
    return rows


def _talk(nets: Sequence[Weights], stream: Iterator[Samples], minutes: float) -> tuple[list[Curves], float]:
    listening = [KeywordNet(weights) for weights in nets]
    parts: list[list[Curves]] = [[] for _ in nets]
    n = 0
    for k, sound in enumerate(stream):
        level = LEVEL_DBFS + (k * 7 % 21 - 10)
        whole = room(len(sound) + SAMPLE_RATE_HZ // 2, k)
        whole[: len(sound)] += at_level(sound, level)
        for net, mine in zip(listening, parts, strict=True):
            mine.append(curves(net, whole))
        n += len(whole)
        if n >= minutes * 60.0 * SAMPLE_RATE_HZ:
            break
    return [np.concatenate(mine) for mine in parts], n / SAMPLE_RATE_HZ / 3600.0


if __name__ == "__main__":
    main()
