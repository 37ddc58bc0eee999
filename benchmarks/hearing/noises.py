"""Noises of RMS 1: white, pink, babble, a fan, a robot's wheel motors. All are seeded."""

from __future__ import annotations

import random
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks.hearing.material import Team
from hil_fakes.robot_noise import fan, motor, unit
from hil_fakes.room import PinkNoise
from hvcpd.hardware.soundfile import read_wav
from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from hvcpd.synthesis.lexicon import common_words
from hvcpd.synthesis.voices import VOICES, voice_for

KINDS = ("white", "pink", "babble", "fan", "motor")
TALKERS = 6
"""People who talk at once in a babble: of that many no single one is understood (Miller, "The masking of speech",
Psychological Bulletin 44, 1947)."""


def make_noise(kind: str, n: int, seed: int, team: Team, data: Path | None = None) -> NDArray[np.float64]:
    """`n` samples, RMS 1. With `data`, a folder of WAVs, the babble is of people.

    Raises ValueError for an unknown kind.
    """
    random_ = np.random.default_rng(seed)
    if kind in ("white", "pink"):
        sound = steady(kind, n, seed)
    elif kind == "babble":
        sound = babble(n, seed, team, data)
    elif kind == "fan":
        sound = fan(n, random_)
    elif kind == "motor":
        sound = motor(n, random_)
    else:
        raise ValueError(f"no noise is called {kind!r}; there are {', '.join(KINDS)}")
    return unit(sound)


def steady(colour: str, n: int, seed: int) -> NDArray[np.float64]:
    """White or pink noise of RMS 1."""
    if colour == "pink":
        return PinkNoise(1.0, seed).take(n).astype(np.float64)
    return np.random.default_rng(seed).standard_normal(n)


def babble(n: int, seed: int, team: Team, data: Path | None, talkers: int = TALKERS) -> NDArray[np.float64]:
    """`talkers` voices without a pause: people's, from `data`; or else voices that no robot of the team has, which say
    words of the lexicon in any order."""
    chooser = random.Random(seed)
    total = np.zeros(n)
    paths = sorted(data.rglob("*.wav")) if data else []
    taken = {voice_for(name).name for name in team.names}
    others = [voice for voice in VOICES if voice.name not in taken] or list(VOICES)
    words = common_words()
    for talker in range(talkers):
        speaker = team.sound.speaker_in(others[talker % len(others)])
        at = -chooser.randrange(SAMPLE_RATE_HZ)
        while at < n:
            if paths:
                piece: Samples = read_wav(chooser.choice(paths))
            else:
                piece = speaker.render([[chooser.choice(words) for _ in range(4)]])
            if not np.any(piece):
                continue
            piece = np.asarray(unit(piece.astype(np.float64)), np.float32)[max(-at, 0) : max(n - at, 0)]
            begin = max(at, 0)
            total[begin : begin + len(piece)] += piece
            at = begin + len(piece)
    return total
