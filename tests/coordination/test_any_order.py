"""Anything is said to a robot, and anything happens to it, in any order: it is never stuck, and stands while it is
stopped."""

from __future__ import annotations

import math
import random
from dataclasses import replace

import pytest

from hvcpd.config.shared_places import SharedPlace
from hvcpd.config.tasks import Forward, Place, TaskDefinition
from hvcpd.coordination.actions import BreakOff, Halt, Perform, Role, Say, Talk
from hvcpd.coordination.coordination import Coordination
from hvcpd.coordination.floor import OWN_TURN
from hvcpd.coordination.states import DEPARTING, State
from hvcpd.language import messages as m
from hvcpd.language.phrasebook import Phrasebook, Vocabulary
from tests.coordination.mission import plants

NAMES = ("Rob", "Bot", "Max", "Zoe")
TASKS = plants(5)
PLACE = SharedPlace("corridor", 0.5, 0.5, 1.5, 1.5)
BOOK = Phrasebook(Vocabulary(NAMES, ("plant",), tuple(t.name for t in TASKS), (1, 2, 3, 4, 5), places=("corridor",)))
SENTENCE_S, DRIVE_S = 3.0, 4.0
DRIVES = frozenset({State.GOING, State.ACTING, State.MOVING, State.RETURNING})
SPEAKS_NEXT = frozenset(state for state in State if "waits for the floor" in state.value)
LISTENS = frozenset(state for state in State if "listens" in state.value)


class Life:
    """One robot, with a voice and wheels that take their time, checked after each event."""

    def __init__(self, seed: int) -> None:
        rng = self.rng = random.Random(seed)
        self.now = 0.0
        self.tasks = tuple(self._any_kind(task) for task in TASKS[: rng.randint(1, len(TASKS))])
        gives_orders = rng.random() < 0.2
        role = Role(
            "Rob",
            "plant",
            gives_orders,
            not gives_orders and rng.random() < 0.8,
            nearest_first=rng.random() < 0.5,
            unable=frozenset({1}) if rng.random() < 0.2 else frozenset(),
            roster=NAMES if rng.random() < 0.7 else (),
            talk=rng.choice(list(Talk)),
        )
        self.places = (PLACE,) if rng.random() < 0.3 else ()
        self.robot = Coordination(role, self.tasks, rng, places=self.places)
        self.speaks_until_s = self.drives_until_s = math.inf
        self.busy = self.muted = False
        self.gave_up: set[int] = set()

    def _any_kind(self, task: TaskDefinition) -> TaskDefinition:
        """As it is, or with nothing to do on the way, or for two robots, or on demand."""
        near = replace(task, place=None, actions=(Forward(1.0),)) if self.rng.random() < 0.5 else task
        return replace(near, robots=self.rng.choice((1, 1, 1, 2)), on_demand=self.rng.random() < 0.1)

    def happens(self) -> None:
        """Anything."""
        robot, rng, now = self.robot, self.rng, self.now
        robot.sensed(Place(rng.uniform(-1.0, 3.0), rng.uniform(-1.0, 3.0)))
        match rng.randrange(16):
            case 0 | 1 | 2 | 3 | 4:
                sure, ago_s = rng.choice((1.0, 1.0, 0.8)), rng.choice((0.0, 3.0))
                robot.heard(BOOK.sample(rng), now, sure, began_s=now - ago_s, by_person=rng.random() < 0.2)
            case 5 | 6:
                self.hear_agreement()
            case 7:
                robot.garbled(rng.random() < 0.5, now, rng.random() < 0.3)
            case 8:
                self.busy = not self.busy
                robot.channel(self.busy, now)
            case 9:
                self.muted = not self.muted
                robot.mute(self.muted)
            case 10 if self.drives_until_s < math.inf:
                self.fail()
            case 11:
                rng.choice((robot.stop, robot.resume))(now)
            case 12:
                robot.change(rng.choice(self.tasks).number, rng.random() < 0.5, now)
            case 13:
                robot.retask(rng.sample(self.tasks, rng.randint(1, len(self.tasks))), now, self.places)
            case 14:
                robot.reconfigure(now, replace(robot.role, unable=frozenset(rng.sample(range(1, 6), 2))), forgiven=(1,))
            case 15 if rng.random() < 0.02:
                robot.leave(now)
            case _:
                robot.may_drive((Place(1.0, 1.0), Place(3.0, 1.0)), now)
        self.carry_out()

    def hear_agreement(self) -> None:
        """Somebody confirms, or denies, what the robot said last."""
        me = self.robot.knowledge
        numbers = me.my_tasks() or me.report.tasks
        one, also = (*map(m.TaskByNumber, numbers), None, None)[:2]
        said = self.rng.choice((m.Confirmed(one, False, also), m.Confirmed(), m.Confirmed(one, True), m.Negative()))
        self.robot.heard(m.Utterance(me.current.partner or "Bot", m.ToRobot("Rob"), None, said), self.now)

    def fail(self) -> None:
        self.drives_until_s = math.inf
        if self.robot.task is not None:
            self.gave_up.add(self.robot.task)
        self.robot.perform_failed(self.now)

    def carry_out(self) -> None:
        """What the robot asks for, as a whole robot does it."""
        pending = list(self.robot.actions(self.now))
        while pending:
            match pending.pop(0):
                case Say(utterance):
                    assert self.speaks_until_s == math.inf
                    assert not self.muted
                    self.speaks_until_s = self.now + SENTENCE_S
                    self.check_words(m.own_words(utterance.statement))
                case Perform(_, ()):
                    self.robot.performed(self.now)
                    pending += self.robot.actions(self.now)
                case Perform():
                    self.drives_until_s = self.now + DRIVE_S
                case Halt():
                    self.drives_until_s = math.inf
                case BreakOff() if self.speaks_until_s < math.inf:
                    self.speaks_until_s = math.inf
                    self.robot.spoken(self.now, cut=True)
                    pending += self.robot.actions(self.now)
        self.check()

    def live(self, for_s: float) -> None:
        end_s = self.now + for_s
        while (due_s := min(self.speaks_until_s, self.drives_until_s, self.robot.next_deadline())) < end_s:
            self.now = max(self.now, due_s)
            if self.speaks_until_s <= self.now:
                self.speaks_until_s = math.inf
                self.robot.spoken(self.now)
            elif self.drives_until_s <= self.now:
                self.drives_until_s = math.inf
                self.robot.performed(self.now)
            else:
                self.robot.tick(self.now)
            self.carry_out()
        self.now = end_s

    def check_words(self, said: m.Statement | None) -> None:
        """It tells no failure of what it has done."""
        if isinstance(said, m.Failed):
            alone = self.robot.board[said.task.number].definition.robots == 1
            assert said.task.number in self.gave_up or not alone

    def check(self) -> None:
        """Its state is what its voice and its wheels do, and something will happen next."""
        me, state, drives = self.robot.knowledge, self.robot.state, self.drives_until_s < math.inf
        speaking = me.floor.speaking
        assert (speaking is not None) == (self.speaks_until_s < math.inf)
        assert state in DEPARTING or me.latched == (state is State.STOPPED)
        assert not (drives and me.latched)
        assert not drives or state in DRIVES
        assert drives or state not in DRIVES or (state is State.GOING and me.timer_s < math.inf)
        assert state not in SPEAKS_NEXT or me.floor.wants(OWN_TURN) or (speaking is not None and speaking.trigger)
        assert state not in LISTENS or me.timer_s < math.inf
        if state is State.READY and me.timer_s == math.inf and me.role.volunteer and speaking is None:
            board = self.robot.board
            left = [board[number] for number in (*board.not_done(), *board.hearsay())]
            assert not [e for e in left if not (e.is_shared or me.lacks(e))], "it rests for ever"


@pytest.mark.parametrize("seed", range(60))
def test_it_is_never_stuck(seed: int) -> None:
    life = Life(seed)
    for _ in range(80):
        life.happens()
        life.live(life.rng.choice((0.0, 0.1, 1.0, 10.0, 40.0)))
    life.robot.channel(False, life.now)
    life.robot.mute(False)
    life.muted = False
    life.robot.resume(life.now)
    life.carry_out()
    life.live(3000.0)
