"""A plausible mission made up from a seed, of any size: for the reports, which only show what they are given."""

from __future__ import annotations

import math

import numpy as np

from hvcpd.config.shared_places import SharedPlace
from hvcpd.ports import SAMPLE_RATE_HZ, Pose
from hvcpd.reporting.events import (
    Event,
    Garbled,
    Heard,
    MissionRecord,
    Moved,
    Performed,
    Plant,
    Said,
    Started,
    Summary,
    TaskChanged,
    Trail,
)

COLOURS = "green violet indigo orange yellow red blue white pink purple".split()
SPEED_M_S = 0.2
TURN_S = 12.0
"""One sentence and the pause after it."""
SENTENCE_S = 4.0


def example(
    n_robots: int = 2,
    n_tasks: int = 5,
    seed: int = 1,
    names: tuple[str, ...] | None = None,
    task_names: tuple[str, ...] | None = None,
    title: str = "Two robots share out the watering",
    sound: bool = True,
) -> MissionRecord:
    """Robots take the tasks in turn, say so, drive, water and report; some listeners garble, one utterance collides."""
    rng = np.random.default_rng(seed)
    names = names or tuple(f"Rob{k}" if k else "Rob" for k in range(n_robots))
    task_names = task_names or tuple(f"water the {COLOURS[k % 10]} rose" for k in range(n_tasks))
    starts = tuple(Pose(-5.0 + k % 4, -5.0 + k // 4) for k in range(len(names)))
    places = rng.uniform((-4.0, -3.0), (7.0, 5.0), (len(task_names), 2)).round(2).tolist()
    plants = tuple(Plant(k + 1, name, x, y) for k, (name, (x, y)) in enumerate(zip(task_names, places, strict=True)))
    told = _Told(names, rng)
    ways = {name: [(0.0, start.x_m, start.y_m)] for name, start in zip(names, starts, strict=True)}
    for k, name in enumerate(names):
        told.say(1.0 + TURN_S * k, name, f"Hi all, I am {name}, member of team plant")
    clear_s = 1.0 + TURN_S * len(names)
    done = {}
    for k, plant in enumerate(plants):
        name = names[k % len(names)]
        t_s, x, y = ways[name][-1]
        claim_s = max(clear_s, t_s + 1.0)
        told.claim(claim_s, name, plant.task)
        told.say(claim_s, name, f"Hi team plant, I am {name}, I will complete task {plant.task}", collided=k == 1)
        arrive_s = claim_s + SENTENCE_S + math.hypot(plant.x_m - x, plant.y_m - y) / SPEED_M_S
        off = rng.normal(0.0, 0.004, 2)
        told.events.append(Performed(arrive_s + 5.0, name, plant.task, plant.x_m + off[0], plant.y_m + off[1]))
        told.change(arrive_s + 5.0, name, plant.task, "done", name)
        told.say(arrive_s + 6.0, name, f"Hi all, I am {name}, task {plant.task} complete")
        ways[name] += [
            (claim_s + SENTENCE_S, x, y),
            (arrive_s, plant.x_m, plant.y_m),
            (arrive_s + 11, plant.x_m, plant.y_m),
        ]
        clear_s = claim_s + TURN_S
        done[plant.name] = name
    end_s = max(e.at_s for e in told.events if not isinstance(e, Summary)) + 10.0
    events = _in_order(told.events, names, ways, end_s)
    corridor = SharedPlace("corridor", 0.5, -2.0, 2.0, 0.5)
    head = Started(0.0, names, starts, plants, "volunteer", seed, 40.0, places=(corridor,))
    tail = _summary(events, done, len(plants), end_s, seed)
    waves = _sound(told.events, names, end_s, rng) if sound else np.zeros(0, np.float32)
    return MissionRecord((head, *events, tail), tuple(_trail(n, ways[n], end_s) for n in names), waves, title)


class _Told:
    def __init__(self, names: tuple[str, ...], rng: np.random.Generator) -> None:
        self.events: list[Event] = []
        self._names, self._rng, self._n = names, rng, 0

    def say(self, at_s: float, speaker: str, text: str, collided: bool = False) -> None:
        end_s = at_s + SENTENCE_S
        self.events.append(Said(at_s, end_s, self._n, speaker, text, collided))
        for listener in self._names:
            if listener == speaker:
                continue
            lot = self._rng.random()
            if collided or lot < 0.15:
                self.events.append(Garbled(at_s + 0.01, listener))
            elif lot < 0.95:
                confidence, snr_db = 0.5 + 0.5 * self._rng.random(), self._rng.uniform(5.0, 25.0)
                self.events.append(
                    Heard(at_s + 0.01, self._n, listener, speaker, text, confidence, snr_db, _words(at_s, text))
                )
        self._n += 1

    def claim(self, at_s: float, robot: str, task: int) -> None:
        self.change(at_s, robot, task, "claimed", robot)
        for other in self._names[:-1] or self._names:  # the last never learns of it
            if other != robot:
                self.change(at_s + 5.0, other, task, "claimed", robot)

    def change(self, at_s: float, robot: str, task: int, state: str, owner: str) -> None:
        self.events.append(TaskChanged(at_s, robot, task, state, owner))


def _words(at_s: float, text: str) -> tuple[tuple[str, float, float], ...]:
    words = text.replace(",", "").split()
    each_s = SENTENCE_S / max(len(words), 1)
    return tuple((word, at_s + k * each_s, at_s + (k + 0.9) * each_s) for k, word in enumerate(words))


def _in_order(
    events: list[Event], names: tuple[str, ...], ways: dict[str, list[tuple[float, float, float]]], end_s: float
) -> list[Event]:
    """As they come to the terminal: an utterance when it ends, who heard it just after."""
    moves: list[Event] = []
    for at_s in np.arange(0.0, end_s, 1.0).tolist():
        moves.append(Moved(at_s, tuple(Pose(*_at(ways[name], at_s)) for name in names)))

    def due_s(event: Event) -> float:
        late = {Said: SENTENCE_S, Heard: SENTENCE_S + 0.3, Garbled: SENTENCE_S + 0.2}.get(type(event), 0.0)
        return event.at_s + late if not isinstance(event, Summary) else math.inf

    return sorted([*events, *moves], key=due_s)


def _at(way: list[tuple[float, float, float]], at_s: float | np.ndarray) -> tuple[float, float]:
    t, x, y = (np.array(column) for column in zip(*way, strict=True))
    return np.interp(at_s, t, x), np.interp(at_s, t, y)


def _trail(name: str, way: list[tuple[float, float, float]], end_s: float) -> Trail:
    t_s = np.arange(0.0, end_s, 0.025)
    x_m, y_m = _at(way, t_s)
    return Trail(name, t_s, np.asarray(x_m), np.asarray(y_m))


def _summary(events: list[Event], done: dict[str, str], tasks: int, end_s: float, seed: int) -> Summary:
    said = [e for e in events if isinstance(e, Said)]
    heard = {e.utterance for e in events if isinstance(e, Heard)}
    collisions = sum(e.collided for e in said)
    return Summary(
        tasks, done, 0, tasks - len(done), len(said), len(heard), collisions, end_s, end_s / 20, 20.0, seed, "volunteer"
    )


def _sound(events: list[Event], names: tuple[str, ...], end_s: float, rng: np.random.Generator) -> np.ndarray:
    """Quiet noise, and in it each utterance as a harmonic tone whose pitch tells the speaker."""
    wave = 0.0005 * rng.standard_normal(round(end_s * SAMPLE_RATE_HZ))
    t = np.arange(round(SENTENCE_S * SAMPLE_RATE_HZ)) / SAMPLE_RATE_HZ
    for event in events:
        if isinstance(event, Said):
            pitch_hz = pitch_of(names.index(event.speaker))
            tone = sum(np.sin(2 * np.pi * pitch_hz * k * t) / k for k in range(1, 12))
            first = round(event.at_s * SAMPLE_RATE_HZ)
            wave[first : first + len(t)] += 0.003 * tone * np.sin(np.pi * 3 * t) ** 2
    return wave.astype(np.float32)


def pitch_of(index: int) -> float:
    """The pitch that stands for the robot at `index`, Hz."""
    return 110.0 * 2 ** (index / 6)
