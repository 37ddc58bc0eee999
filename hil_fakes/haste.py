"""Robots in a hurry, like the paper's: a robot that claims a task drives off while it still talks, heard or not."""

from __future__ import annotations

from hvcpd.config.tasks import TaskRepository
from hvcpd.hardware.motion import GoTo, MotionState
from hvcpd.hardware.navigator import Navigator
from hvcpd.language.messages import Claim, Completed, Statement, TaskByNumber, TaskRef, own_words
from hvcpd.ports import STANDSTILL, Pose, WheelCommand, WheelReading
from hvcpd.robot.records import RobotOutput, SaidRecord


class Haste:
    """Turns the wheels of one robot that would stand still until it is heard."""

    def __init__(self, tasks: TaskRepository) -> None:
        self._tasks = tasks
        self._way = Navigator()

    def wheels(self, output: RobotOutput, pose: Pose, now: float, reading: WheelReading | None) -> WheelCommand:
        """Instead of `output.wheels`: the same if the robot drives by itself; otherwise towards the task that it has
        claimed."""
        for record in output.records:
            if isinstance(record, SaidRecord):
                self._set_off(record.utterance.statement, pose)
        if output.wheels != STANDSTILL:
            self._way.cancel()
        if self._way.state is not MotionState.MOVING:
            return output.wheels
        return self._way.step(pose, now, reading)

    def _set_off(self, said: Statement | None, pose: Pose) -> None:
        claimed: TaskRef | None = None
        match own_words(said):
            case Claim(ref):
                claimed = ref
            case Completed(_, following):
                claimed = following
        if claimed is None:
            return
        if isinstance(claimed, TaskByNumber):
            task = self._tasks.by_number(claimed.number)
        else:
            task = self._tasks.by_name(claimed.name)
        if task is not None and task.place is not None:
            self._way.start(GoTo(task.place.x_m, task.place.y_m), pose)
