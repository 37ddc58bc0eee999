"""Asks a running daemon over its control socket; docs/control.md describes the lines."""

from __future__ import annotations

import argparse
import json
import os
import pwd
import socket
import sys
from collections.abc import Iterator, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

from hvcpd.config.document import parse, read_bytes
from hvcpd.config.environment import FILE_VARIABLE
from hvcpd.config.settings import (
    STAND_IN_NAME,
    STATE_DIR,
    SYSTEM_SETTINGS_PATH,
    ControlSettings,
    Settings,
    load_with_sources,
)
from hvcpd.daemon.control_protocol import PROTOCOL
from hvcpd.daemon.control_socket import short_address, socket_folders, socket_name
from hvcpd.errors import ConfigError, HvcpdError, NotAllowedError, NotDoneError, NotRunningError, PhraseError

ANSWER_S = 10.0
"""A daemon that lives answers within some 0.05 s, two blocks of sound; more if its computer is overloaded."""

CHUNK_BYTES = 65536
"""Read at once: a line of events has some hundred."""

_BAD_INPUT = {"bad_argument": ConfigError, "bad_settings": ConfigError, "not_in_phrasebook": PhraseError}
"""The protocol's codes for what the user can mend in the command."""


class DaemonClient:
    """One connection to a daemon. Raises NotRunningError and NotAllowedError."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        self._socket.settimeout(ANSWER_S)
        try:
            with short_address(path) as address:
                self._socket.connect(address)
        except PermissionError:
            raise NotAllowedError(_not_allowed(path, os.getuid())) from None
        except OSError as error:
            self._socket.close()
            raise NotRunningError(f"no daemon answers at {path} ({error.strerror}); start it with `hvcpd`") from None
        self._unread = bytearray()
        self.hello = self._read()
        self.name = str(self.hello.get("name"))
        if self.hello.get("protocol") != PROTOCOL:
            raise NotDoneError(
                f"{path}: that daemon (hvcpd {self.hello.get('version')}) talks another protocol than this hvcpctl; "
                "restart it after an upgrade"
            )

    def ask(self, command: str, **arguments: Any) -> dict[str, Any]:
        """The result of a command. Raises NotDoneError, or ConfigError or PhraseError for bad input."""
        self._socket.settimeout(ANSWER_S)
        request = json.dumps({"command": command, **arguments}) + "\n"
        try:
            self._socket.sendall(request.encode())
        except OSError as error:
            raise NotRunningError(f"the daemon at {self.path} has ended ({error.strerror})") from None
        reply = self._read()
        while "event" in reply:
            reply = self._read()
        if reply.get("ok") is True:
            return dict(reply["result"])
        refusal = reply.get("error", {})
        kind: type[HvcpdError] = _BAD_INPUT.get(str(refusal.get("code")), NotDoneError)
        raise kind(str(refusal.get("text", "the daemon gave no reason")))

    def events(self, timeout_s: float | None = None) -> Iterator[dict[str, Any]]:
        """What comes after a `subscribe`, until the daemon ends. Raises NotDoneError if none comes for `timeout_s`."""
        while True:
            self._socket.settimeout(timeout_s)
            yield self._read()

    def event_within(self, timeout_s: float) -> dict[str, Any] | None:
        """The next event after a `subscribe`; None if none comes for so long. Raises NotRunningError."""
        self._socket.settimeout(timeout_s)
        try:
            return self._object(self._line())
        except TimeoutError:
            return None

    def close(self) -> None:
        """Let go of the connection."""
        self._socket.close()

    def _read(self) -> dict[str, Any]:
        try:
            return self._object(self._line())
        except TimeoutError:
            raise NotDoneError(
                f"the daemon at {self.path} does not answer; is it frozen? See `systemctl status hvcpd`"
            ) from None

    def _line(self) -> bytes:
        """One line; what came of it before a TimeoutError is kept for the next call."""
        while b"\n" not in self._unread:
            try:
                more = self._socket.recv(CHUNK_BYTES)
            except TimeoutError:
                raise
            except OSError as error:
                raise NotRunningError(f"the daemon at {self.path} has ended ({error.strerror})") from None
            if not more:
                raise NotRunningError(f"the daemon at {self.path} has ended")
            self._unread += more
        line, _, self._unread = self._unread.partition(b"\n")
        return bytes(line)

    def _object(self, line: bytes) -> dict[str, Any]:
        try:
            value = json.loads(line)
        except (ValueError, RecursionError):
            value = None
        if not isinstance(value, dict):
            raise NotDoneError(f"what answers at {self.path} is no hvcpd; name its socket with --socket FILE")
        return value


def find_daemon(options: argparse.Namespace, environment: Mapping[str, str] = os.environ) -> DaemonClient:
    """The daemon that the options and settings mean; without a name the only one there is.

    Raises NotRunningError, NotAllowedError, and ConfigError where several run and none was named.
    """
    if options.socket is not None:
        return DaemonClient(options.socket)
    settings, name = _settings(options, environment)
    if settings.control.socket is not None:
        return DaemonClient(settings.control.socket)
    folders = tuple(dict.fromkeys(socket_folders(settings, environment)))
    if name is not None:
        return _first([folder / socket_name(name) for folder in folders], name, folders)
    running = _running(folders)
    if len(running) > 1:
        names = ", ".join(path.stem for path in running)
        raise ConfigError(f"several robots run here ({names}); choose one with --name NAME")
    return _first(running, None, folders)


def find_daemon_of(name: str, options: argparse.Namespace) -> DaemonClient | None:
    """The daemon of that robot, if it runs here and may be asked."""
    settings, _ = _settings(options, os.environ)
    own = settings.control.socket if settings.name.lower() == name.lower() else None
    paths = [own] if own else [folder / socket_name(name) for folder in socket_folders(settings)]
    for path in paths:
        with suppress(NotRunningError, NotAllowedError):
            return DaemonClient(path)
    return None


def _settings(options: argparse.Namespace, environment: Mapping[str, str]) -> tuple[Settings, str | None]:
    """The settings, and the robot's name if there is one; faults in them must not keep anybody from saying stop."""
    name = getattr(options, "name", None)
    try:
        loaded = load_with_sources(options.config, {"name": name}, name_needed=False, environment=environment)
    except ConfigError as error:
        first = str(error).splitlines()[0]
        sys.stderr.write(f"hvcpctl: note: the settings have faults ({first})\n")
        return _guessed(options.config or environment.get(FILE_VARIABLE) or SYSTEM_SETTINGS_PATH, name)
    source = next(each.source for each in loaded.sources if each.key == "name")
    return loaded.settings, None if source == "default" else loaded.settings.name


def _guessed(file: str | Path, name: str | None) -> tuple[Settings, str | None]:
    """What tells where the socket lies, as far as it can be read from a file with faults."""
    path = Path(file)
    try:
        value = parse(read_bytes(path), str(path)).value
    except ConfigError:
        value = None
    top = value if isinstance(value, dict) else {}
    group = top.get("control")
    told = {"name": top.get("name"), "state": top.get("state_dir")}
    told["socket"] = group.get("socket") if isinstance(group, dict) else None
    text = {key: each for key, each in told.items() if isinstance(each, str)}
    name = name or text.get("name")
    state_dir = path.parent / text["state"] if "state" in text else STATE_DIR
    control = ControlSettings(socket=path.parent / text["socket"] if "socket" in text else None)
    return Settings(name=name or STAND_IN_NAME, state_dir=state_dir, control=control), name


def _first(paths: list[Path], name: str | None, folders: tuple[Path, ...]) -> DaemonClient:
    forbidden: NotAllowedError | None = None
    for path in paths:
        try:
            return DaemonClient(path)
        except NotAllowedError as error:
            forbidden = error
        except NotRunningError:
            continue
    if forbidden is not None:
        raise forbidden
    who = name or "a robot"
    others = ", ".join(path.stem for path in _running(folders))
    hint = f"running here: {others}" if others else f"start it with `hvcpd --name {name or 'NAME'}`"
    raise NotRunningError(f"{who} does not run here (no socket in {', '.join(map(str, folders))}); {hint}")


def _running(folders: tuple[Path, ...]) -> list[Path]:
    """The sockets in these folders that a daemon answers at, or may."""
    found = []
    for folder in folders:
        with suppress(OSError):
            found += [path for path in sorted(folder.glob("*.sock")) if _answers(path)]
    return found


def _answers(path: Path) -> bool:
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as probe:
        probe.settimeout(ANSWER_S)
        try:
            with short_address(path) as address:
                probe.connect(address)
        except PermissionError:
            return True
        except OSError:
            return False
    return True


def _not_allowed(path: Path, uid: int) -> str:
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
