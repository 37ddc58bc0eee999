"""The doctor's checks of the computer: permissions, clock, disk, processor, service."""

from __future__ import annotations

import os
import shutil
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np

import hvcpd
from hvcpd.assembly.make import make_speech_recogniser
from hvcpd.control.bench.bench import MOST_LOAD
from hvcpd.control.doctor.diagnosis import Machine, fine, note, wrong
from hvcpd.control.simulate.team import Team
from hvcpd.daemon.preflight import Finding, find_memory, nearest_there
from hvcpd.hardware.groups import group_of
from hvcpd.hardware.temperature import processor_temperature_c
from hvcpd.language.messages import Free, Utterance
from hvcpd.ports import SAMPLE_RATE_HZ
from hvcpd.reporting.text import plural

GROUPS = {"audio": "snd/*", "dialout": "tty[AU][CS][MB][0-9]*"}
"""Groups that may use each kind of device on Debian, Ubuntu and Raspberry Pi OS."""
LEAST_FREE_BYTES, FEW_FREE_BYTES = 60e6, 200e6
"""Least free space: the rendered words of a team take about 40 MB, a day's transcript less than one."""
HIGH_LOAD = 0.5 * MOST_LOAD
"""Share of one core that decoding speech takes from which there is little headroom."""
HOT_C = 80.0
"""A Raspberry Pi lowers its clock from 80 °C (documentation, "Frequency management and thermal control")."""
BENCHMARK_SENTENCES = 4
NOISE_RMS = 0.001
"""-60 dBFS beneath the benchmark's sentences, as a quiet room's."""


def look_at_machine(team: Team, machine: Machine) -> Iterator[Finding]:
    """All checks but those of sound and wheels."""
    yield from _look_at_permissions(machine)
    yield _look_at_clock(machine)
    yield from _look_at_disk(team.settings.state_dir)
    yield _look_at_processor(team, machine)
    yield from _look_at_heat(machine)
    yield look_at_service(machine)


def _look_at_permissions(machine: Machine) -> Iterator[Finding]:
    for group, pattern in GROUPS.items():
        there = sorted(path for path in machine.devices.glob(pattern) if not path.is_dir())
        denied = [path for path in there if not machine.may(path, os.R_OK | os.W_OK)]
        if denied:
            remedy = f"`sudo usermod -aG {group_of(denied[0], group)} $USER`, then log in again"
            yield wrong("permissions", f"no permission to use {', '.join(map(str, denied))}: {remedy}")
        elif there:
            yield fine("permissions", f"{plural(len(there), 'device')} of the group {group} may be used")


def _look_at_clock(machine: Machine) -> Finding:
    installed_s = Path(hvcpd.__file__).stat().st_mtime
    now_s = machine.wall_s()
    told = time.strftime("%Y-%m-%d %H:%M", time.localtime(now_s))
    if now_s < installed_s:
        return note(
            "clock",
            f"it says {told}, before hvcpd was installed: times of the transcript, tasks that recur, quiet hours and "
            "codes of a telephone will be wrong; `sudo date -s '…'`, fit a battery-backed one, or set `clock: false`",
        )
    return fine("clock", told)


def _look_at_disk(state_dir: Path) -> Iterator[Finding]:
    yield find_memory(state_dir)
    nearest = nearest_there(state_dir)
    free = shutil.disk_usage(nearest).free
    text, figures = f"{free / 1e6:.0f} MB free at {nearest}", {"free_mb": round(free / 1e6)}
    if free < LEAST_FREE_BYTES:
        yield wrong("disk", f"{text}: delete something, `sudo journalctl --vacuum-size=50M` for a start", **figures)
    elif free < FEW_FREE_BYTES:
        yield note("disk", f"{text}: that is little", **figures)
    else:
        yield fine("disk", text, **figures)


def _look_at_processor(team: Team, machine: Machine) -> Finding:
    """The recogniser on some sentences of a peer, timed against their length."""
    listener = team.settings.name
    peer = next((name for name in team.names if name.lower() != listener.lower()), listener)
    said = team.sound.speaker_of(peer).render(team.phrasebook.phrases(Utterance(peer, statement=Free())))
    sound = np.tile(np.concatenate([said, np.zeros(SAMPLE_RATE_HZ // 2, np.float32)]), BENCHMARK_SENTENCES)
    noise = NOISE_RMS * np.random.default_rng(1).standard_normal(len(sound) + SAMPLE_RATE_HZ)
    stream = noise.astype(np.float32)
    stream[SAMPLE_RATE_HZ:] += sound
    recogniser = make_speech_recogniser(
        team.phrasebook, [name for name in team.names if name != listener] or [peer], team.sound
    )
    began_s = machine.cpu_s()
    heard = recogniser.push(stream)
    load = (machine.cpu_s() - began_s) / (len(stream) / SAMPLE_RATE_HZ)
    much = f"{plural(len(team.names), 'name')}, {plural(len(heard), 'sentence')}"
    text = f"decoding speech takes {load:.0%} of one core ({much})"
    if load > MOST_LOAD:
        return wrong("processor", f"{text}: too slow; stop other programs, or set fewer `names`", load=round(load, 3))
    if load > HIGH_LOAD:
        return note("processor", f"{text}: there is little headroom; fewer `names` help", load=round(load, 3))
    return fine("processor", text, load=round(load, 3))


def _look_at_heat(machine: Machine) -> Iterator[Finding]:
    heat_c = processor_temperature_c(machine.thermal)
    if heat_c is None:
        return
    text = f"{heat_c:.0f} °C"
    if heat_c >= HOT_C:
        yield note("heat", f"{text}: the processor slows down from {HOT_C:g} °C on; give it air", heat_c=heat_c)
    else:
        yield fine("heat", text, heat_c=heat_c)


def look_at_service(machine: Machine) -> Finding:
    """Whether systemd runs the daemon, and in which state it is."""
    told = machine.run(("systemctl", "show", "hvcpd.service", "-p", "LoadState,ActiveState,SubState,Result,NRestarts"))
    values = dict(line.split("=", 1) for line in (told or "").splitlines() if "=" in line)
    if "LoadState" not in values:
        return fine("service", "no systemd here; start `hvcpd` by hand")
    if values["LoadState"] != "loaded":
        what = values["LoadState"].replace("not-found", "not installed")
        return note("service", f"hvcpd.service is {what}; see docs/install.md")
    restarts = values.get("NRestarts") or "0"
    state = f"{values.get('ActiveState')} ({values.get('SubState')}), {restarts} restart{'s' * (restarts != '1')}"
    if "failed" in state or "auto-restart" in state:
        return wrong(
            "service",
            f"{state}, {values.get('Result')}: look with `journalctl -u hvcpd -b`, then `sudo systemctl restart hvcpd`",
        )
    return fine("service", state)
