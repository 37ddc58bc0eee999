"""The lock file: what hvcpd runs on, to the version and the hash; and for which computer.

The format is pip's requirements file as `make lock` writes it: `name==version ; marker`, then lines `--hash=sha256:…`.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from packaging.markers import Marker
from packaging.requirements import InvalidRequirement, Requirement
from packaging.utils import canonicalize_name

LOCK = Path(__file__).parents[1] / "requirements" / "run.txt"
"""What the daemon and hvcpctl need, without what the tests need."""

_HASH = re.compile(r"--hash=sha256:([0-9a-f]{64})(?:\s|$)")

OLDEST_GLIBC = 17
"""glibc 2.17 is where the wheels' platform tags begin on 64-bit ARM (PEP 599)."""

MACHINES = {"amd64": "x86_64", "arm64": "aarch64"}
"""Debian's name of an architecture, and the kernel's."""

GLIBC = {"3.11": 36, "3.13": 41}
"""Python's version, and x of the C library's version 2.x, in Debian 12 and 13 and so in Raspberry Pi OS."""


class LockError(Exception):
    """The lock file, or the wish for a computer, is wrong; the text names the place and the remedy."""


@dataclass(frozen=True)
class Locked:
    """One line of the lock: a package in one version, where it is needed, and the files that it may be."""

    name: str
    version: str
    marker: str | None
    hashes: tuple[str, ...]
    """SHA-256 in hexadecimal, one for each file of that version."""

    @property
    def line(self) -> str:
        """The line as pip reads it, without the marker."""
        return " ".join((f"{self.name}=={self.version}", *(f"--hash=sha256:{digest}" for digest in self.hashes)))


@dataclass(frozen=True)
class Target:
    """A computer to install on: the version of its Python ("3.11") and Debian's name of its architecture ("arm64")."""

    python: str
    architecture: str

    def __post_init__(self) -> None:
        if self.python not in GLIBC:
            raise LockError(f"Python {self.python!r}: choose the one of Debian 12 or 13, {' or '.join(GLIBC)}")
        if self.architecture not in MACHINES:
            raise LockError(f"architecture {self.architecture!r}: choose {' or '.join(MACHINES)}")

    @property
    def machine(self) -> str:
        """As `uname -m` says it there."""
        return MACHINES[self.architecture]

    def needs(self, locked: Locked) -> bool:
        """Whether the line's marker holds there."""
        environment = {
            "implementation_name": "cpython",
            "os_name": "posix",
            "platform_machine": self.machine,
            "platform_python_implementation": "CPython",
            "platform_system": "Linux",
            "python_full_version": f"{self.python}.0",
            "python_version": self.python,
            "sys_platform": "linux",
        }
        return locked.marker is None or Marker(locked.marker).evaluate(environment)

    def pip_options(self) -> list[str]:
        """What makes pip look for wheels of that computer instead of this one."""
        short = self.python.replace(".", "")
        options = ["--python-version", self.python, "--implementation", "cp", "--only-binary", ":all:"]
        options += ["--ignore-requires-python"]  # `pip install` would compare with the Python that it runs on
        for abi in (f"cp{short}", "abi3", "none"):
            options += ["--abi", abi]
        for minor in range(GLIBC[self.python], OLDEST_GLIBC - 1, -1):
            options += ["--platform", f"manylinux_2_{minor}_{self.machine}"]
        return [*options, "--platform", f"manylinux2014_{self.machine}"]


def read_lock(path: Path = LOCK) -> tuple[Locked, ...]:
    """Every line of the lock. Raises LockError for one that is not pinned by version and hash."""
    lines = path.read_text().replace("\\\n", " ").splitlines()
    return tuple(_locked(line, path) for line in lines if line.strip() and not line.lstrip().startswith("#"))


def needed(lock: Iterable[Locked], target: Target) -> tuple[Locked, ...]:
    """The part of the lock that `target` needs."""
    return tuple(locked for locked in lock if target.needs(locked))


def _locked(line: str, path: Path) -> Locked:
    text = line.split(" --hash")[0].strip()
    try:
        requirement = Requirement(text)
    except InvalidRequirement as error:
        raise LockError(f"{path}: {text!r} is no requirement ({error}); run `make lock`") from error
    versions = [each.version for each in requirement.specifier if each.operator == "=="]
    hashes = tuple(_HASH.findall(line))
    if len(versions) != 1 or len(requirement.specifier) != 1 or not hashes or line.count("--hash=") != len(hashes):
        raise LockError(f"{path}: {text!r} is not pinned to one version by SHA-256; run `make lock`")
    marker = str(requirement.marker) if requirement.marker is not None else None
    return Locked(canonicalize_name(requirement.name), versions[0], marker, hashes)
