"""Folders that the environment names."""

from __future__ import annotations

from pathlib import Path

import pytest

from hvcpd.assembly.sound import user_cache_folder
from hvcpd.config.folders import xdg_folder
from hvcpd.daemon.control_socket import socket_folders

NAME = "XDG_RUNTIME_DIR"


@pytest.mark.parametrize("value", ["run", "./run", "../run", ""])
def test_what_the_specification_says_to_ignore_is_ignored(
    value: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """Relative folders were made wherever a command was run."""
    assert xdg_folder(NAME, {NAME: value}) is None
    assert socket_folders(tmp_path, {NAME: value}) == socket_folders(tmp_path, {})
    monkeypatch.setenv("XDG_CACHE_HOME", value)
    monkeypatch.setenv("HOME", str(tmp_path))
    assert user_cache_folder() == tmp_path / ".cache" / "hvcpd" / "units"


def test_a_whole_path_is_taken() -> None:
    assert xdg_folder(NAME, {NAME: "/run/user/1000"}) == Path("/run/user/1000")
    assert xdg_folder(NAME, {}) is None
