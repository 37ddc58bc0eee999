"""Which group lets a person use a device."""

from __future__ import annotations

import grp
from pathlib import Path

SERIAL_GROUP = "dialout"
"""Of serial ports on Debian, Ubuntu and Raspberry Pi OS; others have uucp."""
OVERFLOW_GID = 65534
"""How the kernel shows groups that a user namespace lacks (user_namespaces(7)): to the service, all but its own."""


def group_of(path: str | Path, usual: str = SERIAL_GROUP) -> str:
    """The group that may use the device: its own, or the `usual` one where joining its own is no remedy.

    That is so for root's, and where a user namespace hides the group.
    """
    try:
        number = Path(path).stat().st_gid
        return usual if number in (0, OVERFLOW_GID) else grp.getgrgid(number).gr_name
    except (OSError, KeyError):
        return usual
