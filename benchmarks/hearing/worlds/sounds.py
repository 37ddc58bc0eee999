"""The row `sounds`: false alarms in an hour without speech. There should be no sentence and no stop."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from rich.console import Console
from scipy.signal import fftconvolve
from scipy.stats import chi2

from benchmarks.hearing.material import Team
from benchmarks.hearing.mixing import digitized
from benchmarks.hearing.worlds import ordinary, rooms
from benchmarks.hearing.worlds.trials import MakeRecogniser, hear
from hil_fakes import reverberation
from hil_fakes.robot_noise import unit
from hil_fakes.room import PinkNoise
from hvcpd.hardware.soundfile import read_wav
from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from hvcpd.recognition.events import Recognised, Urgent

RECORDED = ("sounds/*.wav", "noises/*.wav", "kitchen.wav")
"""Below a folder of data. Speech that addresses nobody is in the row `rejection` (`benchmarks.rejection`)."""
LEVELS_DBFS = (-40.0, -14.0)
"""RMS of a clip, faintest and loudest, over a room's noise at ROOM_DBFS."""
ROOM_DBFS = -62.0
GAP_S = 1.0


@dataclass
class Heard:
    """The reports for some sound."""

    hours: float = 0.0
    seconds: float = 0.0
    sentences: list[str] = field(default_factory=list)
    stops: list[str] = field(default_factory=list)
    sources: Counter[str] = field(default_factory=Counter)


def recorded(data: Path) -> Iterator[tuple[str, Samples]]:
    """Every recording of no speech, as it is."""
    for pattern in RECORDED:
        for path in sorted(data.glob(pattern)):
            yield path.name, np.asarray(read_wav(path), np.float32)


def made(minutes: float, seed: int) -> Iterator[tuple[str, Samples]]:
    """Minutes of synthetic ones, each at a level of its own, half of them in rooms."""
    clips = round(minutes * 60.0 / (ordinary.CLIP_S + GAP_S))
    for k in range(clips):
        rng = np.random.default_rng([seed, k])
        recipe = ordinary.RECIPES[k % len(ordinary.RECIPES)]
        sound = ordinary.clip(recipe, rng)
        if k % 2 and reverberation.available():
            sound = unit(fftconvolve(sound, rooms.response(rooms.draw_place(1000 * seed + k % 24)))[: len(sound)])
        sound = np.pad(sound * 10.0 ** (rng.uniform(*LEVELS_DBFS) / 20.0), (0, round(GAP_S * SAMPLE_RATE_HZ)))
        noise = PinkNoise(10.0 ** (ROOM_DBFS / 20.0), 1000 * seed + k).take(len(sound))
        yield f"{recipe.name} {k}", digitized(sound + noise)


def listened(make_speech_recogniser: MakeRecogniser, team: Team, clips: Iterator[tuple[str, Samples]]) -> Heard:
    """The reports of one pair of ears for all of them, one after the other."""
    recogniser, heard = make_speech_recogniser(team), Heard()
    for name, sound in clips:
        events, seconds = hear(recogniser, sound)
        heard.seconds += seconds
        heard.hours += len(sound) / SAMPLE_RATE_HZ / 3600.0
        for event in events:
            if isinstance(event, Recognised):
                text = " ".join(event.words)
                heard.sentences.append(f"{name}: {text} ({event.confidence:.2f}) [{event.source!s}]")
                heard.sources[str(event.source)] += 1
                if event.words[-1] == "stop":
                    heard.stops.append(f"{name}: {text}")
            elif isinstance(event, Urgent):
                heard.stops.append(f"{name}: stop! [urgent]")
                heard.sources["urgent"] += 1
    return heard


def per_hour(count: int, hours: float) -> str:
    """A rate with its exact 95 % interval (F. Garwood, Biometrika 28, 1936)."""
    low = chi2.ppf(0.025, 2 * count) / 2 if count else 0.0
    high = chi2.ppf(0.975, 2 * count + 2) / 2
    return f"{count / hours:.1f} an hour ({low / hours:.1f}-{high / hours:.1f})"


def run(
    make_speech_recogniser: MakeRecogniser,
    team: Team,
    data: Path | None,
    minutes: float,
    seed: int,
    console: Console,
    tell: bool,
) -> list[Heard]:
    """Print the reports for recorded and synthetic sounds."""
    sets = [("made", made(minutes, seed))]
    if data is not None:
        sets.insert(0, ("recorded", recorded(data)))
    found = []
    for label, clips in sets:
        heard = listened(make_speech_recogniser, team, clips)
        if not heard.hours:
            console.print(f"sounds, {label}: skipped, there are none in {data}")
            continue
        by = ", ".join(f"{name} {count}" for name, count in heard.sources.most_common())
        console.print(
            f"sounds, {label}, {60 * heard.hours:.1f} min: {len(heard.sentences)} sentences, "
            f"{per_hour(len(heard.sentences), heard.hours)}; {len(heard.stops)} stops, "
            f"{per_hour(len(heard.stops), heard.hours)}; {by or 'nothing'}; "
            f"{heard.seconds / (3600.0 * heard.hours):.4f} of real time",
            markup=False,
        )
        if tell:
            for text in (*heard.sentences, *heard.stops):
                console.print("    " + text, markup=False)
        found.append(heard)
    return found
