"""Where a robot's settings say that its control socket is.

Read by itself, since the checks of all other settings take longer than a whole `hvcpctl stop`, and since errors in them
must not keep anybody from stopping a robot.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from hvcpd.config.document import Document, KeyPath, Place, parse, read_bytes
from hvcpd.errors import ConfigError

SYSTEM_SETTINGS_PATH = Path("/etc/hvcpd/hvcpd.yaml")
"""Read if no other file is named; it need not be there."""

FILE_VARIABLE = "HVCPD_CONFIG"
"""Names the settings file, where no option does."""

STATE_DIR = Path("/var/lib/hvcpd")
"""Folder where a service keeps its state, by the Filesystem Hierarchy Standard."""

STAND_IN_NAME = "Rob"
"""The name in the settings of a command that is no robot; the first of the paper's two."""

_SOCKET = ("control", "socket")
_VARIABLES: Mapping[str, tuple[str, ...]] = {
    "HVCPD_NAME": ("name",),
    "HVCPD_STATE_DIR": ("state_dir",),
    "HVCPD_CONTROL__SOCKET": _SOCKET,
}


@dataclass(frozen=True)
class Whereabouts:
    """The name of a robot, if it has one, its `state_dir`, and its control socket, if it is not at the usual place."""

    name: str | None
    state_dir: Path
    socket: Path | None
    fault: str | None = None
    """Why the file could not be read, if it could not."""

    @property
    def memory_path(self) -> Path:
        """The robot's memory."""
        return memory_path(self.state_dir, self.name or STAND_IN_NAME)


def memory_path(state_dir: Path, name: str) -> Path:
    """The robot's memory: one file a robot, so that two on one computer share nothing."""
    return state_dir / f"{name.lower()}.sqlite3"


def whereabouts(path: Path | None, name: str | None, environment: Mapping[str, str] = os.environ) -> Whereabouts:
    """What the settings of `path`, or of the usual file, tell, as far as they can be read; `name` precedes theirs."""
    path, fault, document = settings_file(path, environment), None, Document(Place("settings"))
    try:
        document = parse(read_bytes(path), str(path)) if path is not None else document
    except ConfigError as error:
        fault = str(error)
    for variable, key in _VARIABLES.items():
        if (value := environment.get(variable)) is not None:
            document.overlay(key, None if (key, value) == (_SOCKET, "null") else value, variable)

    def text(*key: str) -> str | None:
        found = document.value
        for part in key:
            found = found.get(part) if isinstance(found, dict) else None
        return found if isinstance(found, str) else None

    def file(*key: str) -> Path | None:
        with suppress(ConfigError):
            return absolute(Path(found), document, key, path) if (found := text(*key)) else None
        return None

    return Whereabouts(name or text("name"), file("state_dir") or STATE_DIR, file(*_SOCKET), fault)


def settings_file(
    path: Path | None, environment: Mapping[str, str], system_path: Path = SYSTEM_SETTINGS_PATH
) -> Path | None:
    """The file that is read: `path`, or the one that FILE_VARIABLE names, or `system_path` if it is there, also if this
    user may not look: reading it then says so."""
    if path is not None or environment.get(FILE_VARIABLE):
        return path or Path(environment[FILE_VARIABLE])
    try:
        return system_path if system_path.exists() else None
    except OSError:
        return system_path


def absolute(name: Path, document: Document, key: KeyPath, path: Path | None) -> Path:
    """A file name from the configuration file is relative to that file's directory; ~ is the home directory."""
    if name.parts[:1] == ("~",):
        try:
            name = Path.home().joinpath(*name.parts[1:])
        except RuntimeError as error:
            where = f"{document.place(key)}: {'.'.join(map(str, key))}"
            raise ConfigError(f"{where}: this user has no home directory for the ~; write the whole path") from error
    from_file = path is not None and document.has(key) and document.place(key).source == str(path)
    return path.parent / name if path is not None and from_file else name
