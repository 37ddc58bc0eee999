"""Two whole robots in the hall: they greet, share out tasks by talking, and drive, as on real wheels."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from hil_fakes import bench as bodies
from hil_fakes.hall_room import Echoing, Recorded
from hil_fakes.loudspeakers import IDEAL
from hil_fakes.reverberation import START_M, response
from hil_fakes.room import Air
from hil_fakes.transducers import band
from hvcpd.config.tasks import GoTo, Place, TaskDefinition, TaskRepository, Tend
from hvcpd.coordination.entry import CLAIMED, DONE
from hvcpd.evaluation import listeners
from hvcpd.evaluation.scene import SHIFT_M, Bench, noise
from hvcpd.evaluation.trials import Trial
from hvcpd.ports import Pose, Samples, samples_in
from hvcpd.reporting.events import Event, Performed, TaskChanged
from hvcpd.synthesis.leveling import audible

ONE, OTHER = "Rob", "Bot"
"""The paper's pair. (PocketSphinx hears other names, as they rhyme: `listeners.CALLED`.)"""
WORK_S = 1.0
"""Duration of watering: short, because only the talk is of interest."""
END_WALL_M = 0.5
"""Nobody stands nearer to the far wall."""
LIMIT_S = 240.0
"""A mission that has not ended by then is judged as it stands: without trouble it takes 35 to 70 s."""
NOISE_S = 30.0
"""Period after which the robots' own noise repeats: ten times as long as their recognisers look back."""


@dataclass(frozen=True)
class Plot:
    """A plant: its number, and where it stands along the hall (m); None: it can be watered from anywhere."""

    number: int
    x_m: float | None = None


def repository(plots: Iterable[Plot]) -> TaskRepository:
    """Plants of those numbers, with the names that the paper's have, to be watered there."""
    names = listeners.tasks()
    found = []
    for plot in plots:
        known = names.by_number(plot.number)
        assert known is not None
        place = None if plot.x_m is None else Place(plot.x_m, 0.0)
        way = () if place is None else (GoTo(place),)
        found.append(TaskDefinition(plot.number, known.name, place, (*way, Tend(WORK_S))))
    return TaskRepository(tuple(found))


def run(trial: Trial, tasks: TaskRepository, **plan: Any) -> tuple[tuple[Event, ...], bool]:
    """ONE at 0 m and OTHER `distance_m` away, back to back, carry out the tasks; `plan`: further settings of the bench.
    Return all events, and whether the mission ended by itself.

    Settings: `distance_m`, `robot_noise_db_spl` (or null). Raises ImportError without pyroomacoustics.
    """
    s, rng = trial.settings, trial.generator()
    setting = Bench(robot_noise_db_spl=s["robot_noise_db_spl"])
    free_m = setting.hall.size_m[0] - START_M - END_WALL_M
    shift_m = round(float(rng.uniform(0.0, max(min(SHIFT_M, free_m - s["distance_m"]), 0.0))), 3)
    seed = int(rng.integers(2**31))
    air = Air(
        speech_db_spl=setting.speech_db_spl,
        microphone_full_scale_db_spl=setting.full_scale_db_spl,
        speech_dbfs=spoken_dbfs((ONE, OTHER)),
    )
    noises = [noise(samples_in(NOISE_S), setting, rng) for _ in range(2)]
    mission = bodies.Bench(
        bodies.BenchPlan(
            (ONE, OTHER),
            tasks,
            seed,
            air=air,
            ways=Echoing(lambda distance_m: _heard_from(setting, distance_m, free_m, shift_m), free_m),
            loudspeaker=IDEAL,  # its band is part of what is heard
            noise_at=lambda k: Recorded(noises[k]),
            starts=(Pose(0.0, 0.0, np.pi), Pose(s["distance_m"], 0.0)),
            limit_s=LIMIT_S,
            nearest_first=True,
            **plan,
        ),
        listeners.sound(),
    )
    events = mission.run().events
    return events, all(robot.coordination.board.all_done for robot in mission.robots.values())


def _heard_from(setting: Bench, distance_m: float, free_m: float, shift_m: float) -> Samples:
    """The hall's response to a loudspeaker at that distance, including the flight time."""
    impulse, _ = response(setting.hall, distance_m, min(shift_m, max(free_m - distance_m, 0.0)))
    return band(impulse, *setting.loudspeaker_hz)


@cache
def spoken_dbfs(names: tuple[str, ...]) -> float:
    """RMS of what these robots say, over its audible part, re full scale: the level that stands for the speech's."""
    powers, book = [], listeners.book(*names)
    for name in names:
        words = book.phrases(book.parse_text(f"Hi all, I am {name}"))
        said = listeners.sound().speaker_of(name).render(words)
        powers.append(np.mean(np.square(said[slice(*audible(said))], dtype=np.float64)))
    return float(10.0 * np.log10(np.mean(powers)))


def doers(events: Iterable[Event]) -> dict[int, list[str]]:
    """The robots that watered each plant while they really stood by it."""
    found: dict[int, list[str]] = {}
    for event in events:
        if isinstance(event, Performed):
            found.setdefault(event.task, []).append(event.robot)
    return found


def knows(events: Iterable[Event], robot: str, number: int, owner: str) -> bool:
    """Whether a robot's last state of the task names that one as its performer, in progress or done."""
    changes = [e for e in events if isinstance(e, TaskChanged) and (e.robot, e.task) == (robot, number)]
    return bool(changes) and changes[-1].state in (CLAIMED, DONE) and changes[-1].owner == owner
