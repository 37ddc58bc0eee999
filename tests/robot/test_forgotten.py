"""A sentence that names what was forgotten since it was to be said."""

from hvcpd.config.tasks import Wait
from hvcpd.coordination.states import State
from hvcpd.language import messages as m
from hvcpd.robot.records import SaidRecord, UnsaidRecord
from tests.robot.test_hold import Bench


def test_what_cannot_be_said_any_more_is_left_out_and_the_robot_talks_on() -> None:
    """The daemon ended: its phrasebook had no word for the robot that had done the task."""
    bench = Bench(Wait(1.0))
    bench.coordination.board.complete(1, "Zoe")
    bench.coordination.knowledge.state = State.READY
    bench.run(1.0)
    claim = m.Utterance("Bot", m.ToTeam("plant"), None, m.Claim(m.TaskByNumber(1)))
    bench.coordination.heard(claim, bench.robot.now)
    bench.run(3.0)
    assert bench.noted(UnsaidRecord)
    bench.coordination.heard(m.Utterance("Bot", m.ToRobot("Rob"), None, m.WhatDoing()), bench.robot.now)
    bench.run(3.0)
    assert bench.noted(SaidRecord)
