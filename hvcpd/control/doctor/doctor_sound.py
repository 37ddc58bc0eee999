"""The doctor's checks of microphone and loudspeaker, and of what the robot hears of itself."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any

from hvcpd.control.doctor.diagnosis import fine, note, wrong
from hvcpd.control.doctor.self_hearing import SelfHearing, calibration_path, hear_oneself, listen
from hvcpd.control.simulate.team import Team
from hvcpd.daemon.devices import Devices
from hvcpd.daemon.preflight import Finding, find_sound
from hvcpd.errors import DeviceError
from hvcpd.hardware.acoustics import SILENCE_DBFS
from hvcpd.hardware.audio import Direction, SoundDevice
from hvcpd.ports import SAMPLE_RATE_HZ
from hvcpd.reporting.text import over_noise

CARD_RATES_HZ = (16_000, 44_100, 48_000)
CLIPPED_SHARE = 0.01
"""Share of clipped samples that is worth a note; 5 % cost no sentence (docs/recognition.md, "level -6 dBFS")."""
LOUD_FLOOR_DBFS = -45.0
"""A peer at 1 m arrives at about -41 dBFS with the recommended gain (65 dB SPL, full scale at 106 dB SPL)."""
WEAK_SNR_DB = 10.0
"""Least signal-to-noise ratio of the robot's own voice, which arrives 20 dB louder than a peer's at 1 m."""


def look_at_sound(team: Team, devices: Devices, aloud: bool) -> Iterator[Finding]:
    """Devices and rates, then the room's noise, then with `aloud` the own voice."""
    settings = team.settings.audio
    found = list(find_sound(settings, devices, _with_rates))
    yield from found
    if not all(finding.ok for finding in found):
        return
    try:
        heard = hear_oneself(team, devices.make_stream) if aloud else listen(settings, devices.make_stream)
    except DeviceError as error:
        yield wrong("sound", f"{error}; if hvcpd is running, it has the card: stop it for this test")
        return
    yield from judge(heard)
    yield from _calibration(team)


def _with_rates(backend: Any, direction: Direction, device: SoundDevice) -> str:
    rates = [rate for rate in CARD_RATES_HZ if _takes(backend, direction, device.index, rate)]
    listed = ", ".join(f"{rate / 1000:g}" for rate in rates) or "none of the usual rates"
    return f"{device.name!r}: {listed} kHz; its own rate is {device.rate_hz / 1000:g} kHz"


def _takes(backend: Any, direction: Direction, index: int, rate_hz: int) -> bool:
    check = backend.check_input_settings if direction == "input" else backend.check_output_settings
    try:
        check(device=index, channels=1, dtype="float32", samplerate=rate_hz)
    except (backend.PortAudioError, ValueError):
        return False
    return True


def judge(heard: SelfHearing) -> Iterator[Finding]:
    """The findings of one round of listening."""
    floor = f"noise floor {heard.floor_dbfs:.0f} dBFS"
    figures = {"floor_dbfs": round(heard.floor_dbfs, 1), "clipped_share": round(heard.clipped, 5)}
    if heard.floor_dbfs <= SILENCE_DBFS:
        yield wrong(
            "noise", "the microphone gives digital silence: unmute it (`alsamixer`, F4), or choose another", **figures
        )
    elif heard.floor_dbfs > LOUD_FLOOR_DBFS:
        yield note("noise", f"{floor}: a loud room or too much gain; a peer is heard less far", **figures)
    else:
        yield fine("noise", floor, **figures)
    if heard.clipped > CLIPPED_SHARE:
        yield note(
            "clipping", f"{heard.clipped:.1%} of the samples clip; lower the microphone's gain: hvcpctl calibrate"
        )
    if heard.lost:
        yield note(
            "stream", f"{heard.lost / SAMPLE_RATE_HZ * 1000:.0f} ms of sound were lost: is the computer overloaded?"
        )
    if heard.said is None:
        return
    if heard.echo is None:
        yield wrong(
            "loopback",
            "the robot does not hear itself: is the loudspeaker switched on and its volume up, the microphone unmuted, "
            "and are audio.input_device and audio.output_device the right ones?",
        )
        return
    echo = heard.echo
    level = f"{echo.level_dbfs:.0f} dBFS, {over_noise(echo.snr_db)}"
    result = f"heard itself at {level}, after {echo.delay_s * 1000:.0f} ms"
    values = {
        "level_dbfs": round(echo.level_dbfs, 1),
        "snr_db": round(echo.snr_db, 1),
        "delay_s": round(echo.delay_s, 4),
    }
    if not heard.understood:
        yield wrong(
            "loopback",
            f"{result}, but did not understand {heard.said!r}: too loud, too soft, or distorted; try hvcpctl calibrate",
            **values,
        )
    elif echo.snr_db < WEAK_SNR_DB:
        yield note("loopback", f"{result}: turn the loudspeaker up, or the noise down", **values)
    else:
        yield fine("loopback", f"{result}, and understood {heard.said!r} ({heard.confidence:.0%})", **values)


def _calibration(team: Team) -> Iterator[Finding]:
    try:
        found = json.loads(calibration_path(team).read_text(encoding="utf-8"))
        text = f"of {found['date']}: a peer is understood up to {found['range_m']:.1f} m"
    except (OSError, ValueError, KeyError, TypeError):
        yield note("calibration", "this robot's sound was never calibrated; see hvcpctl calibrate --help")
    else:
        yield fine("calibration", text)
