"""What the machine must have for real processes over real sound."""

from __future__ import annotations

import ctypes.util
import os
import shutil
import subprocess
from collections.abc import Iterator
from functools import cache
from pathlib import Path

from hil_fakes import pulse_pipe
from hil_fakes.sound_server import ALSA_CONFIGURATION

NAMESPACES = (("unshare", "--net", "--"), ("unshare", "--user", "--map-current-user", "--net", "--"))
"""Commands before a command that give it a network of its own: as root, and as a user where the kernel lets users."""

NICENESS = -10
"""Of all processes on stage, as the unit has it (Nice=-10)."""
PRIORITY = ("nice", "-n", str(NICENESS - os.getpriority(os.PRIO_PROCESS, 0))) if os.geteuid() == 0 else ()
"""A command before a command: other programs share the processors, so those on stage are served first, however nice the
tests are (`nice -n` adds to their own). The fakes too, for neither air nor wheels wait for a processor."""


@cache
def missing() -> str:
    """What is missing for real sound, as a reason to skip; empty if nothing is."""
    found = list(_missing_parts())
    return f"not installed: {', '.join(found)} (`make parts` installs them as root)" if found else ""


def _missing_parts() -> Iterator[str]:
    if shutil.which("pulseaudio") is None:
        yield "pulseaudio"
    if shutil.which("setpriv") is None:
        yield "util-linux"
    if ctypes.util.find_library("portaudio") is None:
        yield "libportaudio2"
    if not Path(ALSA_CONFIGURATION).exists() or not any(Path("/usr/lib").rglob("libasound_module_pcm_pulse.so")):
        yield "libasound2-plugins"
    try:
        pulse_pipe.load()
    except OSError:
        yield "libpulse0"


@cache
def own_network() -> tuple[str, ...]:
    """The command that runs another one without any network; empty where the machine does not allow it."""
    there = [command for command in NAMESPACES if shutil.which(command[0])]
    tries = ((command, subprocess.run([*command, "true"], capture_output=True, check=False)) for command in there)
    return next((command for command, result in tries if result.returncode == 0), ())
