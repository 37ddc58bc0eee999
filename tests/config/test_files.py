"""Files that are written whole: who owns them, and who may read them."""

from __future__ import annotations

import os
import stat
from pathlib import Path

import pytest

from hvcpd.config.files import make_folder, write_whole
from tests.full_disk import no_new_bytes
from tests.permissions import bound, needs_permissions

SOMEBODY = 1234
"""A user that is not the one who runs the tests."""

as_root = pytest.mark.skipif(os.geteuid() != 0, reason="not root: only root can give files away")


def permissions(path: Path) -> int:
    return stat.S_IMODE(path.stat().st_mode)


@pytest.mark.parametrize("mode", [None, 0o640])
def test_what_is_replaced_keeps_its_permissions(mode: int | None, tmp_path: Path) -> None:
    """A task file that its owner had closed to others was open to all after `task add`."""
    path = tmp_path / "file"
    path.write_bytes(b"old")
    path.chmod(0o600)
    write_whole(path, b"new", mode)
    assert path.read_bytes() == b"new"
    assert permissions(path) == 0o600


@needs_permissions
def test_a_write_protected_file_is_left_as_it_is(tmp_path: Path) -> None:
    """`say -o` replaced it, for that takes only the permission of its folder."""
    path = tmp_path / "file"
    path.write_bytes(b"old")
    path.chmod(0o444)
    tried = bound("-c", f"from hvcpd.config.files import *; write_whole(Path({str(path)!r}), b'new')")
    assert "PermissionError" in tried.stderr
    assert path.read_bytes() == b"old"


def test_a_private_file_is_closed_even_if_the_old_one_was_open(tmp_path: Path) -> None:
    path = tmp_path / "file"
    path.write_bytes(b"old")
    path.chmod(0o666)
    write_whole(path, b"new", 0o640)
    assert permissions(path) == 0o640


@as_root
@pytest.mark.parametrize("mode", [None, 0o600])
def test_what_is_replaced_keeps_its_owner(mode: int | None, tmp_path: Path) -> None:
    """After `sudo hvcpctl key rotate` the daemon's user could not read the key."""
    path = tmp_path / "file"
    path.write_bytes(b"old")
    os.chown(path, SOMEBODY, SOMEBODY)
    write_whole(path, b"new", mode)
    assert (path.stat().st_uid, path.stat().st_gid) == (SOMEBODY, SOMEBODY)


@as_root
def test_what_root_makes_among_the_files_of_a_robot_is_the_robots(tmp_path: Path) -> None:
    """After `sudo hvcpctl enrol` the daemon's user could not read the person's file."""
    os.chown(tmp_path, SOMEBODY, SOMEBODY)
    path = tmp_path / "people" / "anna.npz"
    make_folder(path.parent)
    write_whole(path, b"new", 0o640)
    assert {at.stat().st_uid for at in (path, path.parent)} == {SOMEBODY}


def test_a_full_disk_leaves_the_old_file_and_no_other(tmp_path: Path) -> None:
    path = tmp_path / "file"
    path.write_bytes(b"old")
    with no_new_bytes(), pytest.raises(OSError, match="File too large"):
        write_whole(path, b"newer", 0o600)
    assert path.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [path]
