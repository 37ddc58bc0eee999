"""`hvcpctl calibrate`: sets the microphone's gain by the robot's own voice, and estimates how far a peer will be
heard."""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path

from hvcpd.config.files import write_whole
from hvcpd.control.doctor.diagnosis import RunCommand, run_command
from hvcpd.control.doctor.mixer import Control, capture_control
from hvcpd.control.doctor.self_hearing import SelfHearing, calibration_path, hear_oneself
from hvcpd.control.live.daemon_client import running_robot
from hvcpd.control.output import show
from hvcpd.control.simulate.team import Team, load_team
from hvcpd.daemon.devices import Devices
from hvcpd.errors import EX_FAILURE, EX_OK, DeviceError, StoreError, writing
from hvcpd.hardware.acoustics import NEEDED_SNR_DB, SILENCE_DBFS, Echo, Response, power_dbfs, predicted_range_m
from hvcpd.hardware.audio import find_device
from hvcpd.reporting.text import over_noise

PEAK_DBFS = -6.0
"""Target peak of the robot's own voice, the loudest sound at its microphone: no clipping, with 6 dB left for a louder
word."""
NEAR_DB = 3.0
"""Tolerance of the peak; mixers have steps of 1 to 3 dB."""
MOST_CHANGE_DB = 20.0
"""Largest change of the gain at a time, because the true peak of a clipped or buried voice is unknown."""
ROUNDS = 6
"""Most changes of the gain: a voice that clips comes down by 6 dB at a time."""


def run(
    options: argparse.Namespace,
    devices: Devices | None = None,
    command: RunCommand = run_command,
    wall_s: Callable[[], float] = time.time,
) -> int:
    """Speak, listen and set the gain in rounds; then keep the result beside the robot's memory."""
    where = devices or Devices()
    team = load_team(options)
    name = running_robot(team.settings.name, options)
    if name is not None:  # a sound server lets both have the card, and gains are kept
        raise DeviceError(f"{name} runs now, and its talk would count as noise: end it first")
    microphone = find_device(where.sound_backend(), "input", team.settings.audio.input_device)
    control = None if options.keep_gain else capture_control(command, microphone.name)
    heard = hear_oneself(team, where.make_stream)
    for _ in range(ROUNDS):
        _tell_round(options, heard)
        if heard.echo is None or control is None or not _adjust(control, heard.echo, options):
            break
        heard = hear_oneself(team, where.make_stream)
    if heard.echo is None:
        raise DeviceError(
            "the robot does not hear itself: is the loudspeaker's volume up and the microphone unmuted? "
            "see hvcpctl doctor --only sound"
        )
    if heard.floor_dbfs <= SILENCE_DBFS:
        raise DeviceError(
            "between words the microphone gives digital silence, so nobody can say how far a peer is heard: "
            "turn its noise suppression off, or choose another"
        )
    return _finish(options, team, heard, heard.echo, control, wall_s())


def _adjust(control: Control, echo: Echo, options: argparse.Namespace) -> bool:
    """Bring the peak of the robot's own voice nearer to PEAK_DBFS; returns whether that changed anything."""
    missing_db = PEAK_DBFS - power_dbfs(echo.peak**2)
    before_db = control.gain_db()
    if abs(missing_db) <= NEAR_DB or before_db is None:
        return False
    step_db = min(max(missing_db, -MOST_CHANGE_DB), MOST_CHANGE_DB)
    after_db = control.set_gain_db(before_db + step_db)
    if after_db is None or after_db == before_db:
        return False
    if not options.json:
        sys.stdout.write(f"microphone gain {before_db:+.1f} dB -> {after_db:+.1f} dB ({control.name})\n")
    return True


def _tell_round(options: argparse.Namespace, heard: SelfHearing) -> None:
    if options.json:
        return
    if heard.echo is None:
        sys.stdout.write(f"noise {heard.floor_dbfs:.0f} dBFS, the own voice was not found\n")
        return
    echo = heard.echo
    peak_dbfs = power_dbfs(echo.peak**2)
    sys.stdout.write(
        f"noise {heard.floor_dbfs:.0f} dBFS, own voice {echo.level_dbfs:.0f} dBFS (peak {peak_dbfs:.0f}), "
        f"{over_noise(echo.snr_db)}, {'understood' if heard.understood else 'not understood'}\n"
    )


def _finish(
    options: argparse.Namespace, team: Team, heard: SelfHearing, echo: Echo, control: Control | None, wall_s: float
) -> int:
    reach_m = predicted_range_m(echo.level_dbfs, options.distance, heard.floor_dbfs)
    result = {
        "date": time.strftime("%Y-%m-%d", time.localtime(wall_s)),
        "floor_dbfs": round(heard.floor_dbfs, 1),
        "own_level_dbfs": round(echo.level_dbfs, 1),
        "own_peak_dbfs": round(power_dbfs(echo.peak**2), 1),
        "own_snr_db": round(echo.snr_db, 1),
        "own_distance_m": options.distance,
        "delay_s": round(echo.delay_s, 4),
        "understood": heard.understood,
        "range_m": round(reach_m, 2),
    }
    response = heard.response
    if response is not None:
        result |= {key: value and round(value, 1) for key, value in asdict(response).items()}
    path = calibration_path(team)
    is_kept = heard.understood and not options.dry_run
    if is_kept:
        _keep(path, result)
    lines, off_db = [], PEAK_DBFS - power_dbfs(echo.peak**2)
    if abs(off_db) > NEAR_DB:
        why = "no mixer control for it was found" if control is None else f"{control.name} goes no further"
        lines.append(f"the microphone's gain should change by {off_db:+.0f} dB, but {why}: set it with `alsamixer`, F4")
    lines.append(
        f"a peer with the same loudspeaker is understood up to {reach_m:.1f} m in a free field: 20 log10("
        f"{reach_m:.1f} m / {options.distance:g} m) = {echo.level_dbfs:.0f} dBFS - ({heard.floor_dbfs:.0f} dBFS) - "
        f"{NEEDED_SNR_DB:g} dB"
    )
    if response is not None:
        lines.append(_about_loudspeaker(response))
    if not heard.understood:
        lines.append("the robot does not understand its own voice: hvcpctl doctor --only sound tells why")
    lines.append(f"kept in {path}; `sudo alsactl store` keeps the gains" if is_kept else "nothing was kept")
    show(options.json, result, *lines)
    return EX_OK if heard.understood else EX_FAILURE


def _about_loudspeaker(response: Response) -> str:
    text = f"the loudspeaker, as the microphone hears it, sounds from {response.lowest_hz:.0f} Hz on"
    if response.resonance_hz is None:
        return f"{text}, without a resonance"
    return f"{text} and resonates at {response.resonance_hz:.0f} Hz, by {response.resonance_db:.0f} dB"


def _keep(path: Path, result: dict[str, object]) -> None:
    """Raises StoreError."""
    with writing(path, StoreError, otherwise="run this as the daemon's user, or with --dry-run"):
        path.parent.mkdir(parents=True, exist_ok=True)
        write_whole(path, (json.dumps(result, indent=2) + "\n").encode())
