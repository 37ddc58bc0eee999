"""The installed unit under a real systemd in a container: ready, closed off, killed by the watchdog, started again.

Real are Debian, systemd, the package, the unit with all its restrictions, PortAudio and ALSA. The sound card is not
there: ALSA leads to a PulseAudio server outside, whose loudspeaker and microphone are one null sink, so the robot
hears itself at once. The wheels are none. Memory and processor limits hold only where the container has these cgroups.
"""

from __future__ import annotations

import json
import os
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from tests.release.container import Container, wait_until

pytestmark = [pytest.mark.container, pytest.mark.slow]

AIR = "/run/air"
"""Where the sound server's socket is seen inside; /tmp would be the service's own."""
START_S = 300.0
"""A start makes all words when it is the first: 8 s of one processor's time, more on a busy machine."""

PROBE = """
import json, os, socket, subprocess

def fails(action):
    try:
        action()
    except OSError as error:
        return error.strerror
    return None

PATHS = ["/", "/usr", "/etc/hvcpd", "/var/lib/hvcpd", "/run/hvcpd", "/tmp", "/var/tmp", "/dev/shm"]
print("probe " + json.dumps({
    "internet": fails(lambda: socket.socket(socket.AF_INET, socket.SOCK_STREAM)),
    "netlink": fails(lambda: socket.socket(socket.AF_NETLINK, socket.SOCK_RAW)),
    "packets": fails(lambda: socket.socket(socket.AF_PACKET, socket.SOCK_RAW)),
    "unix": fails(lambda: socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)),
    "interfaces": [line.split(":")[0].strip() for line in open("/proc/self/net/dev") if ":" in line],
    "read-only": [path for path in PATHS if os.statvfs(path).f_flag & os.ST_RDONLY],
    "not to run from": [path for path in PATHS if os.statvfs(path).f_flag & os.ST_NOEXEC],
    "write memory": fails(lambda: open("/var/lib/hvcpd/x", "w")),
    "run what was written": fails(lambda: subprocess.run(["/var/lib/hvcpd/program"], check=True)),
    "others' processes": [name for name in os.listdir("/proc") if name.isdigit() and int(name) == 1],
    "home": fails(lambda: os.listdir("/home")),
    "niceness": os.getpriority(os.PRIO_PROCESS, 0),
    "faster": fails(lambda: os.nice(-1)),
}))
"""


@contextmanager
def sound_server(folder: Path) -> Iterator[None]:
    """PulseAudio with one null sink, for everybody who reaches its socket in `folder`."""
    script = folder / "server.pa"
    script.write_text(
        "load-module module-null-sink sink_name=air rate=16000 channels=1 norewinds=1\n"
        f"load-module module-native-protocol-unix socket={folder}/native auth-anonymous=1\n"
    )
    command = ["pulseaudio", "-n", "-F", str(script), "--daemonize=no", "--exit-idle-time=-1", "--use-pid-file=no"]
    with (folder / "log").open("wb") as log:
        server = subprocess.Popen(
            [*command, "--disable-shm=yes"],
            env={**os.environ, "HOME": str(folder), "XDG_RUNTIME_DIR": str(folder)},
            stdout=log,
            stderr=log,
        )
    try:
        wait_until((folder / "native").exists, 30.0, "PulseAudio has started")
        yield
    finally:
        server.kill()
        server.wait()


def set_up(robot: Container, package: Path) -> None:
    (robot.root / "root/hvcpd.deb").write_bytes(package.read_bytes())
    robot.run("dpkg", "--install", "/root/hvcpd.deb")
    (robot.root / "etc/asound.conf").write_text(
        f'pcm.loudspeaker {{ type pulse server "unix:{AIR}/native" device "air" }}\n'
        f'pcm.microphone {{ type pulse server "unix:{AIR}/native" device "air.monitor" }}\n'
        'pcm.!default { type asym playback.pcm "loudspeaker" capture.pcm "microphone" }\n'
    )
    (robot.root / "etc/hvcpd/hvcpd.yaml").write_text("name: Rob\nwheels: {driver: none}\n")
    drop_in = robot.root / "etc/systemd/system/hvcpd@probe.service.d"
    drop_in.mkdir(parents=True)
    (drop_in / "probe.conf").write_text(
        "[Service]\nType=oneshot\nRestart=no\nExecStart=\nExecStart=/usr/bin/python3 /usr/share/probe.py\n"
    )
    (robot.root / "usr/share/probe.py").write_text(PROBE)
    program = robot.root / "var/lib/hvcpd/program"
    program.write_text("#!/bin/sh\n")
    program.chmod(0o755)


def test_from_ready_to_the_last_word(debian: Path, package: Path, tmp_path: Path) -> None:
    air = tmp_path / "air"
    air.mkdir()
    with sound_server(air), Container(debian, tmp_path) as robot:
        set_up(robot, package)
        robot.boot({air: AIR})
        check_restrictions(robot)
        check_ready(robot)
        check_watchdog(robot)
        check_end(robot)
        check_wrong_settings(robot)


def check_restrictions(robot: Container) -> None:
    robot.asked("systemctl", "start", "hvcpd@probe.service")
    told = robot.journal("hvcpd@probe.service")
    line = next((line for line in told if line.startswith("probe ")), None)
    assert line is not None, told
    found = json.loads(line.removeprefix("probe "))
    not_supported = "Address family not supported by protocol"
    assert {found.pop(name) for name in ("internet", "netlink", "packets")} == {not_supported}
    assert found == {
        "unix": None,
        "interfaces": ["lo"],
        "read-only": ["/", "/usr", "/etc/hvcpd"],
        "not to run from": ["/var/lib/hvcpd", "/run/hvcpd", "/tmp", "/var/tmp", "/dev/shm"],
        "write memory": None,
        "run what was written": "Permission denied",
        "others' processes": [],
        "home": "Permission denied",
        "niceness": -10,
        "faster": "Operation not permitted",
    }


def ready(robot: Container) -> bool:
    unit = robot.unit("hvcpd")
    assert unit["ActiveState"] != "failed", robot.journal("hvcpd")
    return unit["ActiveState"] == "active" and unit["StatusText"] == "Rob of team plant listens"


def check_ready(robot: Container) -> None:
    robot.inside("systemctl", "start", "--no-block", "hvcpd")
    wait_until(lambda: ready(robot), START_S, "the service is ready")
    assert robot.inside("stat", "--format=%U:%G %a", "/run/hvcpd/rob.sock") == "hvcpd:hvcpd 660"
    wait_until(lambda: any("event=said" in line for line in robot.journal("hvcpd")), 60.0, "the robot speaks")


def check_watchdog(robot: Container) -> None:
    before = robot.unit("hvcpd")["MainPID"]
    robot.inside("kill", "-STOP", before)
    wait_until(lambda: robot.unit("hvcpd")["NRestarts"] == "1", 60.0, "the frozen daemon was killed")
    assert any("Watchdog timeout" in line for line in robot.journal("hvcpd"))
    wait_until(lambda: ready(robot), START_S, "the service is ready again")
    assert robot.unit("hvcpd")["MainPID"] != before


def check_end(robot: Container) -> None:
    robot.inside("systemctl", "stop", "hvcpd")
    unit = robot.unit("hvcpd")
    assert (unit["ActiveState"], unit["Result"], unit["ExecMainStatus"]) == ("inactive", "success", "0")
    assert any("I am leaving" in line for line in robot.journal("hvcpd"))


def check_wrong_settings(robot: Container) -> None:
    (robot.root / "etc/hvcpd/hvcpd.yaml").write_text("nome: Rob\n")
    robot.asked("systemctl", "start", "hvcpd")
    unit = robot.unit("hvcpd")
    assert (unit["ActiveState"], unit["ExecMainStatus"], unit["NRestarts"]) == ("failed", "78", "0")
    assert any("did you mean 'name'" in line for line in robot.journal("hvcpd"))
