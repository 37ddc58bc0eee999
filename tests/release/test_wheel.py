"""The source archive is whole: who unpacks it can do all that the Makefile offers."""

from __future__ import annotations

import tarfile
from pathlib import Path

import pytest

from release.deb import REPOSITORY
from release.wheel import build_archive, known_to_git

OF_THE_REPOSITORY = (".github", ".gitignore", ".pre-commit-config.yaml")
"""Only a clone has a use for them."""


@pytest.mark.skipif(not (REPOSITORY / ".git").exists(), reason="only a clone knows which files are its own")
def test_the_source_archive_has_every_file_that_is_not_for_a_clone_alone(tmp_path: Path) -> None:
    with tarfile.open(build_archive(tmp_path / "tree", tmp_path / "made")) as archive:
        packed = {name.split("/", 1)[-1] for name in archive.getnames()}
    wanted = {name for name in known_to_git() if not name.startswith(OF_THE_REPOSITORY)}
    assert wanted - packed == set()
