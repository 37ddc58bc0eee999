"""The room's ways of sound between robots: straight on, with echoes, and robots that drive off while they talk."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from numpy.typing import NDArray

from hil_fakes.hall_room import STEP_M, Echoing, Recorded, shortened
from hil_fakes.haste import Haste
from hil_fakes.room import Air, DelayLine, FreeField, Room
from hvcpd.config.tasks import GoTo, Place, TaskDefinition, TaskRepository
from hvcpd.language.messages import Claim, Completed, Statement, TaskByNumber, ToAll, Utterance, WhoHere
from hvcpd.ports import STANDSTILL, Pose, Samples, WheelCommand, WheelReading
from hvcpd.robot.records import RobotOutput, SaidRecord

BLOCK = 400
ECHO = 900


def respond(distance_m: float) -> Samples:
    """Straight on after 10 samples a step, and an echo of half that."""
    impulse = np.zeros(4000, np.float32)
    impulse[round(10 * distance_m / STEP_M)] = 1.0 / distance_m
    impulse[ECHO] = 0.5 / distance_m
    return impulse


def carried(line: DelayLine, sound: Samples, way: Echoing, metres: NDArray[np.float64]) -> NDArray[np.float64]:
    heard = []
    for k in range(len(sound) // BLOCK):
        line.write(sound[k * BLOCK : (k + 1) * BLOCK])
        heard.append(way.carry(line, BLOCK, metres[k], metres[k + 1], 1.0))
    return np.concatenate(heard)


def test_echoes_are_those_of_the_response_whatever_the_blocks() -> None:
    sound = np.random.default_rng(1).standard_normal(20 * BLOCK).astype(np.float32)
    way = Echoing(respond, 20.0)
    heard = carried(DelayLine(way.reach), sound, way, np.full(21, 2.0))
    wanted = np.convolve(sound, shortened(respond(2.0)))[: len(sound)]
    np.testing.assert_allclose(heard, wanted, atol=1e-5)
    assert way.latest(2.0) == ECHO + 1


def test_who_drives_is_heard_from_one_response_to_the_next_without_a_click() -> None:
    slope = 2 * np.pi * 0.0103
    tone = np.sin(slope * np.arange(20 * BLOCK)).astype(np.float32)
    way = Echoing(respond, 20.0)
    line = DelayLine(way.reach)
    heard = carried(line, tone, way, np.linspace(1.0, 2.0, 21))
    steepest = slope * 1.5  # of the tone and its echo, where they are loudest
    assert np.abs(np.diff(heard[3 * BLOCK :])).max() < steepest
    metres = (1.0, 1.25, 1.5, 1.75, 2.0)
    alone = [carried(DelayLine(way.reach), tone, way, np.full(21, at))[3 * BLOCK :] for at in metres]
    cuts = [np.abs(near - far)[::BLOCK].max() for near, far in pairwise(alone)]
    assert min(cuts) > steepest, "cut over from one block to the next it would click"
    np.testing.assert_allclose(heard[-BLOCK:], alone[-1][-BLOCK:], atol=1e-5)


def test_a_response_loses_only_what_nobody_hears() -> None:
    decaying = (10.0 ** (-3.0 * np.arange(40_000) / 8000.0)).astype(np.float32)
    kept = shortened(decaying)
    assert len(kept) == pytest.approx(8000, abs=20)
    assert np.sum(decaying[len(kept) :] ** 2) <= 1.01e-6 * np.sum(decaying**2)


def test_a_room_takes_other_ways_and_noises_for_the_others_only() -> None:
    air = Air()
    way = Echoing(respond, 20.0)
    hum = np.full(7, 0.25, np.float32)
    room = Room(2, air, 1, ways=way, noises=[Recorded(hum), Recorded(np.zeros(3, np.float32))])
    click = np.zeros(BLOCK, np.float32)
    click[0] = 0.1
    quiet = np.zeros(BLOCK, np.float32)
    blocks = [room.advance([click if k == 0 else quiet, quiet], [(0.0, 0.0), (2.0, 0.0)]) for k in range(4)]
    own, other = (np.concatenate([block[ear] for block in blocks]) for ear in (0, 1))
    assert own[BLOCK:] == pytest.approx(0.25, abs=1e-4)
    at = np.flatnonzero(np.abs(other) > 0.3 * np.abs(other).max())
    assert list(at) == [round(10 * 2.0 / STEP_M), ECHO]


def test_free_air_is_silent_once_the_sound_has_passed() -> None:
    line, free = DelayLine(FreeField().reach), FreeField()
    line.write(np.ones(BLOCK, np.float32))
    assert not line.is_silent(BLOCK, free.latest(3.43))
    for _ in range(2):
        line.write(np.zeros(BLOCK, np.float32))
    assert line.is_silent(BLOCK, free.latest(3.43))


TASKS = TaskRepository((TaskDefinition(1, "water the green rose", Place(2.0, 0.0), (GoTo(Place(2.0, 0.0)),)),))


def said(statement: Statement | None, wheels: WheelCommand = STANDSTILL) -> RobotOutput:
    record = SaidRecord(0.0, Utterance("Rob", ToAll(), None, statement), "", 3.0)
    return RobotOutput(np.zeros(BLOCK, np.float32), wheels, (record,))


STILL = WheelReading(0.0, 0.0)
SILENT = RobotOutput(np.zeros(BLOCK, np.float32), STANDSTILL, ())


@pytest.mark.parametrize(
    ("statement", "drives"),
    [
        (Claim(TaskByNumber(1)), True),
        (Completed(TaskByNumber(2), TaskByNumber(1)), True),
        (Completed(TaskByNumber(1)), False),
        (Claim(TaskByNumber(7)), False),
        (WhoHere(), False),
    ],
)
def test_who_is_in_a_hurry_drives_off_with_its_claim(statement: Statement, drives: bool) -> None:
    haste = Haste(TASKS)
    haste.wheels(said(statement), Pose(0.0, 0.0), 0.0, None)
    later = [haste.wheels(SILENT, Pose(0.0, 0.0), 0.05 * k, STILL) for k in range(1, 10)]
    assert any(command != STANDSTILL for command in later) == drives


def test_the_robots_own_driving_goes_first() -> None:
    haste, own = Haste(TASKS), WheelCommand(1.0, 1.0)
    haste.wheels(said(Claim(TaskByNumber(1))), Pose(0.0, 0.0), 0.0, None)
    assert haste.wheels(RobotOutput(SILENT.sound, own, ()), Pose(0.0, 0.0), 0.1, None) == own
    assert haste.wheels(SILENT, Pose(0.0, 0.0), 0.2, STILL) == STANDSTILL
