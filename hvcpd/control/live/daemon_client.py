"""Asks a running daemon over its control socket; docs/control.md describes the lines."""

from __future__ import annotations

import argparse
import json
import os
import pwd
import shlex
import socket
import struct
import time
from collections.abc import Iterator, Mapping
from contextlib import closing, suppress
from pathlib import Path
from typing import Any

from hvcpd.config.json_objects import json_object
from hvcpd.config.whereabouts import STAND_IN_NAME, Whereabouts, whereabouts
from hvcpd.control.output import print_note
from hvcpd.daemon.control_protocol import PROTOCOL
from hvcpd.daemon.control_socket import answers, no_answer, short_address, socket_folders, socket_name
from hvcpd.errors import BusyError, ConfigError, HvcpdError, NotAllowedError, NotDoneError, NotRunningError, PhraseError

ANSWER_S = 10.0
"""Time limit of an answer; a running daemon answers within about 0.05 s, two blocks of sound, or later on an overloaded
computer."""

CHUNK_BYTES = 65536
"""Bytes read at a time; a line of events has a few hundred."""

REPEATABLE = frozenset({"stop", "status", "tasks", "config"})
"""Commands that may be sent twice without harm."""

_REFUSALS: dict[str, type[HvcpdError]] = {
    "bad_argument": ConfigError,
    "bad_settings": ConfigError,
    "not_in_phrasebook": PhraseError,
    "busy": BusyError,
}
"""The protocol's codes for errors that the user can fix in the command, or by trying again."""


class DaemonClient:
    """One connection to a daemon. Raises NotRunningError, NotAllowedError, and BusyError if the daemon is too busy or
    frozen."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.patience_s = ANSWER_S
        """The time limit for an answer."""
        self._connect()

    def _connect(self) -> None:
        self._unread = bytearray()
        self._hello: dict[str, Any] | None = None
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        try:
            with short_address(self.path) as address:
                connect_in_turn(self._socket, address)
        except OSError as error:
            self._socket.close()
            raise self._unreachable(error) from None

    def _unreachable(self, error: OSError) -> HvcpdError:
        match error:
            case PermissionError():
                return NotAllowedError(permission_fault(self.path, os.getuid()))
            case BlockingIOError():
                return BusyError(f"the daemon at {self.path} is too busy to answer: too many programs connect to it")
            case _:
                return no_answer(self.path, error)

    @property
    def name(self) -> str:
        """The robot's name."""
        return str(self._greeted().get("name"))

    def _greeted(self) -> dict[str, Any]:
        """The daemon's first line. Raises NotDoneError if it talks another protocol."""
        if self._hello is None:
            self._hello = self._read()
            if self._hello.get("protocol") != PROTOCOL:
                _raise_refusal(self._hello)
                raise NotDoneError(
                    f"{self.path}: that daemon (hvcpd {self._hello.get('version')}) uses another protocol version "
                    "than this hvcpctl; restart it after an upgrade"
                )
        return self._hello

    def ask(self, command: str, **arguments: Any) -> dict[str, Any]:
        """The result of a command. Raises NotDoneError, or ConfigError or PhraseError for bad input.

        The request is sent at once, before the daemon has said anything: it serves first who has asked already. What
        may be asked twice is asked again if the daemon hung up on us, as it does where too many programs ask.
        """
        request = json.dumps({"command": command, **arguments}).encode() + b"\n"
        until_s = time.monotonic() + (ANSWER_S if command in REPEATABLE else 0.0)
        while True:
            try:
                return self._asked(request)
            except (BusyError, NotRunningError):
                if self._hello is None or time.monotonic() >= until_s:
                    raise
            self.close()
            self._connect()

    def _asked(self, request: bytes) -> dict[str, Any]:
        self._socket.settimeout(self.patience_s)
        with suppress(OSError):  # what it said before it hung up tells why
            self._socket.sendall(request)
        self._greeted()
        reply = self._read()
        while "event" in reply:
            reply = self._read()
        if reply.get("ok") is True:
            return dict(reply["result"])
        _raise_refusal(reply)
        raise NotDoneError("the daemon gave no reason")

    def events(self, within_s: float) -> Iterator[dict[str, Any]]:
        """The events after a `subscribe` that come within this time. Raises NotRunningError."""
        until_s = time.monotonic() + within_s
        while (left_s := until_s - time.monotonic()) > 0.0 and (event := self.event_within(left_s)) is not None:
            yield event

    def event_within(self, timeout_s: float) -> dict[str, Any] | None:
        """The next event after a `subscribe`; None if none comes within this time. Raises NotRunningError."""
        self._greeted()
        self._socket.settimeout(timeout_s)
        try:
            return self._next_object()
        except TimeoutError:
            return None

    def close(self) -> None:
        """Close the connection."""
        self._socket.close()

    def _read(self) -> dict[str, Any]:
        try:
            return self._next_object()
        except TimeoutError:
            raise BusyError(
                f"the daemon at {self.path} does not answer; is it frozen? See `systemctl status hvcpd`"
            ) from None

    def _next_object(self) -> dict[str, Any]:
        """The next line's object; a part received before a TimeoutError is kept for the next call."""
        while b"\n" not in self._unread:
            try:
                more = self._socket.recv(CHUNK_BYTES)
            except TimeoutError:
                raise
            except OSError as error:
                raise NotRunningError(f"the daemon at {self.path} has ended ({error.strerror})") from None
            if not more:
                raise NotRunningError(
                    f"the daemon at {self.path} has ended, or has hung up because what it sent was not read in time"
                )
            self._unread += more
        line, _, self._unread = self._unread.partition(b"\n")
        value = json_object(bytes(line))
        if value is None:
            raise NotDoneError(
                f"the program that answers at {self.path} is not hvcpd; name its socket with --socket FILE"
            )
        return value


def connect_in_turn(connection: socket.socket, address: str, patience_s: float = ANSWER_S) -> None:
    """Connect; if many want to, wait for our turn, at most this time. Raises BlockingIOError if it does not come.

    The kernel wakes who waits in order, but only those that block: a time limit of Python's own would fail at once.
    """
    connection.setblocking(True)
    seconds, fraction_s = divmod(patience_s, 1.0)
    limit = struct.pack("@ll", int(seconds), int(fraction_s * 1e6))
    connection.setsockopt(socket.SOL_SOCKET, socket.SO_SNDTIMEO, limit)
    connection.connect(address)
    connection.settimeout(ANSWER_S)


def _raise_refusal(reply: Mapping[str, Any]) -> None:
    """Raise the error that a reply reports, if it reports one."""
    refusal = reply.get("error")
    if isinstance(refusal, dict):
        kind: type[HvcpdError] = _REFUSALS.get(str(refusal.get("code")), NotDoneError)
        raise kind(str(refusal.get("text", "the daemon gave no reason")))


def find_daemon(options: argparse.Namespace, where: Whereabouts | None = None, *, noted: bool = True) -> DaemonClient:
    """The daemon that the options and settings mean; without a name the only one there is. `where`: as the settings
    have it, if they were read.

    Errors in the settings are `noted` on standard error where none is found, and where they cannot be read. Raises
    NotRunningError, NotAllowedError, and ConfigError where several run and none was named.
    """
    if options.socket is not None:
        return _at(options.socket, options.name)
    where = where or meant(options, noted=noted)
    try:
        return _daemon_at(where, options)
    except (NotRunningError, ConfigError):
        if noted and where.fault is None:
            _note_errors(options)
        raise


def _daemon_at(where: Whereabouts, options: argparse.Namespace) -> DaemonClient:
    if where.socket is not None:
        return _at(where.socket, options.name)
    folders, file = socket_folders(where.state_dir), options.config
    if where.name is not None:
        return _only([folder / socket_name(where.name) for folder in folders], where.name, folders, file)
    running = _running(folders)
    if len(running) > 1 and len({path.name for path in running}) == len(running):
        names = ", ".join(path.stem for path in running)
        raise ConfigError(f"several robots run here ({names}); choose one with --name NAME")
    return _only(running, None, folders, file)


def _at(path: Path, name: str | None) -> DaemonClient:
    """The daemon at this socket. Raises NotRunningError if --name names another robot than the one there."""
    daemon = DaemonClient(path)
    if name is not None and daemon.name.lower() != name.lower():
        daemon.close()
        raise NotRunningError(f"{path}: this is {daemon.name}'s socket, not {name}'s; name another by --socket")
    return daemon


def running_sockets(where: Whereabouts, is_chosen: bool) -> list[Path]:
    """The sockets of all robots that run here, as far as the settings tell where they are; if one `is_chosen`, of those
    at the usual places that may be meant: of this name, or any where there is none."""
    folders, own = socket_folders(where.state_dir), where.socket
    if is_chosen:
        return _running(folders, where.name) if own is None else []
    there = [own] if own is not None and answers(own) else []
    return _each_once([*there, *_running(folders)])


def find_daemon_of(name: str, options: argparse.Namespace) -> DaemonClient | None:
    """The daemon of that robot, if it runs here and may be asked. Who goes on without it tells of errors in the
    settings."""
    where = meant(options, noted=False)
    own = where.socket if (where.name or STAND_IN_NAME).lower() == name.lower() else None
    paths = [own] if own else [folder / socket_name(name) for folder in socket_folders(where.state_dir)]
    for path in paths:
        with suppress(NotRunningError, NotAllowedError):
            return DaemonClient(path)
    return None


def running_robot(name: str, options: argparse.Namespace) -> str | None:
    """The name of that robot if it runs here, so that the sound card and the wheels are its own; else None."""
    daemon = find_daemon_of(name, options)
    if daemon is None:
        return None
    with closing(daemon):
        return daemon.name


def meant(options: argparse.Namespace, *, noted: bool = True) -> Whereabouts:
    """Of the robot that the options and settings name."""
    where = whereabouts(options.config, getattr(options, "name", None))
    if noted and where.fault is not None:
        _note(where.fault)
    return where


def _note_errors(options: argparse.Namespace) -> None:
    """Tell of errors in the settings, which may be why no robot is found where they have it."""
    from hvcpd.config.settings_file import load_with_sources  # not where one is found: it takes as long as all else

    try:
        load_with_sources(options.config, {"name": getattr(options, "name", None)}, name_needed=False)
    except ConfigError as error:
        _note(str(error))


def _note(errors: str) -> None:
    print_note(f"note: the settings have errors ({errors.splitlines()[0]})")


def _only(paths: list[Path], name: str | None, folders: tuple[Path, ...], file: Path | None) -> DaemonClient:
    """The daemon at one of these sockets; users may each have a robot of one name."""
    found: list[DaemonClient] = []
    forbidden: NotAllowedError | None = None
    for path in _each_once(paths):
        try:
            found.append(DaemonClient(path))
        except NotAllowedError as error:
            forbidden = error
        except NotRunningError:
            continue
    if len(found) > 1:
        sockets = ", ".join(str(daemon.path) for daemon in found)
        raise ConfigError(f"several robots that run here may be meant ({sockets}); choose one with --socket FILE")
    if found:
        return found[0]
    hidden = [each for each in folders if os.access(each, os.F_OK) and not os.access(each, os.R_OK | os.X_OK)]
    if forbidden is None and hidden:
        forbidden = NotAllowedError(permission_fault(hidden[0] / socket_name("*"), os.getuid()))
    if forbidden is not None:
        raise forbidden
    missing = f"{name} does not run here" if name else "no robot runs here"
    others = ", ".join(path.stem for path in _running(folders))
    with_file = f"--config {shlex.quote(str(file))} " if file is not None else ""
    hint = f"running here: {others}" if others else f"start it with `hvcpd {with_file}--name {name or 'NAME'}`"
    raise NotRunningError(f"{missing} (no socket in {', '.join(map(str, folders))}); {hint}")


def _running(folders: tuple[Path, ...], name: str | None = None) -> list[Path]:
    """The sockets in these folders, of the robot of that name or of any, at which a daemon answers or may answer."""
    found: list[Path] = []
    for folder in folders:
        with suppress(OSError):
            there = sorted(folder.glob("*.sock")) if name is None else [folder / socket_name(name)]
            found += [path for path in there if path.exists() and answers(path)]
    return _each_once(found)


def _each_once(paths: list[Path]) -> list[Path]:
    """Without those that lead to the same file as one before."""
    return list({os.path.realpath(path): path for path in reversed(paths)}.values())[::-1]


def permission_fault(path: Path, uid: int) -> str:
    """Whom to ask for permission: the socket's group, as far as it can be seen."""
    try:
        user = pwd.getpwuid(uid).pw_name
    except KeyError:  # a container's users need no names
        user = "USER"
    try:
        group = path.group()
    except (OSError, KeyError):
        group = "hvcpd"
    return (
        f"no permission to ask the daemon at {path}; `sudo usermod -aG {group} {user}`, then log in again, or use sudo"
    )
