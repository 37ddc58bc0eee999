"""The cost of listening: processor time and memory, ours and PocketSphinx's, on the same sound in the same run.

Each listener runs in a process of its own (`listener`), one after the other, so that its peak memory is its own.
"""

from __future__ import annotations

import csv
import json
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from rich.console import Console

from benchmarks.hearing import mixing
from benchmarks.hearing.listeners import padded
from benchmarks.hearing.material import Spoken, Team, make_stream, make_team, more_tasks
from benchmarks.hearing.noises import steady
from hvcpd.hardware.soundfile import write_wav
from hvcpd.ports import SAMPLE_RATE_HZ, Samples

SENTENCES = 20
NOISE_S = 60.0
SNR_DB = 20.0
LEVEL_DBFS = -35.0
NAMES = ("Rob Bot Max Ann Mia Ted Gus Rex Zoe Kim Oda Cal Eve Pip Amy Vic Sue Ned Ben Dot").split()
"""In the order in which teams grow; they have all eight voices from the twelfth name on."""
NAME_COUNTS = (2, 4, 8, 12, 16, 20)
WORD_COUNTS = (100, 200, 400, 700, 1000)


@dataclass(frozen=True)
class Cost:
    """Of one listener with one vocabulary. `speech` and `noise` are processor time over the sound's duration."""

    listener: str
    words: int
    names: int
    voices: int
    speech: float
    noise: float
    peak_mb: float
    right: int
    sentences: int
    start_s: float


def measure(listener: str, names: Sequence[str], n_words: int, speech: Path, noise: Path) -> Cost:
    """Let a process of its own listen to two files. Raises CalledProcessError when it fails."""
    command = [sys.executable, "-m", "benchmarks.hearing.listener", listener, ",".join(names), str(n_words)]
    done = subprocess.run([*command, str(speech), str(noise)], check=True, capture_output=True, text=True)
    return Cost(**json.loads(done.stdout.splitlines()[-1]))


def _sounds(names: Sequence[str], n_words: int, seed: int, folder: Path) -> tuple[Path, Path]:
    """Twenty sentences with half a second of noise at both ends, one after the other; and a minute of noise alone."""
    team = make_team(names, more_tasks(n_words))
    clean, spoken = make_stream(team.book, team.speakers(), SENTENCES, seed)
    noisy = mixing.mix(clean, spoken, steady("pink", len(clean), seed), SNR_DB, LEVEL_DBFS)
    rms = 10.0 ** ((LEVEL_DBFS - SNR_DB) / 20.0)
    lead = mixing.digitized(rms * steady("pink", SAMPLE_RATE_HZ, seed + 1))
    pieces = [lead, *(padded(noisy, s) for s in spoken)]
    write_wav(folder / "speech.wav", np.concatenate(pieces))
    alone = mixing.digitized(rms * steady("pink", round(NOISE_S * SAMPLE_RATE_HZ), seed + 2))
    write_wav(folder / "noise.wav", alone)
    truth = truth_of(pieces, spoken)
    (folder / "speech.json").write_text(json.dumps([[s.words, s.start, s.end] for s in truth]))
    return folder / "speech.wav", folder / "noise.wav"


def truth_of(pieces: Sequence[Samples], spoken: Sequence[Spoken]) -> list[Spoken]:
    """The places of the sentences when the segments, the first of them noise, are concatenated."""
    at, out = len(pieces[0]), []
    for piece, s in zip(pieces[1:], spoken, strict=True):
        pad = (len(piece) - (s.end - s.start)) // 2
        out.append(Spoken(s.words, at + pad, at + pad + s.end - s.start))
        at += len(piece)
    return out


def _cases(rows: Sequence[str], names: Sequence[str]) -> Iterator[tuple[str, Sequence[str], int]]:
    if "cost" in rows:
        yield "cost", names, 0
    if "vocabulary" in rows:
        for n_words in WORD_COUNTS:
            yield "vocabulary", names[:2], n_words
    if "names" in rows:
        for count in NAME_COUNTS:
            yield "names", NAMES[:count], 0
        yield "names", NAMES, WORD_COUNTS[-1]


def run(rows: Sequence[str], team: Team, seed: int, peer: bool, out: Path | None, console: Console) -> None:
    """Measure, print, and with `out` write cost.csv and draw."""
    if not rows:
        return
    listeners = ["hvcpd", *(["pocketsphinx", "pocketsphinx-wide"] if peer else [])]
    console.print("\nprocessor time over the sound's duration, one core; peak memory of a process that only listens")
    console.print(f"{'row':10} {'listener':18} words names voices  speech   noise  peak MB    right  start s")
    found: list[tuple[str, Cost]] = []
    for row, names, n_words in _cases(rows, team.names):
        with tempfile.TemporaryDirectory() as folder:
            speech, noise = _sounds(names, n_words, seed, Path(folder))
            for listener in listeners if row == "cost" else listeners[:2]:
                c = measure(listener, names, n_words, speech, noise)
                found.append((row, c))
                console.print(
                    f"{row:10} {c.listener:18} {c.words:5d} {c.names:5d} {c.voices:6d} {c.speech:7.4f} {c.noise:7.4f}"
                    f" {c.peak_mb:8.0f} {c.right:5d}/{c.sentences} {c.start_s:8.1f}"
                )
    if out is not None:
        from benchmarks.hearing import plots

        _write_csv(out / "cost.csv", found)
        plots.draw_costs(out, found)


def _write_csv(path: Path, found: Sequence[tuple[str, Cost]]) -> None:
    with path.open("w", newline="", encoding="utf-8") as file:
        table = csv.writer(file)
        table.writerow(["row", *Cost.__dataclass_fields__])
        table.writerows([row, *vars(c).values()] for row, c in found)
