"""Robots in a hurry, like the paper's: a robot that claims a task drives off while it still talks, heard or not."""

from __future__ import annotations

from hvcpd.config.tasks import TaskRepository
from hvcpd.hardware.motion import GoTo, MotionState
from hvcpd.hardware.navigator import Navigator
from hvcpd.language.messages import Claim, Completed, Statement, TaskByNumber, own_words
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
        words = own_words(said)
        claim = words.claim if isinstance(words, Completed) else words
        if not isinstance(claim, Claim):
            return
        ref, tasks = claim.task, self._tasks
        task = tasks.by_number(ref.number) if isinstance(ref, TaskByNumber) else tasks.by_name(ref.name)
        if task is not None and task.place is not None:
            self._way.start(GoTo(task.place.x_m, task.place.y_m), pose)
