"""Clips of sound near a robot, each of one kind, and their split: people are split by speaker, other recordings by file
(`part_of`)."""

from __future__ import annotations

import hashlib
import random
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hvcpd.hardware.soundfile import read_wav
from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from hvcpd.synthesis.leveling import audible

KEYWORD = "stop"
PARTS = ("train", "validate", "test")
KINDS = ("stop", "word", "talk", "sound", "inside")
"""The keyword at the end of a call; single words and calls that are none; sentences; what nobody says; sentences of
which the keyword is a part."""


@dataclass(frozen=True, eq=False)
class Clip:
    """`sound` at 16 kHz; `end`: the sample where the keyword ends, for kind "stop"; `part`: train, validate or test."""

    sound: Samples
    kind: str
    end: int
    part: str
    source: str


def part_of(name: str, half: bool = False) -> str:
    """The part for recordings by this speaker, or for this recording; the same on all machines. `half`: half of them
    are for tests, a tenth for choosing thresholds."""
    first = hashlib.sha256(name.encode()).digest()[0]
    if half:
        return "test" if first % 2 else "validate" if first % 10 == 0 else "train"
    share = first % 100
    return "test" if share < 24 else "validate" if share < 32 else "train"


def trimmed(sound: Samples) -> Samples:
    """Scale to full scale, and trim inaudible ends to 50 ms."""
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
        yield clip_of(sound, "stop" if word == KEYWORD else "word", part_of(speaker), f"words {word} {speaker}")
    for path in sorted((data / "digits").glob("*.wav")):
        _, speaker, take = path.stem.split("_")
        part = "test" if int(take) >= 5 else "train"
        yield clip_of(trimmed(np.asarray(read_wav(path), np.float32)), "word", part, f"digits {path.stem} {speaker}")
    for folder, kind in (("negatives", "talk"), ("sounds", "sound")):
        for path in sorted((data / folder).glob("*.wav")):
            sound = trimmed(np.asarray(read_wav(path), np.float32))
            yield clip_of(sound, kind, part_of(path.stem, half=True), f"{folder} {path.stem}")
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
            yield clip_of(np.concatenate(parts), "inside", part_of(speaker), f"words among others {speaker}")


def _tight(sound: Samples) -> Samples:
    begin, end = audible(sound)
    kept = sound[begin:end]
    return np.asarray(kept * (0.9 / max(float(np.abs(kept).max(initial=0.0)), 1e-6)), np.float32)


def clip_of(sound: Samples, kind: str, part: str, source: str) -> Clip:
    """A clip of sound that ends with the word."""
    return Clip(sound, kind, audible(sound)[1], part, source)


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
    """Load the clips that `save` wrote."""
    file = np.load(path)
    sounds = np.split(file["sound"].astype(np.float32) / 32768.0, np.cumsum(file["length"])[:-1])
    columns = (file["kind"], file["end"], file["part"], file["source"])
    rows = zip(sounds, *columns, strict=True)
    return [Clip(sound, str(kind), int(end), str(part), str(source)) for sound, kind, end, part, source in rows]
