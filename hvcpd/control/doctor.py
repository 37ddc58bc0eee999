"""`hvcpctl doctor`: everything that is wrong with this robot, each with its remedy. So far: settings and wheels."""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Iterator
from dataclasses import asdict, dataclass

from hvcpd.config.settings import WheelSettings, load_settings
from hvcpd.errors import EX_FAILURE, EX_OK
from hvcpd.hardware.wheels_bus import MakePort
from hvcpd.hardware.wheels_find import KINDS, examine
from hvcpd.hardware.wheels_port import WaitingPort


@dataclass(frozen=True)
class Diagnosis:
    """One thing that was looked at: what is there, or what is wrong and what to do."""

    subject: str
    ok: bool
    text: str


def run(options: argparse.Namespace) -> int:
    """Look at everything; 0 only if all is well."""
    settings = load_settings(
        options.config, {"wheels.port": options.port, "wheels.driver": options.driver}, name_needed=False
    )
    found = list(look_at_wheels(settings.wheels))
    for diagnosis in found:
        if options.json:
            sys.stdout.write(json.dumps(asdict(diagnosis)) + "\n")
        else:
            sys.stdout.write(f"{'ok   ' if diagnosis.ok else 'WRONG'} {diagnosis.subject}: {diagnosis.text}\n")
    return EX_OK if all(diagnosis.ok for diagnosis in found) else EX_FAILURE


def look_at_wheels(settings: WheelSettings, make_port: MakePort = WaitingPort) -> Iterator[Diagnosis]:
    """The same handshake as at the daemon's start; nothing moves."""
    if settings.driver == "none":
        yield Diagnosis("wheels", True, "none, as wheels.driver says")
        return
    finding = examine(settings, make_port)
    for problem in finding.problems:
        yield Diagnosis("wheels", False, problem)
    if finding.ok and finding.kind is not None:
        yield Diagnosis("wheels", True, f"{KINDS[finding.kind]} at {finding.port}: {', '.join(finding.facts)}")
