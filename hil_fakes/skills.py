"""Fake skills in virtual time: pumps and tanks, grippers, and whatever takes its time. They answer as a host does.

A device is asked for the state of a call at every block; its finished work stays done, as in the world.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import Protocol

from hvcpd.config.skill_settings import JointSettings, SkillSettings
from hvcpd.config.skills import Value
from hvcpd.config.tasks import TENDING, TaskRepository
from hvcpd.skills.joints import BLOCKED
from hvcpd.skills.life import Begin, Call, Cancel, Order, Pause, Report, Resume, SkillState

Arguments = Mapping[str, Value]

USUAL_S = 5.0
"""The duration of a skill of which nothing is known."""
LITRES_PER_S = 0.05
"""Of a small pump: 3 l a minute."""
TOLD_EVERY_S = 1.0
"""Between two progress reports of a fake."""
EMPTY = "the tank is empty"


class FakeDevice(Protocol):
    """Carries out one call after another."""

    def begin(self, arguments: Arguments) -> None:
        """A call is to be carried out."""

    def advance(self, dt_s: float) -> Report:
        """Its state after another `dt_s`; the report's number is ignored."""

    def leave(self) -> None:
        """Be safe: whatever is on is off."""


@dataclass
class FakeTimed:
    """Takes USUAL_S and is done."""

    done_s: float = 0.0

    def begin(self, arguments: Arguments) -> None:  # noqa: ARG002 - it takes as long with any arguments
        self.done_s = 0.0

    def advance(self, dt_s: float) -> Report:
        self.done_s += dt_s
        if self.done_s < USUAL_S:
            return Report(0, SkillState.RUNNING, self.done_s / USUAL_S)
        return Report(0, SkillState.FINISHED, 1.0)

    def leave(self) -> None:
        """Nothing is on."""


@dataclass
class Tank:
    """Water on a robot's back."""

    litres: float

    @property
    def is_empty(self) -> bool:
        return self.litres <= 1e-9


@dataclass
class Pump:
    """Moves water out of a tank while it is on."""

    tank: Tank
    litres_per_s: float = LITRES_PER_S
    poured: float = 0.0
    """Litres poured until now."""

    def run(self, on_s: float) -> None:
        """It was on for this time."""
        litres = min(self.litres_per_s * on_s, self.tank.litres)
        self.tank.litres -= litres
        self.poured += litres


@dataclass
class FakePump:
    """A pump on a pin: on for a call's `amount`, litres or seconds. One with a float fails when the tank is empty; one
    without runs dry."""

    pump: Pump
    amount: str = "seconds"
    per_s: float = 1.0
    has_float: bool = True
    is_on: bool = False
    _begun: float = 0.0
    _needed_s: float = 0.0
    _done_s: float = 0.0

    def begin(self, arguments: Arguments) -> None:
        self._needed_s = float(arguments[self.amount]) / self.per_s
        self._begun, self._done_s, self.is_on = self.pump.poured, 0.0, True

    def advance(self, dt_s: float) -> Report:
        on_s = min(dt_s, self._needed_s - self._done_s)
        self.pump.run(on_s)
        self._done_s += on_s
        is_over = self._done_s >= self._needed_s - 1e-9
        is_dry = self.has_float and self.pump.tank.is_empty and not is_over
        self.is_on = not (is_over or is_dry)
        state = SkillState.FINISHED if is_over else SkillState.FAILED if is_dry else SkillState.RUNNING
        results: tuple[tuple[str, Value], ...] = (("litres", round(self.pump.poured - self._begun, 3)),)
        return Report(0, state, min(self._done_s / self._needed_s, 1.0), EMPTY if is_dry else "", results)

    def leave(self) -> None:
        self.is_on = False


@dataclass
class FakeGripper:
    """A joint that turns to an angle, and does not get past a thing at `thing_deg`, if there is one."""

    settings: JointSettings
    thing_deg: float = math.inf
    angle_deg: float = 0.0
    _goal_deg: float = 0.0

    def begin(self, arguments: Arguments) -> None:
        self._goal_deg = float(arguments[self.settings.angle])

    def advance(self, dt_s: float) -> Report:
        step_deg = self.settings.speed_deg_s * dt_s
        wanted_deg = self.angle_deg + max(-step_deg, min(step_deg, self._goal_deg - self.angle_deg))
        meets = wanted_deg > self.thing_deg
        self.angle_deg = min(wanted_deg, self.thing_deg)
        load = self.settings.effort if meets else 0.0
        results: tuple[tuple[str, Value], ...] = ((self.settings.angle, round(self.angle_deg, 1)), ("load", load))
        if meets and self.settings.blocked == "failed":
            return Report(0, SkillState.FAILED, text=BLOCKED, results=results)
        if meets or abs(self._goal_deg - self.angle_deg) < 1e-9:
            return Report(0, SkillState.FINISHED, 1.0, results=results)
        return Report(0, SkillState.RUNNING, results=results)

    def leave(self) -> None:
        """It holds its position, with its remaining torque."""


@dataclass(frozen=True)
class Switch:
    """Something that a call of a task uses was switched on or off at `at_s`, by the robot's clock."""

    at_s: float
    task: int
    skill: str
    on: bool


@dataclass
class FakeHost:
    """All of one robot's devices, by the skills that they are for; at most one call is under way."""

    devices: Mapping[str, FakeDevice] = field(default_factory=dict)
    _call: Call | None = None
    _device: FakeDevice | None = None
    _held: bool = False
    _last_s: float = 0.0
    _told_s: float = 0.0
    _on: Switch | None = None
    _switches: list[Switch] = field(default_factory=list)

    def take_switches(self) -> tuple[Switch, ...]:
        """The switches since the last call."""
        switches, self._switches = tuple(self._switches), []
        return switches

    def take(self, orders: Iterable[Order], now: float) -> None:
        """The robot's requests at time `now`, s."""
        for order in orders:
            match order:
                case Begin(call):
                    self._call, self._device, self._held = call, self.devices[call.skill], False
                    self._last_s, self._told_s = now, -TOLD_EVERY_S
                    self._device.begin(dict(call.arguments))
                case Cancel():
                    self._leave()
                case Pause() | Resume():
                    self._held = isinstance(order, Pause)
                    if self._held and self._device is not None:
                        self._device.leave()
            self._note(now)

    def live(self, now: float, tell: Callable[[Report], None]) -> None:
        """Let time pass until `now`, and report all changes."""
        dt_s, self._last_s = now - self._last_s, now
        call, device = self._call, self._device
        if call is None or device is None or self._held:
            return
        report = replace(device.advance(dt_s), number=call.number)
        self._note(now)
        if report.state is not SkillState.RUNNING:
            self._leave()
        elif now - self._told_s < TOLD_EVERY_S:
            return
        self._told_s = now
        tell(report)

    def _note(self, now: float) -> None:
        on = isinstance(self._device, FakePump) and self._device.is_on
        if self._call is not None and on and self._on is None:
            self._on = Switch(now, self._call.task, self._call.skill, True)
            self._switches.append(self._on)
        elif self._on is not None and not on:
            self._switches.append(replace(self._on, at_s=now, on=False))
            self._on = None

    def _leave(self) -> None:
        if self._device is not None:
            self._device.leave()
        self._call = self._device = None


def usual_devices(
    tasks: TaskRepository, skills: Mapping[str, SkillSettings], litres: float | None = None
) -> dict[str, FakeDevice]:
    """Something for each skill that a task file declares, as one robot's settings have it: a pump for a pin, a gripper
    for a joint, and for what nothing is known of something that takes its time. `litres` are in the tank; None: it has
    no pump that is not in the settings, and a tank that never runs empty."""
    tank = Tank(litres if litres is not None else math.inf)
    devices: dict[str, FakeDevice] = {skill.name: FakeTimed() for skill in tasks.skills}
    if litres is not None:
        devices |= {name: FakePump(Pump(tank)) for name in TENDING}
    for name, skill in skills.items():
        if skill.gpio is not None:
            amount, per_s = skill.gpio.amount, skill.gpio.per_s
            pump = Pump(tank, per_s if amount == "litres" else LITRES_PER_S)
            devices[name] = FakePump(pump, amount, per_s, skill.gpio.empty_pin is not None)
        elif skill.joint is not None:
            grips = skill.joint.blocked == "done"
            devices[name] = FakeGripper(skill.joint, skill.joint.most_deg / 2.0 if grips else math.inf)
    return devices
