"""A robot whose sound card is gone stands still, keeps quiet, and goes on where it was when it hears again."""

from __future__ import annotations

import numpy as np

from hvcpd.config.tasks import Forward
from hvcpd.coordination.actions import SaveStopped
from hvcpd.coordination.states import State
from hvcpd.language.messages import Confirmed, ToRobot, TurnBy, Utterance
from hvcpd.ports import SAMPLE_RATE_HZ, STANDSTILL
from hvcpd.robot.records import PerformedRecord, SaidRecord
from tests.robot.test_hold import BLOCK, Bench, Mouth

NONE = np.zeros(0, np.float32)


def deaf(bench: Bench, duration_s: float) -> None:
    """So long without sound, told in steps of 0.1 s."""
    for _ in range(round(duration_s / 0.1)):
        output = bench.robot.step(NONE, None, round(0.1 * SAMPLE_RATE_HZ))
        assert output.wheels == STANDSTILL
        assert output.sound.size == 0
        bench.wheels = output.wheels
        bench.records += output.records


def test_time_goes_on() -> None:
    bench = Bench(Forward(1.0))
    bench.run(1.0)
    before_s = bench.robot.now
    deaf(bench, 30.0)
    assert abs(bench.robot.now - before_s - 30.0) < 1e-6


def test_the_wheels_stand_and_the_way_is_finished_afterwards() -> None:
    bench = Bench(Forward(1.0))
    bench.until_driving()
    deaf(bench, 120.0)
    driven_m = bench.angles[0] * 0.033
    assert 0.0 < driven_m < 0.9
    bench.until(lambda: bench.noted(PerformedRecord), 400.0)
    assert abs(bench.angles[0] * 0.033 - 1.0) < 0.01


def test_nothing_is_said_while_deaf_nor_in_the_same_moment_as_hearing_is_back() -> None:
    bench = Bench(Forward(1.0))
    deaf(bench, 20.0)
    assert not bench.noted(SaidRecord)
    back_s = bench.robot.now
    bench.until(lambda: bench.noted(SaidRecord), back_s + 30.0)
    assert bench.robot.now - back_s > 0.3, "it listens first"


def test_what_was_being_said_is_said_again() -> None:
    bench = Bench(Forward(1.0))
    bench.until(lambda: bench.robot.speaking, 60.0)
    first = bench.noted(SaidRecord)[0]
    deaf(bench, 5.0)
    assert not bench.robot.speaking
    bench.until(lambda: len(bench.noted(SaidRecord)) > 1, 60.0)
    again = bench.noted(SaidRecord)[1]
    assert isinstance(first, SaidRecord)
    assert isinstance(again, SaidRecord)
    assert again.text == first.text


def test_a_motion_whose_read_back_was_cut_waits_for_its_confirmation() -> None:
    """The wheels turned as soon as sound was back, and nobody had heard what the robot had understood."""
    bench = Bench(mouth=Mouth(16000))
    talk = bench.robot.coordination
    bench.until(lambda: talk.board.all_done and talk.state is State.READY)
    talk.heard(Utterance("Bot", ToRobot("Rob"), None, TurnBy(90.0)), bench.robot.now)
    bench.until(lambda: talk.state is State.READING_BACK and bench.robot.speaking)
    deaf(bench, 1.0)
    bench.run(2.0)
    assert not bench.robot.performer.busy
    talk.heard(Utterance("Bot", ToRobot("Rob"), None, Confirmed()), bench.robot.now)
    bench.run(1.0)
    assert bench.robot.performer.busy


def test_a_stop_by_hand_while_deaf_is_kept_at_once_and_ends_the_motion() -> None:
    bench = Bench(Forward(1.0))
    bench.until_driving()
    deaf(bench, 1.0)
    assert bench.robot.coordination.stop(bench.robot.now)
    deaf(bench, 0.1)
    assert bench.noted(SaveStopped) == [SaveStopped(True)]
    assert not bench.robot.performer.busy


def test_a_block_with_sound_after_a_gap_is_heard() -> None:
    bench = Bench(Forward(1.0))
    deaf(bench, 1.0)
    output = bench.robot.step(np.zeros(BLOCK, np.float32), None, 100)
    assert output.sound.size == BLOCK
