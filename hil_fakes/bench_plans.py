"""Missions for whole robots that a benchmark and a test share."""

from __future__ import annotations

from hil_fakes.bench import BenchPlan
from hil_fakes.room import Air
from hvcpd.config.tasks import TaskDefinition, TaskRepository, Tend, Wait
from hvcpd.ports import Pose

SPACING_M = 12.0
EARSHOT_M = 15.0
"""Each hears its neighbours, and those at the ends do not hear each other."""
MET_S = 20.0
"""By then all three have greeted, at switch-on times of up to 1.5 s."""
NOISE_DB = 35.0


def relay_plan(seed: int) -> BenchPlan:
    """Three robots in a row. When they have met, a wall is drawn between the ends; Rob at one end orders what only
    Zoe at the other can do, on the spot, so that nobody comes nearer."""
    here = TaskRepository((TaskDefinition(1, "water the green rose", None, (Wait(1.0), Tend(2.0))),))
    return BenchPlan(
        ("Rob", "Max", "Zoe"),
        here,
        seed,
        coordinator="Rob",
        air=Air(noise_db_spl=NOISE_DB),
        starts=tuple(Pose(k * SPACING_M, 0.0) for k in range(3)),
        earshot_m=EARSHOT_M,
        earshot_from_s=MET_S,
        unable={"Max": frozenset({1})},
        limit_s=300.0,
    )
