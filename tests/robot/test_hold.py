"""A robot stands still for what may be "stop" over talk, and goes on, or stays, when it is known."""

from __future__ import annotations

import random
from collections.abc import Callable, Sequence

import numpy as np
import pytest

from hvcpd.assembly.sound import make_phrasebook
from hvcpd.config.shared_places import SharedPlace
from hvcpd.config.skills import Skill
from hvcpd.config.tasks import Action, Forward, Place, TaskDefinition, TaskRepository, Wait
from hvcpd.coordination.actions import Role, SaveStopped
from hvcpd.coordination.coordination import Coordination
from hvcpd.coordination.states import State
from hvcpd.hardware.kinematics import BURGER, Odometry
from hvcpd.hardware.navigator import Navigator
from hvcpd.language.messages import Stop, ToRobot, Utterance
from hvcpd.ports import SAMPLE_RATE_HZ, STANDSTILL, Pose, Samples, WheelReading
from hvcpd.ranging.ranging import Ranging
from hvcpd.recognition.events import Event, Held, Recognised, Released, Urgent
from hvcpd.recognition.stream import History
from hvcpd.robot.measures import Measures
from hvcpd.robot.own_voice import Acoustics
from hvcpd.robot.performer import Performer
from hvcpd.robot.records import HoldRecord, PerformedRecord, Record, SaidRecord
from hvcpd.robot.robot import Robot
from hvcpd.robot.sealing import Sealing

BLOCK = 400
BLOCK_S = BLOCK / SAMPLE_RATE_HZ


class ScriptedEars:
    """Reports what it is told to report, at its block."""

    def __init__(self) -> None:
        self.coming: list[Event] = []
        self.busy = False

    def push(self, samples: Samples, masked: bool = False) -> list[Event]:
        told, self.coming = self.coming, []
        return told

    def lost(self, n_samples: int) -> list[Event]:
        return []

    def adopt(self, others: ScriptedEars) -> None:
        """They report what they are told to, whatever words they know."""

    def prepare(self, go_on: Callable[[], bool]) -> None:
        pass


class Mouth:
    def __init__(self, n_samples: int = 800) -> None:
        self._n = n_samples

    def render(self, phrases: Sequence[Sequence[str]]) -> Samples:
        return np.zeros(self._n, np.float32)


class Overheard:
    """Reports "stop" in the block in which it is told to."""

    def __init__(self) -> None:
        self.coming: list[Event] = []
        self.begun: list[int] = []
        self.played = self.disturbed = 0

    def begin(self, now: int, latency_s: float) -> None:
        self.begun.append(now)
        self.played = 0

    def play(self, samples: Samples) -> None:
        self.played += len(samples)

    def hear(self, samples: Samples, speaking: bool) -> list[Event]:
        told, self.coming = self.coming, []
        return told

    def lost(self) -> None:
        pass

    def disturb(self) -> None:
        self.disturbed += 1


class KnownDelay:
    """Finds that the own voice comes back when it should."""

    def begin(self) -> None:
        pass

    def play(self, samples: Samples) -> None:
        pass

    def hear(self, samples: Samples) -> None:
        pass

    def measure(self) -> float | None:
        return 0.0


class Bench:
    """A robot alone, with wheels that do what they are told."""

    def __init__(
        self,
        *actions: Action,
        skills: tuple[Skill, ...] = (),
        mouth: Mouth | None = None,
        places: tuple[SharedPlace, ...] = (),
        roster: tuple[str, ...] = (),
        sealing: Sealing | None = None,
    ) -> None:
        task = TaskDefinition(1, "water the green rose", Place(0.0, 0.0), actions)
        tasks = TaskRepository((task,), places=places, skills=skills)
        self.recogniser, self.overheard, self.records = ScriptedEars(), Overheard(), list[Record]()
        self.coordination = Coordination(
            Role("Rob", "plant", roster=roster, volunteer=True), tasks.tasks, random.Random(1), places=tasks.places
        )
        mouth, here = mouth or Mouth(), Pose(0.0, 0.0)
        self.robot = Robot(
            self.coordination,
            make_phrasebook(("Rob", "Bot"), ("plant",), tasks, sealing is not None),
            self.recogniser,
            mouth,
            Odometry(here, BURGER),
            Performer(Navigator(), here),
            Acoustics(),
            mouth,
            self.overheard,
            sealing,
            KnownDelay(),
            {},
            Measures(Ranging("Rob", History()), lambda _: mouth),
        )
        self.angles = [0.0, 0.0]
        self.wheels = STANDSTILL

    @property
    def stopped(self) -> bool:
        return self.robot.coordination.state is State.STOPPED

    def live(self, *events: Event) -> None:
        """One block, at whose end these events are known."""
        self.angles[0] += self.wheels.left_rad_s * BLOCK_S
        self.angles[1] += self.wheels.right_rad_s * BLOCK_S
        self.recogniser.coming = list(events)
        left_rad, right_rad = self.angles
        reading = WheelReading(left_rad, right_rad, self.wheels.left_rad_s, self.wheels.right_rad_s)
        output = self.output = self.robot.step(np.zeros(BLOCK, np.float32), reading)
        self.wheels = output.wheels
        self.records += output.records

    def run(self, duration_s: float) -> None:
        for _ in range(round(duration_s / BLOCK_S)):
            self.live()

    def until(self, is_so: Callable[[], object], limit_s: float = 300.0) -> None:
        while not is_so():
            assert self.robot.now < limit_s
            self.live()

    def until_driving(self) -> None:
        self.until(lambda: self.wheels != STANDSTILL)
        self.run(1.0)

    def resume(self) -> Recognised:
        """Said in this block."""
        n = round(self.robot.now * SAMPLE_RATE_HZ)
        return Recognised(("resume",), "oak", n, n + BLOCK, 1.0, 20.0, ())

    def noted(self, kind: type[Record]) -> list[Record]:
        return [record for record in self.records if isinstance(record, kind)]


def test_a_hold_halts_in_the_same_block_and_a_release_goes_on() -> None:
    bench = Bench(Forward(2.0))
    bench.until_driving()
    bench.live(Held(0, 1))
    held_s = bench.robot.now
    for _ in range(240):
        assert bench.wheels == STANDSTILL
        bench.live()
    bench.live(Released(0, 1))
    assert bench.wheels != STANDSTILL
    assert not bench.stopped
    assert bench.noted(HoldRecord) == [HoldRecord(held_s, bench.robot.now)]
    bench.run(15.0)
    assert bench.noted(PerformedRecord)


def test_a_hold_that_was_the_stop_latches() -> None:
    bench = Bench(Forward(2.0))
    bench.until_driving()
    bench.live(Held(0, 1))
    bench.run(2.0)
    bench.live(Urgent(0, 1))
    assert bench.stopped
    bench.run(20.0)
    bench.live(Held(0, 1))
    bench.live(Released(0, 1))
    bench.run(20.0)
    assert bench.wheels == STANDSTILL
    assert bench.noted(SaveStopped) == [SaveStopped(True)]
    assert not bench.noted(HoldRecord)


def test_who_speaks_breaks_off_and_says_stop_at_once() -> None:
    bench = Bench(Forward(2.0), mouth=Mouth(3 * SAMPLE_RATE_HZ))
    bench.until(lambda: bench.robot.speaking)
    bench.live(Urgent(0, 1))
    assert not bench.robot.speaking
    bench.run(2.0 * BLOCK_S)
    assert [r.text for r in bench.records if isinstance(r, SaidRecord)][1:] == ["Stop"]


def test_a_stopped_robot_breaks_off_what_it_says_to_call_stop_for_its_owner() -> None:
    """Whoever pressed the console's button again had the others wait for the end of "I have stopped"."""
    bench = Bench(Forward(2.0), mouth=Mouth(3 * SAMPLE_RATE_HZ))
    bench.until_driving()
    bench.robot.coordination.stop(bench.robot.now)
    bench.until(lambda: bench.robot.speaking)
    for _ in range(3):  # the second and third call come while "Stop" is said
        assert bench.coordination.say(Utterance(None, statement=Stop()), bench.robot.now) is None
        bench.run(2.0 * BLOCK_S)
        assert bench.robot.speaking
    texts = [record.text for record in bench.records if isinstance(record, SaidRecord)]
    assert texts[-2:] == ["Hi all, I am Rob, I have stopped", "Stop"]


def test_two_calls_in_a_row_are_one_hold() -> None:
    bench = Bench(Forward(2.0))
    bench.until_driving()
    bench.live(Held(0, 1))
    held_s = bench.robot.now
    bench.run(1.0)
    bench.live(Held(2, 3))
    bench.run(1.0)
    bench.live(Released(2, 3))
    assert bench.noted(HoldRecord) == [HoldRecord(held_s, bench.robot.now)]


def test_each_detector_lets_go_of_its_own_hold_only() -> None:
    """The one that listens over the own voice let the robot go on while the other was not sure yet."""
    bench = Bench(Forward(2.0))
    bench.until_driving()
    bench.overheard.coming = [Held(0, 1)]
    bench.live()
    held_s = bench.robot.now
    bench.live(Held(2, 3))
    for over_own_voice in (True, False):
        assert bench.wheels == STANDSTILL
        assert not bench.noted(HoldRecord)
        bench.overheard.coming = [Released(0, 1)] if over_own_voice else []
        bench.live(*([] if over_own_voice else [Released(2, 3)]))
    assert bench.wheels != STANDSTILL
    assert bench.noted(HoldRecord) == [HoldRecord(held_s, bench.robot.now)]


def test_new_words_wait_until_it_is_known_what_the_robot_stands_still_for() -> None:
    """The new ears would not know of the word that the old ones were not sure of."""
    bench, adopted = Bench(Forward(2.0)), list[float]()
    bench.until_driving()
    bench.live(Held(0, 1))
    bench.robot.adopt(bench.robot.phrasebook, bench.robot._recogniser, lambda: adopted.append(bench.robot.now))
    bench.run(1.0)
    bench.live(Released(0, 1))
    bench.recogniser.busy = True
    bench.run(1.0)
    assert not adopted, "nor in the middle of a sentence"
    bench.recogniser.busy = False
    bench.live()
    bench.live()
    assert len(adopted) == 1


def test_watering_takes_its_time_beside_the_hold() -> None:
    ends = []
    for held_s in (0.0, 3.0):
        bench = Bench(Wait(8.0))
        while bench.robot.coordination.state is not State.ACTING:
            assert bench.robot.now < 300.0
            bench.live()
        bench.run(1.0)
        if held_s:
            bench.live(Held(0, 1))
            bench.run(held_s - BLOCK_S)
            bench.live(Released(0, 1))
        while not bench.noted(PerformedRecord):
            assert bench.robot.now < 400.0
            bench.live()
        ends.append(bench.robot.now)
    assert abs(ends[1] - ends[0] - 3.0) < 2 * BLOCK_S


def test_a_hold_while_idle_leaves_no_trace() -> None:
    bench = Bench(Forward(2.0))
    bench.run(0.5)
    bench.live(Held(0, 1))
    bench.run(1.0)
    bench.live(Released(0, 1))
    bench.until_driving()
    assert not bench.noted(HoldRecord)


def test_a_robot_that_speaks_halts_for_what_it_overhears() -> None:
    bench = Bench(Forward(1.0))
    overheard = bench.overheard
    bench.until(lambda: bench.robot.speaking)
    assert not overheard.begun, "before its first sentence came back it does not know when it hears itself"
    bench.until(lambda: overheard.begun)
    assert overheard.begun == [round(bench.robot.now * SAMPLE_RATE_HZ)]
    bench.live()
    assert overheard.played == 2 * BLOCK, "the first block is played over the block after the one that it was begun in"
    bench.robot.disturb()
    assert overheard.disturbed == 1, "what it played with gaps, it may hear"
    overheard.coming = [Urgent(100, 200)]
    bench.live()
    assert bench.stopped
    bench.run(20.0)
    assert any(isinstance(r, SaidRecord) and r.text.endswith("I have stopped") for r in bench.records)
    assert len(overheard.begun) == 1, "stopped, it need not listen over its own voice"


def test_a_stop_that_follows_its_own_is_no_echo_of_it() -> None:
    bench = Bench(Forward(2.0))
    bench.until_driving()
    assert bench.coordination.say(Utterance(None, ToRobot("Bot"), None, Stop()), bench.robot.now) is None
    bench.until(lambda: bench.robot.speaking)
    bench.until(lambda: not bench.robot.speaking)
    assert not bench.stopped
    n = round(bench.robot.now * SAMPLE_RATE_HZ)
    bench.live(Recognised(("stop",), "oak", n, n + BLOCK, 1.0, 20.0, ()))
    assert bench.stopped


def test_who_has_no_words_yet_listens_and_obeys_and_speaks_once_it_has_them() -> None:
    bench = Bench(Forward(1.0))
    bench.robot.is_silent = True
    for _ in range(800):  # 20 s, far more than it waits before it greets
        bench.live()
    assert not [r for r in bench.records if isinstance(r, SaidRecord)]
    bench.live(Urgent(0, 1))
    assert bench.stopped
    bench.robot.is_silent = False
    for _ in range(400):
        bench.live()
    said = [r.text for r in bench.records if isinstance(r, SaidRecord)]
    assert said[0] == "Stop"
    assert any(text.endswith("I have stopped") for text in said)


def test_while_its_stop_button_is_pressed_it_is_released_by_nobody_not_even_for_a_block() -> None:
    bench = Bench(Forward(2.0))
    bench.until_driving()
    bench.robot.is_held_down = True
    bench.live()
    assert bench.wheels == STANDSTILL
    for _ in range(2):
        bench.live(bench.resume())
        assert bench.stopped
        assert bench.noted(SaveStopped)[-1] == SaveStopped(True)
    bench.run(20.0)
    assert bench.wheels == STANDSTILL
    bench.robot.is_held_down = False
    bench.live()
    assert bench.stopped
    bench.live(bench.resume())
    assert not bench.stopped


def test_its_stop_button_stops_a_robot_that_has_no_sound() -> None:
    bench = Bench(Forward(2.0))
    bench.until_driving()
    bench.robot.is_held_down = True
    bench.records += bench.robot.step(np.zeros(0, np.float32), None, BLOCK).records
    assert bench.stopped
    assert bench.noted(SaveStopped)[-1] == SaveStopped(True)


@pytest.mark.parametrize("by_voice", [True, False])
def test_a_resume_that_was_said_before_the_stop_and_is_understood_after_it_releases_nobody(by_voice: bool) -> None:
    """Through an unknown channel a sentence takes seconds; a "stop" meanwhile was undone by it."""
    bench = Bench(Forward(2.0))
    bench.until_driving()
    earlier = bench.resume()
    bench.run(1.0)
    if by_voice:
        n = round(bench.robot.now * SAMPLE_RATE_HZ)
        bench.live(Urgent(n - BLOCK, n))
    else:
        bench.robot.coordination.stop(bench.robot.now)
    bench.run(1.0)
    for _ in range(2):
        bench.live(earlier)
        assert bench.stopped
    bench.live(bench.resume())
    assert not bench.stopped
