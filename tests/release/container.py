"""A Debian of its own in a folder, with systemd in a container on it: for what can only be seen where it is installed.

Only for Linux and root, where mmdebstrap, systemd-nspawn and an overlay mount work; elsewhere the tests skip and say
why. systemd never runs outside systemd-nspawn: on the computer itself it would tidy away folders that are not its own.
"""

from __future__ import annotations

import fcntl
import json
import os
import shutil
import subprocess
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from threading import Event

import pytest

from release.deb import TEMPLATES

SUITE, PYTHON = "bookworm", "3.11"
"""Debian 12, which Raspberry Pi OS follows, and its Python."""
_CONTROL = (TEMPLATES / "control").read_text().splitlines()
_DEPENDS = next(line for line in _CONTROL if line.startswith("Depends:")).removeprefix("Depends:").split(",")
PACKAGES = tuple(sorted({each.split()[0] for each in _DEPENDS} | {"libasound2-plugins", "procps"}))
"""What hvcpd's package depends on, ALSA's way to a PulseAudio server, and `pkill`."""
TOOLS = ("mmdebstrap", "systemd-nspawn", "nsenter", "dpkg-deb", "pulseaudio")
MAKING_S = 900
"""A quarter of a gigabyte is unpacked: half a minute of processor time, and the downloads."""
NSPAWN = ("systemd-nspawn", "--quiet", "--register=no", "--keep-unit", "--private-network", "--link-journal=no")


def skip_unless_possible() -> None:
    """Skip the test, with the reason, where no container can be made."""
    missing = [tool for tool in TOOLS if shutil.which(tool) is None]
    if os.geteuid() != 0:
        pytest.skip("only root can make a container")
    if missing:
        pytest.skip(f"not installed: {', '.join(missing)}")


@contextmanager
def locked(path: Path) -> Iterator[None]:
    """One test process at a time."""
    with path.open("w") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        yield


def base_root(cache: Path) -> Path:
    """A folder with Debian in it, made once and kept in `cache`; not to be written to."""
    root = cache / f"{SUITE}-{'-'.join(PACKAGES)}"
    with locked(cache / "lock"):
        if not root.is_dir():
            scratch = cache / "scratch"
            shutil.rmtree(scratch, ignore_errors=True)
            # Not debootstrap, which does not understand what python3-cryptography depends on.
            command = ["mmdebstrap", "--quiet", "--variant=apt", f"--include={','.join(PACKAGES)}", SUITE, scratch]
            done = subprocess.run(command, capture_output=True, text=True, timeout=MAKING_S)
            if done.returncode != 0:
                pytest.skip(f"no Debian {SUITE} can be had here: {done.stdout[-300:]}{done.stderr[-300:]}")
            scratch.rename(root)
    return root


class Container:
    """A writable copy of the base, laid over it; `run` without systemd, `boot` and then `inside` with it."""

    def __init__(self, base: Path, scratch: Path) -> None:
        self.root = scratch / "root"
        self._layers = {name: scratch / name for name in ("upper", "work")}
        self._base = base
        self._process: subprocess.Popen[bytes] | None = None
        self._leader = ""
        for folder in (self.root, *self._layers.values()):
            folder.mkdir()

    def __enter__(self) -> Container:
        upper, work = self._layers.values()
        options = f"lowerdir={self._base},upperdir={upper},workdir={work}"
        done = subprocess.run(["mount", "-t", "overlay", "overlay", "-o", options, self.root], capture_output=True)
        if done.returncode != 0:
            pytest.skip(f"no overlay mount here: {done.stderr.decode()}")
        return self

    def __exit__(self, *_: object) -> None:
        if self._process is not None:
            self._process.terminate()  # systemd-nspawn then switches the container off in order
            with suppress(subprocess.TimeoutExpired):
                self._process.wait(60)
            self._process.kill()
            self._process.wait()
        subprocess.run(["umount", "--lazy", self.root], check=True)

    def run(self, *command: str) -> str:
        """What the command prints there; nothing else runs. Raises AssertionError with it if the command fails."""
        return _succeed([*NSPAWN, "--as-pid2", "-D", str(self.root), *command])

    def boot(self, shown: Mapping[Path, str]) -> None:
        """Start systemd; folders that are to be `shown` are seen inside under the names given."""
        binds = [f"--bind={path}:{name}" for path, name in shown.items()]
        log = (self.root.parent / "boot.log").open("wb")
        command = [*NSPAWN, "--boot", "--console=pipe", *binds, "-D", str(self.root)]
        self._process = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=log, stderr=log)
        log.close()
        children = Path(f"/proc/{self._process.pid}/task/{self._process.pid}/children")

        def up() -> bool:
            if self._process is not None and self._process.poll() is not None:
                pytest.skip(f"systemd-nspawn does not boot here: {(self.root.parent / 'boot.log').read_text()[-500:]}")
            self._leader = children.read_text().strip()
            return bool(self._leader) and self.asked("systemctl", "is-system-running") in ("running", "degraded")

        wait_until(up, 60.0, "systemd has started")

    def inside(self, *command: str) -> str:
        """The same in the booted container."""
        return _succeed(self._enter(command))

    def asked(self, *command: str) -> str:
        """What the command prints there, whatever its exit status."""
        return subprocess.run(self._enter(command), capture_output=True, text=True, timeout=60).stdout.strip()

    def unit(self, name: str) -> dict[str, str]:
        """A unit's properties as systemd has them now."""
        lines = self.asked("systemctl", "show", name).splitlines()
        return dict(line.split("=", 1) for line in lines if "=" in line)

    def journal(self, name: str) -> list[str]:
        """The messages of a unit, and of systemd about it, in order."""
        entries = [json.loads(line) for line in self.asked("journalctl", "-o", "json", "-u", name).splitlines()]
        return [str(entry.get("MESSAGE", "")) for entry in entries]

    def _enter(self, command: Sequence[str]) -> list[str]:
        return ["nsenter", "-t", self._leader, "--mount", "--uts", "--ipc", "--net", "--pid", "--", *command]


def wait_until(holds: Callable[[], bool], within_s: float, what: str) -> None:
    """Wait in real time; raises AssertionError."""
    end_s = time.monotonic() + within_s
    while not holds():
        assert time.monotonic() < end_s, f"after {within_s:g} s still not: {what}"
        Event().wait(0.2)


def _succeed(command: Sequence[str]) -> str:
    done = subprocess.run(command, capture_output=True, text=True, timeout=300, stdin=subprocess.DEVNULL)
    assert done.returncode == 0, f"{command}: {done.stdout}{done.stderr}"
    return done.stdout.strip()
