"""Shared parts of benchmarks: the talkers and the noise, and how often what is so sure is right."""

from __future__ import annotations

import shutil
import subprocess
import tempfile
import wave
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from hvcpd.evaluation.statistics import wilson
from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from hvcpd.synthesis.lexicon import Lexicon
from hvcpd.synthesis.speaker import Speaker
from hvcpd.synthesis.voices import VOICES

Phrases = Sequence[Sequence[str]]

QUIET_RMS = 10.0 ** (-75 / 20)
"""The floor of the quiet condition, full scale = 1: PocketSphinx suffers over digital silence."""

PAD_S = 0.5


@dataclass(frozen=True)
class Talker:
    """A talker that speaks sentences given in words; `own` for our voices."""

    speak: Callable[[Phrases], Samples]
    own: bool


def in_noise(sound: Samples, snr_db: float | None, seed: int, floor: float = QUIET_RMS) -> Samples:
    """The sound with `PAD_S` around it in white noise; None is the quiet condition, with noise of rms `floor`."""
    pad = np.zeros(round(PAD_S * SAMPLE_RATE_HZ), dtype=np.float32)
    padded = np.concatenate([pad, sound, pad])
    active = sound[np.abs(sound) > 0.01]
    level = floor if snr_db is None else float(np.sqrt(np.mean(active**2))) * 10.0 ** (-snr_db / 20)
    return (padded + level * np.random.default_rng(seed).standard_normal(len(padded))).astype(np.float32)


def text_of(phrases: Phrases) -> str:
    """As a synthesizer reads them, with a pause between two."""
    return ", ".join(" ".join(phrase) for phrase in phrases) + "."


def program(command: Sequence[str]) -> Callable[[Phrases], Samples]:
    """A synthesizer outside: `command` with {text} and {wav}; its output is brought to 16 kHz by sox."""

    def speak(phrases: Phrases) -> Samples:
        text = text_of(phrases)
        with tempfile.TemporaryDirectory() as folder:
            raw, wav = f"{folder}/raw.wav", f"{folder}/16k.wav"
            subprocess.run([part.format(text=text, wav=raw) for part in command], check=True, capture_output=True)
            form = ["-r", str(SAMPLE_RATE_HZ), "-c", "1", "-b", "16"]
            subprocess.run(["sox", raw, *form, wav, "norm", "-3"], check=True)
            with wave.open(wav) as file:
                data = np.frombuffer(file.readframes(file.getnframes()), dtype="<i2")
        return (data / 32768.0).astype(np.float32)

    return speak


_PROGRAMS = {
    "espeak-ng": ("espeak-ng", "-v", "en-us", "-w", "{wav}", "{text}"),
    "flite slt": ("flite", "-voice", "slt", "-t", "{text}", "-o", "{wav}"),
    "flite rms": ("flite", "-voice", "rms", "-t", "{text}", "-o", "{wav}"),
    "pico": ("pico2wave", "-l", "en-US", "-w", "{wav}", "{text}"),
}


def talkers(lexicon: Lexicon) -> dict[str, Talker]:
    """Our eight voices by each synthesizer and in each accent (`lexicon` is American), and the programs that are
    installed; a line tells which are not."""
    natural = [replace(voice, name=f"{voice.name}-n", natural=True) for voice in VOICES]
    found = {voice.name: Talker(Speaker(voice, lexicon).render, own=True) for voice in (*VOICES, *natural)}
    british = replace(lexicon, accent="gb")
    found |= {f"{voice.name}-gb": Talker(Speaker(voice, british).render, own=True) for voice in VOICES}
    for name, command in _PROGRAMS.items():
        if shutil.which(command[0]) and shutil.which("sox"):
            found[name] = Talker(program(command), own=False)
        else:
            print(f"{name}: skipped, needs the programs {command[0]} and sox")
    return found


def reliability(told: Iterable[tuple[float, bool]], levels: Sequence[float]) -> list[tuple[float, float, int, int]]:
    """Of sentences, each with its confidence and whether it is right: between two levels each, how many there are and
    how many of them are right. A confidence of 1 counts below the last level, 1."""
    each = list(told)
    found = []
    for low, high in pairwise(levels):
        here = [right for p, right in each if low <= p < high or p == high == 1.0]
        found.append((low, high, len(here), sum(here)))
    return found


def tell_reliability(rows: Sequence[tuple[float, float, int, int]]) -> None:
    """A line for each, with its interval."""
    for low, high, n, right in rows:
        share = "{:.0%} [{:.0%}, {:.0%}]".format(right / n, *wilson(right, n)) if n else "-"
        print(f"confidence {low:.2f} to {high:.2f}: {n:5} sentences, right {share}")
