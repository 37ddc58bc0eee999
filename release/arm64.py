"""hvcpd as it is on a Raspberry Pi, run here: its Debian package and Debian's Python for arm64 under qemu-user.

They are unpacked into a folder of their own; nothing is installed, and no root is needed. What is run there sees this
computer's files and network, but Debian's arm64 libraries before the computer's own.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

from release.deb import AT_ONCE, build, build_natural
from release.libraries import STRIP
from release.lock import Target

TARGET = Target("3.11", "arm64")
"""Debian 12's Python, whose bytecode this computer's may be compiled for as well."""
EMULATOR = "qemu-aarch64"
NEEDED = {EMULATOR: "qemu-user", STRIP[TARGET.architecture]: "binutils-aarch64-linux-gnu", "dpkg-deb": "dpkg"}
"""Programs, and Debian's packages that they come in."""
PACKAGES = ("python3", "libportaudio2", "libsndfile1", "python3-cryptography", "tzdata")
"""What the package depends on and Debian has; their own dependencies come with them."""
LIBRARIES = Path("usr/lib/hvcpd")
RESERVED = 1 << 39
"""The program's addresses are below it, with qemu's option -R, and the emulator's own beyond."""


class UnavailableError(Exception):
    """Something that is needed for it is missing here; the text says what, and how to get it."""


def make_root(folder: Path) -> Path:
    """Return the root that was unpacked into `folder`, made now if it is not there.

    Raises UnavailableError, or what `build` raises.
    """
    missing = [package for program, package in NEEDED.items() if shutil.which(program) is None]
    if missing:
        raise UnavailableError(f"missing here: apt install {' '.join(missing)}")
    root = folder / "root"
    done = folder / "-".join(("done", *PACKAGES))
    if not done.exists():
        shutil.rmtree(root, ignore_errors=True)
        root.mkdir(parents=True)
        for package in _debian_packages(folder):
            _unpack(package, root)
        _compile(root / "usr/lib/python3.11")
        done.touch()
    return root


def put_hvcpd(root: Path, folder: Path) -> None:
    """Build hvcpd's packages in `folder` and unpack them into the root, in place of those that are there."""
    shutil.rmtree(root / LIBRARIES, ignore_errors=True)
    _unpack(build(TARGET, folder, compression=AT_ONCE), root)
    _unpack(build_natural(folder, compression=AT_ONCE), root)
    compile_hvcpd(root)


def command(root: Path, arguments: Sequence[str], more: Sequence[str] = (), emulator: str = EMULATOR) -> list[str]:
    """Return the command that runs the root's Python with these arguments; `more`: options of the emulator's."""
    return [emulator, "-L", str(root), *more, str(root / "usr/bin/python3.11"), *arguments]


def environment(root: Path) -> Mapping[str, str]:
    """Return what Python there needs to find hvcpd."""
    return {**os.environ, "PYTHONPATH": str(root / LIBRARIES), "OPENBLAS_NUM_THREADS": "1"}


def compile_hvcpd(root: Path) -> None:
    """As the package's own script does after the installation."""
    script, libraries = root / "usr/share/hvcpd/compile.py", root / LIBRARIES
    subprocess.run([sys.executable, "-X", "no_debug_ranges", str(script), str(libraries)], check=True)


def resident_mb(pid: int) -> float:
    """Resident memory of the program in an emulator's process, MB (1e6 bytes): what lies below `RESERVED`.

    The emulator maps the libraries' files as Linux would; so these are the pages that the program would have on a
    Raspberry Pi, and with a qemu before 8.1 those that it has freed. Raises OSError.
    """
    resident_kib, below = 0, False
    for line in Path(f"/proc/{pid}/smaps").read_text(encoding="utf-8").splitlines():
        if place := re.match(r"([0-9a-f]+)-[0-9a-f]+ ", line):
            below = int(place[1], 16) < RESERVED
        elif below and line.startswith("Rss:"):
            resident_kib += int(line.split()[1])
    return resident_kib * 1024 / 1e6


def _debian_packages(folder: Path) -> list[Path]:
    """Download PACKAGES and all that they depend on, by an apt that knows no installed package. Raises
    UnavailableError."""
    state, cache = folder / "apt/state", folder / "apt/cache"
    for each in (state / "lists/partial", cache / "archives/partial"):
        each.mkdir(parents=True, exist_ok=True)
    (state / "status").touch()
    options = {
        "APT::Architecture": TARGET.architecture,
        "APT::Architectures": TARGET.architecture,
        "APT::Install-Recommends": "0",
        "APT::Sandbox::User": "",
        "Debug::NoLocking": "1",
        "Dir::State": str(state),
        "Dir::State::status": str(state / "status"),
        "Dir::Cache": str(cache),
    }
    apt = ["apt-get", "-qq", *(part for key, value in options.items() for part in ("-o", f"{key}={value}"))]
    for step in (["update"], ["install", "--yes", "--download-only", *PACKAGES]):
        try:
            subprocess.run([*apt, *step], check=True, capture_output=True, text=True, timeout=300)
        except (OSError, subprocess.SubprocessError) as error:
            told = getattr(error, "stderr", None) or str(error)
            raise UnavailableError(f"apt cannot fetch Debian's arm64 packages: {told.strip()[-200:]}") from error
    return sorted((cache / "archives").glob("*.deb"))


def _compile(folder: Path) -> None:
    """As Debian's own scripts do after the installation; a file of a test that is no Python does no harm."""
    compileall = [sys.executable, "-m", "compileall", "-q", str(folder)]
    subprocess.run(compileall, check=False, stdout=subprocess.DEVNULL)


def _unpack(package: Path, root: Path) -> None:
    subprocess.run(["dpkg-deb", "--extract", str(package), str(root)], check=True)
