"""A private PulseAudio server with a loudspeaker and a microphone for each robot, and ALSA devices of these names.

Each of them is a null sink: what a robot plays goes into its loudspeaker's sink, and what is played into its
microphone's sink the robot records from that sink's monitor. Between the two there is nothing; `real_air` is put there.
The server speaks over a UNIX socket only, which a process without any network reaches as well.
"""

from __future__ import annotations

import os
import socket
import subprocess
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from hvcpd.ports import SAMPLE_RATE_HZ

START_S = 30.0
"""A server that does not answer by then has failed; it takes a tenth of a second on an idle machine."""
POLL_S = 0.05
DIE_WITH_PARENT = ("setpriv", "--pdeathsig", "KILL", "--")
"""A test that is killed leaves no process behind (util-linux, setpriv(1))."""
ALSA_CONFIGURATION = "/usr/share/alsa/alsa.conf"
"""ALSA's own, which a private one builds on (package libasound2-data)."""
LOUDSPEAKER, MICROPHONE = "loudspeaker", "microphone"
"""The names of the devices, for every robot."""

# Without `norewinds` a null sink takes back sound of a late client that was already heard.
_SINK = f"load-module module-null-sink sink_name={{}} rate={SAMPLE_RATE_HZ} channels=1 format=s16le norewinds=1\n"
_CLIENT = "default-server = unix:{server}\nautospawn = no\nenable-shm = no\n"
_ALSA = f"""
pcm.{LOUDSPEAKER} {{ type pulse device "ROBOT_{LOUDSPEAKER}" }}
pcm.{MICROPHONE} {{ type pulse device "ROBOT_{MICROPHONE}.monitor" }}
pcm.!default {{ type asym playback.pcm "{LOUDSPEAKER}" capture.pcm "{MICROPHONE}" }}
ctl.!default {{ type pulse }}
"""


def wait_until(condition: Callable[[], bool], timeout_s: float, what: str) -> None:
    """Wait in real time until `condition` holds. Raises TimeoutError with `what` as the missing condition."""
    end_s = time.monotonic() + timeout_s
    pause = threading.Event()
    while not condition():
        if time.monotonic() > end_s:
            raise TimeoutError(f"after {timeout_s:g} s still not: {what}")
        pause.wait(POLL_S)


class SoundServer:
    """PulseAudio for the robots of these names, running while the context lasts.

    `directory` holds its socket, so its path must be short (108 bytes for a UNIX socket's, unix(7)); `log` takes what
    the server writes; `prefix` is a command before the server's own. Raises OSError where PulseAudio is not installed,
    TimeoutError if it does not start.
    """

    def __init__(self, directory: Path, names: Sequence[str], log: Path, prefix: Sequence[str] = ()) -> None:
        self._directory = directory
        self._prefix = tuple(prefix)
        self._log = log
        self._process: subprocess.Popen[bytes] | None = None
        self.socket = directory / "native"
        sinks = "".join(_SINK.format(f"{name}_{kind}") for name in names for kind in (LOUDSPEAKER, MICROPHONE))
        protocol = f"load-module module-native-protocol-unix socket={self.socket} auth-anonymous=1\n"
        (directory / "server.pa").write_text(sinks + protocol)
        (directory / "client.conf").write_text(_CLIENT.format(server=self.socket))
        for name in names:
            (directory / f"{name}.alsa").write_text(_ALSA.replace("ROBOT", name))

    def __enter__(self) -> SoundServer:
        self.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.kill()

    def environment(self, name: str) -> Mapping[str, str]:
        """The environment in which the process of the robot `name` finds its two devices and no others."""
        return {
            **self._home(),
            "ALSA_CONFIG_PATH": f"{ALSA_CONFIGURATION}:{self._directory / name}.alsa",
            "PULSE_CLIENTCONFIG": str(self._directory / "client.conf"),
        }

    def start(self) -> None:
        """Start the server and wait until it takes connections."""
        self.socket.unlink(missing_ok=True)
        command = [*self._prefix, *DIE_WITH_PARENT, "pulseaudio", "-n", "-F", str(self._directory / "server.pa")]
        command += ["--daemonize=no", "--exit-idle-time=-1", "--use-pid-file=no", "--disable-shm=yes"]
        with self._log.open("ab") as log:
            self._process = subprocess.Popen(
                command, env={**os.environ, **self._home()}, stdin=subprocess.DEVNULL, stdout=log, stderr=log
            )
        wait_until(self._answers, START_S, f"PulseAudio takes connections (see {self._log})")

    def kill(self) -> None:
        """kill -9; safe to call twice."""
        process, self._process = self._process, None
        if process is not None:
            process.kill()
            process.wait()

    def _answers(self) -> bool:
        if self._process is not None and self._process.poll() is not None:
            raise TimeoutError(f"PulseAudio ended with status {self._process.returncode}; see {self._log}")
        with socket.socket(socket.AF_UNIX) as probe:
            return probe.connect_ex(str(self.socket)) == 0

    def _home(self) -> Mapping[str, str]:
        return {"HOME": str(self._directory), "XDG_RUNTIME_DIR": str(self._directory)}
