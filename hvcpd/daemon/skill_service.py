"""Skills over the control socket: the clients that offer them, and the messages of a call.

All of it in the event loop, and nothing in it waits: an order is a line that is written, a report a line that came.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from typing import Any

import structlog

from hvcpd.config.skills import MAX_TEXT_LENGTH, Value
from hvcpd.config.tasks import TENDING, TaskRepository
from hvcpd.daemon.control_protocol import NUMBER, RefusalError, line_of
from hvcpd.daemon.control_server import Client
from hvcpd.errors import did_you_mean
from hvcpd.reporting.text import clean
from hvcpd.robot.records import SkillRecord
from hvcpd.robot.robot import Robot
from hvcpd.skills.life import MAX_RESULTS, NOBODY, OVER, Begin, Call, Order, Report, SkillState

BEAT_S = 0.1
"""Interval (sample clock) of the beats by which the client of a call knows that the robot lives: silence stops a pump
as it stops the wheels, after BEATS_MISSED_S in `hvcpd.skills.host`."""

OFFER: dict[str, tuple[type, ...]] = {"skills": (list,)}
PROGRESS: dict[str, tuple[type, ...]] = {"call": (int,), "state": (str,), "share": NUMBER, "text": (str,)}
DONE: dict[str, tuple[type, ...]] = {"call": (int,), "text": (str,), "results": (dict,)}
FAILED: dict[str, tuple[type, ...]] = {"call": (int,), "reason": (str,)}
"""The arguments of the commands."""

_STATES = {"initializing": SkillState.INITIALIZING, "running": SkillState.RUNNING}

_log = structlog.get_logger(__name__)


@dataclass
class _Use:
    """A call under way, the client that carries it out, and its progress."""

    last: SkillRecord
    client: Client


class SkillService:
    """Passes calls between the robot and the clients that offer skills; `changed` is called when the offer changes."""

    def __init__(self, tasks: Callable[[], TaskRepository], changed: Callable[[], None] = lambda: None) -> None:
        self._tasks = tasks
        self._changed = changed
        self._offers: dict[str, Client] = {}
        self._use: _Use | None = None
        self._robot: Robot | None = None
        self._beaten_s = -math.inf

    @property
    def offered(self) -> frozenset[str]:
        """The skills that clients offer now."""
        return frozenset(self._offers)

    @property
    def under_way(self) -> SkillRecord | None:
        """The call under way, and its last report."""
        return self._use.last if self._use is not None else None

    def begin(self, robot: Robot) -> None:
        """Begin: the robot is ready."""
        self._robot = robot
        robot.performer.offer(self.offered)

    def offer(self, client: Client, names: Iterable[object]) -> dict[str, Any]:
        """A client offers these skills from now on, and no others; it replaces clients that offered them before."""
        known = [*(skill.name for skill in self._tasks().skills), *TENDING]
        skills = []
        for name in names:
            if not isinstance(name, str) or name not in known:
                hint = did_you_mean(str(name)[:40], known)
                raise RefusalError("bad_argument", f"skills: the task file declares no {str(name)[:40]!r}; {hint}")
            skills.append(name)
        self._offers = {name: each for name, each in self._offers.items() if each is not client}
        self._offers |= dict.fromkeys(skills, client)
        self._tell_offers()
        return {"skills": sorted(set(skills))}

    def gone(self, client: Client) -> None:
        """A client has disconnected: its skills are no longer offered, and its call has failed."""
        if client in self._offers.values():
            self._offers = {name: each for name, each in self._offers.items() if each is not client}
            self._tell_offers()
        if self._use is not None and self._use.client is client:
            self._tell_robot(Report(self._use.last.call.number, SkillState.FAILED, text=NOBODY))

    def take(self, orders: Iterable[Order], now: float) -> None:
        """Pass on the robot's requests, at time `now` (s, sample clock)."""
        for order in orders:
            if isinstance(order, Begin):
                self._begin(order.call, now)
            elif self._use is not None and self._use.last.call.number == order.number:
                kind = type(order).__name__.lower()
                self._use.client.send(line_of({"event": kind, "call": order.number}))
                if kind == "cancel":
                    self._use = None
        if self._use is not None and now - self._beaten_s >= BEAT_S:
            self._beaten_s = now
            self._use.client.send(line_of({"event": "beat"}))

    def halt(self) -> None:
        """Cancel the call under way at once, without waiting for the next block of sound."""
        if self._use is not None:
            self._use.client.send(line_of({"event": "cancel", "call": self._use.last.call.number}))

    def note(self, record: SkillRecord) -> None:
        """The robot's state of a call."""
        if self._use is not None and self._use.last.call.number == record.call.number:
            self._use.last = record
            if record.report.state in OVER:
                self._use = None

    def progress(self, client: Client, arguments: dict[str, Any]) -> None:
        """A client reports the progress of a call."""
        state = arguments.get("state", "running")
        if state not in _STATES:
            raise RefusalError(
                "bad_argument", f"state: there is no {state[:40]!r}; {did_you_mean(state[:40], _STATES)}"
            )
        share = arguments.get("share")
        if share is not None and not 0.0 <= share <= 1.0:
            raise RefusalError("bad_argument", "share: give a number from 0 to 1")
        self._tell(client, arguments, Report(0, _STATES[state], share, _text(arguments, "text")))

    def done(self, client: Client, arguments: dict[str, Any]) -> None:
        """A client reports that a call has succeeded."""
        results = _results(arguments.get("results", {}))
        self._tell(client, arguments, Report(0, SkillState.FINISHED, 1.0, _text(arguments, "text"), results))

    def failed(self, client: Client, arguments: dict[str, Any]) -> None:
        """A client reports that a call has failed."""
        self._tell(client, arguments, Report(0, SkillState.FAILED, text=_text(arguments, "reason") or "it failed"))

    def _begin(self, call: Call, now: float) -> None:
        client = self._offers.get(call.skill)
        if client is None:
            self._tell_robot(Report(call.number, SkillState.FAILED, text="nobody offers it"))
            return
        self._use = _Use(SkillRecord(now, call, Report(call.number, SkillState.WAITING)), client)
        fields = {"call": call.number, "task": call.task, "skill": call.skill, "arguments": dict(call.arguments)}
        client.send(line_of({"event": "perform", **fields, "limit_s": call.limit_s}))

    def _tell(self, client: Client, arguments: dict[str, Any], report: Report) -> None:
        number, use = arguments.get("call"), self._use
        if use is None or use.last.call.number != number or use.client is not client:
            raise RefusalError("refused", f"call {number} is not under way, or not yours")
        self._tell_robot(replace(report, number=number))

    def _tell_robot(self, report: Report) -> None:
        if self._robot is not None:
            self._robot.performer.tell(report)

    def _tell_offers(self) -> None:
        _log.info("skills offered", skills=", ".join(sorted(self._offers)) or "none")
        if self._robot is not None:
            self._robot.performer.offer(self.offered)
        self._changed()


def _text(arguments: dict[str, Any], name: str) -> str:
    return clean(str(arguments.get(name, ""))[:MAX_TEXT_LENGTH])


def _results(found: dict[str, Any]) -> tuple[tuple[str, Value], ...]:
    if len(found) > MAX_RESULTS:
        raise RefusalError("bad_argument", f"results: at most {MAX_RESULTS}")
    results: list[tuple[str, Value]] = []
    for name, value in found.items():
        if isinstance(value, str):
            results.append((clean(name[:40]), clean(value[:MAX_TEXT_LENGTH])))
        elif type(value) in NUMBER and abs(value) <= sys.float_info.max:
            results.append((clean(name[:40]), float(value)))
        else:
            raise RefusalError("bad_argument", f"results: {name[:40]}: expected a number or text")
    return tuple(results)
