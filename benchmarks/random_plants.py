"""Random rooms for missions with sound: the places of the plants, and the noise."""

from __future__ import annotations

import random
from dataclasses import dataclass
from pathlib import Path

COLOURS = "green violet indigo orange yellow white purple silver red blue brown golden".split()
"""Names of plants, twelve at most, of which no two sound alike."""
ROOM_M = 6.0
"""Half the side of the room: the paper's plants stand within it."""
WATERING_S = (2.0, 8.0)


@dataclass(frozen=True)
class PlantRoom:
    """A room with its plants (name, x and y in metres, how long watering takes in seconds), and its noise."""

    plants: tuple[tuple[str, float, float, float], ...]
    noise_db: float
    """Of ambient noise, dB SPL."""

    def write_tasks(self, file: Path) -> None:
        """Write the task repository that `hvcpctl simulate --tasks` reads."""
        lines = ["tasks:"]
        for number, (name, x_m, y_m, water_s) in enumerate(self.plants, 1):
            lines += [
                f"  - number: {number}",
                f"    name: water the {name} rose",
                f"    place: {{x_m: {x_m:.2f}, y_m: {y_m:.2f}}}",
                f"    actions: [go to place, {{water: {water_s:.1f}}}]",
            ]
        file.write_text("\n".join(lines) + "\n", encoding="utf-8")


def random_room(seed: int, plants: tuple[int, int], noise_db: tuple[float, float]) -> PlantRoom:
    """A room drawn by seed: the ranges of the number of plants and of the noise, both ends included."""
    rng = random.Random(f"plants {seed}")
    colours = rng.sample(COLOURS, rng.randint(*plants))
    side_m = -ROOM_M, ROOM_M
    drawn = tuple((colour, rng.uniform(*side_m), rng.uniform(*side_m), rng.uniform(*WATERING_S)) for colour in colours)
    return PlantRoom(drawn, round(rng.uniform(*noise_db), 1))
