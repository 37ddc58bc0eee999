"""Collects what is said and heard near a robot: the keyword by many, words like it, talk, sounds.

    nice python -m benchmarks.keyword.clips --data DIR --out clips.npz [--seed 1] [--scale 1.0]

Needs espeak-ng and flite. By part: people are split by speaker, other recordings by file (`part_of`). Never
drawn, so that `benchmarks.stop` may be held against them: flite's slt and rms, espeak-ng's plain voices and its
variants f3 and m3, and all other synthesizers.
"""

from __future__ import annotations

import argparse
import hashlib
import random
import subprocess
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import numpy as np

from benchmarks.judging import Phrases, text_of
from benchmarks.phones.texts import NAMES, Texts, common_words
from benchmarks.phones.voices import ACCENTS, VARIANTS, Talker, espeak
from hvcpd.hardware.soundfile import read_wav
from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from hvcpd.synthesis.leveling import audible
from hvcpd.synthesis.lexicon import Lexicon
from hvcpd.synthesis.speaker import Speaker
from hvcpd.synthesis.voices import VOICES, Voice

KEYWORD = "stop"
KINDS = ("stop", "word", "talk", "sound", "inside")
"""The keyword at the end of a call; single words and calls that are none; sentences; what nobody says; sentences of
which the keyword is a part."""
PHONES = ("S", "T", "AA", "P")
ALIKE = tuple(
    "top shop chop crop drop hop pop mop cop prop swap stock stalk stomp stump stub stuff stab stack staff step stoop "
    "steep strap strip strop start star stark stall storm store spot spa scott slop slot stalled stand still up cup "
    "tub tap tip type tarp tarot tom todd talk taught dot dock pop-up option adopted alexa foxtrot bob rob bot robot "
    "laptop desktop rooftop treetop atop tiptop table-top start-up what's-up it's-top stopped stopping "
    "stopper stopwatch stopover unstopped best-option last-option this-top let's-talk that's-tough it's-tough "
    "ask-tom next-tom is-tom is-scott hi-scott its-up let's-hop lost-opera past-opera mist-up rest-up east-up "
    "go forward follow house on off six five four one two three yes no left right down back come".split()
)
OWN_WORDS = (
    "i have stopped",
    "rob has stopped",
    "bot has stopped",
    "hi rob i am bot i have stopped",
    "i have lost my memory i have stopped",
    "task one complete",
    "top",
    "shop",
    "up",
    "alexa",
    "foxtrot",
    "stopped",
    "stock",
    "stomp",
    "spot",
    "step",
    "start",
)


BEFORE_IT = tuple(
    "the bus|the next|at the last|do not|we will never|you can|where does it|he would not|did they ever|she did not|"
    "i want to|they had to|this is a tram|it will|when do we|after that they|the robot will|how can i|never".split("|")
)
AFTER_IT = tuple(
    "|is near the house|on the way|for a coffee|talking about it|at the corner|working today|the music|in the morning|"
    "by the shop|and look at that|before the bridge|to think|them from doing it|it from falling|over there".split("|")
)
JOBS = 4
"""Processes; most of their time they wait for synthesizers to start."""


@dataclass(frozen=True, eq=False)
class Clip:
    """`sound` at 16 kHz; `end`: the sample where the keyword ends, for kind "stop"; `part`: train, validate or test."""

    sound: Samples
    kind: str
    end: int
    part: str
    source: str


def part_of(name: str, half: bool = False) -> str:
    """Where recordings by this speaker, or this recording, belong; the same everywhere. `half`: half of them to test
    with, a tenth to choose thresholds by."""
    first = hashlib.sha256(name.encode()).digest()[0]
    if half:
        return "test" if first % 2 else "validate" if first % 10 == 0 else "train"
    share = first % 100
    return "test" if share < 24 else "validate" if share < 32 else "train"


def trimmed(sound: Samples) -> Samples:
    """At full scale, without what is not audible before and after it but 50 ms."""
    sound = sound - sound.mean(dtype=np.float64).astype(np.float32)
    begin, end = audible(sound)
    margin = SAMPLE_RATE_HZ // 20
    kept = sound[max(begin - margin, 0) : end + margin]
    return np.asarray(kept * (0.9 / max(float(np.abs(kept).max(initial=0.0)), 1e-6)), np.float32)


def recorded(data: Path) -> Iterator[Clip]:
    """People's words, digits, and talk; sounds."""
    for path in sorted((data / "words").rglob("*.wav")):
        word, speaker = path.parent.name, path.name.split("_")[0]
        sound = trimmed(np.asarray(read_wav(path), np.float32))
        yield _clip(sound, "stop" if word == KEYWORD else "word", part_of(speaker), f"words {word} {speaker}")
    for path in sorted((data / "digits").glob("*.wav")):
        _, speaker, take = path.stem.split("_")
        part = "test" if int(take) >= 5 else "train"
        yield _clip(trimmed(np.asarray(read_wav(path), np.float32)), "word", part, f"digits {path.stem} {speaker}")
    for folder, kind in (("negatives", "talk"), ("sounds", "sound")):
        for path in sorted((data / folder).glob("*.wav")):
            sound = trimmed(np.asarray(read_wav(path), np.float32))
            yield _clip(sound, kind, part_of(path.stem, half=True), f"{folder} {path.stem}")
    yield from _among_others(data / "words")


def _among_others(folder: Path) -> Iterator[Clip]:
    """Each of people's keywords again between other words of theirs, as in a sentence."""
    by_speaker: dict[str, list[Path]] = {}
    for path in sorted(folder.rglob("*.wav")):
        by_speaker.setdefault(path.name.split("_")[0], []).append(path)
    for speaker, paths in sorted(by_speaker.items()):
        others = [path for path in paths if path.parent.name != KEYWORD]
        chooser = random.Random(speaker)
        for path in [path for path in paths if path.parent.name == KEYWORD] if len(others) > 2 else ():
            before, after = chooser.choices(others, k=chooser.choice((1, 2))), chooser.choices(others, k=2)
            parts = [_tight(np.asarray(read_wav(each), np.float32)) for each in (*before, path, *after)]
            yield _clip(np.concatenate(parts), "inside", part_of(speaker), f"words among others {speaker}")


def _tight(sound: Samples) -> Samples:
    begin, end = audible(sound)
    kept = sound[begin:end]
    return np.asarray(kept * (0.9 / max(float(np.abs(kept).max(initial=0.0)), 1e-6)), np.float32)


def _clip(sound: Samples, kind: str, part: str, source: str) -> Clip:
    return Clip(sound, kind, audible(sound)[1], part, source)


def any_voice(chooser: random.Random) -> Voice:
    """One of the robots' voices, or one like none: a child's, a giant's, somebody's in a hurry or who calls."""
    voice = chooser.choice(VOICES)
    if chooser.random() < 0.4:
        return replace(voice, rate=voice.rate * chooser.uniform(0.8, 1.25))
    return Voice(
        "any",
        85.0 * 2.0 ** chooser.uniform(0.0, 1.8),
        chooser.uniform(0.9, 1.35),
        chooser.uniform(0.6, 1.35),
        chooser.uniform(-42.0, -24.0),
        chooser.uniform(0.45, 0.75),
        chooser.uniform(2000.0, 6000.0),
        chooser.uniform(0.5, 1.6),
    )


def own(lexicon: Lexicon, exact: bool) -> Talker:
    """The robots' synthesizer; `exact`: in the eight voices as they are."""

    def say(phrases: Phrases, chooser: random.Random) -> Samples:
        voice = chooser.choice(VOICES) if exact else any_voice(chooser)
        return Speaker(voice, lexicon).render(phrases)

    return say


def flite(voice: str) -> Talker:
    """A voice of flite, faster or slower, higher or lower."""

    def say(phrases: Phrases, chooser: random.Random) -> Samples:
        with tempfile.TemporaryDirectory() as folder:
            wav = f"{folder}/a.wav"
            stretch = f"duration_stretch={chooser.uniform(0.75, 1.5):.2f}"
            command = ("flite", "-voice", voice, "--setf", stretch, "-t", text_of(phrases), "-o", wav)
            subprocess.run(command, check=True, capture_output=True)
            return np.asarray(read_wav(Path(wav)), np.float32)

    return say


def foreign() -> Talker:
    """espeak-ng or flite, at any pace and pitch."""
    wide = espeak(ACCENTS[2:], VARIANTS)
    american = espeak(("en-us",), VARIANTS)
    some = (wide, american, flite("awb"), flite("kal16"))

    def say(phrases: Phrases, chooser: random.Random) -> Samples:
        return chooser.choices(some, (0.46, 0.22, 0.2, 0.12))[0](phrases, chooser)

    return say


def call(chooser: random.Random) -> Phrases:
    """The keyword as it is called."""
    name = chooser.choice(NAMES).lower()
    before = chooser.choices(((), (name,), ("all",), ("please",), ("robot",), (KEYWORD,)), (12, 5, 2, 1, 1, 1))[0]
    return [(*before, KEYWORD)]


def alike(known: Mapping[str, Sequence[str]]) -> list[tuple[str, ...]]:
    """Words and pairs of words that sound like it: ALIKE, and all of the dictionary that are one sound away."""
    found = [tuple(word.split("-")) for word in ALIKE]
    plain = [word for word in sorted(known) if word.isalpha() and 2 < len(word) < 12]
    for word in plain:
        phones = known[word]
        if tuple(phones[-4:]) == PHONES:
            continue
        is_near = len(phones) <= 5 and _distance(phones) <= 1
        if is_near or _has(phones, PHONES) or _has(phones, PHONES[1:]):
            found.append((word,))
    return found


def _has(phones: Sequence[str], part: Sequence[str]) -> bool:
    return any(tuple(phones[k : k + len(part)]) == tuple(part) for k in range(len(phones)))


def _distance(phones: Sequence[str]) -> int:
    row = list(range(len(PHONES) + 1))
    for i, phone in enumerate(phones):
        left, row[0] = row[0], i + 1
        for j, other in enumerate(PHONES):
            left, row[j + 1] = row[j + 1], min(left + (phone != other), row[j] + 1, row[j + 1] + 1)
    return row[-1]


def inside(chooser: random.Random) -> Phrases:
    """A sentence with the keyword in it, which calls nobody."""
    return [f"{chooser.choice(BEFORE_IT)} {KEYWORD} {chooser.choice(AFTER_IT)}".split()]


Job = tuple[str, str, Phrases, float]
"""By whom, of what kind, what, and a seed."""


def jobs(seed: int, scale: float) -> Iterator[Job]:
    """What synthesizers shall say."""
    known, chooser = common_words(), random.Random(seed)
    texts, near = Texts(known, seed), alike(known)
    plan = {
        "own": {"stop": 150, "talk": 350, "word": 150, "inside": 30},
        "like own": {"stop": 350, "talk": 150, "word": 300, "inside": 80},
        "foreign": {"stop": 800, "talk": 900, "word": 900, "inside": 350},
    }
    for source, numbers in plan.items():
        for kind in (kind for kind, n in numbers.items() for _ in range(round(n * scale))):
            if kind == "stop":
                phrases = call(chooser)
            elif kind == "inside":
                phrases = inside(chooser)
            elif kind == "talk":
                phrases = texts.prose().phrases if chooser.random() < 0.3 else texts.draw().phrases
            elif source != "foreign" and chooser.random() < 0.4:
                phrases = [tuple(chooser.choice(OWN_WORDS).split())]
            else:
                phrases = [chooser.choice(near)]
            if kind in ("stop", "inside") or not any(KEYWORD in phrase for phrase in phrases):
                yield source, kind, phrases, chooser.random()


@cache
def _talkers() -> Mapping[str, Talker]:
    lexicon = Lexicon.load()
    return {"own": own(lexicon, True), "like own": own(lexicon, False), "foreign": foreign()}


def said(job: Job) -> Clip:
    """By a synthesizer."""
    source, kind, phrases, seed = job
    sound = trimmed(_talkers()[source](phrases, random.Random(seed)))
    text = " ".join(word for phrase in phrases for word in phrase)
    return _clip(sound, kind, part_of(f"{text} {len(sound)}").replace("test", "train"), f"{source}: {text}")


def save(path: Path, clips: Sequence[Clip]) -> None:
    """As arrays one after the other."""
    np.savez(
        path,
        sound=np.concatenate([np.round(c.sound * 32767.0).astype(np.int16) for c in clips]),
        length=np.array([len(c.sound) for c in clips]),
        end=np.array([c.end for c in clips]),
        kind=np.array([c.kind for c in clips]),
        part=np.array([c.part for c in clips]),
        source=np.array([c.source for c in clips]),
    )


def load(path: Path) -> list[Clip]:
    """Those that `save` wrote."""
    file = np.load(path)
    sounds = np.split(file["sound"].astype(np.float32) / 32768.0, np.cumsum(file["length"])[:-1])
    columns = (file["kind"], file["end"], file["part"], file["source"])
    rows = zip(sounds, *columns, strict=True)
    return [Clip(sound, str(kind), int(end), str(part), str(source)) for sound, kind, end, part, source in rows]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, required=True)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--scale", type=float, default=1.0, help="how much synthetic speech")
    o = parser.parse_args()
    with ProcessPoolExecutor(JOBS) as pool:
        clips = [*recorded(o.data), *pool.map(said, jobs(o.seed, o.scale), chunksize=8)]
    clips = [clip for clip in clips if len(clip.sound) > SAMPLE_RATE_HZ // 20]
    save(o.out, clips)
    for kind in KINDS:
        of_kind = [clip for clip in clips if clip.kind == kind]
        print(kind, {part: sum(c.part == part for c in of_kind) for part in ("train", "validate", "test")})


if __name__ == "__main__":
    main()
