"""The named conditions, and worlds drawn at random: a world for each of their sentences."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from benchmarks.hearing.worlds import rooms
from benchmarks.hearing.worlds.loudspeakers import GOOD, SMALL, SMALL_DISTORTING
from benchmarks.hearing.worlds.microphones import Microphone
from benchmarks.hearing.worlds.world import FASTEST_M_S, World, draw_world

MakeWorld = Callable[[int], World]
"""The world of a sentence, by a seed that no other has."""
VARIANTS = 8
"""So many rooms of a kind for each seed: to simulate one takes seconds."""


@dataclass(frozen=True)
class Condition:
    """Worlds of a kind. `simulated`: they need pyroomacoustics, or the responses in the cache; `apart_db`: a second
    robot speaks at the same time, through a world of its own, louder or fainter by so much."""

    name: str
    label: str
    make: MakeWorld
    simulated: bool = False
    apart_db: float | None = None


def conditions(seed: int, data: Path | None) -> list[Condition]:
    """All that can be had with this folder of data; rooms differ with `seed`."""

    def living(k: int) -> rooms.Place:
        return rooms.living_room(_variant(seed, k))

    def chain(k: int) -> World:
        microphone = Microphone(gain_control=True)
        return World(SMALL_DISTORTING, living(k), 0.0, _sign(k) * 150.0, "fan", 5.0, microphone=microphone, seed=k)

    def together(k: int) -> World:
        return World(GOOD, living(k) if k % 2 else None, 0.0, _sign(k) * 40.0, "pink", 25.0, seed=k)

    def plain(name: str, label: str, **of_world: Any) -> Condition:
        """In free field, or in the living room."""
        at_home = of_world.pop("at_home", False)
        return Condition(name, label, lambda k: World(room=living(k) if at_home else None, seed=k, **of_world), at_home)

    found = [
        plain("small-living", "small driver, living room, fan 20 dB", loudspeaker=SMALL, noise="fan", at_home=True),
        Condition("chain", "whole chain, fan 5 dB", chain, True),
        plain("small-vacuum", "small driver, vacuum −5 dB", loudspeaker=SMALL, noise="vacuum", snr_db=-5.0),
        plain("good-vacuum", "good loudspeaker, vacuum −10 dB", loudspeaker=GOOD, noise="vacuum", snr_db=-10.0),
        plain("ideal-vacuum", "ideal loudspeaker, vacuum −10 dB", noise="vacuum", snr_db=-10.0),
        _off("clock", "clock ±300 ppm, pink −10 dB", -10.0, ppm=300.0),
        _off("clock-worst", "clock ±1,300 ppm, pink −10 dB", -10.0, ppm=1300.0),
        _off("doppler", "Doppler, ±0.44 m/s, pink −5 dB", -5.0, speed_m_s=FASTEST_M_S),
    ]
    measured = rooms.measured(data) if data is not None else []

    def room(k: int) -> Path:
        return measured[k * 7 % len(measured)]

    if measured:
        found.append(Condition("measured", "measured rooms, quiet", lambda k: World(room=room(k), snr_db=30.0, seed=k)))
        for snr_db in (0.0, -5.0):
            label = f"measured rooms, appliances {snr_db:g} dB"
            found.append(Condition(f"measured{snr_db:+g}", label, _noisy(room, "appliances", snr_db)))
    hard = {"next-room": rooms.next_room, "classroom": rooms.classroom, "chapel": rooms.chapel}
    for name, make in hard.items():
        found.append(Condition(name, f"{name.replace('-', ' ')}, quiet", _quiet(seed, make), True))
    loud = "kitchen" if data is not None and (data / "kitchen.wav").exists() else "pink"
    for name, make in {"living-room": rooms.living_room, **hard}.items():
        for snr_db in (0.0, -5.0):
            label = f"{name.replace('-', ' ')}, {loud} {snr_db:g} dB"
            found.append(Condition(f"{name}{snr_db:+g}", label, _noisy(_of(seed, make), loud, snr_db), True))
    for apart_db in (6.0, 12.0):
        label = f"two robots at once, {apart_db:g} dB apart"
        found.append(Condition(f"two{apart_db:+g}", label, together, True, apart_db))
    found.append(Condition("drawn", "worlds drawn at random", lambda k: draw_world(k, data), True))
    return found


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


def _quiet(seed: int, make: Callable[[int], rooms.Place]) -> MakeWorld:
    return lambda k: World(room=make(_variant(seed, k)), snr_db=30.0, seed=k)


def _noisy(room: Callable[[int], rooms.Place | Path], noise: str, snr_db: float) -> MakeWorld:
    return lambda k: World(room=room(k), noise=noise, snr_db=snr_db, seed=k)
