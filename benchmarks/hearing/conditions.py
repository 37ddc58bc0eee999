"""The conditions of the table, row by row: for each a stream of sound, and its sentences."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks.hearing import mixing
from benchmarks.hearing.material import Spoken, Team, make_stream
from benchmarks.hearing.noises import make_noise
from hil_fakes import reverberation, transducers
from hil_fakes.reverberation import Hall
from hvcpd.assembly.make import SLOW
from hvcpd.ports import SAMPLE_RATE_HZ, Samples

LEVELS_DBFS = (-50.0, -40.0, -30.0, -20.0, -12.0, -6.0)
LEVEL_SNR_DB = 20.0
RATES = (0.7, 0.8, 0.9, 1.1, 1.25, 1.5)
"""Of the speaker's, against the templates'."""
RATES_SNR_DB = (0.0, 45.0)
"""Where templates do all the work, and where the channel search follows words, too."""
TIMES = 3
"""A sentence that is not understood is said so often in the row `slow`; robots ask three times (`repair`)."""
FREE_M = (0.5, 1.0, 1.4, 2.0, 2.8, 4.0, 5.7, 8.0, 11.0, 16.0, 23.0, 32.0, 45.0, 64.0, 90.0)
"""By a factor of 1.4, 3 dB: in free field, where level and SNR fall by 6 dB with each doubling."""
RANGE_SNR_DB = 20.0
"""At 1 m."""
RANGE_DBFS = -25.0
"""At 1 m."""
HALL_M = (14.0, 6.0, 3.0)
"""A hall in which 10 m fit."""
RT60_S = (0.3, 0.45, 0.6)
DISTANCES_M = (0.5, 1.0, 2.0, 5.0, 10.0)


@dataclass(frozen=True)
class Options:
    """The options of the command line."""

    sentences: int
    seed: int
    noises: tuple[str, ...]
    snrs_db: tuple[float, ...]
    level_dbfs: float
    range_noise: str
    data: Path | None = None


@dataclass(frozen=True)
class Condition:
    """A point of the table: in `group`, of the series `name` at `value` (dB, m, …), `label` in words."""

    group: str
    name: str
    value: float
    label: str
    sound: Samples
    spoken: list[Spoken]


class Stage:
    """Makes the streams of one team. The same sentences are said in every condition."""

    def __init__(self, team: Team, options: Options) -> None:
        self.team = team
        self.options = options
        self.clean, self.spoken = self.stream()
        self._noises: dict[tuple[str, int], NDArray[np.float64]] = {}

    def stream(self, rate: float = 1.0, times: int = 1) -> tuple[Samples, list[Spoken]]:
        o = self.options
        return make_stream(self.team.book, self.team.speakers(rate), o.sentences, o.seed, times)

    def noise(self, kind: str, n: int) -> NDArray[np.float64]:
        if (kind, n) not in self._noises:
            self._noises = {(kind, n): make_noise(kind, n, self.options.seed, self.team, self.options.data)}
        return self._noises[kind, n]

    def noises(self) -> Iterator[Condition]:
        """Every noise at every SNR."""
        for kind in self.options.noises:
            for snr_db in self.options.snrs_db:
                sound = mixing.mix(self.clean, self.spoken, self.noise(kind, len(self.clean)), snr_db, self.dbfs)
                yield Condition("noise", kind, snr_db, f"{kind} noise, SNR {snr_db:g} dB", sound, self.spoken)

    @property
    def dbfs(self) -> float:
        return self.options.level_dbfs

    def slow(self) -> Iterator[Condition]:
        """Said slowly, again when nothing was understood."""
        clean, spoken = self.stream(SLOW, TIMES)
        for kind in self.options.noises:
            for snr_db in (-10.0, -15.0):
                sound = mixing.mix(clean, spoken, self.noise(kind, len(clean)), snr_db, self.dbfs)
                label = f"{kind} noise, SNR {snr_db:g} dB, slowly, up to {TIMES} times"
                yield Condition("slow", kind, snr_db, label, sound, spoken)

    def levels(self) -> Iterator[Condition]:
        """The same SNR at every level; then each sentence at a level of its own, in a quiet room."""
        noise = self.noise("pink", len(self.clean))
        for dbfs in LEVELS_DBFS:
            sound = mixing.mix(self.clean, self.spoken, noise, LEVEL_SNR_DB, dbfs)
            clipped = float(np.mean(np.abs(sound) >= 1.0))
            label = f"level {dbfs:g} dBFS, pink noise, SNR {LEVEL_SNR_DB:g} dB, {clipped:.2%} of samples clipped"
            yield Condition("level", "fixed", dbfs, label, sound, self.spoken)
        low, high = -50.0, -15.0
        own = mixing.own_levels(self.clean, self.spoken, low, high, self.options.seed)
        sound = mixing.digitized(own + noise * 10.0 ** ((low - LEVEL_SNR_DB) / 20.0))
        label = f"each sentence at its own level, {low:g} to {high:g} dBFS, SNR {LEVEL_SNR_DB:g} dB and more"
        yield Condition("level", "own", low, label, sound, self.spoken)

    def channels(self) -> Iterator[Condition]:
        """A small loudspeaker's band, a microphone's tilt."""
        noise = self.noise("pink", len(self.clean))
        flat = self.clean
        filters: tuple[tuple[str, Callable[[Samples], Samples]], ...] = (
            ("flat", lambda x: x),
            ("300 to 6,000 Hz", lambda x: transducers.band(x, 300.0, 6000.0)),
            ("+3 dB an octave", lambda x: transducers.tilt(x, 3.0)),
            ("-3 dB an octave", lambda x: transducers.tilt(x, -3.0)),
        )
        for name, through in filters:
            for snr_db in (20.0, 0.0):
                sound = mixing.mix(through(flat), self.spoken, noise, snr_db, self.dbfs)
                yield Condition("channel", name, snr_db, f"channel {name}, pink, {snr_db:g} dB", sound, self.spoken)

    def clocks(self) -> Iterator[Condition]:
        """Sample clocks that differ."""
        for ppm in (-200.0, 200.0):
            moved, spoken = mixing.off_clock(self.clean, self.spoken, ppm)
            sound = mixing.mix(moved, spoken, self.noise("pink", len(moved)), 0.0, self.dbfs)
            yield Condition("clock", "clock", ppm, f"clock {ppm:+g} ppm, pink noise, SNR 0 dB", sound, spoken)

    def rates(self) -> Iterator[Condition]:
        """A speaker who talks slower or faster than the templates."""
        for rate in RATES:
            clean, spoken = self.stream(rate)
            noise = self.noise("pink", len(clean))
            for snr_db in RATES_SNR_DB:
                sound = mixing.mix(clean, spoken, noise, snr_db, self.dbfs)
                label = f"{rate:g} of the usual rate, pink noise, SNR {snr_db:g} dB"
                yield Condition("rate", f"rate at {snr_db:g} dB", rate, label, sound, spoken)

    def steps(self) -> Iterator[Condition]:
        """Noise that steps by 20 dB."""
        noise = self.noise("pink", len(self.clean))
        for amid in (False, True):
            stepping = mixing.stepped(noise, self.spoken, amid, self.options.seed)
            sound = mixing.mix(self.clean, self.spoken, stepping, 25.0, self.dbfs)
            where = "within every third sentence" if amid else "0.5 s after every third sentence"
            label = f"noise steps by 20 dB {where}, SNR 25 and 5 dB"
            yield Condition("steps", "amid" if amid else "between", 20.0, label, sound, self.spoken)

    def free_field(self) -> Iterator[Condition]:
        """Growing distances, without walls."""
        kind = self.options.range_noise
        noise = self.noise(kind, len(self.clean)) * 10.0 ** ((RANGE_DBFS - RANGE_SNR_DB) / 20.0)
        gain = 10.0 ** (RANGE_DBFS / 20.0) / mixing.speech_rms(self.clean, self.spoken)
        for distance_m in FREE_M:
            sound = mixing.digitized(self.clean * (gain / distance_m) + noise)
            snr_db = RANGE_SNR_DB - 20.0 * np.log10(distance_m)
            label = f"free field, {distance_m:g} m (SNR {snr_db:.0f} dB), {kind} noise"
            yield Condition("range", "free field", distance_m, label, sound, self.spoken)

    def rooms(self) -> Iterator[Condition]:
        """In rooms; the noise is what leaves an SNR of 20 dB at 1 m without the room."""
        kind = self.options.range_noise
        noise = self.noise(kind, len(self.clean)) * 10.0 ** ((RANGE_DBFS - RANGE_SNR_DB) / 20.0)
        gain = 10.0 ** (RANGE_DBFS / 20.0) / mixing.speech_rms(self.clean, self.spoken)
        for rt60_s in RT60_S:
            for distance_m in DISTANCES_M:
                response, delay = reverberation.response(Hall(HALL_M, rt60_s), distance_m)
                far = reverberation.through(self.clean, response)[delay:]
                far = np.pad(far, (0, len(self.clean) - len(far)))
                sound = mixing.digitized(far * gain + noise)
                label = f"room, RT60 {rt60_s:g} s, {distance_m:g} m, {kind} noise"
                yield Condition("rooms", f"RT60 {rt60_s:g} s", distance_m, label, sound, self.spoken)

    def groups(self) -> dict[str, tuple[int, Callable[[], Iterator[Condition]]]]:
        """The available rows: the number of conditions in each, and the function that makes them."""
        kinds = len(self.options.noises)
        return {
            "noise": (kinds * len(self.options.snrs_db), self.noises),
            "slow": (kinds * 2, self.slow),
            "level": (len(LEVELS_DBFS) + 1, self.levels),
            "channel": (8, self.channels),
            "clock": (2, self.clocks),
            "rate": (len(RATES) * len(RATES_SNR_DB), self.rates),
            "steps": (2, self.steps),
            "range": (len(FREE_M), self.free_field),
            "rooms": (len(RT60_S) * len(DISTANCES_M), self.rooms),
        }

    @property
    def minutes(self) -> float:
        return len(self.clean) / SAMPLE_RATE_HZ / 60.0
