"""`hvcpctl doctor`: everything that is wrong with this robot, each with its remedy."""

from __future__ import annotations

import argparse
from collections import Counter
from collections.abc import Callable, Iterator
from itertools import chain

from hvcpd.config.settings import WheelSettings
from hvcpd.config.settings_file import load_settings
from hvcpd.control.doctor.diagnosis import Machine, fine, note, wrong
from hvcpd.control.doctor.doctor_board import look_at_board
from hvcpd.control.doctor.doctor_machine import look_at_machine
from hvcpd.control.doctor.doctor_sound import look_at_sound
from hvcpd.control.live.daemon_client import running_robot
from hvcpd.control.output import show
from hvcpd.control.simulate.team import Team, load_team
from hvcpd.daemon.devices import Devices
from hvcpd.daemon.preflight import Finding
from hvcpd.errors import EX_FAILURE, EX_OK
from hvcpd.hardware.wheels_bus import MakePort
from hvcpd.hardware.wheels_find import KINDS, examine
from hvcpd.hardware.wheels_port import WaitingPort
from hvcpd.reporting.text import plural

_SIGNS = {"ok": "ok   ", "note": "note ", "wrong": "WRONG"}


def run(
    options: argparse.Namespace,
    devices: Devices | None = None,
    machine: Machine | None = None,
    make_port: MakePort = WaitingPort,
) -> int:
    """Check everything, or the given subjects; returns 0 only if nothing is wrong."""
    where, computer = devices or Devices(), machine or Machine()
    subjects: dict[str, Callable[[Team], Iterator[Finding]]] = {
        "machine": lambda team: chain(look_at_board(computer), look_at_machine(team, computer)),
        "sound": lambda team: look_at_sound(team, where, aloud=not options.silent),
    }
    found: list[Finding] = []
    if options.only != "machine":
        found += _shown(look_for_daemon(options), options.json)
    if options.only in (None, "machine", "sound"):
        team = load_team(options)
        for subject, look in subjects.items():
            if options.only in (None, subject):
                found += _shown(look(team), options.json)
    if options.only in (None, "wheels"):
        overrides = {"wheels.port": options.port, "wheels.driver": options.driver}
        wheels = load_settings(options.config, overrides, name_needed=False).wheels
        found += _shown(look_at_wheels(wheels, make_port), options.json)
    list(_shown([_verdict(found)], options.json))
    return EX_OK if all(finding.ok for finding in found) else EX_FAILURE


def look_for_daemon(options: argparse.Namespace) -> Iterator[Finding]:
    """Whether the robot runs now, so that others of these checks do not tell what they seem to."""
    name = running_robot(load_settings(options.config, name_needed=False).name, options)
    if name is not None:
        yield note("hvcpd", f"{name} runs now, and uses the card and the port: end it, and check again")


def look_at_wheels(settings: WheelSettings, make_port: MakePort = WaitingPort) -> Iterator[Finding]:
    """Make the handshake of the daemon's start; nothing moves."""
    if settings.driver == "none":
        yield fine("wheels", "none, as wheels.driver says")
        return
    if settings.driver == "ros":
        yield fine("wheels", "ROS has them, as wheels.driver says; see `hvcpctl status` while `hvcpctl ros` runs")
        return
    if not settings.on_serial_port:
        yield note("wheels", f"driver {settings.driver}: only `hvcpctl drive status` checks it")
        return
    finding = examine(settings, make_port)
    for problem in finding.problems:
        yield wrong("wheels", problem)
    if finding.ok and finding.kind is not None:
        yield fine("wheels", f"{KINDS[finding.kind]} at {finding.port}: {', '.join(finding.facts)}")


def _verdict(found: list[Finding]) -> Finding:
    counts = Counter(finding.grade for finding in found)
    notes = f"; {counts['note']} to note" if counts["note"] else ""
    checks = plural(len(found), "check")
    if counts["wrong"]:
        remedies = "remedy is" if counts["wrong"] == 1 else "remedies are"
        return wrong("verdict", f"{counts['wrong']} of {checks} failed; the {remedies} above{notes}")
    return fine("verdict", f"{'all ' * (len(found) > 1)}{checks} passed{notes}")


def _shown(findings: Iterator[Finding] | list[Finding], as_json: bool) -> Iterator[Finding]:
    """Write each finding as soon as it is known, because the checks take a while."""
    for finding in findings:
        fields = {"subject": finding.subject, "grade": finding.grade, "ok": finding.ok, "text": finding.text}
        show(as_json, {**fields, **finding.figures}, f"{_SIGNS[finding.grade]} {finding.subject}: {finding.text}")
        yield finding
