"""The file of the control socket: where it lies, who may use it, and that only one daemon of a name has it."""

from __future__ import annotations

import fcntl
import os
import socket
import stat
import struct
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from hvcpd.config.folders import xdg_folder
from hvcpd.errors import NotRunningError, RunningError

if TYPE_CHECKING:  # what only asks a robot checks no settings
    from hvcpd.config.settings import Settings

SYSTEM_FOLDER = Path("/run/hvcpd")
"""Folder where a service keeps its sockets, by the Filesystem Hierarchy Standard; systemd or the package makes it."""

SUFFIX = ".sock"
"""Of a socket that the settings do not name."""

MODE = 0o660
"""Owner and group: people who may command the robot join the group."""

MAX_NAME_BYTES = 100
"""Of a robot's name in a lock file; longer than any name may be."""

BACKLOG = 32
"""Connections that may wait to be accepted; further ones wait to be one of them."""


@dataclass(frozen=True)
class Caller:
    """The process at the other end of a connection, as the kernel reports it (SO_PEERCRED, unix(7))."""

    pid: int
    uid: int
    gid: int


def socket_folders(state_dir: Path, environment: Mapping[str, str] = os.environ) -> tuple[Path, ...]:
    """The default folders for the socket, each once, in the order in which a daemon with that `state_dir` tries."""
    given = [Path(folder) for folder in environment.get("RUNTIME_DIRECTORY", "").split(":") if folder]
    of_user = xdg_folder("XDG_RUNTIME_DIR", environment)
    runtime = (of_user / "hvcpd",) if of_user is not None else ()
    return tuple(dict.fromkeys((*given[:1], *runtime, SYSTEM_FOLDER, state_dir)))


def socket_name(name: str) -> str:
    """The file name of the socket of the robot of that name."""
    return f"{name.lower()}{SUFFIX}"


def socket_path(settings: Settings, environment: Mapping[str, str] = os.environ) -> Path:
    """The path of the socket of a daemon with these settings."""
    if settings.control.socket is not None:
        return settings.control.socket
    folders = socket_folders(settings.state_dir, environment)
    usable = (folder for folder in folders if os.access(folder, os.W_OK | os.X_OK) and folder.is_dir())
    return next(usable, settings.state_dir) / socket_name(settings.name)


def runtime_file(settings: Settings, suffix: str) -> Path:
    """A file of this robot alone beside its socket: "rob.pose" beside "rob.sock". Only SUFFIX is replaced, since the
    sockets of two robots may be called "team.rob" and "team.bot"."""
    path = socket_path(settings)
    return path.with_suffix(suffix) if path.suffix == SUFFIX else path.with_name(path.name + suffix)


class SocketFile:
    """A listening socket and the lock beside it, which is held as long as this process lives."""

    def __init__(self, path: Path, robot: str) -> None:
        """`robot` is the name of the robot that serves at `path`."""
        self.path = path
        self._robot = robot
        self._lock: int | None = None
        self._made: os.stat_result | None = None

    @property
    def is_there(self) -> bool:
        """Whether who connects to the path reaches this socket: its folder may be removed, as a user's is at logout."""
        try:
            return self._made is not None and os.path.samestat(self.path.lstat(), self._made)
        except OSError:
            return False

    def listen(self) -> socket.socket:
        """Return the listening socket; a file left behind by a daemon that has ended is replaced.

        Raises RunningError if a daemon has it, OSError if it cannot be made.
        """
        self.path.parent.mkdir(parents=True, exist_ok=True)
        self._lock = self._locked(self.path.with_name(self.path.name + ".lock"))
        listener = listen_at(self.path, MODE, BACKLOG)
        self._made = self.path.lstat()
        return listener

    def remove(self) -> None:
        """Remove the socket and release the lock; the lock's own file stays, so that nobody locks another one."""
        if self.is_there:
            with suppress(OSError):
                self.path.unlink()
        self._made = None
        if self._lock is not None:
            os.close(self._lock)
            self._lock = None

    def _locked(self, path: Path) -> int:
        """As `locked`, with the robot's name in the file, for the message to another one: the settings of two robots
        may name the same socket."""
        try:
            lock = locked(path, self.path)
        except RunningError as error:
            holder = path.read_bytes()[:MAX_NAME_BYTES].decode(errors="replace")
            if holder.casefold() in ("", self._robot.casefold()):  # older versions wrote no name
                raise
            remedy = "give each robot its own `control.socket`, or none"
            raise RunningError(f"{holder} already has the control socket {self.path}; {remedy}") from error
        with suppress(OSError):  # a full disk
            os.ftruncate(lock, 0)
            os.write(lock, self._robot.encode())
        return lock


def locked(path: Path, what: Path) -> int:
    """Lock the file `path` until the returned descriptor is closed or the process ends.

    Raises RunningError if a daemon, which so has `what`, holds it, OSError if it cannot be made.
    """
    lock = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC | os.O_NOFOLLOW, 0o600)
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as error:
        os.close(lock)
        if not isinstance(error, BlockingIOError):
            raise
        raise RunningError(
            f"a robot of this name already runs on this computer (it holds {what}); stop it, or give this one "
            "another name with --name NAME"
        ) from None
    return lock


def listen_at(path: Path, mode: int, backlog: int) -> socket.socket:
    """A socket that listens at `path`, with these permissions, in place of one that was left behind there. Raises
    OSError."""
    with suppress(FileNotFoundError):
        if not stat.S_ISSOCK(path.lstat().st_mode):
            raise FileExistsError(None, "something that is not a socket is in its place", str(path))
        path.unlink()
    listener = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    try:
        with short_address(path) as address:
            listener.bind(address)
        path.chmod(mode)  # nobody can connect before `listen`, so nobody slips in
        listener.listen(backlog)
    except OSError:
        listener.close()
        raise
    return listener


@contextmanager
def short_address(path: Path) -> Iterator[str]:
    """A short address for `bind` and `connect` to a path of any length: AF_UNIX allows 107 bytes (unix(7)).

    Raises OSError if the folder is not there.
    """
    folder = os.open(path.parent, os.O_PATH | os.O_DIRECTORY | os.O_CLOEXEC)
    try:
        yield f"/proc/self/fd/{folder}/{path.name}"
    finally:
        os.close(folder)


def answers(path: Path) -> bool:
    """Whether somebody listens at the path, as far as this user may know."""
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as probe:
        probe.setblocking(False)
        try:
            with short_address(path) as address:
                probe.connect(address)
        except (PermissionError, BlockingIOError):  # somebody is there, and keeps us out, or waiting
            return True
        except OSError:
            return False
    return True


def no_answer(path: Path, error: OSError) -> NotRunningError:
    """The error for a socket at which nobody listens."""
    if os.path.exists(path) and not path.is_socket():  # noqa: PTH110 - false for a name that is too long
        return NotRunningError(f"{path}: this is no socket; name that of a daemon, such as /run/hvcpd/rob.sock")
    return NotRunningError(f"no daemon answers at {path} ({error.strerror or error}); start it with `hvcpd`")


def caller_of(connection: socket.socket) -> Caller:
    """The process at the other end of a connection."""
    size = struct.calcsize("3i")
    return Caller(*struct.unpack("3i", connection.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, size)))
