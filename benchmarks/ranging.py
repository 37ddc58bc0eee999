"""How well two robots measure how far apart they are, with clocks that differ, in measured and simulated rooms.

`python -m benchmarks.ranging [--rooms DIR [--behind]] [--halls] [--n 40] [--seed 1]` (DIR: impulse responses as WAV
files, `bbc_*` and `unis_a_*`). Robot A asks and robot B answers, with the
sentences and the voices that robots have, through small loudspeakers; what each microphone hears is resampled by its
own clock. Both robots then do just what they do on a robot: `hvcpd.ranging`.

The truth in a simulated room is the distance. A measured response has a delay of its own, so its direct sound is moved
to the distance: its arrival is taken as where the response, interpolated, first rises to half of its first strong
extremum. That is known to about half a sample, 1 cm. The room's reflections stay as they were measured 1.5 or 2 m from
the loudspeaker; so for distances of 10 m they are fainter, relative to the direct sound, than in a hall.
"""

from __future__ import annotations

import argparse
import wave
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from hil_fakes.loudspeakers import SMALL
from hil_fakes.reverberation import Hall, response
from hvcpd.assembly.sound import Sound, make_sound, user_cache_folder
from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from hvcpd.ranging.arrival import REACH, Arrival, arrival
from hvcpd.ranging.distance import SOUND_SPEED_M_S, Distance, distance, interval_ticks, is_sure

Way = NDArray[np.float64]
"""An impulse response whose direct sound is at sample LEAD."""
LEAD = 64
OWN_WAY_M = 0.1
OWN_GAIN = 10.0
"""The robot's own loudspeaker is 0.1 m from its microphone: 20 dB louder than at 1 m."""
BEFORE = 4000
WAYS = 3
"""Places in a hall for each distance."""
FINE = 16
"""Steps to a sample in which sound is moved."""
GAP = 20_000
"""Samples from the question's end to the answer: 1.25 s."""
MOST_PPM = 50.0
"""Of either microphone's clock; loudspeakers run by that of the air."""
UNKNOWN = 320
"""Samples by which the recogniser may be wrong about where a sentence begins."""
SHADE_DB = 20.0
HALLS = (Hall((9.0, 5.0, 2.7), 0.3), Hall((14.0, 6.0, 3.0), 0.5), Hall((16.0, 8.0, 3.0), 0.8))
DISTANCES_M = (1.0, 3.0, 6.0, 10.0, 12.0)
SNRS_DB = (20.0, 10.0, 0.0)


@dataclass(frozen=True)
class Result:
    """One measurement: its error, m, and what was told; None: nothing was."""

    error_m: float
    told: Distance | None


def exchange(
    said: tuple[Samples, Samples],
    way: tuple[Way, Way],
    own: Way,
    distance_m: float,
    snr_db: float,
    rng: np.random.Generator,
) -> Result:
    """One measurement at that distance; `way`: from A to B and back; `own`: to a robot's own microphone."""
    question, answer = said
    asked, answered = BEFORE, BEFORE + len(question) + GAP + int(rng.integers(0, 8000))
    flight = distance_m / SOUND_SPEED_M_S * SAMPLE_RATE_HZ
    own_flight = OWN_WAY_M / SOUND_SPEED_M_S * SAMPLE_RATE_HZ
    arrivals: list[tuple[Arrival | None, Arrival | None]] = []
    for hears_own_first in (True, False):
        skew = 1.0 + rng.uniform(-MOST_PPM, MOST_PPM) * 1e-6
        first = (own, own_flight, OWN_GAIN) if hears_own_first else (way[0], flight, 1.0)
        second = (way[1], flight, 1.0) if hears_own_first else (own, own_flight, OWN_GAIN)
        parts = [(question, asked, *first), (answer, answered, *second)]
        heard = _heard(parts, skew, snr_db, rng)
        found = []
        for spoken, at, _, delay, _gain in parts:
            near = round((at + delay) * skew) + int(rng.integers(-UNKNOWN, UNKNOWN))
            begin = near - REACH
            piece = heard[max(begin, 0) : near + len(spoken) + REACH]
            result = arrival(np.asarray(piece, np.float32), spoken, REACH)
            found.append(result.later(begin) if result is not None else None)
        arrivals.append((found[0], found[1]))
    (own_a, answer_a), (question_b, own_b) = arrivals
    if own_a is None or answer_a is None or question_b is None or own_b is None:
        return Result(float("nan"), None)
    if not (is_sure(question_b) and is_sure(own_b)):
        return Result(float("nan"), None)
    told = distance(own_a, answer_a, interval_ticks(question_b, own_b, OWN_WAY_M), OWN_WAY_M)
    return Result(told.distance_m - distance_m if told is not None else float("nan"), told)


Part = tuple[Samples, int, Way, float, float]
"""A sentence, the sample at which it is said, its way, its flight time in samples, and its gain."""


def _heard(parts: Sequence[Part], skew: float, snr_db: float, rng: np.random.Generator) -> NDArray[np.float64]:
    """What one microphone, whose clock runs `skew` times as fast as the air's, records; noise by the fainter voice."""
    n = max(at + len(sound) for sound, at, *_ in parts) + 12_000
    heard, levels = np.zeros(n), []
    for sound, at, way, delay, gain in parts:
        carried = _convolved(SMALL.play(sound), way) * gain
        heard += _shifted(carried, at + delay - LEAD, skew, n)
        levels.append(float(np.std(carried[: len(sound)])))
    heard += _pink(n, rng) * min(levels) * 10.0 ** (-snr_db / 20.0)
    return heard


def _shifted(sound: NDArray[np.float64], at: float, skew: float, n: int) -> NDArray[np.float64]:
    """The sound, which begins at the air's sample `at`, by a clock that runs `skew` times as fast, shape (n,).

    Interpolated by FINE, then linearly: the error at 6 kHz is 55 dB down.
    """
    size = 1 << (len(sound) + 64).bit_length()
    fine = np.fft.irfft(np.fft.rfft(sound, size), FINE * size) * FINE
    times = (np.arange(n) / skew - at) * FINE
    return np.asarray(np.interp(times, np.arange(len(fine)), fine, left=0.0, right=0.0), np.float64)


def _convolved(sound: NDArray[np.float64], way: Way) -> NDArray[np.float64]:
    n = len(sound) + len(way) - 1
    size = 1 << n.bit_length()
    return np.fft.irfft(np.fft.rfft(sound, size) * np.fft.rfft(way, size), size)[:n]


def _pink(n: int, rng: np.random.Generator) -> NDArray[np.float64]:
    hz = np.fft.rfftfreq(n, 1.0 / SAMPLE_RATE_HZ)
    noise = np.fft.irfft(np.fft.rfft(rng.standard_normal(n)) / np.sqrt(np.maximum(hz, 50.0)), n)
    return np.asarray(noise / np.std(noise))


def sentences(sound: Sound) -> tuple[Samples, Samples]:
    """The question and the answer, as the robots say them."""
    both = (("Rob", "hi bot, i am rob, how far are you"), ("Bot", "hi rob, i am bot, i will measure it"))
    first, second = (sound.speaker_of(name).render([p.split() for p in text.split(", ")]) for name, text in both)
    return first, second


def measured_way(path: Path) -> Way:
    """A measured response with its direct sound at LEAD, at level 1."""
    with wave.open(str(path)) as file:
        raw = np.frombuffer(file.readframes(file.getnframes()), "<i2").astype(np.float64)
    fine = np.fft.irfft(np.fft.rfft(raw), 16 * len(raw))
    strong = np.abs(fine) > 0.5 * np.abs(fine).max()
    peak = int(np.argmax(strong))
    while np.abs(fine[peak + 1]) > np.abs(fine[peak]):
        peak += 1
    edge = peak - int(np.argmax(np.abs(fine[peak::-1]) < 0.5 * np.abs(fine[peak])))
    moved = _shifted(raw, LEAD - edge / 16, 1.0, len(raw) + LEAD)
    return np.asarray(moved / np.abs(fine[peak]) * 16)


def shaded(way: Way) -> Way:
    """The same with something in the way: what arrives in the first 2 ms is SHADE_DB fainter."""
    hidden = way.copy()
    hidden[: LEAD + 32] *= 10.0 ** (-SHADE_DB / 20.0)
    return hidden


def simulated_way(hall: Hall, distance_m: float, shift_m: float) -> Way:
    """A simulated response with its direct sound at LEAD."""
    impulse, _ = response(hall, distance_m, shift_m)
    at = 40 + distance_m / 343.0 * SAMPLE_RATE_HZ  # the library's fractional delays have 81 taps
    return _shifted(impulse.astype(np.float64), LEAD - at, 1.0, len(impulse))


def own_way(far: Way) -> Way:
    """To a robot's own microphone: the direct sound, and the room, as far below it as the loudspeaker is nearer."""
    own = np.asarray(far / (OWN_GAIN * np.abs(far[: LEAD + 8]).max()), np.float64)
    own[: LEAD + 16] = 0.0
    own[LEAD] = 1.0
    return own


def in_sight(folder: Path) -> list[Path]:
    """The responses of the ears that are turned to the loudspeaker: of each pair, the louder direct sound."""
    pairs = [(left, left.with_name(left.name[:-5] + "R.wav")) for left in sorted(folder.glob("*L.wav"))]
    return [max(pair, key=_direct_energy) for pair in pairs]


def _direct_energy(path: Path) -> float:
    with wave.open(str(path)) as file:
        raw = np.frombuffer(file.readframes(file.getnframes()), "<i2").astype(np.float64)
    first = int(np.argmax(np.abs(raw) > 0.5 * np.abs(raw).max()))
    return float(np.sum(raw[first : first + 32] ** 2))


def show(title: str, results: Sequence[Result]) -> None:
    """One row of the table."""
    told = [r for r in results if r.told is not None]
    sure = [r for r in told if r.told is not None and r.told.sure]
    errors = np.abs([r.error_m for r in sure]) * 100.0
    within = [abs(r.error_m) <= 2.0 * r.told.deviation_m for r in sure if r.told is not None]
    middle, most = (np.median(errors), np.quantile(errors, 0.95)) if len(errors) else (np.nan, np.nan)
    worst = errors.max() if len(errors) else np.nan
    print(
        f"| {title} | {len(results)} | {len(results) - len(sure)} | {middle:.1f} | {most:.1f} | {worst:.1f} | "
        f"{100.0 * np.mean(within) if within else np.nan:.0f} % |",
        flush=True,
    )


def cases(
    rooms: Path | None, behind: bool, halls: bool, n: int, rng: np.random.Generator
) -> Iterator[tuple[str, list[tuple[Way, Way, float]]]]:
    """Rooms, and in each `n` ways there and back with the distance."""
    if rooms is not None:
        recogniser = in_sight(rooms)
        for title, start in (("listening room", "bbc_"), ("office", "unis_")):
            ways = [measured_way(path) for path in recogniser if path.name.startswith(start)]
            drawn = rng.integers(0, len(ways), (n, 2))
            yield f"{title}, moved to 10 m", [(ways[i], ways[j], 10.0) for i, j in drawn]
            if behind:
                hidden = [shaded(way) for way in ways]
                yield f"{title}, something in the way", [(hidden[i], hidden[j], 10.0) for i, j in drawn]
    for hall in HALLS if halls else ():
        fitting = [d for d in DISTANCES_M if d + 3.0 <= hall.size_m[0]]
        for distance_m in fitting:
            title = f"hall {hall.size_m[0]:g} × {hall.size_m[1]:g} m, {hall.rt60_s:g} s, {distance_m:g} m"
            ways = [simulated_way(hall, distance_m, shift_m) for shift_m in rng.uniform(0.0, 0.9, WAYS)]
            yield title, [(ways[k % WAYS], ways[k % WAYS], distance_m) for k in range(n)]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rooms", type=Path)
    parser.add_argument("--n", type=int, default=40)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--behind", action="store_true", help="with --rooms: also with something in the way")
    parser.add_argument("--halls", action="store_true", help="simulated halls, too (needs pyroomacoustics)")
    parser.add_argument("--snr", type=float, nargs="*", default=SNRS_DB)
    options = parser.parse_args()
    rng, said = np.random.default_rng(options.seed), sentences(make_sound(None, user_cache_folder()))
    print("| room | n | unsure or none | median, cm | 95 %, cm | worst, cm | within 2 deviations |")
    print("|---|---|---|---|---|---|---|")
    for title, ways in cases(options.rooms, options.behind, options.halls, options.n, rng):
        for snr_db in options.snr:
            results = [exchange(said, (a, b), own_way(a), d, snr_db, rng) for a, b, d in ways]
            show(f"{title}, {snr_db:g} dB", results)


if __name__ == "__main__":
    main()
