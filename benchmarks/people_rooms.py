"""Strangers who speak from across a room: rows of `benchmarks.people`."""

from __future__ import annotations

import random

import numpy as np
from scipy.signal import fftconvolve

from benchmarks.hearing.worlds.rooms import Box, Place, response
from benchmarks.people_material import Foreigner, foreigners, sentences
from benchmarks.people_stage import Stage
from benchmarks.people_strangers import heard, test_voices
from benchmarks.phones.voices import Talker

ROOMS: tuple[tuple[str, Box | None, float], ...] = (
    ("close to the robot", None, 0.0),
    ("RT60 0.4 s, 1.5 m", Box((5.0, 4.0, 2.6), 0.4), 1.5),
    ("RT60 0.6 s, 2.5 m", Box((8.0, 6.0, 3.0), 0.6), 2.5),
    ("RT60 0.9 s, 3 m", Box((10.0, 7.0, 3.2), 0.9), 3.0),
)
PLACES = 6
"""Of speaker and robot in each room."""


def rooms_row(stage: Stage, n: int, seed: int) -> None:
    """Sentences by strangers from across a room, by Kokoro's test voices and flite's, with noise at 20 and 10 dB."""
    flite = {f.name: _in_one_manner(f) for f in foreigners() if f.name.startswith("flite")}
    voices, chooser = {**test_voices(), **flite}, random.Random(seed)
    spoken = [
        (tuple(w for p in ps for w in p), say(ps, chooser))
        for number, say in enumerate(voices.values())
        for ps in sentences(stage.book, n, seed + number)
    ]
    for label, box, distance_m in ROOMS:
        try:
            places = [response(Place(box, distance_m, seed + k)) for k in range(PLACES)] if box else None
        except ImportError:
            print("rooms: skipped, pip install pyroomacoustics")
            return
        there = [
            (words, np.asarray(fftconvolve(sound, places[k % PLACES]), np.float32) if places else sound)
            for k, (words, sound) in enumerate(spoken)
        ]
        for snr_db, colour in ((20.0, "white"), (10.0, "pink")):
            count = heard(stage, there, snr_db, colour, seed)
            count.told(f"strangers' sentences, {label}, {colour} noise at {snr_db:.0f} dB")


def _in_one_manner(foreigner: Foreigner) -> Talker:
    return lambda phrases, _chooser: foreigner.say(phrases)
