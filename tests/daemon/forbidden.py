"""What a unit file forbids its service, forbidden to this process: for a subprocess that a test starts.

libseccomp (Debian: libseccomp2) makes the filters, as systemd does: what `SystemCallFilter` does not allow fails with
`SystemCallErrorNumber`, memory cannot become executable (`MemoryDenyWriteExecute`), and there are no sockets but those
of `RestrictAddressFamilies`. The groups, such as @resources, are systemd's own: asked of `systemd-analyze`, or as
`systemd_groups.txt` has them. Renew that file with: python -m tests.daemon.forbidden > tests/daemon/systemd_groups.txt
"""

from __future__ import annotations

import ctypes
import errno
import mmap
import shutil
import socket
import subprocess
import sys
from collections.abc import Iterable, Mapping
from ctypes.util import find_library
from pathlib import Path

SYSTEMD = Path(__file__).parents[2] / "systemd"
STORED_GROUPS = Path(__file__).with_name("systemd_groups.txt")

ALLOW, ERRNO = 0x7FFF0000, 0x00050000
"""SCMP_ACT_ALLOW, SCMP_ACT_ERRNO(0); seccomp.h of libseccomp."""
NOT_EQUAL, MASKED_EQUAL = 1, 7
"""SCMP_CMP_NE, SCMP_CMP_MASKED_EQ."""
SHM_EXEC = 0o100000
"""sys/shm.h."""

Groups = Mapping[str, frozenset[str]]


class _Comparison(ctypes.Structure):
    """struct scmp_arg_cmp."""

    _fields_ = (
        ("argument", ctypes.c_uint),
        ("operation", ctypes.c_int),
        ("first", ctypes.c_uint64),
        ("second", ctypes.c_uint64),
    )


def library() -> ctypes.CDLL | None:
    """libseccomp, if it is installed."""
    name = find_library("seccomp")
    if name is None:
        return None
    found = ctypes.CDLL(name)
    found.seccomp_init.restype = ctypes.c_void_p
    found.seccomp_init.argtypes = [ctypes.c_uint32]
    comparisons = ctypes.POINTER(_Comparison)
    found.seccomp_rule_add_array.argtypes = [
        ctypes.c_void_p,
        ctypes.c_uint32,
        ctypes.c_int,
        ctypes.c_uint,
        comparisons,
    ]
    found.seccomp_load.argtypes = [ctypes.c_void_p]
    return found


def service_of(unit: Path) -> dict[str, list[str]]:
    """The section [Service]: for each key its values, as often as it stands there."""
    found: dict[str, list[str]] = {}
    section = ""
    for line in unit.read_text().splitlines():
        if line.startswith("["):
            section = line
        elif section == "[Service]" and "=" in line and line[0] not in "#;":
            key, value = line.split("=", 1)
            found.setdefault(key, []).append(value)
    return found


def groups() -> Groups:
    """Each group of system calls with what stands in it: names and other groups."""
    if shutil.which("systemd-analyze") is None:
        text = STORED_GROUPS.read_text()
    else:
        command = ["systemd-analyze", "--no-pager", "syscall-filter"]
        text = subprocess.run(command, capture_output=True, text=True, timeout=30, check=True).stdout
    found: dict[str, set[str]] = {}
    members: set[str] = set()
    for line in text.splitlines():
        name = line.strip()
        if line.startswith("@"):
            members = found.setdefault(name, set())
        elif name and not name.startswith("#"):
            members.add(name)
    return {name: frozenset(members) for name, members in found.items()}


def allowed(unit: Path, known: Groups) -> frozenset[str]:
    """The system calls that the unit allows; a list that begins with ~ takes away (systemd.exec(5))."""
    found = set(_expanded(["@default"], known))
    for value in service_of(unit)["SystemCallFilter"]:
        names = _expanded(value.removeprefix("~").split(), known)
        found = found - names if value.startswith("~") else found | names
    return frozenset(found)


def _expanded(names: Iterable[str], known: Groups) -> set[str]:
    found: set[str] = set()
    for name in names:
        found |= _expanded(known[name], known) if name.startswith("@") else {name}
    return found


def forbid(unit: Path) -> None:
    """From now on this process, with all threads that it starts, lives as the unit's service does. Raises OSError."""
    seccomp = library()
    if seccomp is None:
        raise OSError(errno.ENOENT, "libseccomp is not installed")
    service = service_of(unit)
    refused = ERRNO | getattr(errno, service["SystemCallErrorNumber"][-1])
    calls = allowed(unit, groups())
    others = seccomp.seccomp_init(ALLOW)
    if service["MemoryDenyWriteExecute"] == ["yes"]:
        both = mmap.PROT_WRITE | mmap.PROT_EXEC
        _add(seccomp, others, ERRNO | errno.EPERM, "mmap", _Comparison(2, MASKED_EQUAL, both, both))
        executable = _Comparison(2, MASKED_EQUAL, mmap.PROT_EXEC, mmap.PROT_EXEC)
        for name in ("mprotect", "pkey_mprotect"):
            _add(seccomp, others, ERRNO | errno.EPERM, name, executable)
        _add(seccomp, others, ERRNO | errno.EPERM, "shmat", _Comparison(2, MASKED_EQUAL, SHM_EXEC, SHM_EXEC))
    if service["RestrictAddressFamilies"] == ["AF_UNIX"]:
        local = _Comparison(0, NOT_EQUAL, socket.AF_UNIX, 0)
        _add(seccomp, others, ERRNO | errno.EAFNOSUPPORT, "socket", local)
    listed = seccomp.seccomp_init(refused)
    for name in sorted(calls):
        _add(seccomp, listed, ALLOW, name)
    for context in (others, listed):
        status = seccomp.seccomp_load(context)
        if status < 0:
            raise OSError(-status, "seccomp_load")


def _add(seccomp: ctypes.CDLL, context: int, action: int, name: str, *comparisons: _Comparison) -> None:
    """A rule for a system call that this kind of computer has."""
    number = seccomp.seccomp_syscall_resolve_name(name.encode())
    if number < 0:
        return  # unknown here, or another kind of computer's
    many = (_Comparison * len(comparisons))(*comparisons)
    status = seccomp.seccomp_rule_add_array(context, action, number, len(comparisons), many)
    if status < 0:
        raise OSError(-status, f"seccomp_rule_add {name}")


if __name__ == "__main__":
    version = subprocess.run(["systemd-analyze", "--version"], capture_output=True, text=True, check=True).stdout
    found = groups()
    sys.stdout.write(f"# `systemd-analyze syscall-filter` of {version.splitlines()[0]}; see forbidden.py\n")
    for group in sorted(found):
        if group != "@known":
            sys.stdout.writelines([f"{group}\n", *(f"    {name}\n" for name in sorted(found[group]))])
