"""What a robot hears begin as its own voice ends may be the end of a longer sentence."""

from __future__ import annotations

import numpy as np
import pytest

from hvcpd.assembly.make import make_robot
from hvcpd.assembly.plan import RobotPlan, TeamPlan
from hvcpd.config.tasks import TaskRepository
from hvcpd.coordination.actions import Role
from hvcpd.coordination.states import State
from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from hvcpd.robot.own_voice import Acoustics
from hvcpd.robot.robot import Robot
from tests.robot.test_echo import sound
from tests.robot.test_hold import BLOCK

OWN = "Hi team plant, I am Rob, what are you doing"
HINT = "Hi all, I am Bot, I have stopped until you say resume"


def speech(robot: Robot, name: str, text: str) -> Samples:
    book = robot.phrasebook
    return sound().speaker_of(name).render(book.phrases(book.parse_text(text)))


@pytest.mark.slow
@pytest.mark.parametrize("left_s", [0.62, 0.66])
def test_the_end_of_another_ones_sentence_releases_nobody(left_s: float) -> None:
    """A robot that ended its own sentence while another one said how it is released heard "resume", surely, and was."""
    team = TeamPlan(("Rob", "Bot"))
    robot = make_robot(RobotPlan(Role("Rob", "plant"), team, TaskRepository(()), 1), sound())
    robot.coordination.stop(0.0)
    own, hint = speech(robot, "Rob", OWN), speech(robot, "Bot", HINT)
    air = (1e-3 * np.random.default_rng(1).standard_normal(30 * SAMPLE_RATE_HZ)).astype(np.float32)
    is_told = False
    for at in range(0, len(air), BLOCK):
        if at == 10 * SAMPLE_RATE_HZ:  # it has said that it stands
            assert robot.coordination.say(robot.phrasebook.parse_text(OWN), robot.now) is None
        if at > 10 * SAMPLE_RATE_HZ and robot.speaking and not is_told:
            is_told = True
            end = at + len(own) + round((Acoustics().tail_s + left_s) * SAMPLE_RATE_HZ)
            assert end - len(hint) >= at, "it begins while the robot speaks"
            air[end - len(hint) : end] += 0.3 * hint
        robot.step(air[at : at + BLOCK], None)
    assert is_told
    assert robot.coordination.state is State.STOPPED
