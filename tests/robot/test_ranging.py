"""Two whole robots in a room, by sound alone: one asks how far the other is."""

from __future__ import annotations

import numpy as np
import pytest

from hil_fakes.furnished_room import FurnishedRoom
from hil_fakes.loudspeakers import SMALL
from hil_fakes.room import Air, Room
from hvcpd.assembly.make import make_robot
from hvcpd.assembly.plan import HearingPlan, RobotPlan, TeamPlan
from hvcpd.assembly.sound import make_sound, user_cache_folder
from hvcpd.config.tasks import TaskRepository
from hvcpd.coordination.actions import Role
from hvcpd.ports import Samples
from hvcpd.recognition.stages import SynchronousWorker
from hvcpd.robot.records import RangeRecord, Record
from hvcpd.robot.robot import Robot

NAMES = ("Rob", "Bot")
BLOCK = 400


class Pair:
    """Both robots stand; `distance_m` apart, in a furnished room, with small loudspeakers."""

    def __init__(self, distance_m: float, seed: int) -> None:
        sound, tasks = make_sound(None, user_cache_folder()), TaskRepository(())
        self.robots: list[Robot] = [
            make_robot(
                RobotPlan(
                    Role(name, "plant", roster=NAMES),
                    TeamPlan(NAMES),
                    tasks,
                    seed + k,
                    hearing=HearingPlan(channel=SynchronousWorker()),
                ),
                sound,
            )
            for k, name in enumerate(NAMES)
        ]
        self._room = Room(2, Air(), seed, (1.0, 1.0), FurnishedRoom(), loudspeaker=SMALL)
        self._places = [(0.0, 0.0), (distance_m, 0.0)]
        self._playing: list[Samples] = [np.zeros(BLOCK, np.float32)] * 2
        self.records: list[tuple[str, Record]] = []

    def run(self, for_s: float) -> None:
        for _ in range(round(for_s * 16_000 / BLOCK)):
            heard = self._room.advance(self._playing, self._places)
            outputs = [robot.step(part, None) for robot, part in zip(self.robots, heard, strict=False)]
            self._playing = [output.sound for output in outputs]
            for name, output in zip(NAMES, outputs, strict=True):
                self.records += [(name, record) for record in output.records]

    def ask(self) -> None:
        rob = self.robots[0]
        assert rob.coordination.say(rob.phrasebook.parse_text("Hi Bot, I am Rob, how far are you"), rob.now) is None

    @property
    def away(self) -> RangeRecord | None:
        return self.robots[0].measures.distances.get("bot")


@pytest.mark.parametrize("distance_m", [2.0, 10.0])
def test_a_robot_that_is_asked_tells_its_interval_and_the_other_knows_the_distance(distance_m: float) -> None:
    pair = Pair(distance_m, seed=round(distance_m))
    pair.run(12.0)
    pair.ask()
    while pair.away is None and pair.robots[0].now < 40.0:
        pair.run(0.5)
    assert pair.away is not None
    assert pair.away.sure
    assert pair.away.distance_m == pytest.approx(distance_m, abs=0.05)
    assert [name for name, record in pair.records if isinstance(record, RangeRecord)] == ["Rob"]
