"""Tasks that recur every hour, and a mission in the middle of such an hour."""

from __future__ import annotations

from dataclasses import replace

from hil_fakes.word_channel import Conditions
from hil_fakes.word_mission import WordMission, WordPlan
from hvcpd.config.recurrence import Recurrence
from hvcpd.config.tasks import TaskDefinition, Wait
from hvcpd.language import messages as m

HOUR_S = 3600.0
EVERY_HOUR = tuple(
    TaskDefinition(number, f"do the {word} thing", None, (Wait(20.0),), every=Recurrence("1 h"))
    for number, word in enumerate(("first", "second", "third"), 1)
)
PLAN = WordPlan(("Rob", "Bot", "Max"), EVERY_HOUR, 1, Conditions(0.1), clocks={"Rob": 0.0}, limit_s=6 * HOUR_S)


def done_for_this_hour(names: tuple[str, ...] = ("Rob", "Bot"), doer: str = "Bot") -> WordMission:
    """Half an hour after `doer` has done task one for this hour; only Rob has a clock."""
    plan = replace(PLAN, names=names, tasks=EVERY_HOUR[:1], conditions=Conditions())
    mission = WordMission(replace(plan, fails=lambda name, _task, _now: name != doer), keep=True)
    mission.air.run_until(HOUR_S + 1800.0)
    assert mission.by == {1: doer}
    return mission


def again(number: int) -> m.Change:
    """ "Task one again", as the change of that number."""
    return m.Change(m.TaskByNumber(1), skip=False, count=(number - 1) % 9 + 1)
