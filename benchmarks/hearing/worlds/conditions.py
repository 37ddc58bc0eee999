"""The named conditions, and worlds drawn at random: a world for each of their sentences."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from benchmarks.hearing.worlds import noises, rooms
from benchmarks.hearing.worlds.microphones import Microphone, narrow
from benchmarks.hearing.worlds.world import FASTEST_M_S, World, draw_world
from hil_fakes.loudspeakers import GOOD, SMALL, SMALL_DISTORTING

MakeWorld = Callable[[int], World]
"""The world of a sentence, by a seed that no other has."""
QUIET_DB = 30.0
"""SNR of a quiet room."""
VARIANTS = 8
"""Number of rooms of a kind for each seed: to simulate one takes seconds."""


@dataclass(frozen=True)
class Condition:
    """Worlds of a kind. `simulated`: they need pyroomacoustics, or the responses in the cache; `apart_db`: a second
    robot speaks at the same time, through a world of its own, louder or fainter by this much; it says `calls`, or else
    a sentence that is drawn."""

    name: str
    label: str
    make: MakeWorld
    simulated: bool = False
    apart_db: float | None = None
    calls: tuple[str, ...] | None = None

    @property
    def parts(self) -> tuple[str, ...]:
        """Names of a trial's sentences."""
        if self.apart_db is None:
            return ("",)
        return ("louder", "fainter") if self.calls is None else ("talk", "call")


def conditions(seed: int, data: Path | None) -> list[Condition]:
    """All conditions that this folder of data allows; rooms differ with `seed`."""
    recorded = noises.kinds(data)
    fan = "air conditioner" if "air conditioner" in recorded else "fan"
    loud = "kitchen" if "kitchen" in recorded else "pink"
    measured = rooms.measured(data) if data is not None else []
    drawn = Condition("drawn", "worlds drawn at random", lambda k: draw_world(k, data), True)
    return [*_channels(seed, fan), *_measured(measured), *_simulated(seed, loud), *_together(seed), drawn]


def _channels(seed: int, fan: str) -> list[Condition]:
    """Loudspeakers, clocks, motion."""

    def plain(name: str, label: str, at_home: bool = False, **of_world: Any) -> Condition:
        def make(k: int) -> World:
            return World(room=rooms.living_room(_variant(seed, k)) if at_home else None, seed=k, **of_world)

        return Condition(name, label, make, at_home)

    def chain(k: int) -> World:
        room, controlled = rooms.living_room(_variant(seed, k)), Microphone(gain_control=True)
        return World(SMALL_DISTORTING, room, 0.0, _sign(k) * 150.0, fan, 5.0, microphone=controlled, seed=k)

    return [
        plain("small-living", f"small driver, living room, {fan} 20 dB", True, loudspeaker=SMALL, noise=fan),
        Condition("chain", f"whole chain, {fan} 5 dB", chain, True),
        plain("small-vacuum", "small driver, vacuum −5 dB", loudspeaker=SMALL, noise="vacuum", snr_db=-5.0),
        plain("good-vacuum", "good loudspeaker, vacuum −10 dB", loudspeaker=GOOD, noise="vacuum", snr_db=-10.0),
        plain("ideal-vacuum", "ideal loudspeaker, vacuum −10 dB", noise="vacuum", snr_db=-10.0),
        plain("narrow", "microphone up to 3.8 kHz, white 20 dB", noise="white", microphone=narrow(3800.0)),
        _off("clock", "clock ±300 ppm, pink −10 dB", -10.0, ppm=300.0),
        _off("clock-worst", "clock ±1,300 ppm, pink −10 dB", -10.0, ppm=1300.0),
        _off("doppler", "Doppler, ±0.44 m/s, pink −5 dB", -5.0, speed_m_s=FASTEST_M_S),
    ]


def _measured(paths: Sequence[Path]) -> list[Condition]:
    """Measured rooms, one after the other, in random order."""
    if not paths:
        return []

    def room(k: int) -> Path:
        return paths[k * 7 % len(paths)]

    return [
        Condition("measured", "measured rooms, quiet", _noisy(room, "pink", QUIET_DB)),
        *(
            Condition(f"measured{db:+g}", f"measured rooms, appliances {db:g} dB", _noisy(room, "appliances", db))
            for db in (0.0, -5.0)
        ),
    ]


def _simulated(seed: int, loud: str) -> list[Condition]:
    """Hard rooms in quiet, and all in noise."""
    hard = {"next-room": rooms.next_room, "classroom": rooms.classroom, "chapel": rooms.chapel}
    found = []
    for name, make in hard.items():
        label = f"{name.replace('-', ' ')}, quiet"
        found.append(Condition(name, label, _noisy(_of(seed, make), "pink", QUIET_DB), True))
    for name, make in {"living-room": rooms.living_room, **hard}.items():
        for snr_db in (0.0, -5.0):
            label = f"{name.replace('-', ' ')}, {loud} {snr_db:g} dB"
            found.append(Condition(f"{name}{snr_db:+g}", label, _noisy(_of(seed, make), loud, snr_db), True))
    return found


def _together(seed: int) -> list[Condition]:
    """Two robots that speak at once, every other time in a room."""

    def make(k: int) -> World:
        room = rooms.living_room(_variant(seed, k)) if k % 2 else None
        return World(GOOD, room, 0.0, _sign(k) * 40.0, "pink", 25.0, seed=k)

    return [
        Condition("two+6", "two robots at once, 6 dB apart", make, True, 6.0),
        Condition("two+12", "two robots at once, 12 dB apart", make, True, 12.0),
        Condition("stop", "“stop” over talk as loud", make, True, 0.0, ("stop",)),
    ]


def _off(name: str, label: str, snr_db: float, ppm: float = 0.0, speed_m_s: float = 0.0) -> Condition:
    def make(k: int) -> World:
        return World(ppm=_sign(k) * ppm, speed_m_s=_sign(k) * speed_m_s, snr_db=snr_db, seed=k)

    return Condition(name, label, make)


def _sign(k: int) -> float:
    return 1.0 if k % 2 else -1.0


def _variant(seed: int, k: int) -> int:
    return 1000 * seed + k % VARIANTS


def _of(seed: int, make: Callable[[int], rooms.Place]) -> Callable[[int], rooms.Place]:
    return lambda k: make(_variant(seed, k))


def _noisy(room: Callable[[int], rooms.Place | Path], noise: str, snr_db: float) -> MakeWorld:
    return lambda k: World(room=room(k), noise=noise, snr_db=snr_db, seed=k)
