"""The file of a team's keys: read, checked, written, and protected from other users.

One key a line, the oldest first, each with the days for which it is valid:

    key 000102030405060708090a0b0c0d0e0f made 2026-11-21 from 2026-11-21 until 2026-12-21
    revoked Zoe

A robot speaks with the newest key whose `from` has come, and accepts all whose `until` has not passed. So while robots
are apart, robots with the new key already understand those without it, and the other way round once all have it.
"""

from __future__ import annotations

import fcntl
import os
import re
import secrets
import shlex
import stat
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field, replace
from datetime import date, timedelta
from pathlib import Path

from hvcpd.config.files import write_whole
from hvcpd.errors import KeyFileError, writing
from hvcpd.security.keys import KEY_BYTES, KeyRing, TeamKey

CREDENTIAL = "hvcpd.key"
"""The name under which systemd hands the file to the service (systemd.exec(5), LoadCredential=)."""
DEFAULT_PATH = Path("/etc/hvcpd/team.key")
"""File where `hvcpctl key` keeps the key unless another is given."""
MAX_BYTES = 64 * 1024
"""Largest key file that is read: no team has that many keys; a device file or a film is not read to its end."""
_ENTRY = re.compile(
    rf"key (?P<secret>[0-9a-f]{{{2 * KEY_BYTES}}}) made (?P<made>\S+) from (?P<spoken>\S+)(?: until (?P<until>\S+))?"
)
_REVOKED = re.compile(r"revoked ([A-Za-z][A-Za-z0-9]{0,31})")
_HEAD = "# The key of a team of robots (hvcpd). Anybody who can read this file can speak as any of them.\n"


@dataclass(frozen=True)
class Entry:
    """One key and its days."""

    key: TeamKey
    made: date
    spoken_from: date
    until: date | None = None


@dataclass(frozen=True)
class KeyFile:
    """All entries, the oldest first, and the names whose voices are no longer trusted."""

    entries: tuple[Entry, ...] = field(repr=False)
    revoked: tuple[str, ...] = ()

    @property
    def newest(self) -> date:
        """When the newest key was made."""
        return max(entry.made for entry in self.entries)

    def ring(self, today: date | None) -> KeyRing:
        """The keys that are valid on a day. None, or a day before the newest key was made, counts as the day when it
        was made: a Raspberry Pi has no clock that outlives a power cut. Raises KeyFileError if no key is valid."""
        day = self.newest if today is None else max(today, self.newest)
        valid = [entry for entry in self.entries if entry.until is None or entry.until >= day]
        if not valid:
            raise KeyFileError("every key of the team has expired; make a new one with: hvcpctl key rotate")
        spoken = [entry for entry in valid if entry.spoken_from <= day] or valid
        others = tuple(entry.key for entry in reversed(valid) if entry is not spoken[-1])
        return KeyRing(spoken[-1].key, others, frozenset(self.revoked))

    def rotated(self, today: date, after: timedelta, keep: timedelta) -> KeyFile:
        """Return the file with a fresh key, spoken from `after` on; older ones are believed for `keep` from then on, or
        leave the file at once where that is 0. The clock is as for `ring`."""
        day = max(today, self.newest)
        spoken_from = day + after
        ending = [replace(e, until=min(e.until or date.max, spoken_from + keep)) for e in self.entries]
        ends_now = not after and not keep  # a robot without a clock would believe them for ever
        alive = () if ends_now else tuple(entry for entry in ending if entry.until is None or entry.until >= day)
        return replace(self, entries=(*alive, fresh_entry(day, spoken_from)))

    def is_revoked(self, name: str) -> bool:
        return name.casefold() in {other.casefold() for other in self.revoked}

    def with_revoked(self, name: str) -> KeyFile:
        return self if self.is_revoked(name) else replace(self, revoked=(*self.revoked, name))


def fresh_entry(today: date, spoken_from: date | None = None) -> Entry:
    """A key that nobody has had before, from the system's source of randomness."""
    return Entry(TeamKey(secrets.token_bytes(KEY_BYTES)), today, spoken_from or today)


def find_key_file(named: Path | None, environment: Mapping[str, str] = os.environ) -> Path | None:
    """The key file to use: the one that the settings name, or systemd's credential; None without a key."""
    if named is not None:
        return named
    folder = environment.get("CREDENTIALS_DIRECTORY")
    credential = Path(folder) / CREDENTIAL if folder else None
    return credential if credential is not None and credential.is_file() else None


def key_command(action: str, path: Path) -> str:
    """The command, ready to be copied, that has `hvcpctl key` carry an action out on this file."""
    return f"hvcpctl key {action}" + (f" --key {shlex.quote(str(path))}" if path != DEFAULT_PATH else "")


def read_key_file(path: Path, environment: Mapping[str, str] = os.environ) -> KeyFile:
    """Raises KeyFileError if it is missing, readable by others, or malformed; the error never shows its content."""
    try:
        handle = os.open(path, os.O_RDONLY | os.O_CLOEXEC | os.O_NONBLOCK)
        state = os.fstat(handle)
        if not stat.S_ISREG(state.st_mode):
            os.close(handle)
            raise KeyFileError(f"{path}: this is not a regular file; name the team's key file")
        with os.fdopen(handle, "rb") as file:
            handed = environment.get("CREDENTIALS_DIRECTORY")
            if not (handed and path.parent == Path(handed)):  # systemd protects those itself
                _refuse_open_doors(path, state)
            content = file.read(MAX_BYTES + 1)
    except OSError as error:
        remedy = "check its name and its disk"
        if isinstance(error, PermissionError):
            remedy = "run as its owner, or make this user its owner"
        elif isinstance(error, FileNotFoundError):
            remedy = f"make one with: {key_command('new', path)}"
        raise KeyFileError(f"{path}: the key cannot be read: {error.strerror}; {remedy}") from None
    if len(content) > MAX_BYTES:
        raise KeyFileError(f"{path}: too large for a key file; name the team's key file")
    return parse_key_file(content.decode("utf-8", "replace"), str(path))


def _refuse_open_doors(path: Path, state: os.stat_result) -> None:
    if state.st_mode & 0o077:
        raise KeyFileError(f"{path}: others can read this key; close it with: chmod 600 {shlex.quote(str(path))}")
    if state.st_uid not in (os.geteuid(), 0):
        take_over = f"chown {os.geteuid()} {shlex.quote(str(path))}"
        raise KeyFileError(f"{path}: this key belongs to somebody else; take it over with: {take_over}")


def parse_key_file(text: str, source: str) -> KeyFile:
    """The content of a key file. Raises KeyFileError naming the line, not its content."""
    entries: list[Entry] = []
    revoked: list[str] = []
    for number, line in enumerate(text.splitlines(), 1):
        line = line.strip()
        if not line or line.startswith("#"):
            continue
        try:
            if match := _ENTRY.fullmatch(line):
                entries.append(_entry(match))
            elif match := _REVOKED.fullmatch(line):
                revoked.append(match[1])
            else:
                raise ValueError
        except ValueError:
            raise KeyFileError(
                f"{source}, line {number}: not understood; restore the file from its copy, or move it away and type "
                "the recovery sheet (hvcpctl key restore)"
            ) from None
    if not entries:
        raise KeyFileError(f"{source}: there is no key in it; move it away, and make one with: hvcpctl key new")
    return KeyFile(tuple(entries), tuple(revoked))


def _entry(match: re.Match[str]) -> Entry:
    until = match["until"]
    return Entry(
        TeamKey(bytes.fromhex(match["secret"])),
        date.fromisoformat(match["made"]),
        date.fromisoformat(match["spoken"]),
        date.fromisoformat(until) if until else None,
    )


def written(keys: KeyFile) -> str:
    """The content of the file."""
    lines = [
        f"key {e.key.secret.hex()} made {e.made} from {e.spoken_from}" + (f" until {e.until}" if e.until else "")
        for e in keys.entries
    ]
    return _HEAD + "\n".join([*lines, *(f"revoked {name}" for name in keys.revoked)]) + "\n"


def write_key_file(path: Path, keys: KeyFile, replaces: bool) -> None:
    """Write it whole, readable by its owner alone; where a link points, if it is one. Raises KeyFileError; without
    `replaces` also if there is one."""
    with writing(path, KeyFileError, "the key: ", "name another with --key"):
        if not replaces:
            see_free(path)
        write_whole(path, written(keys).encode(), 0o600)


def see_free(path: Path) -> None:
    """Raise KeyFileError where there is a file or a folder already."""
    if path.is_dir():
        raise KeyFileError(f"{path}: this is a folder; name a file in it with --key")
    if path.exists():
        raise KeyFileError(
            f"{path}: this is there; change its key with: {key_command('rotate', path)}, or move it away"
        )


@contextmanager
def changing(path: Path) -> Iterator[None]:
    """Lock the file between reading and writing: of two simultaneous changes one would be lost."""
    try:
        folder = os.open(Path(os.path.realpath(path)).parent, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
    except OSError as error:
        raise KeyFileError(f"{path}: its folder cannot be opened: {error.strerror}; name another with --key") from None
    try:
        fcntl.flock(folder, fcntl.LOCK_EX)
        yield
    finally:
        os.close(folder)


def keep_out_of_dumps() -> None:
    """Keep this process's memory out of core dumps and from other processes of the same user."""
    import ctypes
    import resource

    with suppress(OSError, ValueError):  # a service manager that forbids it has set the limit itself
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    ctypes.CDLL(None, use_errno=True).prctl(_PR_SET_DUMPABLE, 0, 0, 0, 0)


_PR_SET_DUMPABLE = 4
"""prctl(2), from linux/prctl.h."""
