"""Whole missions at the level of words: real state machines, air of words, driving as a delay, faults as scheduled.

It keeps the score from outside: which robot truly did each task, how often, and the robots' beliefs at the end.
"""

from __future__ import annotations

import math
import random
from collections import Counter, defaultdict
from collections.abc import Callable
from dataclasses import replace
from functools import partial

from hil_fakes.word_body import Body, takes_s
from hil_fakes.word_channel import WordChannel
from hil_fakes.word_lengths import n_words, names_in
from hil_fakes.word_mishearing import misheard
from hil_fakes.word_occurrences import counted, times
from hil_fakes.word_seals import WordSeals as WordSeals
from hil_fakes.word_setup import Outage as Outage
from hil_fakes.word_setup import WordPlan as WordPlan
from hil_fakes.word_setup import WordResult as WordResult
from hvcpd.config.tasks import Action, GoTo, Place
from hvcpd.coordination.actions import (
    SECOND_PAUSE_S,
    SLOW_STRETCH,
    BreakOff,
    Halt,
    Perform,
    Role,
    SaveChange,
    SaveDue,
    SaveStopped,
    SaveTask,
    Say,
    Talk,
)
from hvcpd.coordination.coordination import Coordination
from hvcpd.coordination.states import State
from hvcpd.language import messages as m

STEP_S = 5.0
"""Interval at which the mission checks whether all is done."""


class WordMission:
    """Runs one mission; `said` keeps the conversation if `keep` is set (for tests and tables)."""

    def __init__(self, plan: WordPlan, keep: bool = False) -> None:
        self.plan = plan
        self.keep = keep
        self.robots: dict[str, Coordination] = {}
        self.saved: dict[str, dict[int, tuple[str, str | None]]] = {name: {} for name in plan.names}
        self.stopped: set[str] = set()
        """The robots that have saved that they are stopped."""
        self.watered: Counter[int] = Counter()
        self.by: dict[int, str] = {}
        self.done: list[tuple[float, int, str]] = []
        """The tasks carried out, with time and robot."""
        self.dues: dict[str, dict[int, float]] = {name: {} for name in plan.names}
        self.changes: dict[str, dict[int, tuple[int, bool]]] = {name: {} for name in plan.names}
        self.said: list[tuple[float, str, m.Utterance]] = []
        self.off_in_mid_task = False
        self.halted_s: dict[str, float] = {}
        self._level_db: defaultdict[str, float] = defaultdict(float)
        """The level of each speaker's last sentence, relative to the usual one."""
        self._rng = random.Random(plan.seed)
        self._pending = 0
        self._names = {name.lower(): name for name in plan.names}
        self.known: dict[str, set[str]] = {name: {name} for name in plan.names}
        """The names that each robot knows; they survive being switched off."""
        corner = {name: Place(-5.0 + i % 4, -5.0 + i // 4) for i, name in enumerate(plan.names)}
        self.bodies = {name: Body(plan.starts.get(name, place)) for name, place in corner.items()}
        self.air = WordChannel(
            self.robots,
            n_words,
            plan.conditions,
            self._rng.getrandbits(32),
            touched=self._collect,
            earshot=self._in_earshot,
            fading=None if plan.clear_m is None else self._fading,
            mishear=partial(misheard, plan.names, [task.number for task in plan.tasks]),
            follows=self._follows,
        )
        if plan.seals is not None:
            seals = plan.seals
            self.air.judge = lambda listener, utterance: seals.judge(listener, utterance, self.air.now)
        for name in plan.names:
            on_s = plan.late.get(name, 0.0)
            self.at(on_s, partial(self.switch_on, name)) if on_s else self.switch_on(name)
        for name, at_s in plan.leaving.items():
            self.at(at_s, partial(self.leave, name))
        for outage in plan.outages:
            self.at(outage.at_s, partial(self.fail, outage))

    def remember_done(self, wall_s: float) -> None:
        """Switch all robots on again; recurring tasks count as done for their last occurrence before `wall_s`."""
        recurring = {task.number: task.every for task in self.plan.tasks if task.every is not None}
        for name in self.plan.names:
            self.saved[name] |= dict.fromkeys(recurring, ("done", None))
            lasts = {number: every.last(wall_s - 1.0) for number, every in recurring.items()}
            self.dues[name] |= {number: due_s for number, due_s in lasts.items() if due_s is not None}
        for name in tuple(self.robots):
            self.switch_on(name)

    def run(self) -> WordResult:
        """To the end: every robot that is on holds all for done, and nothing more will happen to any."""
        air, plan = self.air, self.plan
        if plan.clocks is not None:  # with tasks that recur, all is never done
            air.run_until(plan.limit_s)
            return self.result(math.inf)
        ended_s = math.inf
        while air.now < plan.limit_s:
            air.run_until(air.now + STEP_S)
            if not self._pending and self.robots and self._all_done():
                ended_s = air.now
                air.run_until(air.now + plan.settle_s)
                break
        return self.result(ended_s)

    def go_on(self, until_s: float) -> None:
        """Run until that time; what was done to robots directly takes effect first."""
        self.air.refresh()
        self.air.run_until(until_s)

    def run_until(self, is_so: Callable[[], object], step_s: float = 0.1, limit_s: float = 3600.0) -> None:
        """Run in steps until it is so. Raises TimeoutError if it is not by `limit_s`."""
        while not is_so():
            if self.air.now >= limit_s:
                raise TimeoutError(f"not so by {limit_s:.0f} s")
            self.air.run_until(self.air.now + step_s)

    def until(self, name: str, state: State, step_s: float = 0.1, limit_s: float = 3600.0) -> None:
        """Run until a robot is in that state."""
        self.run_until(lambda: self.robots[name].state is state, step_s, limit_s)

    def _all_done(self) -> bool:
        return all(r.board.all_done for r in self.robots.values())

    def result(self, ended_s: float) -> WordResult:
        counts = [times(task, self.watered[task.number]) for task in self.plan.tasks if not task.on_demand]
        return WordResult(
            lost=sum(n == 0 for n in counts),
            duplicates=sum(max(n - 1, 0) for n in counts),
            agreed=self._all_done(),
            off_in_mid_task=self.off_in_mid_task,
            ended_s=ended_s,
            sent=self.air.sent,
            collisions=self.air.collisions,
            airtime_s=self.air.airtime_s,
            misheard=self.air.misheard,
            missed=sum(n == 0 for n in self.occurrences().values()),
            repeated=sum(max(n - 1, 0) for n in self.occurrences().values()),
        )

    def occurrences(self) -> dict[tuple[int, float], int]:
        """The number of times that each occurrence was carried out."""
        if self.plan.clocks is None:
            return {}
        return counted(self.plan.tasks, self.done, self.plan.limit_s, self.plan.begin_s)

    def tell(self, at_s: float, speaker: str, utterance: m.Utterance, times: int = 1) -> None:
        """Have a speaker that is not one of our robots say a sentence at that time, `times` times."""
        self.at(at_s, lambda: self.speak(speaker, utterance, times=times))

    def speak(self, speaker: str, utterance: m.Utterance, slowly: bool = False, times: int = 1) -> None:
        """Have anybody say something now; robots do it here, too. A subclass may note it."""
        if self.keep:
            self.said.append((self.air.now, speaker, utterance))
        self.air.say(speaker, utterance, SLOW_STRETCH if slowly else 1.0, times, SECOND_PAUSE_S)

    def at(self, at_s: float, what: Callable[[], object]) -> None:
        """Call `what` at that time; the mission lasts at least until then."""
        self._pending += 1

        def do() -> None:
            self._pending -= 1
            what()

        self.air.at(at_s, do)

    def switch_on(self, name: str) -> None:
        """Switch a robot on, with its saved memory from before."""
        plan = self.plan
        encrypts = plan.seals is not None and plan.seals.encrypts
        role = Role(
            name,
            plan.team,
            name == plan.coordinator,
            plan.coordinator is None,
            plan.nearest_first,
            plan.unable.get(name, frozenset()),
            listed=not plan.strangers,
            roster=() if plan.strangers else plan.names,
            speech=replace(plan.speech, sealed=plan.seals is not None, encrypted=encrypts),
            talk=plan.talks.get(name, Talk.NORMAL),
            softly_db=plan.softly_db,
        )
        if plan.seals is not None:
            plan.seals.switch_on(name, role.roster)
        self.robots[name] = Coordination(
            role,
            plan.tasks,
            random.Random(self._rng.getrandbits(32)),
            plan.timing,
            remembered=self.saved[name],
            now=self.air.now,
            stopped=name in self.stopped,
            home=self.bodies[name].place,
            dues=self.dues[name],
            changes=self.changes[name],
            places=plan.places,
        )
        if plan.clocks is not None and name in plan.clocks:
            self.robots[name].set_clock(plan.begin_s + plan.clocks[name], self.air.now)
        self.air.refresh()

    def fail(self, outage: Outage) -> None:
        """Switch a robot off now, without a word, and on again later."""
        robot = self.robots.get(outage.name)
        if robot is None:
            return
        self.off_in_mid_task |= robot.task is not None or robot.knowledge.report.task is not None
        self._switch_off(outage.name)
        if outage.back_s is not None:
            self.at(self.air.now + outage.back_s, lambda: self.switch_on(outage.name))

    def leave(self, name: str) -> None:
        """Tell a robot to end: it is switched off once it has said so."""
        if name in self.robots:
            self.robots[name].leave(self.air.now)
            self.air.refresh((name,))

    def _switch_off(self, name: str) -> None:
        self.bodies[name].halt(self.air.now)
        del self.robots[name]
        self.air.switch_off(name)

    def _collect(self, name: str) -> None:
        robot = self.robots[name]
        robot.sensed(here=self.bodies[name].at(self.air.now))
        for action in robot.actions(self.air.now):
            match action:
                case Say(utterance, slowly, times, level_db):
                    self._level_db[name] = level_db
                    if self.plan.seals is not None:
                        utterance = self.plan.seals.marked(name, utterance, self.air.now)
                    self.speak(name, utterance, slowly, times)
                case Perform(task, actions):
                    self.perform(name, task, actions)
                case Halt():
                    self.bodies[name].halt(self.air.now)
                    self.halted_s[name] = self.air.now
                case BreakOff():
                    self.air.break_off(name)
                case SaveTask(number, state, owner):
                    self.saved[name][number] = (state, owner)
                case SaveDue(number, due_s):
                    self.dues[name][number] = due_s
                case SaveChange(number, count, skipped):
                    self.changes[name][number] = (count, skipped)
                case SaveStopped(stopped):
                    (self.stopped.add if stopped else self.stopped.discard)(name)
                case _:
                    pass
        if robot.has_left:
            self.air.at(self.air.now, lambda: self._switch_off(name) if self.robots.get(name) is robot else None)

    def perform(self, name: str, task: int, actions: tuple[Action, ...]) -> None:
        """Have a robot carry out the actions of a task, 0 for a motion, from now on. A subclass may do otherwise."""
        body, now = self.bodies[name], self.air.now
        body.halt(now)
        job = body.job
        robot = self.robots[name]
        acts = robot.at_place
        length_s = 0.0
        for action in actions:
            action_s = takes_s(action, body.place)
            if isinstance(action, GoTo):
                body.moving = (now + length_s, now + length_s + action_s, action.place)
            length_s += action_s

        def finish() -> None:
            if body.job == job and self.robots.get(name) is robot:
                body.halt(self.air.now)
                self.carried_out(name, task, acts)

        self.air.at(now + length_s, finish)

    def carried_out(self, name: str, task: int, acts: bool) -> None:
        """A robot has carried out its actions; `acts`: those were the task itself, and not the way there."""
        robot, now = self.robots[name], self.air.now
        robot.sensed(here=self.bodies[name].place)
        if acts and self.plan.fails(name, task, now):
            robot.perform_failed(now, self.plan.reason)
        else:
            if acts:
                self.watered[task] += 1
                self.by[task] = name
                self.done.append((now, task, name))
            robot.performed(now)
        self.air.refresh((name,))

    def _in_earshot(self, speaker: str, listener: str) -> bool:
        if self.plan.earshot_m is None:
            return True
        carried: float = 10.0 ** (self._level_db[speaker] / 20.0)
        return self._apart_m(speaker, listener) <= carried * self.plan.earshot_m

    def _fading(self, speaker: str, listener: str) -> float:
        """The loss by distance alone: none up to `clear_m`, all at `earshot_m`, and evenly more between."""
        near_m, far_m = self.plan.clear_m or 0.0, self.plan.earshot_m or math.inf
        return min(max((self._apart_m(speaker, listener) - near_m) / (far_m - near_m), 0.0), 1.0)

    def _apart_m(self, speaker: str, listener: str) -> float:
        """The distance between two robots; a speaker that is not a robot is everywhere."""
        if speaker not in self.bodies:
            return 0.0
        return self.bodies[speaker].at(self.air.now).distance_m(self.bodies[listener].at(self.air.now))

    def _follows(self, listener: str, u: m.Utterance) -> bool:
        """Whether the sentence has only names that the listener knows; it learns one that is spelled."""
        if not self.plan.strangers:
            return True
        known = self.known[listener]
        if isinstance(u.statement, m.Spelled) and u.speaker is not None:
            known.add(u.speaker)
        return names_in(u) <= known
